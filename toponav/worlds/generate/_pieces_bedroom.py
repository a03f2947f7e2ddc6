"""Beds, and what clothes are kept in."""

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate._fronts import carcass, doors, drawers
from toponav.worlds.generate.shapes import Number, ShapeBuilder
from toponav.worlds.grid import SemanticClass

__all__: list[str] = []

_S = SemanticClass
Rng = np.random.Generator


def _bedding(
    b: ShapeBuilder, rng: Rng, half: Number, long: Number, low: Number, pillows: int
) -> None:
    """Mattress, blanket, and pillows at the back."""
    b.soft((-half, half), (0.06, long), (low, low + 0.2), "white", 0.05)
    top = low + 0.2
    start = float(rng.uniform(0.45, 0.75))
    b.soft(
        (-half - 0.02, half + 0.02), (start, long + 0.02), (low + 0.04, top + 0.045), "linen", 0.05
    )
    if rng.random() < 0.35:
        fold = float(rng.uniform(1.2, 1.45))
        b.soft(
            (-half - 0.03, half + 0.03),
            (fold, fold + 0.5),
            (low + 0.05, top + 0.06),
            "fabric",
            0.03,
        )
    wide = 2 * half / pillows
    for number in range(pillows):
        x0 = -half + number * wide
        mark = b.mark
        b.soft((x0 + 0.05, x0 + wide - 0.05), (0.1, 0.5), (top - 0.01, top + 0.12), "linen", 0.08)
        b.turn_since(mark, 0, 0.18, (0, 0.3, top))


def _frame(b: ShapeBuilder, rng: Rng, half: Number, long: Number, low: Number) -> None:
    """Rails, feet and a headboard, of wood or covered with cloth."""
    body = str(rng.choice(["wood", "wood", "painted", "fabric"]))
    high = float(rng.uniform(0.75, 1.15))
    if body == "fabric":
        b.soft((-half - 0.04, half + 0.04), (0.0, 0.1), (0.03, high), body, 0.04)
    elif rng.random() < 0.4:
        for x in (-half, half):
            b.box((x - 0.03, x + 0.03), (0.0, 0.06), (0.0, high + 0.04), body)
        for z in np.linspace(low + 0.25, high, 4):
            b.box((-half, half), (0.015, 0.045), (float(z) - 0.05, float(z)), body)
    else:
        b.box((-half - 0.03, half + 0.03), (0.0, 0.05), (0.0, high), body)
    under = float(rng.choice([0.04, 0.16]))
    b.box((-half - 0.02, half + 0.02), (0.05, long + 0.03), (under, low + 0.02), body)
    b.legs((-half + 0.05, half - 0.05), (0.12, long - 0.08), under + 0.01, "wood", thick=0.06)
    if rng.random() < 0.3:
        b.box((-half - 0.03, half + 0.03), (long + 0.03, long + 0.07), (0.0, low + 0.25), body)


@furniture_class("bed", _S.FURNITURE, 0.5)
def _bed(b: ShapeBuilder, rng: Rng) -> None:
    half, long = float(rng.choice([0.7, 0.8, 0.8, 0.9])), float(rng.uniform(1.95, 2.05))
    low = float(rng.uniform(0.22, 0.32))
    _frame(b, rng, half, long, low)
    _bedding(b, rng, half - 0.01, long, low, 2)


@furniture_class("single_bed", _S.FURNITURE, 0.5)
def _single_bed(b: ShapeBuilder, rng: Rng) -> None:
    low = float(rng.uniform(0.22, 0.3))
    half = float(rng.uniform(0.45, 0.5))
    _frame(b, rng, half, 1.95, low)
    _bedding(b, rng, half - 0.01, 1.95, low, 1)


