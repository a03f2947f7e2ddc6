"""Puts furniture into rooms and hallways so that every way in and through stays open."""

import math

import numpy as np
from jaxtyping import Bool
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._canvas import Canvas, Mask
from toponav.worlds.generate._rooms import PlacedRoom
from toponav.worlds.generate._skeleton import CELL_M, Run, Skeleton
from toponav.worlds.generate.furniture import FURNISHING, Piece, Placement, draw_piece
from toponav.worlds.grid import SemanticClass

__all__ = ["furnish_hallways", "furnish_room", "hang_door", "keep_ways_free", "room_heart"]

_USUAL_AREA_M2 = 16.0


def keep_ways_free(
    skeleton: Skeleton,
    rooms: list[PlacedRoom],
    hearts: list[tuple[int, int]],
    shape: tuple[int, int],
) -> Bool[np.ndarray, "rows cols"]:
    """The middle of hallways, the way in at each door and a way to each room's heart."""
    free = np.zeros(shape, dtype=bool)
    for run in skeleton.runs:
        half = 15 if run.is_open else min(run.half - 3, 12)
        free[run.box((run.low, run.high), (run.across - half, run.across + half))] = True
    for room, (row, col) in zip(rooms, hearts, strict=True):
        run = skeleton.runs[room.door.run]
        to_axis = run.half * CELL_M if room.door.side else 1.0
        inside = _inner_point(skeleton, room, 0.75)
        outside_m = -(abs(room.door.depth) + room.door.recess) * CELL_M - to_axis
        half = room.door.width // 2 + 1
        _clear_line(free, _inner_point(skeleton, room, outside_m), inside, half)
        _clear_line(free, inside, (row, col), 7)
    return free


def _inner_point(skeleton: Skeleton, room: PlacedRoom, depth_m: float) -> tuple[int, int]:
    """The (row, col) straight inside the doorway, this far behind the inner face."""
    door = room.door
    run = skeleton.runs[door.run]
    sign = 1 if door.depth > 0 else -1
    far = door.face + door.depth + sign * round(depth_m / CELL_M)
    if door.side == 0:
        return (door.along, far) if run.horizontal else (far, door.along)
    return (far, door.along) if run.horizontal else (door.along, far)


def _clear_line(
    free: Bool[np.ndarray, "rows cols"], a: tuple[int, int], b: tuple[int, int], half: int
) -> None:
    """Reserves a band of cells along a straight line."""
    steps = max(abs(a[0] - b[0]), abs(a[1] - b[1]), 1)
    for step in range(0, steps + 1, 3):
        row = round(a[0] + (b[0] - a[0]) * step / steps)
        col = round(a[1] + (b[1] - a[1]) * step / steps)
        free[max(row - half, 0) : row + half + 1, max(col - half, 0) : col + half + 1] = True


def room_heart(rng: np.random.Generator, room: PlacedRoom) -> tuple[int, int]:
    """A point near the middle of a room that stays free and reachable."""

    def middle(span: tuple[int, int]) -> int:
        return round(span[0] + (span[1] - span[0]) * rng.uniform(0.35, 0.65))

    return middle(room.row), middle(room.col)


def hang_door(
    rng: np.random.Generator, canvas: Canvas, skeleton: Skeleton, room: PlacedRoom
) -> float | None:
    """How far the door stands open, 1 for a right angle or more; None without a leaf."""
    if rng.random() < 0.45:
        return None
    door = room.door
    open_rad = math.radians(float(rng.uniform(72.0, 115.0)))
    sign = 1 if door.depth > 0 else -1
    span = room.col if skeleton.runs[door.run].horizontal == (door.side != 0) else room.row
    # Hung at the nearer corner, so that the open leaf never narrows the way in.
    hinge_side = -1 if door.along - span[0] < span[1] - door.along else 1
    hinge = door.along + hinge_side * (door.width / 2 + 0.5)
    base = door.face + door.depth + (0 if sign > 0 else -1)
    mask = np.zeros_like(canvas.keep_free)
    horizontal = skeleton.runs[door.run].horizontal == (door.side != 0)
    for step in np.arange(0.0, door.width, 0.5):
        along = math.floor(hinge - hinge_side * step * math.cos(open_rad))
        deep = math.floor(base + sign * step * math.sin(open_rad))
        row, col = (deep, along) if horizontal else (along, deep)
        if room.row[0] <= row < room.row[1] and room.col[0] <= col < room.col[1]:
            mask[row, col] = True
    canvas.count += 1
    canvas.heights_m[mask] = 2.0
    canvas.semantics[mask] = SemanticClass.DOOR
    canvas.things[mask] = canvas.count
    return min(open_rad / (math.pi / 2), 1.0)


