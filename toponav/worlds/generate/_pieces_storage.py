"""Shelves, cabinets and boxes."""

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate._fronts import carcass, doors, drawers, shelves
from toponav.worlds.generate.shapes import Number, ShapeBuilder, Span
from toponav.worlds.grid import SemanticClass

__all__: list[str] = []

_S = SemanticClass
Rng = np.random.Generator


def _fill_shelf(b: ShapeBuilder, rng: Rng, x: Span, depth: Number, z: Number, gap: Number) -> None:
    """Books, boxes or a vase in one compartment."""
    left, right = x[0] + 0.02, x[1] - 0.02
    style = rng.random()
    if style < 0.65:
        end = left + (right - left) * float(rng.uniform(0.4, 1.0))
        high = min(gap - 0.04, float(rng.uniform(0.2, 0.28)))
        b.box((left, end), (0.03, depth - 0.05), (z, z + high), "cardboard", front="books")
    elif style < 0.85:
        wide = min((right - left) * 0.45, 0.32)
        for at in (left, right - wide)[: int(rng.integers(1, 3))]:
            kind = str(rng.choice(["wicker", "plastic", "cardboard"]))
            b.box((at, at + wide), (0.04, depth - 0.03), (z, z + min(gap - 0.05, 0.22)), kind)
    elif rng.random() < 0.6:
        at = float(rng.uniform(left + 0.08, right - 0.08))
        high = min(gap - 0.06, 0.24)
        b.lathe(
            (at, depth / 2),
            [(0.04, z), (0.07, z + high * 0.4), (0.03, z + high * 0.8), (0.045, z + high)],
            "ceramic",
        )


@furniture_class("bookcase", _S.BOOKCASE, 0.45)
def _bookcase(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.38, 0.6)), float(rng.uniform(0.28, 0.36))
    high = float(rng.choice([1.1, 1.5, 1.85, 2.05]))
    body = "painted" if rng.random() < 0.4 else "wood"
    count = round(high / 0.36)
    levels = shelves(b, (-half, half), (0, depth), (0, high), count, body)
    for z in levels:
        _fill_shelf(b, rng, (-half + 0.03, half - 0.03), depth, z, (high - 0.05) / count - 0.02)


@furniture_class("shelf", _S.BOOKCASE, 0.0)
def _shelf(b: ShapeBuilder, rng: Rng) -> None:
    """Boards that hang on a wall."""
    half, depth = float(rng.uniform(0.3, 0.5)), 0.2
    for z in (1.35, 1.7)[: int(rng.integers(1, 3))]:
        b.box((-half, half), (0, depth), (z, z + 0.03), "wood")
        _fill_shelf(b, rng, (-half, half), depth, z + 0.03, 0.3)


@furniture_class("sideboard", _S.FURNITURE, 0.5)
def _sideboard(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.6, 0.85)), float(rng.uniform(0.4, 0.48))
    high, foot = float(rng.uniform(0.75, 0.9)), float(rng.choice([0.05, 0.16]))
    body = "painted" if rng.random() < 0.35 else "wood"
    carcass(b, half, depth, (foot, high - 0.03), body)
    b.box((-half - 0.01, half + 0.01), (0, depth), (high - 0.03, high), "wood")
    b.legs((-half + 0.06, half - 0.06), (0.06, depth - 0.08), foot + 0.01, "wood", thick=0.05)
    third = 2 * half / 3
    doors(b, (-half, -half + third), (foot + 0.02, high - 0.04), depth - 0.02, 1, body)
    drawers(b, (-half + third, half - third), (foot + 0.02, high - 0.04), depth - 0.02, 3, body)
    doors(b, (half - third, half), (foot + 0.02, high - 0.04), depth - 0.02, 1, body)


@furniture_class("china_cabinet", _S.FURNITURE, 0.5)
def _china_cabinet(b: ShapeBuilder, rng: Rng) -> None:
    """Doors below, open shelves with dishes above."""
    half, depth, high = float(rng.uniform(0.42, 0.6)), 0.42, float(rng.uniform(1.75, 2.05))
    body = "painted" if rng.random() < 0.5 else "wood"
    carcass(b, half, depth, (0.0, 0.85), body)
    doors(b, (-half, half), (0.06, 0.84), depth - 0.02, 2, body)
    b.box((-half - 0.01, half + 0.01), (0, depth), (0.85, 0.88), body)
    levels = shelves(b, (-half, half), (0, depth - 0.12), (0.88, high), 3, body)
    for z in levels:
        for x in np.linspace(-half + 0.14, half - 0.14, 4):
            radius = float(rng.uniform(0.04, 0.085))
            b.lathe((float(x), 0.15), [(0.03, z), (radius, z + 0.1), (0, z + 0.04)], "ceramic", 10)


