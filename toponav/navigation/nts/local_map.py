"""The map that the local policy drives on: occupancy around the start, from depth or ranges."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64

from toponav.core.geometry import Pose2
from toponav.core.imagenav import IMAGE_NAV_ROBOT_RADIUS_M
from toponav.models.nts.panorama import (
    CAMERA_HEIGHT_M,
    OBSTACLE_HEIGHTS_M,
    column_yaw_rad,
    horizontal_scale,
)
from toponav.navigation.nts.drive_kernels import clearance_cells
from toponav.navigation.nts.map_kernels import add_ranges, add_view, march

__all__ = ["LocalMap", "MapConfig", "Window"]


@dataclass(frozen=True)
class MapConfig:
    """How the map is kept and read."""

    cell_m: float = 0.05
    """Side of a cell."""
    side_m: float = 32.0
    """Side of the map; the start lies in its middle."""
    margin_m: float = 0.03
    """Kept from obstacles besides the robot's radius."""
    comfort_m: float = 0.3
    """Beyond this distance from obstacles driving is no faster."""
    unknown_speed: float = 0.6
    """Speed where nothing was seen yet, free space being 1."""
    believed_m: float = 3.5
    """Predicted ranges (RGB) mark obstacles up to here."""


@dataclass(frozen=True, eq=False)
class Window:
    """A cut of the map, ready to plan on.

    Attributes:
        row: First row.
        col: First column.
        speed: 0 in obstacles, 1 in the open.
        clearance_m: Distance to the nearest obstacle, up to where none matters.
        unknown: Cells not seen yet.
    """

    row: int
    col: int
    speed: Float64[np.ndarray, "rows cols"]
    clearance_m: Float32[np.ndarray, "rows cols"]
    unknown: Bool[np.ndarray, "rows cols"]


