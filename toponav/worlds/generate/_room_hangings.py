"""What hangs on walls and ceilings, lies on the floor or stands on furniture."""

import math

import numpy as np
from scipy import ndimage

from toponav.worlds.generate._home_canvas import Cells, Piece, footprint, turned_exactly
from toponav.worlds.generate._home_shell import CELL_M
from toponav.worlds.generate._home_walls import WallRun, Window
from toponav.worlds.generate._pieces_decor import build_curtain
from toponav.worlds.generate._room_base import Placed, RoomBase
from toponav.worlds.generate.pieces import CLASSES
from toponav.worlds.generate.shapes import ShapeBuilder
from toponav.worlds.generate.surfaces import surface, variants
from toponav.worlds.grid import SemanticClass

__all__ = ["RoomHangings"]


class RoomHangings(RoomBase):
    """The part of a room's furnishing that takes no floor."""

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
