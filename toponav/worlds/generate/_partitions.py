"""Partitions in rooms: walls and panels with a gap that is no door of the map."""

import numpy as np
from jaxtyping import Bool

from toponav.worlds.generate._canvas import Canvas
from toponav.worlds.generate._rooms import PlacedRoom
from toponav.worlds.generate._skeleton import CELL_M
from toponav.worlds.grid import SemanticClass

__all__ = ["partition_room"]

_LEAST_M = 2.2
_SCREEN_SHARE = 0.35


def partition_room(
    rng: np.random.Generator,
    canvas: Canvas,
    room: PlacedRoom,
    within: Bool[np.ndarray, "rows cols"],
) -> None:
    """Divides a room by one or two walls, each with a gap as wide as a door.

    What must stay free stays free, so the way from the door to the room's heart is a gap too.

    Args:
        rng: Draws where the walls stand.
        canvas: What stands on the floor so far.
        room: Its rectangle, in cells.
        within: Its floor without the way in at the door.
    """
    spans = (room.row, room.col)
    sides_m = [(high - low) * CELL_M for low, high in spans]
    for _ in range(int(rng.integers(1, 3))):
        axis = int(rng.random() < sides_m[1] / sum(sides_m))
        if sides_m[axis] < _LEAST_M:
            continue
        (low, high), (start, stop) = spans[axis], spans[1 - axis]
        at = round(low + (high - low) * float(rng.uniform(0.25, 0.75)))
        thick = int(rng.integers(2, 4))
        wall = np.zeros_like(within)
        _box(wall, axis, (at, at + thick), (start, stop))
        gap = round(float(rng.uniform(0.8, 1.5)) / CELL_M)
        gap_at = int(rng.integers(start, max(start + 1, stop - gap)))
        _box(wall, axis, (at, at + thick), (gap_at, gap_at + gap), value=False)
        if rng.random() < _SCREEN_SHARE:
            # A screen: it ends before one of the walls.
            middle = round(start + (stop - start) * float(rng.uniform(0.35, 0.7)))
            ends = (start, middle) if rng.random() < 0.5 else (middle, stop)
            _box(wall, axis, (at, at + thick), ends, value=False)
        height_m = float(canvas.heights_m.max())
        if rng.random() < 0.4:
            height_m = min(height_m, float(rng.uniform(1.2, 2.0)))
        wall &= within & ~canvas.keep_free & (canvas.heights_m == 0)
        canvas.count += 1
        canvas.heights_m[wall] = height_m
        canvas.semantics[wall] = SemanticClass.WALL
        canvas.things[wall] = canvas.count


def _box(
    mask: Bool[np.ndarray, "rows cols"],
    axis: int,
    along: tuple[int, int],
    across: tuple[int, int],
    *,
    value: bool = True,
) -> None:
    """Sets a rectangle that reaches `along` an axis and `across` the other."""
    spans = (slice(*along), slice(*across))
    mask[spans if axis == 0 else spans[::-1]] = value
