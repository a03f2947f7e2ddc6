"""Furniture as a depth scan leaves it in a floor plan: outlines, pieces of outlines, blobs."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._canvas import Mask, ragged, scanned
from toponav.worlds.grid import SemanticClass

__all__ = ["FURNISHING", "Piece", "Placement", "draw_piece"]

_CELL_M = 0.05


@dataclass(frozen=True)
class Piece:
    """A thing to put down; row 0 of the mask is the side that stands against a wall."""

    mask: Mask
    height_m: float
    semantic: SemanticClass


@dataclass(frozen=True)
class Placement:
    """How often a room gets a kind of piece, and whether it stands against a wall."""

    draw: Callable[[np.random.Generator], Piece]
    per_room: float
    at_wall: bool


def draw_piece(rng: np.random.Generator, placement: Placement) -> Piece:
    """One piece with its own size, shape and height."""
    return placement.draw(rng)


def _box(rng: np.random.Generator, wide: tuple[float, float], deep: tuple[float, float]) -> Mask:
    width = max(2, round(rng.uniform(*wide) / _CELL_M))
    depth = max(1, round(rng.uniform(*deep) / _CELL_M))
    return np.ones((depth, width), dtype=bool)


def _desk(rng: np.random.Generator) -> Piece:
    """Front edge of a desk along the wall, with or without its ends; or an L of two."""
    solid = _box(rng, (1.1, 2.4), (0.55, 0.85))
    if rng.random() < 0.3:
        leg = _box(rng, (0.5, 0.8), (0.6, 1.2))
        corner = np.zeros((solid.shape[0] + leg.shape[0], max(solid.shape[1], leg.shape[1])), bool)
        corner[: solid.shape[0], : solid.shape[1]] = True
        corner[solid.shape[0] :, : leg.shape[1]] = True
        solid = corner if rng.random() < 0.5 else corner[:, ::-1]
    mask = scanned(rng, solid, 0.0)
    mask[0] &= rng.random() < 0.3
    if rng.random() < 0.15:
        mask = solid
    mask = ragged(rng, mask, float(rng.uniform(0.1, 0.7)))
    return Piece(mask, float(rng.uniform(0.68, 0.78)), SemanticClass.TABLE)


def _chair(rng: np.random.Generator) -> Piece:
    """A round back, a star of five legs, or a lump."""
    style = rng.random()
    height = float(rng.uniform(0.75, 1.05))
    if style < 0.5:
        radius = float(rng.uniform(3.5, 6.5))
        size = 2 * int(radius + 1.5) + 1
        rows, cols = np.indices((size, size)) - size // 2
        away = np.hypot(rows, cols)
        turn = rng.uniform(-np.pi, np.pi)
        bearing = np.abs((np.arctan2(rows, cols) - turn + np.pi) % (2 * np.pi) - np.pi)
        mask = (np.abs(away - radius) < rng.uniform(0.5, 1.0)) & (bearing < rng.uniform(1.0, 2.9))
    elif style < 0.65:
        mask = np.zeros((11, 11), dtype=bool)
        turn = rng.uniform(0.0, np.pi)
        for leg in range(5):
            for step in range(6):
                angle = turn + leg * 2 * np.pi / 5
                mask[round(5 + step * np.sin(angle)), round(5 + step * np.cos(angle))] = True
        height = float(rng.uniform(0.2, 0.95))
    else:
        mask = _blob(rng, float(rng.uniform(2.0, 6.5)))
    return Piece(ragged(rng, mask, float(rng.uniform(0.0, 0.4))), height, SemanticClass.CHAIR)


def _blob(rng: np.random.Generator, radius: float) -> Mask:
    """A round lump with a rough edge."""
    size = 2 * int(radius + 2) + 1
    rows, cols = np.indices((size, size)) - size // 2
    bearing = np.arctan2(rows, cols)
    edge = radius * (
        1
        + 0.35 * np.sin(2 * bearing + rng.uniform(0, 6.3))
        + 0.2 * np.sin(5 * bearing + rng.uniform(0, 6.3))
    )
    return np.asarray(np.hypot(rows, cols) <= edge)


def _shelf(rng: np.random.Generator) -> Piece:
    mask = _box(rng, (0.6, 1.8), (0.2, 0.4))
    if rng.random() < 0.5:
        mask = mask[-int(rng.integers(1, 3)) :]
    return Piece(
        ragged(rng, mask, float(rng.uniform(0.0, 0.3))),
        float(rng.uniform(1.2, 2.2)),
        SemanticClass.BOOKCASE,
    )


def _cabinet(rng: np.random.Generator) -> Piece:
    solid = _box(rng, (0.4, 1.1), (0.4, 0.65))
    filled = rng.random() < 0.4
    mask = ragged(rng, solid, 0.1) if filled else scanned(rng, solid, float(rng.uniform(0.1, 0.7)))
    return Piece(mask, float(rng.uniform(0.6, 1.4)), SemanticClass.FURNITURE)


def _closet(rng: np.random.Generator) -> Piece:
    """A built-in closet or duct: walls to the ceiling that make a notch in the room."""
    return Piece(scanned(rng, _box(rng, (0.5, 1.6), (0.35, 0.8)), 0.0), 9.0, SemanticClass.WALL)


def _strip(rng: np.random.Generator) -> Piece:
    """A board, radiator or curtain that thickens a wall."""
    mask = _box(rng, (0.2, 1.8), (0.05, 0.1))
    return Piece(mask, float(rng.uniform(0.7, 2.4)), SemanticClass.BOARD)


def _table(rng: np.random.Generator) -> Piece:
    if rng.random() < 0.5:
        radius = int(rng.integers(8, 13))
        rows, cols = np.indices((2 * radius + 1, 2 * radius + 1)) - radius
        solid = np.asarray(np.hypot(rows, cols) <= radius)
    else:
        solid = _box(rng, (0.8, 1.6), (0.6, 0.9))
    return Piece(
        scanned(rng, solid, float(rng.uniform(0.1, 0.7))),
        float(rng.uniform(0.45, 0.76)),
        SemanticClass.TABLE,
    )


def _meeting_table(rng: np.random.Generator) -> Piece:
    """A long table; often only bits of its foot were scanned."""
    solid = _box(rng, (1.8, 3.4), (0.9, 1.3))
    return Piece(
        scanned(rng, solid, float(rng.uniform(0.3, 0.9))),
        float(rng.uniform(0.7, 0.76)),
        SemanticClass.TABLE,
    )


def _sofa(rng: np.random.Generator) -> Piece:
    solid = _box(rng, (1.3, 2.3), (0.7, 0.95))
    mask = ragged(rng, solid, 0.15) if rng.random() < 0.5 else scanned(rng, solid, 0.15)
    return Piece(mask, float(rng.uniform(0.62, 0.9)), SemanticClass.SOFA)


def _plant(rng: np.random.Generator) -> Piece:
    return Piece(
        _blob(rng, float(rng.uniform(2.0, 5.0))),
        float(rng.uniform(0.7, 1.8)),
        SemanticClass.CLUTTER,
    )


def _carton(rng: np.random.Generator) -> Piece:
    solid = _box(rng, (0.25, 0.7), (0.2, 0.55))
    mask = solid if rng.random() < 0.5 else scanned(rng, solid, 0.3)
    return Piece(mask, float(rng.uniform(0.25, 1.1)), SemanticClass.CLUTTER)


def _screen(rng: np.random.Generator) -> Piece:
    """A partition between two desks, standing out from a wall."""
    mask = _box(rng, (0.05, 0.1), (0.8, 1.9))[:, : int(rng.integers(1, 3))]
    return Piece(
        ragged(rng, mask, float(rng.uniform(0.0, 0.25))),
        float(rng.uniform(1.1, 1.8)),
        SemanticClass.FURNITURE,
    )


def _stalls(rng: np.random.Generator) -> Piece:
    """A row of toilet stalls: partitions and a front with open doors."""
    count, pitch, depth = int(rng.integers(2, 5)), int(rng.integers(17, 22)), 28
    mask = np.zeros((depth, count * pitch + 1), dtype=bool)
    for wall in range(count + 1):
        mask[:, wall * pitch] = True
    for stall in range(count):
        start = stall * pitch + int(rng.integers(0, 4))
        mask[-1, start : start + int(rng.integers(4, 12))] = True
    return Piece(ragged(rng, mask, 0.15), float(rng.uniform(1.7, 2.1)), SemanticClass.FURNITURE)


def _counter(rng: np.random.Generator) -> Piece:
    mask = scanned(rng, _box(rng, (1.4, 3.2), (0.5, 0.65)), 0.1)
    return Piece(mask, float(rng.uniform(0.82, 0.95)), SemanticClass.FURNITURE)


def _rack(rng: np.random.Generator) -> Piece:
    mask = ragged(rng, _box(rng, (0.8, 2.0), (0.35, 0.6)), 0.2)
    return Piece(mask, float(rng.uniform(1.4, 2.3)), SemanticClass.BOOKCASE)


def _copier(rng: np.random.Generator) -> Piece:
    return Piece(
        _box(rng, (0.6, 1.1), (0.55, 0.75)), float(rng.uniform(0.9, 1.25)), SemanticClass.FURNITURE
    )


def _speck(rng: np.random.Generator) -> Piece:
    """A few stray cells: legs of chairs, bags, cables, reflections."""
    mask = np.zeros((9, 9), dtype=bool)
    row = col = 4
    for _ in range(int(rng.integers(2, 26))):
        mask[row, col] = True
        step = int(rng.integers(-1, 2)), int(rng.integers(-1, 2))
        row, col = min(max(row + step[0], 0), 8), min(max(col + step[1], 0), 8)
    return Piece(mask, float(rng.uniform(0.25, 1.1)), SemanticClass.CLUTTER)


_ALWAYS = (
    Placement(_closet, 0.45, True),
    Placement(_strip, 3.0, True),
    Placement(_speck, 3.2, False),
)

FURNISHING: dict[RoomKind, tuple[Placement, ...]] = {
    RoomKind.OFFICE: (
        *_ALWAYS,
        Placement(_desk, 1.7, True),
        Placement(_chair, 2.6, False),
        Placement(_shelf, 1.5, True),
        Placement(_cabinet, 1.0, True),
        Placement(_table, 0.5, False),
        Placement(_screen, 0.6, True),
        Placement(_carton, 0.7, True),
        Placement(_plant, 0.3, True),
        Placement(_sofa, 0.08, True),
    ),
    RoomKind.CONFERENCE_ROOM: (
        *_ALWAYS,
        Placement(_meeting_table, 1.0, False),
        Placement(_chair, 4.0, False),
        Placement(_cabinet, 0.6, True),
        Placement(_shelf, 0.3, True),
    ),
    RoomKind.WC: (
        *_ALWAYS,
        Placement(_stalls, 1.5, True),
        Placement(_counter, 0.9, True),
    ),
    RoomKind.STORAGE: (
        *_ALWAYS,
        Placement(_rack, 2.2, True),
        Placement(_carton, 2.5, True),
        Placement(_shelf, 1.0, True),
    ),
    RoomKind.COPY_ROOM: (
        *_ALWAYS,
        Placement(_copier, 1.5, True),
        Placement(_counter, 0.8, True),
        Placement(_shelf, 0.8, True),
        Placement(_carton, 1.0, True),
    ),
    RoomKind.PANTRY: (
        *_ALWAYS,
        Placement(_counter, 1.6, True),
        Placement(_cabinet, 0.8, True),
        Placement(_table, 0.8, False),
        Placement(_chair, 2.0, False),
    ),
    RoomKind.OPEN_SPACE: (
        Placement(_strip, 2.0, True),
        Placement(_speck, 6.0, False),
        Placement(_desk, 0.8, True),
        Placement(_table, 1.4, False),
        Placement(_chair, 5.0, False),
        Placement(_sofa, 0.6, True),
        Placement(_screen, 0.8, True),
        Placement(_shelf, 0.6, True),
    ),
    RoomKind.LOUNGE: (
        Placement(_strip, 2.0, True),
        Placement(_speck, 4.0, False),
        Placement(_sofa, 1.8, True),
        Placement(_sofa, 0.5, False),
        Placement(_table, 1.2, False),
        Placement(_chair, 3.5, False),
        Placement(_plant, 0.8, True),
        Placement(_counter, 0.4, True),
    ),
    RoomKind.HALLWAY: (
        Placement(_strip, 1.2, True),
        Placement(_speck, 0.8, True),
        Placement(_carton, 0.35, True),
        Placement(_cabinet, 0.2, True),
        Placement(_plant, 0.25, True),
        Placement(_closet, 0.5, True),
    ),
}
