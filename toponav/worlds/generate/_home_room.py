"""Puts things into one room: at walls, beside and before each other, in the middle, on top."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool
from scipy import ndimage

from toponav.worlds.furniture_library import FurnitureLibrary
from toponav.worlds.generate._home_canvas import Canvas, Piece, footprint, turned_exactly
from toponav.worlds.generate._home_program import RoomSpec
from toponav.worlds.generate._home_shell import CELL_M
from toponav.worlds.generate._home_style import EACH_OBJECT, Palette
from toponav.worlds.generate._home_walls import WallRun, Window
from toponav.worlds.generate._library_pieces import library_piece
from toponav.worlds.generate._pieces_decor import build_curtain
from toponav.worlds.generate.pieces import CLASSES, parametric_model
from toponav.worlds.generate.shapes import ShapeBuilder
from toponav.worlds.generate.surfaces import Surface, surface, variants
from toponav.worlds.grid import SemanticClass

__all__ = ["Placed", "RoomBuilder"]

_PASSAGE_M = 0.24
"""Half of the width that ways through a room keep, a robot's 0.18 m with a margin."""
_LEAST_FLOOR_M2 = 0.4

Cells = Bool[np.ndarray, "rows cols"]


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


class RoomBuilder:
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

    # --- Placing --------------------------------------------------------------------------

    def at_wall(
        self,
        name: str | Piece,
        *,
        centered: bool = False,
        corner: bool = False,
        facing: Placed | None = None,
        runs: list[WallRun] | None = None,
        under_windows: bool = False,
        tries: int = 14,
    ) -> Placed | None:
        """A piece with its back at some wall.

        Args:
            name: Class of the piece, or the piece.
            centered: Prefer the middle of long walls.
            corner: Prefer the ends of walls.
            facing: Prefer the wall that this piece looks at, opposite to it.
            runs: Walls to try; all where not given.
            under_windows: Whether even a tall piece may stand before a window.
            tries: How many places to try.
        """
        for _ in range(1 if isinstance(name, Piece) else 2):
            piece = self.model(name) if isinstance(name, str) else name
            spots = self._wall_spots(piece, centered, corner, facing, runs or self.runs)
            for run, along in spots[:tries]:
                placed = self._put_at(piece, run, along, under_windows)
                if placed is not None:
                    return placed
        return None

    def _wall_spots(
        self,
        piece: Piece,
        centered: bool,
        corner: bool,
        facing: Placed | None,
        runs: list[WallRun],
    ) -> list[tuple[WallRun, float]]:
        """Where along walls a piece might stand, best first."""
        width = piece.shape.size_m[0]
        spots = []
        for run in runs:
            low, high = run.start_m + width / 2 + 0.01, run.stop_m - width / 2 - 0.01
            if high < low:
                continue
            for along in [*np.arange(low, high + 1e-09, 0.15).tolist(), high]:
                ends = min(along - low, high - along)
                worth = float(self.rng.normal(0, 0.35))
                if centered:
                    worth += 0.35 * min(run.length_m, 5.0) - abs(along - (low + high) / 2) * 0.8
                elif corner:
                    worth -= 2.0 * min(ends, 1.0)
                if facing is not None:
                    worth -= self._off_axis(run, along, facing)
                spots.append((worth, run, along))
        spots.sort(key=lambda spot: -spot[0])
        return [(run, along) for _, run, along in spots]

    @staticmethod
    def _off_axis(run: WallRun, along: float, facing: Placed) -> float:
        """How badly a place is seen by a piece that looks ahead."""
        x, y = run.point(along, 0.0)
        c, s = math.cos(facing.yaw_rad), math.sin(facing.yaw_rad)
        dx, dy = x - facing.x_m, y - facing.y_m
        right, ahead = c * dx + s * dy, -s * dx + c * dy
        turn = abs((run.yaw_rad - facing.yaw_rad + math.pi) % (2 * math.pi) - math.pi)
        far = max(0.0, 1.8 - ahead) * 4 + max(0.0, ahead - 4.5)
        return 2.5 * abs(right) + far + (0.0 if turn > 3.0 else 6.0)

    def put_at(
        self, piece: Piece, run: WallRun, along_m: float, *, low_only: bool = False
    ) -> Placed | None:
        """A piece with its back at one place of one wall; `low_only` lets windows lie above."""
        return self._put_at(piece, run, along_m, low_only)

    def _put_at(
        self, piece: Piece, run: WallRun, along: float, under_windows: bool = False
    ) -> Placed | None:
        width, _, high = piece.shape.size_m
        span = (along - width / 2, along + width / 2)
        if not run.is_clear(span, (0.0, 0.9 if under_windows else high)):
            return None
        x, y = run.point(along, 0.012)
        placed = self._try(piece, x, y, run.yaw_rad)
        if placed is None:
            return None
        run.used.append((*span, 0.0, high))
        return Placed(piece, x, y, run.yaw_rad, run, along)

    def beside(
        self, placed: Placed, name: str | Piece, side: int, gap_m: float = 0.03
    ) -> Placed | None:
        """A piece at the same wall, to the right (+1) or left (-1) of another."""
        piece = self.model(name) if isinstance(name, str) else name
        off = side * (placed.size_m[0] / 2 + gap_m + piece.shape.size_m[0] / 2)
        if placed.run is not None:
            turn = 1.0 if math.cos(placed.yaw_rad) + math.sin(placed.yaw_rad) > 0 else -1.0
            along = placed.along_m + off * turn
            width = piece.shape.size_m[0]
            if along - width / 2 < placed.run.start_m or along + width / 2 > placed.run.stop_m:
                return None
            return self._put_at(piece, placed.run, along)
        x, y = placed.point(off, 0.0)
        return self._try(piece, x, y, placed.yaw_rad)

    def before(
        self,
        placed: Placed,
        name: str | Piece,
        gap_m: float,
        *,
        turned: bool = False,
        right_m: float = 0.0,
        wobble_rad: float = 0.0,
    ) -> Placed | None:
        """A piece in front of another, looking the same way or, turned, back at it."""
        piece = self.model(name) if isinstance(name, str) else name
        depth = piece.shape.size_m[1]
        forward = placed.size_m[1] + gap_m + (depth if turned else 0.0)
        x, y = placed.point(right_m, forward)
        yaw = placed.yaw_rad + (math.pi if turned else 0.0)
        yaw += float(self.rng.normal(0, wobble_rad)) if wobble_rad else 0.0
        return self._try(piece, x, y, yaw, on_reserved=True, front_m=0.0)

    def in_middle(
        self, name: str | Piece, *, spread_m: float = 0.4, room_m: float = 0.5
    ) -> Placed | None:
        """A free-standing piece where there is most floor around it, parallel to the walls."""
        piece = self.model(name) if isinstance(name, str) else name
        taken = ~self._floor | self._canvas.blocked | self._reserved
        depth = ndimage.distance_transform_edt(~taken[self._box]) * CELL_M
        width, deep, _ = piece.shape.size_m
        need = max(min(width, deep) / 2 + room_m * 0.6, 0.2)
        cells = np.argwhere(depth >= min(need, 0.95 * float(depth.max())))
        if len(cells) == 0:
            return None
        tall = self._box[0].stop - self._box[0].start
        wide = self._box[1].stop - self._box[1].start
        for _ in range(6):
            weights = depth[tuple(cells.T)] + self.rng.normal(0, spread_m * 0.5, len(cells))
            row, col = cells[int(np.argmax(weights))]
            lengthwise = 0.0 if wide >= tall else math.pi / 2
            yaw = lengthwise if self.chance(0.8) else math.pi / 2 - lengthwise
            x = (self._box[1].start + col + 0.5) * CELL_M + math.sin(yaw) * deep / 2
            y = (self._box[0].start + row + 0.5) * CELL_M - math.cos(yaw) * deep / 2
            placed = self._try(piece, x, y, yaw)
            if placed is not None:
                return placed
        return None

    def around(self, table: Placed, name: str, most: int, gap_m: float = -0.18) -> int:
        """Chairs that look at a table from its sides; how many found a place."""
        piece = self.model(name)
        width, deep, _ = table.size_m
        chair_w, chair_d, _ = piece.shape.size_m
        long = max(1, int((width - 0.1) / (chair_w + 0.12)))
        short = 1 if deep > chair_w + 0.15 else 0
        spots = [
            (right, side, 0)
            for right in (np.arange(long) - (long - 1) / 2) * (width / long)
            for side in (-1, 1)
        ]
        spots += [(0.0, side, 1) for side in (-1, 1)] * short
        count = 0
        for right, side, at_end in spots:
            if count >= most:
                break
            pull = gap_m + float(self.rng.uniform(0.0, 0.12))
            if at_end:
                away = width / 2 + pull + chair_d
                x, y = table.point(side * away, deep / 2)
                yaw = table.yaw_rad + side * math.pi / 2
            else:
                ahead = deep + pull + chair_d if side > 0 else -pull - chair_d
                x, y = table.point(float(right), ahead)
                yaw = table.yaw_rad + (math.pi if side > 0 else 0.0)
            yaw += float(self.rng.normal(0, 0.06))
            if self._try_tucked(piece, x, y, yaw, table) is not None:
                count += 1
        return count

    def _try_tucked(
        self, piece: Piece, x_m: float, y_m: float, yaw_rad: float, table: Placed
    ) -> Placed | None:
        """A chair that may reach under its table."""
        at = (x_m, y_m, 0.0)
        if not self._is_inside(piece, at, yaw_rad):
            return None
        cells = footprint(piece.shape, at, yaw_rad, self._floor.shape)
        if cells is None:
            return None
        below = footprint(
            table.piece.shape, (table.x_m, table.y_m, 0.0), table.yaw_rad, self._floor.shape
        )
        assert below is not None
        own = np.zeros(self._floor.shape, bool)
        own[below[0]] |= below[1]
        window, mask = cells
        bad = ~self._floor[window] | (self._canvas.blocked[window] & ~own[window])
        bad |= self._canvas.shell.keep_free[window]
        if (bad & mask).any() or not self._stays_open(cells):
            return None
        self._commit(piece, at, yaw_rad, (window, mask & ~own[window]))
        return Placed(piece, x_m, y_m, yaw_rad)

    def on_top(
        self,
        placed: Placed,
        name: str | Piece,
        right_m: float = 0.0,
        forward_m: float | None = None,
        *,
        z_m: float | None = None,
        turned: bool = False,
    ) -> Placed:
        """A small thing on top of another; `forward_m` is the depth of its middle."""
        piece = self.model(name) if isinstance(name, str) else name
        middle = placed.size_m[1] / 2 if forward_m is None else forward_m
        half = piece.shape.size_m[1] / 2
        x, y = placed.point(right_m, middle + half if turned else middle - half)
        yaw = placed.yaw_rad + (math.pi if turned else 0.0)
        height = placed.size_m[2] if z_m is None else z_m
        self._canvas.put(piece, self.colors(piece), (x, y, height + 0.001), yaw, None)
        return Placed(piece, x, y, yaw)

    def on_wall(
        self,
        name: str | Piece,
        z_m: float,
        *,
        run: WallRun | None = None,
        along_m: float | None = None,
        tries: int = 8,
    ) -> bool:
        """Something that hangs on a wall; z is its origin's height."""
        piece = self.model(name) if isinstance(name, str) else name
        low = float(piece.shape.corners_m[..., 2].min()) + z_m
        high = float(piece.shape.corners_m[..., 2].max()) + z_m
        width = piece.shape.size_m[0]
        if high > self._canvas.shell.ceiling_m - 0.05:
            return False
        walls = [run] if run is not None else self.runs
        for _ in range(tries):
            wall = walls[int(self.rng.integers(len(walls)))]
            if along_m is None and wall.length_m < width + 0.2:
                continue
            along = (
                float(
                    self.rng.uniform(
                        wall.start_m + width / 2 + 0.08, wall.stop_m - width / 2 - 0.08
                    )
                )
                if along_m is None
                else along_m
            )
            margin = 0.04 if along_m is None else 0.0
            span = (along - width / 2 - margin, along + width / 2 + margin)
            if span[0] < wall.start_m - 1e-6 or span[1] > wall.stop_m + 1e-6:
                continue
            if not wall.is_clear(span, (low, high)):
                continue
            x, y = wall.point(along, 0.002)
            at = (x, y, z_m)
            cells = footprint(piece.shape, at, wall.yaw_rad, self._floor.shape)
            inside = piece.shape.size_m[1] <= 0.06 or self._is_inside(piece, at, wall.yaw_rad)
            if cells is None or not inside or not self._may_hang(cells):
                continue
            # What hangs low enough to be hit stands out from the wall and blocks its cells.
            blocks = piece.shape.size_m[1] > 0.06 and cells[1].any()
            self._canvas.put(
                piece, self.colors(piece), at, wall.yaw_rad, cells if blocks else None
            )
            wall.used.append((*span, low, high))
            return True
        return False

    def _may_hang(self, cells: tuple[tuple[slice, slice], Cells]) -> bool:
        window, mask = cells
        if not mask.any():
            return True
        leaf = self._canvas.blocked[window] & mask & self._floor[window]
        keep = self._canvas.shell.keep_free[window] & mask
        return not leaf.any() and not keep.any() and self._stays_open(cells)

    def hang_curtains(self, run: WallRun, window: Window) -> None:
        """A pair of curtains beside a window and the rod that they hang from."""
        wide = min(0.24 * (window.stop_m - window.start_m) + 0.1, 0.45)
        low = 0.06 if window.sill_m < 0.6 else window.sill_m - 0.15
        high = min(window.head_m + 0.1, self._canvas.shell.ceiling_m - 0.05)
        variant = int(self.rng.choice(variants("curtain", self._held_out)))
        own = (surface("curtain", variant),)
        for at in (window.start_m - wide / 2 + 0.12, window.stop_m + wide / 2 - 0.12):
            if at - wide / 2 < run.start_m or at + wide / 2 > run.stop_m:
                continue
            builder = ShapeBuilder()
            build_curtain(builder, wide, low, high)
            kind = CLASSES["curtain"].semantic
            piece = Piece("curtain", f"curtain/{variant}", kind, builder.finish(), own)
            x, y = run.point(at, 0.055)
            cells = footprint(piece.shape, (x, y, 0.0), run.yaw_rad, self._floor.shape)
            if cells is not None and self._may_hang(cells):
                blocks = cells if low < 0.5 else None
                self._canvas.put(piece, own, (x, y, 0.0), run.yaw_rad, blocks)

    def tile_wall(
        self, run: WallRun, span: tuple[float, float], heights: tuple[float, float]
    ) -> None:
        """Tiles on a stretch of wall, below any window there."""
        sills = [
            window.sill_m - 0.04
            for window in run.windows
            if window.start_m - 0.05 < span[1] and span[0] < window.stop_m + 0.05
        ]
        high = min([heights[1], *sills])
        if high <= heights[0] + 0.02:
            return
        builder = ShapeBuilder()
        half = (span[1] - span[0]) / 2
        builder.box((-half, half), (0.0, 0.008), (heights[0], high), "wall_tiles")
        shape = builder.finish()
        x, y = run.point((span[0] + span[1]) / 2, 0.0)
        self._canvas.add_shape(
            shape,
            (surface("wall_tiles", self._palette["wall_tiles"]),),
            SemanticClass.WALL,
            0,
            turned_exactly(run.yaw_rad),
            (x, y, 0.0),
        )

    def lay_door_mat(self) -> None:
        """A mat inside the front door."""
        door = self._canvas.shell.entrance
        if door is None or self._canvas.shell.specs[door.inner] is not self.spec:
            return
        x, y = door.point_m((door.start + door.stop) / 2, 3.0)
        yaw = (0.0 if door.side > 0 else math.pi) if door.horizontal else -door.side * math.pi / 2
        self._lay(self.model("door_mat"), x, y, yaw)

    def rug(self, placed: Placed, name: str = "rug", gap_m: float = -0.3) -> None:
        """A rug in front of or under a piece; robots drive over it."""
        piece = self.model(name)
        x, y = placed.point(0.0, placed.size_m[1] + gap_m)
        self._lay(piece, x, y, placed.yaw_rad)

    def rug_in_middle(self, name: str = "rug") -> None:
        """A rug on the free floor."""
        free = self._floor & ~self._canvas.blocked
        depth = ndimage.distance_transform_edt(free[self._box])
        row, col = np.unravel_index(int(np.argmax(depth)), depth.shape)
        tall = self._box[0].stop - self._box[0].start
        wide = self._box[1].stop - self._box[1].start
        piece = self.model(name)
        yaw = 0.0 if wide >= tall else math.pi / 2
        deep = piece.shape.size_m[1]
        x = (self._box[1].start + int(col) + 0.5) * CELL_M + math.sin(yaw) * deep / 2
        y = (self._box[0].start + int(row) + 0.5) * CELL_M - math.cos(yaw) * deep / 2
        self._lay(piece, x, y, yaw)

    def _lay(self, piece: Piece, x_m: float, y_m: float, yaw_rad: float) -> None:
        if self._is_inside(piece, (x_m, y_m, 0.0), yaw_rad):
            self._canvas.put(piece, self.colors(piece), (x_m, y_m, 0.001), yaw_rad, None)

    def hang_lamp(self, over: Placed | None = None) -> None:
        """A lamp at the ceiling, over a piece or in the middle of the room."""
        piece = self.model("ceiling_lamp")
        if over is None:
            depth = ndimage.distance_transform_edt(self._floor[self._box])
            row, col = np.unravel_index(int(np.argmax(depth)), depth.shape)
            x = (self._box[1].start + int(col) + 0.5) * CELL_M
            y = (self._box[0].start + int(row) + 0.5) * CELL_M
        else:
            x, y = over.point(0.0, over.size_m[1] / 2)
        at = (x, y - piece.shape.size_m[1] / 2, self._canvas.shell.ceiling_m - 0.001)
        self._canvas.put(piece, self.colors(piece), at, 0.0, None)
