"""Where a robot of a given radius can be, and how far it is from there to a goal."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, Int32
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.worlds.grid import GridFrame
from toponav.worlds.grid_kernels import distance_to_solid, downhill_cells, geodesic_cells
from toponav.worlds.scene import Scene

__all__ = ["FreeSpace", "indoors"]

_GAP_M = 1.0
"""Unlabelled floor up to this wide between rooms (doorways, unscanned spots) is indoors."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The floor that a round robot's centre can reach inside a building.

    Floor outside the building does not count: a scene with rooms is free in its rooms and in
    gaps of up to a metre between them, such as doorways.

    Attributes:
        grid: Where the cells lie.
        radius_m: Radius of the robot.
        clearance_m: Distance from each cell's centre to the nearest solid surface.
        free: Cells indoors with more clearance than the radius.

    Example:
        >>> from toponav.worlds.scene import scene_from_heights
        >>> room = np.pad(np.zeros((4, 4)), 1, constant_values=2.5)
        >>> scene = scene_from_heights("cell", GridFrame(0.5, (0.0, 0.0), 6, 6), room)
        >>> int(FreeSpace.of(scene, radius_m=0.3).free.sum())
        4
    """

    grid: GridFrame
    radius_m: float
    clearance_m: Float32[np.ndarray, "rows cols"]
    free: Bool[np.ndarray, "rows cols"]

    @staticmethod
    def of(scene: Scene, radius_m: float = 0.2) -> "FreeSpace":
        """The free space of a robot of this radius.

        Raises:
            InputError: When the radius is not between 0 and 10 m.
        """
        if not 0 <= radius_m < 10:
            raise InputError(
                f"radius_m must lie in 0..10, got {radius_m}",
                where="FreeSpace.of",
                remedy="give the robot's radius in metres",
            )
        cells: np.ndarray = distance_to_solid(scene.occupied)
        clearance_m: np.ndarray = cells * np.float32(scene.grid.resolution_m)
        free = (clearance_m > radius_m) & indoors(scene.room_index, scene.grid.resolution_m)
        if scene.rooms:
            free = _pieces_that_touch(free, scene.room_index >= 0)
        clearance_m.setflags(write=False)
        free.setflags(write=False)
        return FreeSpace(scene.grid, float(radius_m), clearance_m, free)

    @cached_property
    def component(self) -> Int32[np.ndarray, "rows cols"]:
        """A number per connected piece of free space, 1 the largest; 0 elsewhere."""
        # Four neighbours: a diagonal step needs both cells beside it, as in `geodesic_m`.
        pieces, count = ndimage.label(self.free)
        sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
        rank = np.zeros(count + 1, np.int32)
        rank[1 + np.argsort(-sizes, kind="stable")] = np.arange(1, count + 1)
        numbers: np.ndarray = rank[pieces]
        return numbers

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Whether the robot's centre can be in the cell at this point."""
        row, col = self.grid.cell_of(x_m, y_m)
        return bool(
            0 <= row < self.grid.rows and 0 <= col < self.grid.cols and self.free[row, col]
        )

    def nearest_free(self, x_m: float, y_m: float, within_m: float = 1.0) -> tuple[int, int]:
        """The free cell (row, col) whose centre is nearest to a point.

        Raises:
            InputError: When no free cell lies within `within_m`.
        """
        cell_m = self.grid.resolution_m
        row, col = self.grid.cell_of(x_m, y_m)
        reach = math.ceil(within_m / cell_m) + 1
        row0, col0 = max(row - reach, 0), max(col - reach, 0)
        window = self.free[row0 : max(row + reach + 1, 0), col0 : max(col + reach + 1, 0)]
        cells = np.argwhere(window) + np.array([row0, col0])
        if len(cells):
            centers = (cells[:, ::-1] + 0.5) * cell_m + np.array(self.grid.origin_m)
            distance_m = np.hypot(centers[:, 0] - x_m, centers[:, 1] - y_m)
            best = int(distance_m.argmin())
            if distance_m[best] <= within_m or (row, col) == tuple(cells[best]):
                return int(cells[best, 0]), int(cells[best, 1])
        raise InputError(
            f"no free floor within {within_m:g} m for a robot of radius {self.radius_m:g} m",
            where=f"point ({x_m:.2f}, {y_m:.2f})",
            remedy="choose a point inside a room, away from furniture, or a smaller robot",
        )

    def geodesic_m(
        self,
        goal_xy: tuple[float, float] | Float[np.ndarray, "2"],
        weight: Float32[np.ndarray, "rows cols"] | None = None,
    ) -> Float32[np.ndarray, "rows cols"]:
        """The length of the shortest path from every cell to the goal; infinite where none.

        Steps go to eight neighbours, so a path is at most 8.3 % longer than the true one.

        Args:
            goal_xy: The goal; the nearest free cell within a metre stands for it.
            weight: Factor on the length of the path through each cell, at least 1.

        Raises:
            InputError: When no free cell lies within a metre of the goal.
        """
        goal = self.nearest_free(float(goal_xy[0]), float(goal_xy[1]))
        return self.geodesic_from_cells_m(np.array([goal], np.int32), weight)

    def geodesic_from_cells_m(
        self,
        goals: Int32[np.ndarray, "goals 2"],
        weight: Float32[np.ndarray, "rows cols"] | None = None,
    ) -> Float32[np.ndarray, "rows cols"]:
        """As `geodesic_m`, to the nearest of several goal cells (row, col)."""
        if weight is None:
            weight, largest = np.ones((1, 1), np.float32), 1.0
        else:
            largest = float(weight[self.free].max(initial=1.0))
            lowest = float(weight[self.free].min(initial=1.0))
            if not (lowest >= 1.0 and largest <= 1e4):
                raise InputError(
                    f"weights must lie in 1..10000, got {lowest}..{largest}",
                    where="FreeSpace.geodesic_m",
                    remedy="scale the weights so that the cheapest cell costs 1",
                )
        cells: np.ndarray = geodesic_cells(self.free, weight, largest, goals)
        return cells * np.float32(self.grid.resolution_m)

    def path_m(
        self, geodesic_m: Float32[np.ndarray, "rows cols"], start_xy: tuple[float, float]
    ) -> Float[np.ndarray, "points 2"]:
        """Cell centres down a geodesic field from the start to its goal.

        Raises:
            InputError: When the field's goal cannot be reached from the start.
        """
        row, col = self.nearest_free(*start_xy)
        if not np.isfinite(geodesic_m[row, col]):
            raise InputError(
                "the goal cannot be reached",
                where=f"point ({start_xy[0]:.2f}, {start_xy[1]:.2f})",
                remedy="check that doors are open and wider than the robot",
            )
        cells = downhill_cells(self.free, geodesic_m, row, col, self.grid.resolution_m)
        assert geodesic_m[tuple(cells[-1])] == 0, "a geodesic field falls towards its goal"
        centers: np.ndarray = np.array(self.grid.origin_m) + (
            (cells[:, ::-1] + 0.5) * self.grid.resolution_m
        )
        return centers


def indoors(
    room_index: Int16[np.ndarray, "rows cols"], resolution_m: float
) -> Bool[np.ndarray, "rows cols"]:
    """Cells of rooms and of gaps up to a metre between them; all cells where none is known."""
    named = room_index >= 0
    if not named.any():
        return np.ones(named.shape, bool)
    reach = _GAP_M / 2 / resolution_m
    margin = math.ceil(reach) + 2
    padded = np.pad(named, margin)
    near = ndimage.distance_transform_edt(~padded) <= reach
    closed = ndimage.distance_transform_edt(near) > reach
    inner = slice(margin, -margin)
    inside: np.ndarray = closed[inner, inner] | named
    return inside


def _pieces_that_touch(free: np.ndarray, named: np.ndarray) -> np.ndarray:
    """The connected pieces of free space with at least one cell in a room."""
    pieces, count = ndimage.label(free)
    keep = np.zeros(count + 1, bool)
    keep[np.unique(pieces[free & named])] = True
    keep[0] = False
    kept: np.ndarray = keep[pieces]
    return kept
