"""Which floor was searched: in sight and so near that the goal would have been found there."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy import ndimage

from toponav.core.geometry import Pose2
from toponav.navigation.nts.local_map import LocalMap, Window
from toponav.navigation.nts.map_kernels import add_ranges, march
from toponav.navigation.nts.perception import View

__all__ = ["Opening", "SearchConfig", "SearchedFloor"]

_COARSE = 2
_SQUEEZED = 0.02
_FARTHEST_M = 80.0


@dataclass(frozen=True)
class SearchConfig:
    """What counts as searched, and what is left to search."""

    sight_m: float = 3.5
    """Floor so near, in level sight, is searched: the goal is looked for this far."""
    close_m: float = 2.0
    """When nothing is left, floor that was not so near is searched again."""
    moved_m: float = 0.2
    """The robot looks again after driving so far."""
    narrowest_m: float = 0.3
    """Shorter edges of the searched floor are no ways."""
    least_m2: float = 0.6
    """Less unsearched floor behind an edge is no place."""
    around_m: float = 2.5
    """Unsearched floor counts for an edge this far from it."""
    given_up_m: float = 0.7
    """What was given up keeps edges so near from being tried."""


@dataclass(frozen=True)
class Opening:
    """An edge of the searched floor that one can drive to and beyond.

    Attributes:
        x_m: Its middle, in the frame of the start.
        y_m: Its middle.
        drive_m: How far the drive is, in metres of driving in the open.
        unseen_m2: Unsearched floor behind it.
    """

    x_m: float
    y_m: float
    drive_m: float
    unseen_m2: float


@dataclass(frozen=True, eq=False)
class _Field:
    """Metres of driving from where the robot was, over a coarse cut of the map."""

    window: Window
    drive_m: Float64[np.ndarray, "rows cols"]
    passable: Bool[np.ndarray, "rows cols"]


class SearchedFloor:
    """Keeps what was searched on the grid of a local map.

    Args:
        map_: Occupancy, in the frame of the start.
        config: What counts.
    """

    def __init__(self, map_: LocalMap, config: SearchConfig | None = None) -> None:
        self.config = config or SearchConfig()
        self._map = map_
        self._looked: Pose2 | None = None
        self._field: _Field | None = None
        self._given_up: list[tuple[float, float]] = []
        self.closely = False
        self._far = np.zeros_like(map_.evidence)
        self._near = np.zeros_like(map_.evidence)

    def forget(self) -> None:
        """Nothing is searched yet: the goal is another."""
        self._far[:] = 0
        self._near[:] = 0
        self._given_up = []
        self._looked, self.closely = None, False

    def look(self, view: View, pose: Pose2) -> None:
        """Takes in a view."""
        if self._looked is not None and pose.distance_to(self._looked) < self.config.moved_m:
            return
        self._looked = pose
        ranges = view.signature.range_m.astype(np.float64)
        corner_m, cell_m = self._map.corner_m, self._map.config.cell_m
        at = np.array(pose)
        for grid, reach_m in ((self._far, self.config.sight_m), (self._near, self.config.close_m)):
            add_ranges(grid, corner_m, corner_m, cell_m, at, ranges, reach_m)

    def give_up(self, x_m: float, y_m: float) -> None:
        """There is no way through to what lies behind a place."""
        self._given_up.append((x_m, y_m))

    def search_closely(self) -> bool:
        """Counts only what was seen from near by from now on; whether that is new."""
        if self.closely:
            return False
        self.closely, self._given_up = True, []
        return True

    def is_searched(self, x_m: float, y_m: float) -> bool:
        """Whether the goal would have been found at a place."""
        return bool(self._grid[self._map.cell_of(x_m, y_m)] != 0)

    def drive_m(self, x_m: float, y_m: float) -> float:
        """How far a place was at the last `openings`; infinite where no way is known."""
        field = self._field
        if field is None:
            return math.inf
        row, col = self._map.cell_of(x_m, y_m)
        row, col = (row - field.window.row) // _COARSE, (col - field.window.col) // _COARSE
        around = field.drive_m[max(row - 1, 0) : row + 2, max(col - 1, 0) : col + 2]
        return float(around.min()) if around.size else math.inf

    def openings(self, pose: Pose2) -> list[Opening]:
        """What is left to search and can be driven to, the nearest first."""
        config = self.config
        self._field = field = self._drive_field(pose)
        cell_m = self._map.config.cell_m * _COARSE
        searched = self._coarse_searched(field)
        known = searched & field.passable & (field.drive_m < _FARTHEST_M)
        unsearched = ~searched & field.passable
        edge = known & ndimage.binary_dilation(unsearched)
        edges, count = ndimage.label(edge, np.ones((3, 3)))
        rooms, _ = ndimage.label(unsearched)
        found = []
        for part, box in enumerate(ndimage.find_objects(edges), start=1):
            cells = np.argwhere(edges[box] == part) + np.array([box[0].start, box[1].start])
            if len(cells) * cell_m < config.narrowest_m:
                continue
            middle = cells[((cells - cells.mean(axis=0)) ** 2).sum(axis=1).argmin()]
            row, col = middle.tolist()
            unseen_m2 = _behind(rooms, cells, row, col, round(config.around_m / cell_m))
            unseen_m2 *= cell_m**2
            place = self._center_of(field, row, col)
            is_new = all(math.dist(place, old) > config.given_up_m for old in self._given_up)
            if unseen_m2 >= config.least_m2 and is_new:
                found.append(Opening(*place, float(field.drive_m[row, col]), unseen_m2))
        assert len(found) <= count
        return sorted(found, key=lambda opening: opening.drive_m)

    @property
    def _grid(self) -> np.ndarray:
        return self._near if self.closely else self._far

    def _center_of(self, field: _Field, row: int, col: int) -> tuple[float, float]:
        half = (_COARSE - 1) / 2
        return self._map.center_of(
            row * _COARSE + half + field.window.row, col * _COARSE + half + field.window.col
        )

    def _drive_field(self, pose: Pose2) -> _Field:
        window = self._map.window([(pose.x_m, pose.y_m)], margin_m=1.0)
        speed = _blocks(window.speed).min(axis=(1, 3))
        row, col = self._map.cell_of(pose.x_m, pose.y_m)
        row = min((row - window.row) // _COARSE, len(speed) - 1)
        col = min((col - window.col) // _COARSE, speed.shape[1] - 1)
        passable = speed > _SQUEEZED
        # Narrow and unknown ways are slow to drive, but hardly longer.
        speed[passable] = 0.5 + 0.5 * speed[passable]
        times = march(speed, np.array([row]), np.array([col]), -1, -1, 0.0)
        return _Field(window, times * self._map.config.cell_m * _COARSE, passable)

    def _coarse_searched(self, field: _Field) -> Bool[np.ndarray, "rows cols"]:
        window = field.window
        rows, cols = window.speed.shape
        part = self._grid[window.row : window.row + rows, window.col : window.col + cols]
        return np.asarray(_blocks(part != 0).any(axis=(1, 3)))


def _blocks(cells: np.ndarray) -> np.ndarray:
    """Cells in blocks: block row, row in it, block column, column in it."""
    rows, cols = cells.shape[0] // _COARSE, cells.shape[1] // _COARSE
    cut = cells[: rows * _COARSE, : cols * _COARSE]
    return cut.reshape(rows, _COARSE, cols, _COARSE)


def _behind(
    rooms: Int64[np.ndarray, "rows cols"] | np.ndarray,
    cells: Int64[np.ndarray, "cells 2"],
    row: int,
    col: int,
    reach: int,
) -> float:
    """Cells of the unsearched floor that an edge touches, near its middle."""
    low, left = np.maximum(cells.min(axis=0) - 1, 0)
    high, right = cells.max(axis=0) + 2
    touched = np.zeros(int(rooms.max()) + 1, np.bool_)
    # The edge touches it side by side, so what lies around its cells is all that counts.
    around = np.zeros((high - low, right - left), np.bool_)
    around[cells[:, 0] - low, cells[:, 1] - left] = True
    near = rooms[low:high, left:right]
    around = ndimage.binary_dilation(around)[: near.shape[0], : near.shape[1]]
    touched[near[around]] = True
    touched[0] = False
    part = rooms[max(row - reach, 0) : row + reach + 1, max(col - reach, 0) : col + reach + 1]
    return float(touched[part].sum())