@furniture_class("bunk_bed", _S.FURNITURE, 0.6)
def _bunk_bed(b: ShapeBuilder, rng: Rng) -> None:
    half, long = 0.47, 2.0
    body = "painted" if rng.random() < 0.4 else "wood"
    for x in (-half, half):
        for y in (0.04, long):
            b.box((x - 0.035, x + 0.035), (y - 0.035, y + 0.035), (0, 1.65), body)
    for low in (0.26, 1.16):
        b.box((-half, half), (0.04, long), (low - 0.1, low), body)
        _bedding(b, rng, half - 0.04, long - 0.03, low, 1)
    for x in (-half, half):
        b.box((x - 0.015, x + 0.015), (0.04, long), (1.45, 1.55), body)
    for y in (0.04, long):
        b.box((-half, half), (y - 0.015, y + 0.015), (1.4, 1.6), body)
        b.box((-half, half), (y - 0.015, y + 0.015), (0.3, 0.7), body)
    for y in (1.2, 1.6):
        b.bar((half + 0.06, y, 0), (half + 0.02, y, 1.6), 0.02, body)
    for z in np.linspace(0.25, 1.4, 5):
        b.bar((half + 0.05, 1.2, float(z)), (half + 0.05, 1.6, float(z)), 0.015, body)


@furniture_class("child_bed", _S.FURNITURE, 0.5)
def _child_bed(b: ShapeBuilder, rng: Rng) -> None:
    """A cot with bars all around."""
    half, long, high = 0.34, 1.28, float(rng.uniform(0.85, 0.98))
    body = "painted" if rng.random() < 0.6 else "wood"
    b.legs((-half, half), (0.04, long), high, body, thick=0.05)
    b.soft((-half + 0.03, half - 0.03), (0.06, long - 0.02), (0.34, 0.46), "linen", 0.03)
    for z in (0.3, high - 0.05):
        for x in (-half, half):
            b.box((x - 0.015, x + 0.015), (0.04, long), (z, z + 0.045), body)
        for y in (0.04, long):
            b.box((-half, half), (y - 0.015, y + 0.015), (z, z + 0.045), body)
    for y in np.linspace(0.14, long - 0.1, 9):
        for x in (-half, half):
            b.bar((x, float(y), 0.32), (x, float(y), high - 0.04), 0.009, body, 5)
    for x in np.linspace(-half + 0.1, half - 0.1, 5):
        for y in (0.04, long):
            b.bar((float(x), y, 0.32), (float(x), y, high - 0.04), 0.009, body, 5)


@furniture_class("wardrobe", _S.FURNITURE, 0.6)
def _wardrobe(b: ShapeBuilder, rng: Rng) -> None:
    count = int(rng.choice([2, 2, 3, 4]))
    half = count * float(rng.uniform(0.44, 0.52)) / 2
    depth, high = float(rng.uniform(0.56, 0.62)), float(rng.uniform(1.9, 2.25))
    body = "painted" if rng.random() < 0.45 else "wood"
    carcass(b, half, depth, (0.0, high), body)
    low = 0.08
    if rng.random() < 0.35:
        drawers(b, (-half, half), (low, 0.5), depth - 0.02, 2, body)
        low = 0.51
    doors(b, (-half, half), (low, high - 0.02), depth - 0.02, count, body)
    if rng.random() < 0.35:
        edge = -half + 2 * half / count
        b.panel((-half + 0.06, edge - 0.06), (low + 0.1, high - 0.12), depth + 0.002, "mirror")


@furniture_class("dresser", _S.FURNITURE, 0.55)
def _dresser(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.42, 0.7)), float(rng.uniform(0.42, 0.5))
    high, foot = float(rng.uniform(0.75, 1.05)), float(rng.choice([0.04, 0.14]))
    body = "painted" if rng.random() < 0.4 else "wood"
    b.box((-half, half), (0, depth - 0.02), (foot, high - 0.03), body)
    b.box((-half - 0.015, half + 0.015), (0, depth + 0.01), (high - 0.03, high), "wood")
    b.legs((-half + 0.04, half - 0.04), (0.05, depth - 0.06), foot + 0.01, body, thick=0.045)
    rows, span = int(rng.integers(3, 5)), (foot + 0.02, high - 0.04)
    if half > 0.5:
        drawers(b, (-half, 0.0), span, depth - 0.02, rows, body)
        drawers(b, (0.0, half), span, depth - 0.02, rows, body)
    else:
        drawers(b, (-half, half), span, depth - 0.02, rows, body)
