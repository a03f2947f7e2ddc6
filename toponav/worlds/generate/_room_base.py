"""A room that is being furnished: which models it gets, and whether they fit."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from toponav.worlds.furniture_library import FurnitureLibrary
from toponav.worlds.generate._home_canvas import Canvas, Cells, Piece, footprint
from toponav.worlds.generate._home_program import RoomSpec
from toponav.worlds.generate._home_shell import CELL_M
from toponav.worlds.generate._home_style import EACH_OBJECT, Palette
from toponav.worlds.generate._home_walls import WallRun
from toponav.worlds.generate._library_pieces import library_piece
from toponav.worlds.generate.pieces import CLASSES, parametric_model
from toponav.worlds.generate.surfaces import Surface, surface, variants

__all__ = ["Placed", "RoomBase"]

_PASSAGE_M = 0.24
"""Half of the width that ways through a room keep, a robot's 0.18 m with a margin."""
_LEAST_FLOOR_M2 = 0.4


@dataclass(frozen=True, eq=False)
class Placed:
    """Where a piece stands.

    Attributes:
        piece: What it is.
        x_m: Middle of its back.
        y_m: Middle of its back.
        yaw_rad: Turn; 0 has its back towards -y.
        run: The wall behind it, if any.
        along_m: Its middle along that wall.
    """

    piece: Piece
    x_m: float
    y_m: float
    yaw_rad: float
    run: WallRun | None = None
    along_m: float = 0.0

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Width, depth and height."""
        return self.piece.shape.size_m

    def point(self, right_m: float, forward_m: float) -> tuple[float, float]:
        """World (x, y) of a point in the piece's own frame."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.x_m + c * right_m - s * forward_m, self.y_m + s * right_m + c * forward_m


