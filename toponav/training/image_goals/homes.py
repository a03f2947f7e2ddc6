"""Homes that training runs in: made once, kept on disk, and driven in with a compact camera."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.camera import PanoramaCamera
from toponav.core.geometry import Pose2
from toponav.core.imagenav import MAX_STEPS, PanoramaObservation
from toponav.data.nts.episode_sampling import sample_route
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.sim.imagenav import IMAGE_NAV_CAMERA
from toponav.sim.imagenav_env import ImageNavEnv
from toponav.worlds.generate.suites import check_frozen, suite, suite_scene
from toponav.worlds.scene import Scene
from toponav.worlds.storage import load_scene, save_scene

__all__ = ["HomeShelf", "Route", "camera_of", "observation_of"]


def camera_of(config: ImageGoalConfig) -> PanoramaCamera:
    """The camera whose panoramas a network takes as they are: nothing is rendered in vain."""
    if config.is_cylinder:
        return PanoramaCamera(config.rows, config.cols, "cylindrical")
    return PanoramaCamera(config.rows, config.cols)


@dataclass(frozen=True)
class Route:
    """From where to where an episode of training goes.

    Attributes:
        home: Number of the home in its suite.
        start: Where the robot starts.
        goal: Where the picture is taken.
        geodesic_m: Length of the shortest path.
    """

    home: int
    start: Pose2
    goal: Pose2
    geodesic_m: float


class HomeShelf:
    """The homes of a suite as environments with the dense reward, made when first asked for.

    Args:
        suite_name: Suite of homes.
        homes: How many of them, from the first.
        camera: What the robot sees with.
        folder: Where homes are kept between runs; None keeps none.
        kept: Homes kept in memory.
        max_steps: Length of an episode.
        noise: Whether motions are as bad as a LoCoBot's.
        scenes: Other buildings, in place of the suite's.
    """

    def __init__(
        self,
        suite_name: str = "homes-train",
        homes: int | None = None,
        camera: PanoramaCamera = IMAGE_NAV_CAMERA,
        *,
        folder: Path | None = None,
        kept: int = 80,
        max_steps: int = MAX_STEPS,
        noise: bool = True,
        scenes: Sequence[Scene] = (),
    ) -> None:
        self._suite, self._given = suite(suite_name), scenes
        self.seeds = range(len(scenes)) if scenes else self._suite.seeds[:homes]
        self._camera, self._folder, self._kept = camera, folder, kept
        self._settings: dict[str, Any] = {"max_steps": max_steps}
        if not noise:
            self._settings["noise"] = None
        self._envs: OrderedDict[int, ImageNavEnv] = OrderedDict()

    def __len__(self) -> int:
        return len(self.seeds)

    def env(self, home: int) -> ImageNavEnv:
        """The environment of a home, by its number."""
        if home not in self._envs:
            scene = self._scene(self.seeds[home])
            self._envs[home] = ImageNavEnv(scene, self._camera, reward="dense", **self._settings)
            while len(self._envs) > self._kept:
                self._envs.popitem(last=False)
        self._envs.move_to_end(home)
        return self._envs[home]

    def route(self, home: int, near_m: float, far_m: float, rng: np.random.Generator) -> Route:
        """A random start and goal in a home, so far apart along the shortest path."""
        space = self.env(home).simulation.free_space
        return Route(home, *sample_route(space, near_m, far_m, rng))

    def _scene(self, seed: int) -> Scene:
        if self._given:
            return self._given[seed]
        if self._folder is None:
            return suite_scene(self._suite.generator, seed)
        path = self._folder / f"{self._suite.generator}-{seed:04d}"
        if (path / "scene.json").is_file():
            scene = load_scene(path)
            check_frozen(scene)
            return scene
        scene = suite_scene(self._suite.generator, seed)
        save_scene(scene, path)
        return scene


def observation_of(seen: dict[str, Any], step: int) -> PanoramaObservation:
    """What an agent gets of what the environment says."""
    return PanoramaObservation(
        seen["rgb"],
        seen.get("depth"),
        Pose2(*map(float, seen["odometry"])),
        bool(seen["collided"]),
        step,
    )