@furniture_class("tv_stand", _S.FURNITURE, 0.5)
def _tv_stand(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.65, 0.95)), float(rng.uniform(0.36, 0.45))
    high, foot = float(rng.uniform(0.42, 0.56)), float(rng.choice([0.0, 0.12]))
    body = "painted" if rng.random() < 0.4 else "wood"
    middle = half * 0.4
    b.box((-half, half), (0, depth), (high - 0.03, high), body)
    b.box((-half, half), (0, depth - 0.02), (foot, foot + 0.05), body)
    b.box((-half, half), (0, 0.02), (foot, high), body)
    for side in (-1, 1):
        ends = sorted((side * half, side * middle))
        b.box((ends[0], ends[1]), (0, depth - 0.02), (foot, high - 0.03), body)
        doors(b, (ends[0], ends[1]), (foot + 0.03, high - 0.04), depth - 0.02, 1, body)
    b.box(
        (-middle + 0.05, middle - 0.05), (0.08, depth - 0.06), (foot + 0.05, foot + 0.12), "dark"
    )
    if foot:
        b.legs((-half + 0.06, half - 0.06), (0.06, depth - 0.06), foot, "wood", thick=0.04)


@furniture_class("shoe_rack", _S.FURNITURE, 0.4)
def _shoe_rack(b: ShapeBuilder, rng: Rng) -> None:
    half, depth, high = float(rng.uniform(0.35, 0.5)), 0.28, float(rng.uniform(0.5, 1.0))
    if rng.random() < 0.5:
        carcass(b, half, depth, (0, high), "painted")
        drawers(b, (-half, half), (0.05, high - 0.02), depth - 0.02, round(high / 0.35), "painted")
        return
    levels = shelves(b, (-half, half), (0, depth), (0, 0.5), 2, "wood")
    for z in levels:
        for x in np.arange(-half + 0.1, half - 0.12, 0.24):
            b.soft((float(x), float(x) + 0.09), (0.03, 0.27), (z, z + 0.09), "dark", 0.03)
            b.soft((float(x) + 0.1, float(x) + 0.19), (0.03, 0.27), (z, z + 0.09), "plastic", 0.03)


@furniture_class("storage_rack", _S.BOOKCASE, 0.45)
def _storage_rack(b: ShapeBuilder, rng: Rng) -> None:
    """Open metal shelves with boxes and bins."""
    half, depth, high = float(rng.uniform(0.42, 0.6)), float(rng.uniform(0.38, 0.46)), 1.85
    b.legs((-half + 0.02, half - 0.02), (0.02, depth - 0.02), high, "metal", thick=0.035)
    for z in np.linspace(0.12, high - 0.05, 5):
        b.box((-half, half), (0, depth), (float(z), float(z) + 0.03), "metal")
        x = -half + 0.04
        while x < half - 0.2 and z < high - 0.1:
            wide = float(rng.uniform(0.16, 0.4))
            wide = min(wide, half - 0.04 - x)
            tall = float(rng.uniform(0.14, 0.32))
            kind = str(rng.choice(["cardboard", "plastic", "plastic", "wicker"]))
            if rng.random() < 0.8:
                b.box(
                    (x, x + wide),
                    (0.04, depth - 0.04),
                    (float(z) + 0.03, float(z) + 0.03 + tall),
                    kind,
                )
            x += wide + 0.03


@furniture_class("box", _S.CLUTTER, 0.0)
def _box(b: ShapeBuilder, rng: Rng) -> None:
    """Cartons, one on another."""
    z = 0.0
    for _ in range(int(rng.integers(1, 4))):
        half, depth, high = (float(v) for v in rng.uniform((0.16, 0.28, 0.2), (0.26, 0.42, 0.36)))
        b.box((-half, half), (0.0, depth), (z, z + high), "cardboard")
        b.box((-0.03, 0.03), (-0.001, depth + 0.001), (z + 0.02, z + high + 0.001), "wicker")
        z += high


@furniture_class("toy_box", _S.CLUTTER, 0.0)
def _toy_box(b: ShapeBuilder, rng: Rng) -> None:
    half, depth, high = float(rng.uniform(0.3, 0.42)), 0.4, float(rng.uniform(0.36, 0.46))
    b.box((-half, half), (0, depth), (0, high), "plastic")
    for _ in range(6):
        x, y = float(rng.uniform(-half + 0.1, half - 0.1)), float(rng.uniform(0.1, 0.3))
        r = float(rng.uniform(0.05, 0.1))
        kind = str(rng.choice(["plastic", "cushion", "wood"]))
        b.lathe((x, y), [(r, high), (r * 0.9, high + r * 0.6), (0, high + r)], kind, 10)


@furniture_class("laundry_basket", _S.CLUTTER, 0.0)
def _laundry_basket(b: ShapeBuilder, rng: Rng) -> None:
    radius, high = float(rng.uniform(0.19, 0.24)), float(rng.uniform(0.45, 0.6))
    b.lathe(
        (0, radius),
        [(radius * 0.85, 0), (radius, high), (radius * 0.9, high), (radius * 0.8, high - 0.08),
         (0, high - 0.04)],
        "wicker", 14,
    )  # fmt: skip
    b.soft((-0.12, 0.12), (radius - 0.1, radius + 0.1), (high - 0.1, high + 0.03), "linen", 0.06)


@furniture_class("filing_cabinet", _S.FURNITURE, 0.5)
def _filing_cabinet(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = 0.23, float(rng.uniform(0.45, 0.58))
    count = int(rng.integers(2, 5))
    carcass(b, half, depth, (0, 0.05 + 0.3 * count), "metal")
    drawers(b, (-half, half), (0.04, 0.03 + 0.3 * count), depth - 0.02, count, "metal")
