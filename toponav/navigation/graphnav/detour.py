"""What a robot does that gets nowhere: it plans its way on on the map of what it has seen."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import distance_transform_edt

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.navigation.nts.map_kernels import march

__all__ = ["Detour", "DetourConfig"]

_CELL_M: Final = 0.1
_CELLS: Final = 128
_OCCUPIED, _UNKNOWN = 10, 7
_SEED_M: Final = 0.35
_LOOK_M: Final = 0.35
_BEARINGS_RAD: Final = np.radians(np.arange(-180, 180, 10))
_BEARING_COST, _CHANGE_COST = 0.3, 5.0
"""Of a radian away from where it looks, and from where it last went, in cells of free way."""
_STANDING_RAD, _TURN_RAD_S = 0.6, 1.4


@dataclass(frozen=True)
class DetourConfig:
    """When a robot counts as getting nowhere, and how it plans then."""

    soon_steps: int = 15
    """A robot that after so many steps..."""
    soon_m: float = 0.15
    """...is no farther than this from where it was gets nowhere;"""
    late_steps: int = 35
    """so does one that after so many..."""
    late_m: float = 0.45
    """...is no farther than this."""
    least_steps: int = 25
    """For so many steps it follows its own plan, and on,"""
    leads_m: float = 0.8
    """until it is so far from where it got nowhere,"""
    most_steps: int = 60
    """or for so many."""
    clearance_m: float = 0.2
    """From obstacles, to the middle of the robot."""
    wide_m: float = 0.45
    """Ways with less room than this beside them are dearer."""
    unknown_speed: float = 0.6
    """Unknown places count as free, but slower."""
    speed_m_s: float = 0.3
    """Of the robot on a detour."""
    turn_gain: float = 2.0
    """Turn rate for a heading error of a radian."""

    def __post_init__(self) -> None:
        if not all(0.0 < value < 1000.0 for value in vars(self).values()):
            raise InputError(
                f"every setting must be positive, got {self}",
                where="DetourConfig",
                remedy="leave it at its default",
            )


class Detour:
    """Watches whether the robot gets on, and drives in place of the network where it does not.

    Args:
        config: When and how.
    """

    def __init__(self, config: DetourConfig | None = None) -> None:
        self.config = config or DetourConfig()
        self._trail: deque[tuple[float, float]] = deque(maxlen=self.config.late_steps + 1)
        self._place = np.zeros(3)
        self._began: tuple[float, float] | None = None
        self._steps = 0
        self._heading_rad: float | None = None
        self._is_followed = False

    def clear(self) -> None:
        """Forget everything: an episode begins."""
        self._trail.clear()
        self._place[:] = 0.0
        self._began = None
        self._heading_rad = None

    def advance(self, step: Float[np.ndarray, " 3"]) -> None:
        """The robot moved by this: metres forward and left, radians turned."""
        middle = self._place[2] + 0.5 * step[2]
        self._place[0] += step[0] * math.cos(middle) - step[1] * math.sin(middle)
        self._place[1] += step[0] * math.sin(middle) + step[1] * math.cos(middle)
        self._place[2] += step[2]
        if not self._is_followed:
            self._heading_rad = None
        self._is_followed = False
        here = (float(self._place[0]), float(self._place[1]))
        self._trail.append(here)
        if self._began is not None:
            self._steps += 1
            if self._has_led(here):
                self._began = None
        elif self._gets_nowhere():
            self._began, self._steps = here, 0
            self._trail.clear()

    @property
    def is_on(self) -> bool:
        """Whether the robot should follow its own plan now."""
        return self._began is not None

    def velocity(
        self,
        view: UInt8[np.ndarray, "forward left"],
        target: Float[np.ndarray, " 2"],
        obstacles: Float[np.ndarray, "points 2"] | None = None,
    ) -> Velocity | None:
        """The way on to a point; None where none is known.

        Args:
            view: What was seen (`LocalMap.view`), with cells of `cell_m`.
            target: Metres forward and left of the robot.
            obstacles: Further points that it must not touch, likewise.
        """
        occupied = (view >> 4) >= _OCCUPIED
        unknown = (view >> 4) == _UNKNOWN
        robot = (_CELLS - 1) / 2.0
        if obstacles is not None and len(obstacles):
            at = np.rint(obstacles / _CELL_M + robot).astype(int)
            at = at[((at >= 0) & (at < _CELLS)).all(axis=1)]
            occupied[at[:, 0], at[:, 1]] = True
        cell = np.clip(np.rint(target / _CELL_M + robot), 0, _CELLS - 1).astype(int)
        clearance_m = distance_transform_edt(~occupied) * _CELL_M
        speed = np.clip(clearance_m / self.config.wide_m, 0.2, 1.0)
        speed = np.where(unknown, np.minimum(speed, self.config.unknown_speed), speed)
        speed[clearance_m < self.config.clearance_m] = 0.0
        rows, cols = np.ogrid[:_CELLS, :_CELLS]
        from_robot = np.hypot(rows - robot, cols - robot) * _CELL_M
        # The robot stands where it stands, however near an obstacle seems to be, and may leave.
        leaving = 0.1 * (clearance_m / self.config.clearance_m) ** 4
        is_near = (from_robot < self.config.wide_m) & (speed <= 0.0) & ~occupied
        speed = np.where(is_near, np.maximum(leaving, 1e-3), speed)
        seeds = np.hypot(rows - cell[0], cols - cell[1]) * _CELL_M < _SEED_M
        seeds &= speed > 0.0
        if not seeds.any():
            seeds[cell[0], cell[1]] = True
        seed_rows, seed_cols = np.nonzero(seeds)
        middle = _CELLS // 2
        time = march(speed, seed_rows, seed_cols, middle, middle, 8.0)
        points = np.empty((0, 2)) if obstacles is None else obstacles
        return self._along(time, points)

    @staticmethod
    def view_shape() -> tuple[int, float]:
        """Cells along a side of the view, and metres along a side of a cell."""
        return _CELLS, _CELL_M

    def _along(
        self, time: Float[np.ndarray, "forward left"], points: Float[np.ndarray, "points 2"]
    ) -> Velocity | None:
        """Turn to where a short straight drive is clear and leads on best, then drive."""
        robot = (_CELLS - 1) / 2.0
        ends = _LOOK_M * np.stack([np.cos(_BEARINGS_RAD), np.sin(_BEARINGS_RAD)], axis=1)
        row, col = np.rint(ends / _CELL_M + robot).astype(int).T
        cost = time[row, col] + _BEARING_COST * np.abs(_BEARINGS_RAD)
        if self._heading_rad is not None:
            # Two ways round that are about as long would take turns as more of them is seen.
            change_rad = _BEARINGS_RAD + self._place[2] - self._heading_rad
            cost += _CHANGE_COST * np.abs(
                np.remainder(change_rad + math.pi, 2 * math.pi) - math.pi
            )
        cost[~self._is_clear(ends, points)] = np.inf
        best = int(np.argmin(cost))
        if not np.isfinite(cost[best]):
            return None
        bearing = float(_BEARINGS_RAD[best])
        self._heading_rad, self._is_followed = float(self._place[2]) + bearing, True
        turn = max(-_TURN_RAD_S, min(_TURN_RAD_S, self.config.turn_gain * bearing))
        share = max(0.0, 1.0 - abs(bearing) / _STANDING_RAD)
        return Velocity(self.config.speed_m_s * share, turn)

    def _is_clear(
        self, ends: Float[np.ndarray, "ends 2"], points: Float[np.ndarray, "points 2"]
    ) -> Bool[np.ndarray, " ends"]:
        """Whether straight drives keep clear of points; what is near already may be left."""
        near = points[(points**2).sum(axis=1) < (_LOOK_M + 0.4) ** 2]
        along = np.clip(near @ ends.T / _LOOK_M**2, 0.0, 1.0)
        closest = near[:, None] - along[..., None] * ends[None]
        away_m = np.linalg.norm(closest, axis=-1)
        now_m = np.linalg.norm(near, axis=1)
        limit_m = np.minimum(self.config.clearance_m, now_m - 0.005)
        return np.asarray((away_m >= limit_m[:, None]).all(axis=0))

    def _has_led(self, here: tuple[float, float]) -> bool:
        """Whether this detour is over: the network would turn back from a shorter one."""
        assert self._began is not None
        if self._steps < self.config.least_steps:
            return False
        is_on = math.dist(here, self._began) >= self.config.leads_m
        return is_on or self._steps >= self.config.most_steps

    def _gets_nowhere(self) -> bool:
        config = self.config

        def moved_m(steps: int) -> float:
            if len(self._trail) <= steps:
                return math.inf
            return math.dist(self._trail[-1], self._trail[-1 - steps])

        soon = moved_m(config.soon_steps) < config.soon_m
        return bool(soon or moved_m(config.late_steps) < config.late_m)
