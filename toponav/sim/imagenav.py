"""Image-goal navigation in a building: four actions in, panoramas and noisy odometry out."""

import copy
import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    IMAGE_NAV_ROBOT_RADIUS_M,
    MAX_STEPS,
    SUCCESS_RADIUS_M,
    Action,
    ImageGoal,
    PanoramaObservation,
)
from toponav.sim.actuation_noise import INTENDED, MotionNoise, locobot_noise
from toponav.sim.disc_kernels import clearance_of_point, drive_disc
from toponav.sim.render import DepthRenderer, check_backend, make_renderer
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene
from toponav.worlds.shortest_path import any_angle_length_m

__all__ = ["IMAGE_NAV_CAMERA", "LOCOBOT", "ImageNavSimulation", "ImageNavState"]

IMAGE_NAV_CAMERA = PanoramaCamera()
"""128x512 panoramas from 0.6 m above the floor, depth to 10 m."""

LOCOBOT = "locobot"
"""Name of the default noise."""


class ImageNavState(NamedTuple):
    """The truth after one action.

    Attributes:
        pose: Where the robot is, in the building's frame.
        step: Actions taken towards this goal.
        collided: Whether something blocked the last action.
        path_m: Distance driven towards this goal, the drift of turns included.
        done: Whether the episode is over.
        success: Whether it is over and the robot is at its goal.
        collisions: How many actions something blocked.
    """

    pose: Pose2
    step: int
    collided: bool
    path_m: float
    done: bool
    success: bool
    collisions: int


