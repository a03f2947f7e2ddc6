"""What a robot does that is lost in its first room: it looks where it has not looked yet."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float, Float64, UInt8
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.navigation.nts.map_kernels import march

__all__ = ["RoomSearch", "RoomSearchConfig"]

_OCCUPIED: Final = 10
_FREE: Final = 4
_ALL_AROUND: Final = np.ones((3, 3), np.bool_)


@dataclass(frozen=True)
class RoomSearchConfig:
    """When a lost robot searches, and what is worth a look."""

    patience: int = 2
    """The belief has to have been begun anew so often: mostly the first times find the robot."""
    lasts_steps: int = 75
    """For so many steps at most it searches; then it tries its belief again..."""
    rests_steps: int = 40
    """...for so many steps at least."""
    found: float = 1.5
    """A belief of which the judgement, averaged, is above this is found again."""
    clearance_m: float = 0.25
    """From obstacles, to the middle of the robot."""
    standing_m: float = 0.4
    """The floor so near to the robot is seen, though its camera cannot see it."""
    least_m: float = 0.5
    """Edges of what was seen that are shorter than this are gaps, not ways."""
    farthest_m: float = 5.5
    """Edges farther away are not gone to."""
    turn_cost_m: float = 0.5
    """Metres that a radian of turning counts for."""
    near_m: float = 0.6
    """Edges so near to the last one are taken for the same..."""
    keep_m: float = 0.8
    """...and cost so much less than others."""
    look_steps: int = 3
    """The edges are looked for anew after so many steps."""

    def __post_init__(self) -> None:
        if not all(0.0 < value < 1000.0 for value in vars(self).values()):
            raise InputError(
                f"every setting must be positive, got {self}",
                where="RoomSearchConfig",
                remedy="leave it at its default",
            )


class RoomSearch:
    """Frontier exploration of the room, until the robot is judged to know where it is.

    A robot that is wrong about its place heads for a door that is not there. What would put it
    right is out of sight, behind it or behind a partition, and standing still shows nothing new.

    Reference:
        Yamauchi 1997, "A frontier-based approach for autonomous exploration".

    Args:
        config: When and where.
    """

    def __init__(self, config: RoomSearchConfig | None = None) -> None:
        self.config = config or RoomSearchConfig()
        self.clear()

    def clear(self) -> None:
        """Forget everything: an episode begins."""
        self._left_steps = 0
        self._rest_steps = 0
        self._searches = 0
        self._target: Float64[np.ndarray, " 2"] | None = None
        self._kept_steps = 0

    @property
    def is_on(self) -> bool:
        """Whether the robot should look around now."""
        return self._left_steps > 0

    def advance(self, step: Float[np.ndarray, " 3"]) -> None:
        """The robot moved by this: metres forward and left, radians turned."""
        self._left_steps = max(0, self._left_steps - 1)
        self._rest_steps = max(0, self._rest_steps - 1)
        if self._target is not None:
            x, y = self._target - step[:2]
            c, s = math.cos(step[2]), math.sin(step[2])
            self._target = np.array([c * x + s * y, -s * x + c * y])

    def consider(self, searches: int, judged: float, *, is_early: bool) -> None:
        """Begin where the belief was given up before it left the room; end where one is found.

        Args:
            searches: How often the belief was begun anew in this episode.
            judged: Averaged log-odds that the belief is near the truth.
            is_early: Whether the robot may still be in its first room.
        """
        is_new, self._searches = searches > self._searches, searches
        if self.is_on:
            if judged > self.config.found:
                self._left_steps, self._rest_steps = 0, 0
        elif is_new and is_early and searches >= self.config.patience and not self._rest_steps:
            self._left_steps = self.config.lasts_steps
            self._rest_steps = self.config.lasts_steps + self.config.rests_steps
            self._target = None

    def target(
        self, view: UInt8[np.ndarray, "forward left"], cell_m: float
    ) -> Float64[np.ndarray, " 2"] | None:
        """The edge of what was seen to look beyond next: metres forward and left.

        Args:
            view: What was seen (`LocalMap.view`), the robot in the middle.
            cell_m: Side of a cell.

        Returns:
            None where all is seen that can be driven to.
        """
        config = self.config
        if self._target is not None and 0 < self._kept_steps < config.look_steps:
            self._kept_steps += 1
            return self._target
        self._kept_steps = 1
        middle = (len(view) - 1) / 2.0
        rows, cols = np.ogrid[: len(view), : len(view)]
        away_m = np.hypot(rows - middle, cols - middle) * cell_m
        floor = view >> 4
        clearance_m = ndimage.distance_transform_edt(floor < _OCCUPIED) * cell_m
        is_here = away_m < config.standing_m
        free = ((floor <= _FREE) & (clearance_m > config.clearance_m)) | is_here
        unknown = (floor > _FREE) & (floor < _OCCUPIED) & ~is_here
        start = np.array([len(view) // 2])
        drive_m = march(free.astype(np.float64), start, start, -1, -1, 0.0) * cell_m
        edge = np.isfinite(drive_m) & ndimage.binary_dilation(unknown, _ALL_AROUND)
        edge &= away_m > config.standing_m + 2.0 * cell_m
        self._target = self._best(_long(edge, config.least_m / cell_m), drive_m, cell_m)
        return self._target

    def _best(
        self, edge: Bool[np.ndarray, "forward left"], drive_m: np.ndarray, cell_m: float
    ) -> Float64[np.ndarray, " 2"] | None:
        cells = np.argwhere(edge & (drive_m < self.config.farthest_m))
        if not len(cells):
            return None
        places = (cells - (len(edge) - 1) / 2.0) * cell_m
        bearing_rad = np.abs(np.arctan2(places[:, 1], places[:, 0]))
        cost_m = drive_m[tuple(cells.T)] + self.config.turn_cost_m * bearing_rad
        if self._target is not None:
            is_kept = np.hypot(*(places - self._target).T) < self.config.near_m
            cost_m = cost_m - self.config.keep_m * is_kept
        found: Float64[np.ndarray, " 2"] = places[int(cost_m.argmin())]
        return found


def _long(
    edge: Bool[np.ndarray, "forward left"], least_cells: float
) -> Bool[np.ndarray, "forward left"]:
    """The edges that are not gaps."""
    numbers, _ = ndimage.label(edge, structure=_ALL_AROUND)
    sizes = np.bincount(numbers.ravel())
    sizes[0] = 0
    return np.asarray(sizes[numbers] >= least_cells)
