"""Floor and walls of a building from its hallways and rooms, on 5 cm cells."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

from toponav.worlds.generate._irregular import bend_rooms, pierce_walls, shape_hallways
from toponav.worlds.generate._rooms import PlacedRoom
from toponav.worlds.generate._skeleton import Skeleton

__all__ = ["Shell", "door_boxes", "hall_floor", "raise_walls"]

_EIGHT = np.ones((3, 3), dtype=bool)


@dataclass
class Shell:
    """A building without furniture.

    Attributes:
        floor: Cells inside walls.
        room_index: Rooms first, then runs; -1 outside.
        wall: Cells of walls, mostly one cell thick.
    """

    floor: Bool[np.ndarray, "rows cols"]
    room_index: Int16[np.ndarray, "rows cols"]
    wall: Bool[np.ndarray, "rows cols"]


def hall_floor(skeleton: Skeleton, shape: tuple[int, int]) -> Bool[np.ndarray, "rows cols"]:
    """Cells of all hallways and open spaces."""
    floor = np.zeros(shape, dtype=bool)
    for run in skeleton.runs:
        floor[run.floor()] = True
    return floor


def door_boxes(
    skeleton: Skeleton, room: PlacedRoom
) -> tuple[tuple[slice, slice], tuple[slice, slice] | None]:
    """Rows and columns of the opening through the wall, and of the recess before it."""
    door = room.door
    run = skeleton.runs[door.run]
    half = door.width // 2
    ends = (door.face, door.face + door.depth)
    through = (min(ends), max(ends))
    wide = (door.along - half, door.along - half + door.width)
    if door.side == 0:
        return run.box(through, wide), None
    opening = run.box(wide, through)
    if not door.recess:
        return opening, None
    edge = run.across + door.side * run.half
    between = (min(edge, door.face), max(edge, door.face))
    span = room.col if run.horizontal else room.row
    return opening, run.box((max(wide[0] - 5, span[0]), min(wide[1] + 5, span[1])), between)


def raise_walls(
    rng: np.random.Generator,
    skeleton: Skeleton,
    rooms: list[PlacedRoom],
    keep: Bool[np.ndarray, "rows cols"],
) -> Shell:
    """Walls around every floor; two faces where a hallway and a room stand back to back.

    Args:
        rng: Chooses how walls differ from straight lines.
        skeleton: The hallways.
        rooms: The rooms.
        keep: Cells that stay floor where they are floor.
    """
    index = np.full(keep.shape, -1, dtype=np.int16)
    for number, run in sorted(enumerate(skeleton.runs), key=lambda item: not item[1].is_open):
        index[run.floor()] = len(rooms) + number
    for number, room in enumerate(rooms):
        _paint(index, room.box, number)
        opening, recess = door_boxes(skeleton, room)
        if recess is not None:
            _paint(index, recess, len(rooms) + room.door.run)
        _paint(index, opening, number)
    bend_rooms(rng, skeleton, rooms, index, keep)
    shape_hallways(rng, skeleton, index, keep, len(rooms))
    floor = index >= 0
    wall = ndimage.binary_dilation(floor, _EIGHT) & ~floor
    pierce_walls(rng, wall, len(rooms) * 2)
    return Shell(floor, index, wall)


def _paint(index: Int16[np.ndarray, "rows cols"], box: tuple[slice, slice], value: int) -> None:
    window = index[box]
    window[window < 0] = value