class RoomBase:
    """One room that is being furnished; every method leaves all of its doors connected.

    Attributes:
        spec: What the room is for.
        rng: Chooses models and places.
        runs: Its walls, longest first.
        area_m2: Its floor.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        canvas: Canvas,
        number: int,
        runs: list[WallRun],
        palette: Palette,
        held_out: bool,
        library: FurnitureLibrary | None,
    ) -> None:
        self.rng = rng
        self.spec: RoomSpec = canvas.shell.specs[number]
        self.runs = sorted(
            (run for run in runs if run.room == number and run.length_m > 0.3),
            key=lambda run: (-run.length_m, run.line_m, run.start_m),
        )
        self._canvas = canvas
        self._palette = palette
        self._held_out = held_out
        self._library = library
        self._floor = canvas.shell.room_index == number
        self._reserved = canvas.shell.keep_free.copy()
        self.area_m2 = float(self._floor.sum()) * CELL_M**2
        cells = np.argwhere(self._floor)
        (row0, col0), (row1, col1) = cells.min(axis=0) - 8, cells.max(axis=0) + 9
        self._box = slice(max(int(row0), 0), int(row1)), slice(max(int(col0), 0), int(col1))
        self._seeds = [
            self._middle_of(opening)
            for opening in canvas.shell.openings
            if number in (opening.outer, opening.inner)
        ]
        self._walkable = self._floor.copy()
        for opening in canvas.shell.openings:
            if number in (opening.outer, opening.inner):
                self._walkable[opening.box(8, 8)] = True
        self._walkable &= canvas.shell.room_index >= 0

    # --- Choosing -------------------------------------------------------------------------

    def chance(self, share: float) -> bool:
        """True this often."""
        return bool(self.rng.random() < share)

    def model(self, name: str) -> Piece:
        """A model of a class, from the library where it has one, else parametric."""
        if self._library is not None and self.chance(0.75):
            piece = library_piece(self.rng, self._library, name, self._held_out)
            if piece is not None:
                return piece
        variant = int(self.rng.choice(variants(name, self._held_out)))
        kind = CLASSES[name]
        return Piece(name, f"{name}/{variant}", kind.semantic, parametric_model(name, variant))

    def colors(self, piece: Piece) -> tuple[Surface, ...]:
        """The surfaces of a piece in this room's style."""
        if piece.surfaces is not None:
            return piece.surfaces
        found = []
        for slot in piece.shape.slots:
            if slot == "front":
                kind = "wood" if self._palette["has_wooden_front"] else "painted"
                found.append(surface(kind, self._palette["front"]))
            elif slot in EACH_OBJECT:
                options = variants(slot, self._held_out)
                found.append(surface(slot, int(self.rng.choice(options))))
            else:
                found.append(surface(slot, self._palette[slot]))
        return tuple(found)

    # --- Testing --------------------------------------------------------------------------

    def _middle_of(self, opening) -> tuple[int, int]:  # type: ignore[no-untyped-def]
        x, y = opening.point_m((opening.start + opening.stop) / 2, 0.5)
        return int(y / CELL_M), int(x / CELL_M)

    def _fits(
        self, piece: Piece, at: tuple[float, float, float], yaw_rad: float, on_reserved: bool
    ) -> tuple[tuple[slice, slice], Cells] | None:
        """The cells that the piece would take, or None where it cannot stand."""
        if not self._is_inside(piece, at, yaw_rad):
            return None
        cells = footprint(piece.shape, at, yaw_rad, self._floor.shape)
        if cells is None:
            return None
        window, mask = cells
        if not mask.any():
            return cells
        keep = self._canvas.shell.keep_free if on_reserved else self._reserved
        bad = ~self._floor[window] | self._canvas.blocked[window] | keep[window]
        return None if (bad & mask).any() else cells

    def _is_inside(self, piece: Piece, at: tuple[float, float, float], yaw_rad: float) -> bool:
        """Whether the corners and edges of its outline lie over the room's floor."""
        width, depth, high = piece.shape.size_m
        if at[2] + high > self._canvas.shell.ceiling_m - 0.02:
            return False
        placed = Placed(piece, at[0], at[1], yaw_rad)
        # Half a centimetre of slack at walls, which things may touch.
        across = np.linspace(-width / 2 + 0.005, width / 2 - 0.005, max(3, round(width / 0.2)))
        for right in across:
            for forward in (0.005, depth / 2, depth - 0.005):
                x, y = placed.point(float(right), forward)
                row, col = math.floor(y / CELL_M), math.floor(x / CELL_M)
                if not (0 <= row < self._floor.shape[0] and 0 <= col < self._floor.shape[1]):
                    return False
                if not self._floor[row, col]:
                    return False
        return True

    def _stays_open(self, cells: tuple[tuple[slice, slice], Cells]) -> bool:
        """Whether a robot could still get from each door to every other and to some floor."""
        window, mask = cells
        blocked = self._canvas.blocked.copy()
        blocked[window] |= mask
        free = self._walkable[self._box] & ~blocked[self._box]
        depth = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] * CELL_M
        pieces, _ = ndimage.label(depth > _PASSAGE_M)
        row0, col0 = self._box[0].start, self._box[1].start
        found = {int(pieces[row - row0, col - col0]) for row, col in self._seeds}
        if len(found) != 1 or 0 in found:
            return False
        floor = (pieces == found.pop()) & self._floor[self._box]
        return float(floor.sum()) * CELL_M**2 >= min(_LEAST_FLOOR_M2, 0.12 * self.area_m2)

    def _commit(
        self,
        piece: Piece,
        at: tuple[float, float, float],
        yaw_rad: float,
        cells: tuple[tuple[slice, slice], Cells],
    ) -> None:
        surfaces = self.colors(piece)
        self._canvas.put(piece, surfaces, at, yaw_rad, cells if cells[1].any() else None)

    def _try(
        self,
        piece: Piece,
        x_m: float,
        y_m: float,
        yaw_rad: float,
        *,
        on_reserved: bool = False,
        front_m: float | None = None,
    ) -> Placed | None:
        """Puts a piece on the floor if it fits there and no way is lost."""
        at = (x_m, y_m, 0.0)
        cells = self._fits(piece, at, yaw_rad, on_reserved)
        if cells is None or (cells[1].any() and not self._stays_open(cells)):
            return None
        self._commit(piece, at, yaw_rad, cells)
        placed = Placed(piece, x_m, y_m, yaw_rad)
        reach = CLASSES[piece.name].front_m if front_m is None else front_m
        if reach > 0:
            self._reserve(placed, reach)
        return placed

    def _reserve(self, placed: Placed, reach_m: float) -> None:
        """Keeps other furniture off the floor before a piece."""
        width, depth, _ = placed.size_m
        a = placed.point(-width / 2 + 0.05, depth)
        c = placed.point(width / 2 - 0.05, depth + reach_m)
        x0, x1 = sorted((a[0], c[0]))
        y0, y1 = sorted((a[1], c[1]))
        box = (
            slice(max(round(y0 / CELL_M), 0), max(round(y1 / CELL_M), 0)),
            slice(max(round(x0 / CELL_M), 0), max(round(x1 / CELL_M), 0)),
        )
        self._reserved[box] |= self._floor[box]