class ImageNavSimulation:
    """A round robot with a panoramic camera, deterministic to the byte.

    The robot touches what stands in its way at any height, as far as the scene's grid says. One
    instance serves one thread. The same seed gives the same noise at the same step whatever the
    agent does, so agents can be compared in pairs.

    Args:
        scene: The building.
        camera: The camera.
        depth: Whether there is a depth camera besides the colour camera.
        noise: What actions do and odometry says; `locobot`, or None for neither error.
        sliding: Whether the robot slides along what it touches; else it stops there.
        stop: Whether the robot has to say `STOP` at its goal; else an episode ends by itself
            where `STOP` would have been right, and `STOP` is a wasted step.
        max_steps: Length of an episode.
        backend: Which renderer to use, as in `make_renderer`.

    Example:
        >>> simulation = ImageNavSimulation(scene)
        >>> goal = simulation.reset(Pose2(1, 2, 0), Pose2(4, 2, 0), seed=0)  # doctest: +SKIP
        >>> state = simulation.step(Action.FORWARD)  # doctest: +SKIP
        >>> observation = simulation.observe()  # doctest: +SKIP
    """

    def __init__(
        self,
        scene: Scene,
        camera: PanoramaCamera = IMAGE_NAV_CAMERA,
        *,
        depth: bool = True,
        noise: MotionNoise | str | None = LOCOBOT,
        sliding: bool = False,
        stop: bool = True,
        max_steps: int = MAX_STEPS,
        backend: str = "auto",
    ) -> None:
        check_backend(backend)
        if isinstance(noise, str) and noise != LOCOBOT:
            raise InputError(
                f"no noise is called '{noise}'",
                where="ImageNavSimulation",
                remedy=f"choose {LOCOBOT}, give a MotionNoise, or None",
            )
        if max_steps < 1:
            raise InputError(
                f"max_steps must be at least 1, got {max_steps}",
                where="ImageNavSimulation",
                remedy=f"{MAX_STEPS} is the papers' length",
            )
        self.scene = scene
        self.camera = camera
        self.depth = depth
        self.noise = locobot_noise() if isinstance(noise, str) else noise
        self.sliding = sliding
        self.stop = stop
        self.max_steps = max_steps
        self.radius_m = IMAGE_NAV_ROBOT_RADIUS_M
        self._backend = backend
        self._solid = np.ascontiguousarray(scene.occupied)
        self._seed = 0
        self._actions = 0
        self._state: ImageNavState | None = None
        self._odometry = Pose2(0.0, 0.0, 0.0)
        self._goal = Pose2(0.0, 0.0, 0.0)
        self._field_m: np.ndarray | None = None

    def reset(self, start: Pose2, goal: Pose2, seed: int = 0) -> ImageGoal:
        """The goal's picture, with the robot at rest at the start.

        Args:
            start: Where the robot starts.
            goal: Where the picture is taken.
            seed: Seed of the noise.

        Raises:
            InputError: If either pose is not where a robot can be, or the seed is negative.
        """
        if seed < 0:
            raise InputError(
                f"the seed must not be negative, got {seed}",
                where="ImageNavSimulation.reset",
                remedy="give 0 or more",
            )
        for name, pose in (("start", start), ("goal", goal)):
            self._check_free(name, pose)
        self._seed = seed
        self._actions = 0
        self._odometry = Pose2(0.0, 0.0, 0.0)
        return self._begin(Pose2(*map(float, start)), goal)

    def next_goal(self, goal: Pose2) -> ImageGoal:
        """The picture of another goal; the robot, its odometry and its noise go on.

        Raises:
            InputError: If the pose is not where a robot can be, or nothing was reset yet.
        """
        self._check_free("goal", goal)
        return self._begin(self.state.pose, goal)

    def step(self, action: Action) -> ImageNavState:
        """The state after one action.

        Raises:
            InputError: If it is no action, nothing was reset yet, or the episode is over.
        """
        before = self.state
        if before.done:
            raise InputError(
                "the episode is over", where=f"step {before.step}", remedy="call reset first"
            )
        action = _checked(action)
        pose, touched = self._move(before.pose, action)
        driven_m = pose.distance_to(before.pose)
        step = before.step + 1
        state = ImageNavState(
            pose=pose,
            step=step,
            collided=touched,
            path_m=before.path_m + driven_m,
            done=False,
            success=False,
            collisions=before.collisions + touched,
        )
        stopped = action == Action.STOP and self.stop
        at_goal = (stopped or not self.stop) and self._is_at_goal(pose)
        done = stopped or at_goal or step >= self.max_steps
        self._state = state._replace(done=done, success=at_goal)
        return self._state

    def twin(self) -> "ImageNavSimulation":
        """Another robot in the same building, with the same camera and floor plan in memory.

        Not for another thread.
        """
        _ = self.renderer, self.free_space
        other = copy.copy(self)
        other._state = other._field_m = None
        return other

    @property
    def state(self) -> ImageNavState:
        """The state after the last reset or step."""
        if self._state is None:
            raise InputError(
                "a simulation begins with a start and a goal",
                where=f"scene {self.scene.name}",
                remedy="call reset(start, goal) first",
            )
        return self._state

    @property
    def goal(self) -> Pose2:
        """Where the goal's picture was taken."""
        return self._goal

    def observe(self) -> PanoramaObservation:
        """What the robot senses now; rendered when asked and not before."""
        state = self.state
        rgb, depth_m = self.see(state.pose)
        return PanoramaObservation(rgb, depth_m, self._odometry, state.collided, state.step)

    def see(self, pose: Pose2) -> tuple[np.ndarray, np.ndarray | None]:
        """The colour panorama at any pose and its depth, where the robot has a depth camera."""
        if not self.depth:
            seen = self.renderer.render_images(pose, ("rgb",))
        else:
            seen = self.renderer.render_images(pose, ("rgb", "depth"))
        assert seen.rgb is not None
        return seen.rgb, seen.depth_m

    def distance_to_goal_m(self, pose: Pose2 | None = None) -> float:
        """Length of the shortest path from a pose, by default the robot's, to the goal."""
        pose = self.state.pose if pose is None else pose
        goal_xy = (self._goal.x_m, self._goal.y_m)
        if self._field_m is None:
            self._field_m = self.free_space.geodesic_m(goal_xy)
        return any_angle_length_m(self.free_space, self._field_m, (pose.x_m, pose.y_m), goal_xy)

    @cached_property
    def free_space(self) -> FreeSpace:
        """Where the robot can be."""
        return FreeSpace.of(self.scene, self.radius_m)

    @cached_property
    def renderer(self) -> DepthRenderer:
        """The camera's renderer, made on first use."""
        return make_renderer(self.scene, self.camera, self._backend)

    def _begin(self, start: Pose2, goal: Pose2) -> ImageGoal:
        self._goal = Pose2(*map(float, goal))
        self._field_m = None
        self._state = ImageNavState(start, 0, False, 0.0, False, False, 0)
        return ImageGoal(*self.see(self._goal))

    def _is_at_goal(self, pose: Pose2) -> bool:
        if pose.distance_to(self._goal) > SUCCESS_RADIUS_M:
            return False
        return self.distance_to_goal_m(pose) <= SUCCESS_RADIUS_M

    def _move(self, pose: Pose2, action: Action) -> tuple[Pose2, bool]:
        """The pose after an action, and whether something blocked it; updates the odometry."""
        # A generator a step: the noise does not depend on what was done before.
        noise, rng = self.noise, np.random.default_rng([self._seed, self._actions])
        self._actions += 1
        wanted = INTENDED[action] if noise is None else noise.motion(action, rng)
        target = pose.compose(wanted)
        cell_m = self.scene.grid.resolution_m
        x0_m, y0_m = self.scene.grid.origin_m
        row, col, touched = drive_disc(
            self._solid,
            (pose.y_m - y0_m) / cell_m,
            (pose.x_m - x0_m) / cell_m,
            (target.y_m - pose.y_m) / cell_m,
            (target.x_m - pose.x_m) / cell_m,
            self.radius_m / cell_m,
            self.sliding,
        )
        reached = Pose2(x0_m + col * cell_m, y0_m + row * cell_m, target.yaw_rad)
        if not touched:
            reached = target
        made = reached.relative_to(pose)
        reading = made if noise is None else noise.reading(action, made, rng)
        self._odometry = self._odometry.compose(reading)
        # A turn is not blocked where only its drift is.
        return reached, bool(touched) and action == Action.FORWARD

    def _check_free(self, name: str, pose: Pose2) -> None:
        fits = all(map(math.isfinite, pose)) and self.scene.grid.contains(*pose[:2])
        if fits:
            cell_m = self.scene.grid.resolution_m
            x0_m, y0_m = self.scene.grid.origin_m
            radius = self.radius_m / cell_m
            clear, _, _ = clearance_of_point(
                self._solid, (pose[1] - y0_m) / cell_m, (pose[0] - x0_m) / cell_m, radius + 1.0
            )
            fits = clear >= radius - 0.02
        if not fits:
            raise InputError(
                f"a robot of radius {self.radius_m:g} m cannot be at the {name} {tuple(pose)}",
                where=f"scene {self.scene.name}",
                remedy="pick a pose in FreeSpace.of(scene, 0.18)",
            )


def _checked(action: int) -> Action:
    try:
        return Action(int(action))
    except (ValueError, TypeError):
        raise InputError(
            f"no action is {action!r}",
            where="ImageNavSimulation.step",
            remedy="0 stop, 1 forward, 2 left, 3 right",
        ) from None
