"""Frontier exploration on a metric map, until the goal is seen: "Metric Spatial Map + FBE"."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy import ndimage

from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageGoal, ImageNavBelief, PanoramaObservation
from toponav.navigation.nts.goal_finder import GoalFinder
from toponav.navigation.nts.local_map import Window
from toponav.navigation.nts.local_policy import LocalPolicy
from toponav.navigation.nts.map_kernels import march
from toponav.navigation.nts.perception import Perception, View, fault_of
from toponav.navigation.nts.pose_tracking import PoseTracker

__all__ = ["Frontier", "FrontierAgent", "FrontierConfig", "frontiers"]


@dataclass(frozen=True)
class FrontierConfig:
    """How it explores."""

    smallest_cells: int = 5
    """Frontiers of fewer cells are gaps in what was seen, not ways."""
    reached_m: float = 0.35
    """A frontier so near is explored."""
    patience_steps: int = 60
    """A frontier that takes longer is given up for another."""
    avoid_m: float = 0.6
    """What was given up keeps others so near from being tried."""
    approach_steps: int = 120
    """A goal that is not reached in so many steps was a mistake, or is behind something."""


@dataclass(frozen=True, eq=False)
class Frontier:
    """An edge of what is known that one can drive to.

    Attributes:
        cells: Its cells, row and column in the window.
        at: The nearest of them, in the frame of the start.
        drive_m: How far the drive is, in metres of driving in the open.
    """

    cells: Int64[np.ndarray, "cells 2"]
    at: tuple[float, float]
    drive_m: float


def frontiers(
    policy: LocalPolicy, pose: Pose2, smallest_cells: int = 5
) -> tuple[Window, list[Frontier]]:
    """The frontiers of a local policy's map, the nearest first.

    Reference:
        Yamauchi 1997, "A frontier-based approach for autonomous exploration".
    """
    map_ = policy.map
    window = map_.window([(pose.x_m, pose.y_m)], margin_m=0.5)
    row, col = map_.cell_of(pose.x_m, pose.y_m)
    times = _drive_times(window, row - window.row, col - window.col)
    open_ = ~window.unknown & (window.speed > 0.1) & np.isfinite(times)
    edge = open_ & ndimage.binary_dilation(window.unknown)
    numbers, count = ndimage.label(edge, structure=np.ones((3, 3)))
    found = []
    for part, box in enumerate(ndimage.find_objects(numbers), start=1):
        cells = np.argwhere(numbers[box] == part) + np.array([box[0].start, box[1].start])
        if len(cells) < smallest_cells:
            continue
        drive = times[cells[:, 0], cells[:, 1]] * map_.config.cell_m
        nearest = int(drive.argmin())
        at = map_.center_of(*(cells[nearest] + [window.row, window.col]).tolist())
        found.append(Frontier(cells.astype(np.int64), at, float(drive[nearest])))
    assert len(found) <= count
    return window, sorted(found, key=lambda frontier: frontier.drive_m)


def _drive_times(window: Window, row: int, col: int) -> Float64[np.ndarray, "rows cols"]:
    """Cells of driving in the open that each cell of the window is away."""
    times: np.ndarray = march(window.speed, np.array([row]), np.array([col]), -1, -1, 0.0)
    return times


class FrontierAgent:
    """Drives to the nearest edge of its map until the goal is seen, and then to the goal.

    Localization, relative pose and local policy are those of Neural Topological SLAM, as the
    paper has it. Its one map lies where the odometry says: errors add up.

    Args:
        perception: The network's functions.
        config: How it explores.
        seed: Seed of what it does where it is stuck.
    """

    def __init__(
        self, perception: Perception, config: FrontierConfig | None = None, seed: int = 0
    ) -> None:
        self.config = config or FrontierConfig()
        self._perception = perception
        self._seed = seed
        self._finder: GoalFinder | None = None
        self._target: tuple[float, float] | None = None
        self._given_up: list[tuple[float, float]] = []
        self._action: Action | None = None
        self._begin()

    def reseed(self, seed: int) -> None:
        """Starts its random numbers afresh at the next reset."""
        self._seed = seed

    def reset(self, goal: ImageGoal, keep_map: bool = False) -> None:
        """Looks for another place; the map is kept where it is told so."""
        if not keep_map:
            self._begin()
        self._target = None
        self._given_up = []
        self._step = self._approaching = 0
        self._why = fault_of(goal.rgb, goal.depth_m, wants_depth=self._perception.depth)
        if self._why:
            # Nobody can find such a goal: the agent says so at once.
            self._finder = None
            return
        self._finder = GoalFinder(self._perception, self._perception.see(goal.rgb, goal.depth_m))

    def act(self, observation: PanoramaObservation) -> Action:
        """The next action."""
        self._action = self._decide(observation)
        return self._action

    def stop_denied(self) -> None:
        """The place was wrong: it looks elsewhere."""
        if self._finder is not None:
            self._finder.has_arrived = False
            self._finder.give_up()

    def belief(self) -> ImageNavBelief:
        """Where it thinks that it is, and where it is going."""
        place = None if self._finder is None else self._finder.place
        return ImageNavBelief(
            pose=self._pose,
            goal=place,
            subgoal=place or (Pose2(*self._target, 0.0) if self._target else None),
            mode=self._mode,
            stopped_because=self._why if self._mode == "stop" else "",
        )

    def locate(self, observation: PanoramaObservation, view: View) -> Pose2:
        """Where the robot is, in the frame of the start: what the odometry says."""
        return self._tracker.update(observation.odometry, None, self._action)

    def choose(
        self, window: Window, found: list[Frontier], known: Bool[np.ndarray, "rows cols"]
    ) -> Frontier:
        """Which frontier to explore: the nearest."""
        return found[0]

    def _begin(self) -> None:
        self._policy = LocalPolicy(seed=self._seed)
        self._tracker = PoseTracker(aligned=False)
        self._pose = Pose2(0.0, 0.0, 0.0)
        self._action = None
        self._target = None
        self._given_up = []
        self._age = self._step = self._approaching = 0
        self._mode, self._why = "explore", ""

    def _decide(self, observation: PanoramaObservation) -> Action:
        if self._finder is None:
            self._mode = "stop"
            return Action.STOP
        wants_depth = self._perception.depth
        if fault_of(observation.rgb, observation.depth_m, wants_depth=wants_depth):
            self._mode = "blind"
            return Action.LEFT
        depth_m = observation.depth_m if wants_depth else None
        view = self._perception.see(observation.rgb, depth_m)
        self._pose = self.locate(observation, view)
        self._policy.observe(observation, self._pose, None if wants_depth else view.obstacle_m)
        place = self._finder.look(view, self._pose, self._step)
        self._step += 1
        if self._finder.has_arrived:
            self._mode, self._why = "stop", "at the goal"
            return Action.STOP
        return self._explore() if place is None else self._approach(place)

    def _approach(self, place: Pose2) -> Action:
        self._mode = "approach"
        self._approaching += 1
        assert self._finder is not None
        if self._approaching > self.config.approach_steps:
            self._approaching = 0
            self._finder.give_up()
        return self._policy.action((place.x_m, place.y_m))

    def _explore(self) -> Action:
        self._mode = "explore"
        self._age += 1
        here = (self._pose.x_m, self._pose.y_m)
        if self._target is not None and self._age > self.config.patience_steps:
            self._given_up.append(self._target)
            self._target = None
        if self._target is None or self._is_stale(here):
            self._target = self._next_target(here)
            self._age = 0
        return self._policy.action(self._target)

    def _is_stale(self, here: tuple[float, float]) -> bool:
        """Whether the target is reached, or has been seen in the meantime."""
        assert self._target is not None
        if math.dist(here, self._target) < self.config.reached_m:
            return True
        map_ = self._policy.map
        row, col = map_.cell_of(*self._target)
        around = map_.evidence[max(row - 3, 0) : row + 4, max(col - 3, 0) : col + 4]
        return bool((around != 0).all())

    def _next_target(self, here: tuple[float, float]) -> tuple[float, float]:
        window, found = frontiers(self._policy, self._pose, self.config.smallest_cells)
        fresh = [
            frontier
            for frontier in found
            if math.dist(frontier.at, here) >= self.config.reached_m
            and all(math.dist(frontier.at, old) > self.config.avoid_m for old in self._given_up)
        ]
        if fresh:
            return self.choose(window, fresh, ~window.unknown).at
        # Everything within reach is known, or the map is wrong: anywhere it seems free.
        self._given_up = []
        cells = np.argwhere(~window.unknown & (window.speed > 0.5))
        if not len(cells):
            return here[0] + math.cos(self._pose.yaw_rad), here[1] + math.sin(self._pose.yaw_rad)
        rng = np.random.default_rng([self._seed, self._policy.collisions, len(cells)])
        row, col = (cells[rng.integers(len(cells))] + [window.row, window.col]).tolist()
        return self._policy.map.center_of(row, col)
