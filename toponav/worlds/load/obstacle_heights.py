"""Plausible heights and classes for the obstacles of a floor plan that gives neither."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int16, UInt8
from scipy import ndimage

from toponav.worlds.free_space import indoors
from toponav.worlds.grid import SemanticClass

__all__ = ["ObstacleHeights", "raise_obstacles"]

_WALL_LENGTH_M = 2.5
"""Connected obstacles at least this long are walls."""
_BETWEEN_M, _SHARE = 0.25, 0.2
"""A piece with two rooms this near, none with much less of the floor there, is wall."""
_NOWHERE_M = 0.5
"""A piece further than this from any room is part of the building's outside."""
_EDGE_M, _EDGE_LENGTH_M = 0.15, 0.6
"""A piece this near to the outdoors, and at least so long, closes the building: it is wall."""
_THICK_M = 0.2
"""Parts of walls at least this thick are cupboards, columns or machines against them."""

_EIGHT = np.ones((3, 3), bool)

# For each size of piece: class, share, lowest and highest height in metres.
_Choice = tuple[SemanticClass, float, float, float]
_SMALL: tuple[_Choice, ...] = (
    (SemanticClass.CHAIR, 0.65, 0.80, 1.00),
    (SemanticClass.CLUTTER, 0.35, 0.40, 0.90),
)
_MEDIUM: tuple[_Choice, ...] = (
    (SemanticClass.CHAIR, 0.45, 0.80, 1.00),
    (SemanticClass.TABLE, 0.35, 0.70, 0.76),
    (SemanticClass.FURNITURE, 0.20, 0.90, 1.30),
)
_LARGE: tuple[_Choice, ...] = (
    (SemanticClass.TABLE, 0.50, 0.70, 0.76),
    (SemanticClass.BOOKCASE, 0.30, 1.20, 2.00),
    (SemanticClass.SOFA, 0.20, 0.75, 0.90),
)
_AGAINST_WALL: tuple[_Choice, ...] = (
    (SemanticClass.BOOKCASE, 0.60, 1.20, 2.00),
    (SemanticClass.FURNITURE, 0.40, 0.90, 1.30),
)
_DOOR_LEAF: tuple[_Choice, ...] = ((SemanticClass.DOOR, 1.0, 2.00, 2.10),)


@dataclass(frozen=True, eq=False)
class ObstacleHeights:
    """A height and a class per cell; zero and `FLOOR` on free cells."""

    heights_m: Float32[np.ndarray, "rows cols"]
    semantics: UInt8[np.ndarray, "rows cols"]


def raise_obstacles(
    occupied: Bool[np.ndarray, "rows cols"],
    room_index: Int16[np.ndarray, "rows cols"],
    resolution_m: float,
    ceiling_m: float,
    rng: np.random.Generator,
) -> ObstacleHeights:
    """Walls to the ceiling and everything else to the height of what it probably is.

    Long connected pieces and pieces between two rooms or at the building's edge are walls.
    Loose pieces in a room become chairs, tables, shelves or clutter by their size, thin
    strokes of a door's length that touch a wall become door leaves, and thick lumps on walls
    become cupboards. Occupied stays occupied and free stays free.

    Args:
        occupied: Solid cells.
        room_index: Room of each cell; -1 is nowhere.
        resolution_m: Side of a cell.
        ceiling_m: Height of the walls.
        rng: Chooses among what a piece of this size may be, and its height.
    """
    heights_m = np.where(occupied, ceiling_m, 0).astype(np.float32)
    semantics = np.where(occupied, SemanticClass.WALL, SemanticClass.FLOOR).astype(np.uint8)
    pieces, count = ndimage.label(occupied, structure=_EIGHT)
    boxes = ndimage.find_objects(pieces)
    length_m = np.array([_length_cells(box) * resolution_m for box in boxes])
    is_wall = length_m >= _WALL_LENGTH_M
    if (room_index >= 0).any():
        reach = _BETWEEN_M / resolution_m
        is_wall |= _stand_between_rooms(room_index, pieces, count, reach)
        outside = ~indoors(room_index, resolution_m)
        to_outside_m = _least(_distance(outside) * resolution_m, pieces, count)
        is_wall |= (to_outside_m <= _EDGE_M) & (length_m >= _EDGE_LENGTH_M)
        is_wall |= _least(_distance(room_index >= 0) * resolution_m, pieces, count) > _NOWHERE_M
    walls = np.concatenate([[False], is_wall])[pieces]
    by_wall = ndimage.binary_dilation(walls, structure=_EIGHT, iterations=3)
    for number in np.flatnonzero(~is_wall).tolist():
        piece = pieces[boxes[number]] == number + 1
        touches = bool((by_wall[boxes[number]] & piece).any())
        choices = _choices(piece, length_m[number], resolution_m, touches)
        _raise(heights_m, semantics, boxes[number], piece, choices, rng)
    thick = ndimage.binary_opening(walls, np.ones((max(round(_THICK_M / resolution_m), 2),) * 2))
    lumps, _ = ndimage.label(thick, structure=_EIGHT)
    for number, box in enumerate(ndimage.find_objects(lumps)):
        _raise(heights_m, semantics, box, lumps[box] == number + 1, _AGAINST_WALL, rng)
    return ObstacleHeights(heights_m, semantics)


