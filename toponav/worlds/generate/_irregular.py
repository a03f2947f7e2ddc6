"""What keeps real walls from being straight: posts, niches, notches, bays, slants, holes."""

import numpy as np
from jaxtyping import Bool, Int16

from toponav.worlds.generate._rooms import PlacedRoom
from toponav.worlds.generate._skeleton import Run, Skeleton

__all__ = ["bend_rooms", "pierce_walls", "shape_hallways"]

Index = Int16[np.ndarray, "rows cols"]
Cells = Bool[np.ndarray, "rows cols"]
Span = tuple[int, int]


def shape_hallways(
    rng: np.random.Generator, skeleton: Skeleton, index: Index, keep: Cells, first: int
) -> None:
    """Posts that stand out of hallway walls, and niches where nothing stands behind them.

    Args:
        rng: Chooses where.
        skeleton: The hallways.
        index: Room per cell, changed in place.
        keep: Cells that stay floor.
        first: Index of the first hallway.
    """
    for number, run in enumerate(skeleton.runs):
        length = run.high - run.low
        for _ in range(int(rng.poisson(length / 70))):
            _niche(rng, run, index, first + number)
        posts = 0.0 if run.is_open else length / float(rng.uniform(20, 90))
        for _ in range(int(rng.poisson(posts))):
            _post(rng, run, index, keep)


def _beside(run: Run, side: int, start: int, length: int, depth: Span) -> tuple[slice, slice]:
    """A rectangle along one wall; `depth` counts outwards from the wall."""
    edge = run.across + side * run.half
    ends = sorted((edge + side * depth[0], edge + side * depth[1]))
    return run.box((start, start + length), (ends[0], ends[1]))


def _niche(rng: np.random.Generator, run: Run, index: Index, number: int) -> None:
    length, depth = int(rng.integers(10, 60)), int(rng.integers(2, 16))
    if run.high - run.low <= length:
        return
    start, side = int(rng.integers(run.low, run.high - length)), int(rng.choice([-1, 1]))
    if (index[_beside(run, side, start - 2, length + 4, (0, depth + 2))] < 0).all():
        index[_beside(run, side, start, length, (0, depth))] = number


def _post(rng: np.random.Generator, run: Run, index: Index, keep: Cells) -> None:
    length, depth = int(rng.integers(5, 36)), int(rng.integers(1, 6))
    if run.high - run.low <= length:
        return
    start, side = int(rng.integers(run.low, run.high - length)), int(rng.choice([-1, 1]))
    box = _beside(run, side, start, length, (0, -depth))
    if not keep[box].any():
        index[box] = -1


def bend_rooms(
    rng: np.random.Generator,
    skeleton: Skeleton,
    rooms: list[PlacedRoom],
    index: Index,
    keep: Cells,
) -> None:
    """Notches, bays, steps and slanted corners in the outlines of rooms, closets at doors."""
    for number, room in enumerate(rooms):
        for way in (-1, 1):
            if rng.random() < 0.45:
                _cut(index, keep, _closet_at_door(rng, skeleton, room, way))
        for _ in range(int(rng.poisson(1.4))):
            _notch(rng, room, index, keep)
        for _ in range(int(rng.poisson(1.6))):
            _bay(rng, room, index, number)
        for _ in range(int(rng.poisson(3.0))):
            _step(rng, room, index, keep)
        if rng.random() < 0.06:
            _slant(rng, room, index, keep)


def _cut(index: Index, keep: Cells, box: tuple[slice, slice]) -> None:
    if not keep[box].any():
        index[box] = -1


def _corner(
    rng: np.random.Generator, room: PlacedRoom, tall: int, wide: int
) -> tuple[slice, slice]:
    """A rectangle in one of a room's corners."""
    row = room.row[0] if rng.random() < 0.5 else room.row[1] - tall
    col = room.col[0] if rng.random() < 0.5 else room.col[1] - wide
    return slice(row, row + tall), slice(col, col + wide)


