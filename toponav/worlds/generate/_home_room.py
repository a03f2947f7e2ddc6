"""Puts furniture into one room: at walls, beside and before each other, in the middle."""

import math

import numpy as np
from scipy import ndimage

from toponav.worlds.generate._home_canvas import Piece, footprint
from toponav.worlds.generate._home_shell import CELL_M
from toponav.worlds.generate._home_walls import WallRun
from toponav.worlds.generate._room_base import Placed
from toponav.worlds.generate._room_hangings import RoomHangings

__all__ = ["Placed", "RoomBuilder"]


class RoomBuilder(RoomHangings):
    """One room that is being furnished; every method leaves all of its doors connected."""

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
