"""The local policy: drive to a point near by on a map of what was seen."""

import math
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Float64

from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import (
    FORWARD_M,
    IMAGE_NAV_ROBOT_RADIUS_M,
    TURN_RAD,
    Action,
    PanoramaObservation,
)
from toponav.navigation.nts.local_map import LocalMap, MapConfig, Window

__all__ = ["LocalPolicy", "LocalPolicyConfig"]

_HEADINGS = 36


@dataclass(frozen=True)
class LocalPolicyConfig:
    """How the local policy drives."""

    map: MapConfig = field(default_factory=MapConfig)
    replan_steps: int = 4
    """The distance field to a goal that stays is computed again after so many steps."""
    turn_cost_m: float = 0.04
    """A turn is worth this much driving."""
    moved_share: float = 0.35
    """A step forward that moved less than this share was blocked."""


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
        self._plan: tuple[tuple[float, float], Window, Float64[np.ndarray, "rows cols"]] | None
        self._plan = None
        self._plan_age = 0
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
            self._plan = None
            self._after_collision(pose)
        self._odometry = observation.odometry
        self._pose = pose
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
        self._plan_age += 1
        plan = self._plan
        if (
            plan is None
            or math.dist(plan[0], target) > 0.1
            or self._plan_age >= self.config.replan_steps
        ):
            here = (self._pose.x_m, self._pose.y_m)
            window = self.map.window([here, target])
            times = self.map.times_to(window, [target], self._pose)
            self._plan = plan = (target, window, times)
            self._plan_age = 0
        return plan[1], plan[2]

    def distance_m(self, target: tuple[float, float]) -> float:
        """How far the drive to a point is, obstacles included."""
        window, times = self.times(target)
        return self._time_at(window, times, self._pose.x_m, self._pose.y_m)

    def can_reach(self, target: tuple[float, float]) -> bool:
        """Whether a way to a point is known that squeezes through nothing."""
        away_m = math.dist(target, (self._pose.x_m, self._pose.y_m))
        return self.distance_m(target) < 4.0 * away_m + 6.0

    def frontier(self) -> tuple[float, float] | None:
        """The nearest place where known free space borders on what was not seen."""
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
        best, best_cost = None, math.inf
        here = self._time_at(window, times, pose.x_m, pose.y_m)
        for number in range(_HEADINGS):
            turns = (number + 1) // 2 * (1 if number % 2 else -1)
            heading = pose.yaw_rad + turns * TURN_RAD
            cost = self._drive_cost(window, times, heading) + abs(turns) * self.config.turn_cost_m
            if cost < best_cost - 1e-9:
                best, best_cost = turns, cost
        if best is None or not math.isfinite(best_cost):
            return self._straight(target)
        if best == 0 and best_cost > here + 2.0:
            return self._straight(target)
        return Action.FORWARD if best == 0 else Action.LEFT if best > 0 else Action.RIGHT

    def _drive_cost(
        self, window: Window, times: Float64[np.ndarray, "rows cols"], heading: float
    ) -> float:
        """Metres left after a step that way, what it squeezes past included."""
        pose = self._pose
        dx, dy = math.cos(heading), math.sin(heading)
        tight = 0.0
        start = self._clearance_at(window, pose.x_m, pose.y_m)
        radius_m = IMAGE_NAV_ROBOT_RADIUS_M
        for share in (0.4, 0.8, 1.2):
            x_m, y_m = pose.x_m + share * FORWARD_M * dx, pose.y_m + share * FORWARD_M * dy
            clearance = self._clearance_at(window, x_m, y_m)
            # Where it is too tight already, any way that widens is good.
            if clearance < radius_m and clearance < start + 0.01:
                tight += (radius_m - clearance) * 8.0 + 0.4
        one = self._time_at(window, times, pose.x_m + FORWARD_M * dx, pose.y_m + FORWARD_M * dy)
        return one + tight

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

    def _clearance_at(self, window: Window, x_m: float, y_m: float) -> float:
        row, col = self.map.cell_of(x_m, y_m)
        row, col = row - window.row, col - window.col
        if not (0 <= row < window.speed.shape[0] and 0 <= col < window.speed.shape[1]):
            return 0.0
        return float(window.clearance_m[row, col])


def _is_alive(depth_m: Float32[np.ndarray, "height width"]) -> bool:
    """Whether the camera sees anything at all."""
    return bool(np.isfinite(depth_m).all() and (depth_m > 0).any())
