"""`toponav/ImageNav-v0`: find the place in the picture, in a home never seen before."""

import copy
import math
from typing import Any

import gymnasium
import numpy as np
from jaxtyping import UInt8

from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError, did_you_mean
from toponav.core.geometry import Pose2
from toponav.core.imagenav import MAX_STEPS, Action, ImageGoal, ImageNavEpisode
from toponav.sim.actuation_noise import MotionNoise
from toponav.sim.imagenav import IMAGE_NAV_CAMERA, LOCOBOT, ImageNavSimulation
from toponav.sim.registration import register
from toponav.worlds.scene import Scene

__all__ = ["ImageNavEnv"]

_OPTIONS = ("episode", "start", "goal")
_NEAREST_M, _FARTHEST_M = 1.5, 10.0
_TRIES = 1000
_SUCCESS, _STEP = 10.0, 0.001
_FARTHEST_ODOMETRY = 1000.0
"""Metres; an episode of 500 steps drives 125."""


class ImageNavEnv(gymnasium.Env[dict[str, Any], np.int64]):
    """A building to find a place in: panoramas and noisy odometry in, four actions out.

    Actions are those of `toponav.core.imagenav.Action`: stop, forward 0.25 m, left 10 degrees,
    right 10 degrees. The observation holds `rgb` and `goal_rgb` (uint8), with a depth camera also
    `depth` and `goal_depth` (float32 metres), `odometry` (x, y and yaw from the start, noisy)
    and `collided`. The reward is 1 where the episode ends in success, else 0; or the paper's
    dense one (section 5.1): 10 x SPL at success, and at each step how much shorter the shortest
    path to the goal has become, less 0.001. `info` holds the truth: `pose`, `step`, `collided`,
    `path_m`, `success`, `collisions`, `distance_to_goal_m`.

    An episode terminates with `STOP`, and is truncated after `max_steps`.

    Args:
        scene: The building; by default the first of `homes-train`.
        camera: The panoramic camera.
        depth: Whether there is a depth camera.
        noise: `locobot`, a `MotionNoise`, or None.
        sliding: Whether the robot slides along what it touches.
        stop: Whether the robot has to say `STOP`, as in `ImageNavSimulation`.
        max_steps: Steps after which an episode is truncated.
        backend: Which renderer to use.
        reward: `success` or `dense`.
        render_mode: `rgb_array` for the panorama above the goal's.

    Example:
        >>> env = ImageNavEnv(scene)
        >>> observation, info = env.reset(seed=0)
        >>> observation, reward, terminated, truncated, info = env.step(Action.FORWARD)
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 5}  # noqa: RUF012

    def __init__(
        self,
        scene: Scene | None = None,
        camera: PanoramaCamera = IMAGE_NAV_CAMERA,
        *,
        depth: bool = True,
        noise: MotionNoise | str | None = LOCOBOT,
        sliding: bool = False,
        stop: bool = True,
        max_steps: int = MAX_STEPS,
        backend: str = "auto",
        reward: str = "success",
        render_mode: str | None = None,
    ) -> None:
        if reward not in ("success", "dense"):
            raise InputError(
                f"no reward is called '{reward}'",
                where="ImageNavEnv",
                remedy="choose success or dense",
            )
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(
                f"no render_mode is called '{render_mode}'",
                where="ImageNavEnv",
                remedy="choose rgb_array or None",
            )
        self.scene = scene if scene is not None else _default_scene()
        self.simulation = ImageNavSimulation(
            self.scene,
            camera,
            depth=depth,
            noise=noise,
            sliding=sliding,
            stop=stop,
            max_steps=max_steps,
            backend=backend,
        )
        self.render_mode = render_mode
        self.reward = reward
        self._distance_m = self._geodesic_m = 0.0
        self.action_space = gymnasium.spaces.Discrete(len(Action))
        shape = (camera.height, camera.width)
        rgb = gymnasium.spaces.Box(0, 255, (*shape, 3), np.uint8)
        spaces: dict[str, gymnasium.Space[Any]] = {
            "rgb": rgb,
            "goal_rgb": rgb,
            "odometry": gymnasium.spaces.Box(
                -_FARTHEST_ODOMETRY, _FARTHEST_ODOMETRY, (3,), np.float32
            ),
            "collided": gymnasium.spaces.Discrete(2),
        }
        if depth:
            far = gymnasium.spaces.Box(0.0, camera.max_depth_m, shape, np.float32)
            spaces.update(depth=far, goal_depth=far)
        self.observation_space = gymnasium.spaces.Dict(spaces)
        self._goal: ImageGoal | None = None
        self._rgb: np.ndarray | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """The first observation of an episode of this building.

        Args:
            seed: Seed of the noise, and of the start and goal where none are given.
            options: `{"episode": ImageNavEpisode}`, or `{"start": Pose2, "goal": Pose2}`;
                by default both are random, 1.5 to 10 m apart along the shortest path.

        Raises:
            InputError: If an option is unknown, or a pose is not where the robot can be.
        """
        super().reset(seed=seed)
        start, goal = self._chosen(options or {})
        noise_seed = int(self.np_random.integers(2**62))
        self._goal = self.simulation.reset(start, goal, noise_seed)
        info = self._info()
        self._distance_m = self._geodesic_m = info["distance_to_goal_m"]
        return self._observe(), info

    def step(
        self, action: np.int64 | int
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """What came of an action: observation, reward, terminated, truncated and the truth."""
        state = self.simulation.step(Action(int(action)))
        ended = state.done and (state.success or state.step < self.simulation.max_steps)
        stopped = self.simulation.stop and int(action) == Action.STOP
        terminated = bool(ended or stopped)
        truncated = state.done and not terminated
        info = self._info()
        return self._observe(), self._reward(info), terminated, truncated, info

    def twin(self) -> "ImageNavEnv":
        """Another robot in the same building; not for another thread."""
        other = copy.copy(self)
        other.simulation = self.simulation.twin()
        other._goal = other._rgb = None
        return other

    @property
    def goal(self) -> ImageGoal:
        """The picture to find.

        Raises:
            InputError: If nothing was reset yet.
        """
        if self._goal is None:
            raise InputError(
                "an episode has a goal", where="ImageNavEnv", remedy="call reset first"
            )
        return self._goal

    def render(self) -> UInt8[np.ndarray, "height width 3"] | None:
        """The panorama above the goal's."""
        if self.render_mode is None or self._goal is None or self._rgb is None:
            return None
        return np.concatenate([self._rgb, self._goal.rgb])

    def _reward(self, info: dict[str, Any]) -> float:
        if self.reward == "success":
            return float(info["success"])
        before_m, after_m = self._distance_m, info["distance_to_goal_m"]
        # Squeezed into a corner that the floor plan does not join to the rest: nothing is known.
        self._distance_m = after_m if math.isfinite(after_m) else before_m
        spl = self._geodesic_m / max(info["path_m"], self._geodesic_m, 1e-6)
        return float(_SUCCESS * spl * info["success"] + before_m - self._distance_m - _STEP)

    def _chosen(self, options: dict[str, Any]) -> tuple[Pose2, Pose2]:
        for name in options:
            if name not in _OPTIONS:
                raise InputError(
                    f"no option is called '{name}'",
                    where="ImageNavEnv.reset",
                    remedy=did_you_mean(str(name), _OPTIONS),
                )
        if "episode" in options:
            episode: ImageNavEpisode = options["episode"]
            return episode.start, episode.goal
        if "start" in options and "goal" in options:
            return Pose2(*options["start"]), Pose2(*options["goal"])
        if options:
            raise InputError(
                f"a start needs a goal and a goal a start, got {sorted(options)}",
                where="ImageNavEnv.reset",
                remedy="give both, an episode, or none",
            )
        return self._random_poses()

    def _random_poses(self) -> tuple[Pose2, Pose2]:
        space, rng = self.simulation.free_space, self.np_random
        cells = np.argwhere(space.component == 1)
        for _ in range(_TRIES if len(cells) else 0):
            pair = [
                Pose2(
                    *space.grid.center_of(*cells[rng.integers(len(cells))].tolist()),
                    float(rng.uniform(-np.pi, np.pi)),
                )
                for _ in range(2)
            ]
            field_m = space.geodesic_m((pair[1].x_m, pair[1].y_m))
            distance_m = float(field_m[space.grid.cell_of(pair[0].x_m, pair[0].y_m)])
            if _NEAREST_M <= distance_m < _FARTHEST_M:
                return pair[0], pair[1]
        raise InputError(
            f"no two places are {_NEAREST_M:g} to {_FARTHEST_M:g} m apart",
            where=f"scene {self.scene.name}",
            remedy="give options={'start': ..., 'goal': ...}, or use a larger building",
        )

    def _observe(self) -> dict[str, Any]:
        seen = self.simulation.observe()
        assert self._goal is not None
        self._rgb = seen.rgb
        observation: dict[str, Any] = {
            "rgb": seen.rgb,
            "goal_rgb": self._goal.rgb.copy(),
            "odometry": np.array(seen.odometry, np.float32),
            "collided": np.int64(bool(seen.collided)),
        }
        if seen.depth_m is not None and self._goal.depth_m is not None:
            observation.update(depth=seen.depth_m, goal_depth=self._goal.depth_m.copy())
        return observation

    def _info(self) -> dict[str, Any]:
        state = self.simulation.state
        distance_m = self.simulation.distance_to_goal_m()
        return {**state._asdict(), "distance_to_goal_m": distance_m}


def _default_scene() -> Scene:
    from toponav.worlds.generate.suites import suite_scene

    return suite_scene("home", 0)


# What `gymnasium.make("toponav.sim.imagenav_env:...")` imports this module for.
register()