def _notch(rng: np.random.Generator, room: PlacedRoom, index: Index, keep: Cells) -> None:
    """A duct or closet in a corner, or a pillar in the middle of a wall."""
    tall, wide = (int(value) for value in rng.integers(5, 22, size=2))
    if rng.random() < 0.25:
        length = int(rng.integers(5, 16))
        _cut(index, keep, _side(rng, room, length, -int(rng.integers(2, 8))))
    else:
        _cut(index, keep, _corner(rng, room, tall, wide))


def _side(
    rng: np.random.Generator, room: PlacedRoom, length: int, depth: int, pad: int = 0
) -> tuple[slice, slice]:
    """A rectangle at one wall, outwards for a positive depth; `pad` more on three sides."""
    vertical = bool(rng.random() < 0.5)
    along, across = (room.row, room.col) if vertical else (room.col, room.row)
    start = int(rng.integers(along[0], max(along[1] - length, along[0]) + 1))
    high = bool(rng.random() < 0.5)
    edge = across[1] if high else across[0]
    ends = sorted((edge, edge + (depth + (pad if depth > 0 else 0)) * (1 if high else -1)))
    first, second = slice(start - pad, start + length + pad), slice(*ends)
    return (first, second) if vertical else (second, first)


def _bay(rng: np.random.Generator, room: PlacedRoom, index: Index, number: int) -> None:
    """A window bay or niche into empty space behind a wall."""
    length, depth = int(rng.integers(8, 50)), int(rng.integers(1, 12))
    state = rng.bit_generator.state
    guard = _side(rng, room, length, depth, pad=2)
    rng.bit_generator.state = state
    rows, cols = guard
    inside = rows.start >= 2 and cols.start >= 2
    inside &= rows.stop < index.shape[0] - 2 and cols.stop < index.shape[1] - 2
    if inside and (index[guard] < 0).all():
        index[_side(rng, room, length, depth)] = number


def _step(rng: np.random.Generator, room: PlacedRoom, index: Index, keep: Cells) -> None:
    """A stretch of wall that the scan saw a cell or two further in."""
    _cut(index, keep, _side(rng, room, int(rng.integers(4, 45)), -int(rng.choice([1, 1, 2]))))


def _closet_at_door(
    rng: np.random.Generator, skeleton: Skeleton, room: PlacedRoom, way: int
) -> tuple[slice, slice]:
    """A rectangle inside the room, beside the way in."""
    door, run = room.door, skeleton.runs[room.door.run]
    sign = 1 if door.depth > 0 else -1
    inner = door.face + door.depth
    near = door.along + way * (door.width // 2 + int(rng.integers(1, 6)))
    span = sorted((near, near + way * int(rng.integers(6, 26))))
    deep = sorted((inner, inner + sign * int(rng.integers(5, 24))))
    if door.side == 0:
        rows, cols = run.box((deep[0], deep[1]), (span[0], span[1]))
    else:
        rows, cols = run.box((span[0], span[1]), (deep[0], deep[1]))
    return (
        slice(max(rows.start, room.row[0]), min(rows.stop, room.row[1])),
        slice(max(cols.start, room.col[0]), min(cols.stop, room.col[1])),
    )


def _slant(rng: np.random.Generator, room: PlacedRoom, index: Index, keep: Cells) -> None:
    """A corner cut off at an angle."""
    tall, wide = (int(value) for value in rng.integers(14, 45, size=2))
    tall, wide = min(tall, room.row[1] - room.row[0]), min(wide, room.col[1] - room.col[0])
    box = _corner(rng, room, tall, wide)
    if keep[box].any():
        return
    rows, cols = np.indices((tall, wide))
    near_row = rows if box[0].start == room.row[0] else tall - 1 - rows
    near_col = cols if box[1].start == room.col[0] else wide - 1 - cols
    window = index[box]
    window[near_row / tall + near_col / wide < 1.0] = -1


def pierce_walls(rng: np.random.Generator, wall: Cells, count: int) -> None:
    """Takes away single cells where the scan has holes, all too small to drive through."""
    cells = np.argwhere(wall)
    for row, col in cells[rng.integers(len(cells), size=count)]:
        length = int(rng.integers(1, 3))
        if rng.random() < 0.5:
            wall[row : row + length, col] = False
        else:
            wall[row, col : col + length] = False
