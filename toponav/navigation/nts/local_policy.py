"""The local policy: drive to a point near by on a map of what was seen."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Float64
from scipy import ndimage

from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import (
    FORWARD_M,
    IMAGE_NAV_ROBOT_RADIUS_M,
    TURN_RAD,
    Action,
    PanoramaObservation,
)
from toponav.navigation.nts.drive_kernels import best_turn
from toponav.navigation.nts.local_map import LocalMap, MapConfig, Window

__all__ = ["LocalPolicy", "LocalPolicyConfig"]

_AVOIDED_CELLS = 10


@dataclass(frozen=True)
class LocalPolicyConfig:
    """How the local policy drives."""

    map: MapConfig = field(default_factory=MapConfig)
    replan_steps: int = 4
    """The distance field to a goal that stays is computed again after so many steps."""
    turn_cost_m: float = 0.04
    """A turn is worth this much driving."""
    frontier_cells: int = 6
    """Shorter edges of what is known are no ways."""
    moved_share: float = 0.35
    """A step forward that moved less than this share was blocked."""


@dataclass(frozen=True, eq=False)
class _Plan:
    """Metres left to a point, as the map was at a step."""

    target: tuple[float, float]
    step: int
    window: Window
    times: Float64[np.ndarray, "rows cols"]


class LocalPolicy:
    """Keeps the map and drives on it.

    Give it every observation with `observe`, with the pose that is believed; ask for the next
    action towards a point with `action`. Poses are in the frame of the start.

    Args:
        config: How it drives.
        seed: Of what it does when it is stuck.
    """

    def __init__(self, config: LocalPolicyConfig | None = None, seed: int = 0) -> None:
        self.config = config or LocalPolicyConfig()
        self.map = LocalMap(self.config.map)
        self.collisions = 0
        self._rng = np.random.default_rng(seed)
        self._pose = Pose2(0.0, 0.0, 0.0)
        self._last_action: Action | None = None
        self._odometry: Pose2 | None = None
        self._plans: list[_Plan] = []
        self._step = 0
        self._escape: list[Action] = []
        self._blocked: list[tuple[float, float]] = []

    def observe(
        self,
        observation: PanoramaObservation,
        pose: Pose2,
        obstacle_m: Float32[np.ndarray, " directions"] | None = None,
    ) -> None:
        """Adds an observation to the map and notices collisions.

        Args:
            observation: What was sensed.
            pose: Where the robot believes that it is.
            obstacle_m: Predicted ranges to obstacles, where there is no depth.
        """
        if self._was_blocked(observation):
            self.collisions += 1
            self.map.add_bump(pose)
            self._plans = []
            self._after_collision(pose)
        self._odometry = observation.odometry
        self._pose = pose
        self._step += 1
        depth_m = observation.depth_m
        if depth_m is not None and _is_alive(depth_m):
            self.map.add_depth(depth_m, pose)
        elif obstacle_m is not None:
            self.map.add_ranges(obstacle_m, pose)

    def action(self, target: tuple[float, float]) -> Action:
        """The next action towards a point."""
        chosen = self._escape.pop(0) if self._escape else self._towards(target)
        self._last_action = chosen
        return chosen

    def times(
        self, target: tuple[float, float]
    ) -> tuple[Window, Float64[np.ndarray, "rows cols"]]:
        """The window and the distance field to a point, computed anew where it is needed."""
        oldest = self._step - self.config.replan_steps
        for plan in self._plans:
            if plan.step > oldest and math.dist(plan.target, target) <= 0.1:
                return plan.window, plan.times
        window = self.map.window([(self._pose.x_m, self._pose.y_m), target])
        times = self.map.times_to(window, [target], self._pose)
        # Two plans: one to what is sought, one to the next place on the way there.
        self._plans = [_Plan(target, self._step, window, times), *self._plans[:1]]
        return window, times

    def distance_m(self, target: tuple[float, float]) -> float:
        """How far the drive to a point is, obstacles included."""
        window, times = self.times(target)
        return self._time_at(window, times, self._pose.x_m, self._pose.y_m)

    def can_reach(self, target: tuple[float, float]) -> bool:
        """Whether a way to a point is known that squeezes through nothing."""
        away_m = math.dist(target, (self._pose.x_m, self._pose.y_m))
        return self.distance_m(target) < 4.0 * away_m + 6.0

    def is_straight(self, target: tuple[float, float]) -> bool:
        """Whether nothing known stands on the straight line to a point."""
        return self.map.is_clear((self._pose.x_m, self._pose.y_m), target)

    def is_edge(self, place: tuple[float, float]) -> bool:
        """Whether there still is something unseen at a place."""
        row, col = self.map.cell_of(*place)
        around = self.map.evidence[max(row - 3, 0) : row + 4, max(col - 3, 0) : col + 4]
        return bool((around == 0).any())

    def frontier(self, avoided: Sequence[tuple[float, float]] = ()) -> tuple[float, float] | None:
        """The nearest place where known free space borders on what was not seen.

        Args:
            avoided: Places within half a metre of these do not count.
        """
        pose = self._pose
        window = self.map.window([(pose.x_m, pose.y_m)])
        here = self.map.times_to(window, [(pose.x_m, pose.y_m)], Pose2(1e6, 1e6, 0.0))
        beside = np.zeros_like(window.unknown)
        beside[1:] |= window.unknown[:-1]
        beside[:-1] |= window.unknown[1:]
        beside[:, 1:] |= window.unknown[:, :-1]
        beside[:, :-1] |= window.unknown[:, 1:]
        known = ~window.unknown & (window.clearance_m > IMAGE_NAV_ROBOT_RADIUS_M + 0.05)
        edge = beside & known & np.isfinite(here) & (here > 0.6) & (here < 60.0)
        for x_m, y_m in avoided:
            row, col = self.map.cell_of(x_m, y_m)
            low = max(row - window.row - _AVOIDED_CELLS, 0)
            left = max(col - window.col - _AVOIDED_CELLS, 0)
            high = max(row - window.row + _AVOIDED_CELLS + 1, 0)
            right = max(col - window.col + _AVOIDED_CELLS + 1, 0)
            edge[low:high, left:right] = False
        # Slits and the shadows of chair legs are no ways.
        pieces, count = ndimage.label(edge, np.ones((3, 3)))
        sizes = np.bincount(pieces.ravel(), minlength=count + 1)
        edge &= (sizes >= self.config.frontier_cells)[pieces]
        if not edge.any():
            return None
        at = int(np.where(edge, here, np.inf).argmin())
        row, col = divmod(at, edge.shape[1])
        return self.map.center_of(row + window.row, col + window.col)

    def _was_blocked(self, observation: PanoramaObservation) -> bool:
        if self._last_action is not Action.FORWARD or self._odometry is None:
            return False
        if observation.collided is not None:
            return observation.collided
        moved_m = observation.odometry.distance_to(self._odometry)
        return moved_m < self.config.moved_share * FORWARD_M

    def _after_collision(self, pose: Pose2) -> None:
        self._blocked = [*self._blocked[-5:], (pose.x_m, pose.y_m)]
        near = [point for point in self._blocked if math.dist(point, (pose.x_m, pose.y_m)) < 0.15]
        if len(near) < 3:
            return
        # The map must be wrong here: turn away somewhere and try again from there.
        turn = Action.LEFT if self._rng.random() < 0.5 else Action.RIGHT
        self._escape = [turn] * int(self._rng.integers(4, 14)) + [Action.FORWARD] * 2
        self._blocked = []
        if self.collisions % 4 == 0:
            self.map.forget_bumps()

    def _towards(self, target: tuple[float, float]) -> Action:
        window, times = self.times(target)
        pose = self._pose
        here = self._time_at(window, times, pose.x_m, pose.y_m)
        row, col = self.map.cells_of(pose.x_m, pose.y_m)
        turns, cost = best_turn(
            times,
            window.clearance_m,
            row - window.row,
            col - window.col,
            pose.yaw_rad,
            TURN_RAD,
            FORWARD_M / self.map.config.cell_m,
            IMAGE_NAV_ROBOT_RADIUS_M,
            self.config.turn_cost_m,
        )
        if not math.isfinite(cost) or (turns == 0 and cost > here + 2.0):
            return self._straight(target)
        return Action.FORWARD if turns == 0 else Action.LEFT if turns > 0 else Action.RIGHT

    def _straight(self, target: tuple[float, float]) -> Action:
        off = wrap_angle(
            math.atan2(target[1] - self._pose.y_m, target[0] - self._pose.x_m) - self._pose.yaw_rad
        )
        if abs(off) < TURN_RAD:
            return Action.FORWARD
        return Action.LEFT if off > 0 else Action.RIGHT

    def _time_at(
        self, window: Window, times: Float64[np.ndarray, "rows cols"], x_m: float, y_m: float
    ) -> float:
        row, col = self.map.cell_of(x_m, y_m)
        row, col = row - window.row, col - window.col
        if not (1 <= row < times.shape[0] - 1 and 1 <= col < times.shape[1] - 1):
            return math.inf
        value = times[row, col]
        if not math.isfinite(value):
            value = times[row - 1 : row + 2, col - 1 : col + 2].min() + 0.1
        return float(value)


def _is_alive(depth_m: Float32[np.ndarray, "height width"]) -> bool:
    """Whether the camera sees anything at all."""
    return bool(np.isfinite(depth_m).all() and (depth_m > 0).any())