def furnish_room(
    rng: np.random.Generator,
    canvas: Canvas,
    kind: RoomKind,
    box: tuple[slice, slice],
    within: Bool[np.ndarray, "rows cols"],
) -> None:
    """Fills one rectangle of floor with what its kind of room holds."""
    area_m2 = (box[0].stop - box[0].start) * (box[1].stop - box[1].start) * CELL_M**2
    crowding = float(rng.gamma(5.0, 0.2)) * math.sqrt(area_m2 / _USUAL_AREA_M2)
    for placement in FURNISHING[kind]:
        for _ in range(int(rng.poisson(placement.per_room * crowding))):
            _try_put(rng, canvas, placement, box, within)


def _try_put(
    rng: np.random.Generator,
    canvas: Canvas,
    placement: Placement,
    box: tuple[slice, slice],
    within: Bool[np.ndarray, "rows cols"],
) -> None:
    """Puts a piece where it fits, if a few tries find such a place."""
    piece = draw_piece(rng, placement)
    for _ in range(6):
        turns = int(rng.integers(4))
        mask = _turned(piece, turns)
        row, col = _spot(rng, mask, turns, placement.at_wall, box)
        height = float(min(piece.height_m, canvas.heights_m.max()))
        if canvas.put(mask, row, col, height, piece.semantic, within):
            return


def _turned(piece: Piece, turns: int) -> Mask:
    return np.rot90(piece.mask, turns)


def _spot(
    rng: np.random.Generator, mask: Mask, turns: int, at_wall: bool, box: tuple[slice, slice]
) -> tuple[int, int]:
    """Where to try: row 0 of the unturned mask against a wall, else anywhere."""
    (rows, cols), (r, c) = mask.shape, box
    row = int(rng.integers(r.start, max(r.stop - rows, r.start) + 1))
    col = int(rng.integers(c.start, max(c.stop - cols, c.start) + 1))
    if at_wall:
        if rng.random() < 0.35:  # into a corner
            row = int(rng.choice([r.start, r.stop - rows]))
            col = int(rng.choice([c.start, c.stop - cols]))
        gap = int(rng.choice([0, 1, 2, 4], p=[0.45, 0.25, 0.2, 0.1]))
        row, col = (
            (r.start + gap, col),
            (row, c.start + gap),
            (r.stop - rows - gap, col),
            (row, c.stop - cols - gap),
        )[turns]
    return row, col


def furnish_hallways(
    rng: np.random.Generator,
    canvas: Canvas,
    skeleton: Skeleton,
    within: Bool[np.ndarray, "rows cols"],
) -> None:
    """Bins, cabinets, posters and posts along hallway walls; lounges in open spaces."""
    for run in skeleton.runs:
        box = run.floor()
        if run.is_open:
            kind = RoomKind.LOUNGE if run.name.startswith("lounge") else RoomKind.OPEN_SPACE
            furnish_room(rng, canvas, kind, box, within)
        else:
            _furnish_run(rng, canvas, run, within)


def _furnish_run(
    rng: np.random.Generator, canvas: Canvas, run: Run, within: Bool[np.ndarray, "rows cols"]
) -> None:
    pieces = max(1, round((run.high - run.low) * CELL_M / 5.0))
    for placement in FURNISHING[RoomKind.HALLWAY]:
        for _ in range(int(rng.poisson(placement.per_room * pieces))):
            _try_put(rng, canvas, placement, run.floor(), within)


def passable(canvas: Canvas, radius_m: float) -> Bool[np.ndarray, "rows cols"]:
    """Cells where a disc of this radius touches nothing."""
    distance = ndimage.distance_transform_edt(canvas.heights_m == 0)
    return np.asarray(distance * CELL_M > radius_m + CELL_M / 2)
