"""Where a grid of cells lies in the world, and what can stand in a cell."""

import math
from dataclasses import dataclass
from enum import IntEnum

from toponav.core.errors import InputError

__all__ = ["GridFrame", "SemanticClass"]

_MAX_CELLS = 64_000_000


class SemanticClass(IntEnum):
    """What a surface belongs to; the classes of Stanford 2D-3D-S and `FURNITURE` for the rest.

    In a grid it names the obstacle that stands in the cell; `FLOOR` means none does.
    """

    FLOOR = 0
    WALL = 1
    CEILING = 2
    DOOR = 3
    COLUMN = 4
    WINDOW = 5
    TABLE = 6
    CHAIR = 7
    SOFA = 8
    BOOKCASE = 9
    BOARD = 10
    CLUTTER = 11
    FURNITURE = 12

    @property
    def is_structure(self) -> bool:
        """Whether it belongs to the building and not to what was carried in."""
        return self <= SemanticClass.WINDOW


@dataclass(frozen=True)
class GridFrame:
    """Square cells in the world, indexed [row, col]; row 0 has the lowest y.

    Attributes:
        resolution_m: Side of a cell.
        origin_m: World position of the lower-left corner of cell (0, 0).
        rows: Number of cells along y.
        cols: Number of cells along x.

    Example:
        >>> GridFrame(0.5, (-1.0, 0.0), rows=4, cols=6).cell_of(0.6, 1.9)
        (3, 3)
    """

    resolution_m: float
    origin_m: tuple[float, float]
    rows: int
    cols: int

    def __post_init__(self) -> None:
        checks = {
            "resolution_m": 1e-3 <= self.resolution_m <= 10.0,
            "origin_m": len(self.origin_m) == 2 and all(map(_is_on_earth, self.origin_m)),
            "rows": self.rows >= 1,
            "cols": self.cols >= 1,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where="GridFrame",
                    remedy="cells of 1 mm to 10 m, origin within 1e6 m, at least one cell",
                )
        if self.rows * self.cols > _MAX_CELLS:
            raise InputError(
                f"a grid holds at most {_MAX_CELLS:,} cells, got {self.rows} x {self.cols}",
                where="GridFrame",
                remedy="use larger cells or cut the building into parts",
            )

    def cell_of(self, x_m: float, y_m: float) -> tuple[int, int]:
        """The (row, col) of the cell that holds a point; outside the grid too."""
        return (
            math.floor((y_m - self.origin_m[1]) / self.resolution_m),
            math.floor((x_m - self.origin_m[0]) / self.resolution_m),
        )

    def center_of(self, row: int, col: int) -> tuple[float, float]:
        """The (x, y) of a cell's centre, in metres."""
        return (
            self.origin_m[0] + (col + 0.5) * self.resolution_m,
            self.origin_m[1] + (row + 0.5) * self.resolution_m,
        )

    def contains(self, x_m: float, y_m: float) -> bool:
        """Whether the point lies on the grid."""
        row, col = self.cell_of(x_m, y_m)
        return 0 <= row < self.rows and 0 <= col < self.cols

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, the shape of an array over this grid."""
        return self.rows, self.cols

    @property
    def extent_m(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top edges, as matplotlib's `imshow` takes them."""
        x, y = self.origin_m
        return (x, x + self.cols * self.resolution_m, y, y + self.rows * self.resolution_m)


def _is_on_earth(value_m: float) -> bool:
    return math.isfinite(value_m) and abs(value_m) <= 1e6