class LocalMap:
    """Occupancy in the frame of the start.

    Args:
        config: How it is kept.
    """

    def __init__(self, config: MapConfig | None = None) -> None:
        self.config = config or MapConfig()
        cells = round(self.config.side_m / self.config.cell_m)
        self._origin_m = -self.config.side_m / 2
        self.evidence = np.zeros((cells, cells), np.int16)
        self.bumped = np.zeros((cells, cells), np.bool_)

    @property
    def corner_m(self) -> float:
        """Both coordinates of the corner of the first cell."""
        return self._origin_m

    def add_depth(self, depth_m: Float32[np.ndarray, "height width"], pose: Pose2) -> None:
        """Adds what a depth panorama, taken at `pose`, shows."""
        height, width = depth_m.shape
        lift = (height / 2 - np.arange(height) - 0.5) / (width / 8)
        add_view(
            self.evidence,
            self._origin_m,
            self._origin_m,
            self.config.cell_m,
            np.array(pose),
            np.ascontiguousarray(depth_m),
            column_yaw_rad(width),
            horizontal_scale(width),
            lift,
            CAMERA_HEIGHT_M,
            *OBSTACLE_HEIGHTS_M,
        )

    def add_ranges(self, range_m: Float32[np.ndarray, " directions"], pose: Pose2) -> None:
        """Adds ranges to obstacles, predicted from a colour panorama taken at `pose`."""
        config = self.config
        origin = self._origin_m
        add_ranges(
            self.evidence,
            origin,
            origin,
            config.cell_m,
            np.array(pose),
            range_m.astype(np.float64),
            config.believed_m,
        )

    def add_bump(self, pose: Pose2) -> None:
        """Marks what the robot ran into: a short bar ahead of it."""
        ahead_m = IMAGE_NAV_ROBOT_RADIUS_M + 0.06
        for left_m in np.arange(-0.08, 0.09, self.config.cell_m / 2):
            hit = pose.compose(Pose2(ahead_m, float(left_m), 0.0))
            row, col = self.cell_of(hit.x_m, hit.y_m)
            self.bumped[row, col] = True

    def forget_bumps(self) -> None:
        """Takes the marks of collisions away."""
        self.bumped[:] = False

    def cell_of(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column of a point, the nearest on the edge outside."""
        last = len(self.evidence) - 1
        row = math.floor((y_m - self._origin_m) / self.config.cell_m)
        col = math.floor((x_m - self._origin_m) / self.config.cell_m)
        return min(max(row, 0), last), min(max(col, 0), last)

    def is_clear(self, start: tuple[float, float], end: tuple[float, float]) -> bool:
        """Whether nothing known stands on the straight line between two points."""
        count = 2 + round(math.dist(start, end) / self.config.cell_m)
        x_m = np.linspace(start[0], end[0], count)
        y_m = np.linspace(start[1], end[1], count)
        last = len(self.evidence) - 1
        at = [(v - self._origin_m) / self.config.cell_m for v in (y_m, x_m)]
        rows, cols = (np.clip(np.floor(v).astype(int), 0, last) for v in at)
        return not bool((self.evidence[rows, cols] > 0).any())

    def cells_of(self, x_m: float, y_m: float) -> tuple[float, float]:
        """A point in cells: row and column, with what is left of each."""
        cell_m = self.config.cell_m
        return (y_m - self._origin_m) / cell_m, (x_m - self._origin_m) / cell_m

    def center_of(self, row: float | int, col: float | int) -> tuple[float, float]:
        """Middle of a cell, x and y."""
        cell_m = self.config.cell_m
        return (col + 0.5) * cell_m + self._origin_m, (row + 0.5) * cell_m + self._origin_m

    def window(self, points: list[tuple[float, float]], margin_m: float = 2.0) -> Window:
        """The part of the map that holds all that is known, and these points."""
        known = self.evidence != 0
        rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        corners = [self.cell_of(*point) for point in points]
        reach = round(margin_m / self.config.cell_m)
        row_ends = [row for row, _ in corners] + (
            [int(rows[0]), int(rows[-1])] if len(rows) else []
        )
        col_ends = [col for _, col in corners] + (
            [int(cols[0]), int(cols[-1])] if len(cols) else []
        )
        last = len(self.evidence)
        top, bottom = max(min(row_ends) - reach, 0), min(max(row_ends) + reach + 1, last)
        left, right = max(min(col_ends) - reach, 0), min(max(col_ends) + reach + 1, last)
        evidence = self.evidence[top:bottom, left:right]
        occupied = (evidence > 0) | self.bumped[top:bottom, left:right]
        return self._window(top, left, occupied, evidence == 0)

    def _window(
        self,
        top: int,
        left: int,
        occupied: Bool[np.ndarray, "rows cols"],
        unknown: Bool[np.ndarray, "rows cols"],
    ) -> Window:
        config = self.config
        tight = IMAGE_NAV_ROBOT_RADIUS_M + config.margin_m
        reach = math.ceil((tight + config.comfort_m) / config.cell_m) + 1
        clearance_m = (clearance_cells(occupied, reach) - np.float32(0.5)) * np.float32(
            config.cell_m
        )
        share = np.clip((clearance_m - tight) / config.comfort_m, 0.0, 1.0)
        speed = np.where(clearance_m >= tight, 0.35 + 0.65 * share, 0.0).astype(np.float64)
        # Squeezing is for getting out of where one already is: slow, but not a wall.
        squeezing = (speed == 0.0) & ~occupied
        speed[squeezing] = 0.02
        speed[unknown & (speed > 0.02)] *= config.unknown_speed
        return Window(top, left, speed, clearance_m, unknown)

    def times_to(
        self, window: Window, goals: list[tuple[float, float]], robot: Pose2
    ) -> Float64[np.ndarray, "rows cols"]:
        """Metres of driving in the open that each cell is away from the nearest of the goals."""
        rows, cols = [], []
        height, width = window.speed.shape
        for goal in goals:
            row, col = self.cell_of(*goal)
            rows.append(min(max(row - window.row, 0), height - 1))
            cols.append(min(max(col - window.col, 0), width - 1))
        row, col = self.cell_of(robot.x_m, robot.y_m)
        speed = (
            np.maximum(window.speed, 1e-3) if self._is_walled(window, rows, cols) else window.speed
        )
        time = march(
            speed,
            np.array(rows),
            np.array(cols),
            row - window.row,
            col - window.col,
            1.0 / self.config.cell_m,
        )
        return np.asarray(time * self.config.cell_m)

    @staticmethod
    def _is_walled(window: Window, rows: list[int], cols: list[int]) -> bool:
        """Whether all goals lie in what looks like an obstacle."""
        return all(window.speed[row, col] <= 0.02 for row, col in zip(rows, cols, strict=True))