def _stand_between_rooms(
    room_index: np.ndarray, pieces: np.ndarray, count: int, reach_cells: float
) -> np.ndarray:
    """For each piece, whether two rooms share the floor beside it.

    A wall has floor of both rooms all along; a door leaf reaches the other room with its end.
    """
    away, (row, col) = ndimage.distance_transform_edt(pieces == 0, return_indices=True)
    beside = (away <= reach_cells) & (room_index >= 0)
    rooms = int(room_index.max()) + 1
    pairs = pieces[row[beside], col[beside]].astype(np.int64) * rooms + room_index[beside]
    pair, cells = np.unique(pairs, return_counts=True)
    most = np.zeros(count + 1)
    np.maximum.at(most, pair // rooms, cells)
    shares = cells >= _SHARE * most[pair // rooms]
    return np.bincount(pair[shares] // rooms, minlength=count + 1)[1:] >= 2


def _distance(there: np.ndarray) -> np.ndarray:
    """Cells from each cell to the nearest true one; infinite where none is."""
    if not there.any():
        return np.full(there.shape, np.inf)
    return np.asarray(ndimage.distance_transform_edt(~there))


def _least(values: np.ndarray, pieces: np.ndarray, count: int) -> np.ndarray:
    """The least value in each piece."""
    least = np.full(count, np.inf)
    solid = pieces > 0
    np.minimum.at(least, pieces[solid] - 1, values[solid])
    return least


def _length_cells(box: tuple[slice, slice]) -> int:
    """The longer side of a bounding box."""
    return int(max(side.stop - side.start for side in box))


def _choices(
    piece: np.ndarray, length_m: float, resolution_m: float, touches_wall: bool
) -> tuple[_Choice, ...]:
    """What a loose piece of this size and shape may be."""
    if length_m < 0.35:
        return _SMALL
    if touches_wall and _is_door_leaf(piece, resolution_m):
        return _DOOR_LEAF
    return _MEDIUM if length_m < 1.0 else _LARGE


def _is_door_leaf(piece: np.ndarray, resolution_m: float) -> bool:
    """Whether the piece is one thin straight stroke as long as a door is wide."""
    cells = (np.argwhere(piece) - np.argwhere(piece).mean(axis=0)) * resolution_m
    (xx, xy), (_, yy) = cells.T @ cells / len(cells)
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    along = cells @ (math.cos(angle), math.sin(angle))
    across = cells @ (-math.sin(angle), math.cos(angle))
    return bool(0.65 <= np.ptp(along) <= 1.05 and across.std() < 0.04)


def _raise(
    heights_m: np.ndarray,
    semantics: np.ndarray,
    box: tuple[slice, slice],
    piece: np.ndarray,
    choices: tuple[_Choice, ...],
    rng: np.random.Generator,
) -> None:
    """Gives a piece one of the choices, and one height in whole centimetres."""
    kind, _, low_m, high_m = choices[
        rng.choice(len(choices), p=[share for _, share, _, _ in choices])
    ]
    heights_m[box][piece] = min(round(rng.uniform(low_m, high_m), 2), float(heights_m.max()))
    semantics[box][piece] = kind
