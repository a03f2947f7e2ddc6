"""Bathroom fixtures."""

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate._fronts import doors, drawers
from toponav.worlds.generate.shapes import ShapeBuilder
from toponav.worlds.grid import SemanticClass

__all__: list[str] = []

_S = SemanticClass
Rng = np.random.Generator


@furniture_class("toilet", _S.FURNITURE, 0.55)
def _toilet(b: ShapeBuilder, rng: Rng) -> None:
    high = float(rng.uniform(0.4, 0.44))
    deep = float(rng.uniform(0.26, 0.3))
    middle = 0.2 + deep
    b.lathe(
        (0, middle),
        [(0.12, 0), (0.11, 0.12), (0.19, high - 0.04), (0.195, high), (0.13, high), (0.1, high - 0.12), (0, high - 0.16)],  # noqa: E501
        "ceramic", 16, (0.92, deep / 0.2),
    )  # fmt: skip
    b.box((-0.12, 0.12), (0.02, middle), (0, high - 0.06), "ceramic")
    if rng.random() < 0.7:
        b.soft((-0.19, 0.19), (0.0, 0.19), (high - 0.02, high + 0.36), "ceramic", 0.03)
        b.box((-0.02, 0.02), (0.08, 0.12), (high + 0.36, high + 0.375), "metal")
        mark = b.mark
        b.soft((-0.18, 0.18), (0.2, 0.24), (high, high + 0.4), "ceramic", 0.02)
        b.turn_since(mark, 0, 0.12, (0, 0.2, high))
    else:
        b.box((-0.25, 0.25), (0, 0.16), (0, 1.1), "wall_tiles")
        b.lathe(
            (0, middle),
            [(0.2, high), (0.2, high + 0.03), (0, high + 0.035)],
            "ceramic",
            16,
            (0.92, deep / 0.2),
        )


@furniture_class("washbasin", _S.FURNITURE, 0.6)
def _washbasin(b: ShapeBuilder, rng: Rng) -> None:
    """A vanity with a bowl, or a basin on a column."""
    half = float(rng.uniform(0.28, 0.5))
    if rng.random() < 0.65:
        depth, high = 0.46, 0.84
        low = float(rng.choice([0.05, 0.28]))
        b.box((-half, half), (0, depth - 0.02), (low, high - 0.05), "painted")
        if rng.random() < 0.5:
            doors(b, (-half, half), (low, high - 0.06), depth - 0.02, 2, "painted")
        else:
            drawers(b, (-half, half), (low, high - 0.06), depth - 0.02, 2, "painted")
        b.box((-half - 0.01, half + 0.01), (0, depth), (high - 0.05, high), "stone")
        b.lathe(
            (0, 0.25),
            [
                (0.12, high),
                (0.19, high + 0.12),
                (0.17, high + 0.12),
                (0.1, high + 0.03),
                (0, high + 0.02),
            ],
            "ceramic",
            16,
        )
        top = high + 0.12
    else:
        half = min(half, 0.32)
        b.cylinder((0, 0.2), (0, 0.72), 0.08, "ceramic", top_radius=0.1)
        b.lathe(
            (0, 0.24),
            [(0.1, 0.68), (0.24, 0.8), (0.25, 0.85), (0.2, 0.85), (0.1, 0.76), (0, 0.74)],
            "ceramic",
            16,
            (half / 0.25, 0.95),
        )
        top = 0.86
    b.bar((0, 0.06, top - 0.04), (0, 0.06, top + 0.08), 0.014, "metal")
    b.bar((0, 0.06, top + 0.08), (0, 0.2, top + 0.06), 0.012, "metal")


@furniture_class("bathtub", _S.FURNITURE, 0.55)
def _bathtub(b: ShapeBuilder, rng: Rng) -> None:
    """Long side at the back."""
    half, depth = float(rng.uniform(0.78, 0.85)), float(rng.uniform(0.7, 0.78))
    high, rim = float(rng.uniform(0.52, 0.58)), 0.07
    side = "wall_tiles" if rng.random() < 0.5 else "ceramic"
    b.box((-half, half), (0, 0.03), (0, high), side)
    b.box((-half, half), (depth - 0.03, depth), (0, high), side)
    b.box((-half, -half + 0.03), (0, depth), (0, high), side)
    b.box((half - 0.03, half), (0, depth), (0, high), side)
    for x in ((-half, -half + rim + 0.03), (half - rim - 0.03, half)):
        b.box(x, (0, depth), (high - 0.03, high), "ceramic")
    for y in ((0.0, rim), (depth - rim, depth)):
        b.box((-half + rim, half - rim), y, (high - 0.03, high), "ceramic")
    x, y = (-half + rim, half - rim), (rim, depth - rim)
    inner = np.array([(x[0], y[0]), (x[0], y[1]), (x[1], y[1]), (x[1], y[0])])
    foot = inner * np.array([0.86, 0.8]) + np.array([0.0, 0.2 * depth / 2])
    b.prism(inner, (high, 0.16), "ceramic", top=foot, caps=False)
    level = 0.3 if rng.random() < 0.3 else 0.165
    surface = "water" if level > 0.2 else "ceramic"
    flat = np.column_stack([foot if level < 0.2 else inner * 0.97, np.full(4, level)])[::-1]
    b.quads(flat[None], flat[None, :, :2], surface)
    b.bar((half - 0.2, 0.03, high), (half - 0.2, 0.03, high + 0.14), 0.015, "metal")
    b.bar((half - 0.2, 0.03, high + 0.14), (half - 0.2, 0.16, high + 0.12), 0.015, "metal")


@furniture_class("shower", _S.FURNITURE, 0.5)
def _shower(b: ShapeBuilder, rng: Rng) -> None:
    """A tray, tiled back, a screen of frosted glass and a shower head; for a corner."""
    half = float(rng.uniform(0.42, 0.48))
    depth = float(rng.uniform(0.82, 0.95))
    b.box((-half, half), (0, depth), (0, 0.06), "ceramic")
    b.box((-half, half), (0, 0.012), (0.06, 2.0), "wall_tiles")
    side = int(rng.choice([-1, 1]))
    x = sorted((side * half, side * (half - 0.012)))
    b.box((x[0], x[1]), (0, depth), (0.06, 1.95), "water")
    front = float(rng.uniform(0.35, 0.5))
    ends = sorted((side * half, side * (half - 2 * half * front)))
    b.box((ends[0], ends[1]), (depth - 0.012, depth), (0.06, 1.95), "water")
    b.bar((0, 0.05, 0.9), (0, 0.05, 2.0), 0.012, "metal")
    b.bar((0, 0.05, 2.0), (0, 0.3, 2.0), 0.012, "metal")
    b.cylinder((0, 0.32), (1.97, 2.0), 0.09, "metal", sides=14)
    b.box((-0.08, 0.08), (0.012, 0.06), (1.0, 1.06), "metal")


@furniture_class("towel_rack", _S.CLUTTER, 0.0)
def _towel_rack(b: ShapeBuilder, rng: Rng) -> None:
    half = float(rng.uniform(0.22, 0.32))
    if rng.random() < 0.5:
        b.bar((-half, 0.07, 1.3), (half, 0.07, 1.3), 0.012, "metal")
        for x in (-half, half):
            b.bar((x, 0.0, 1.3), (x, 0.07, 1.3), 0.012, "metal")
        b.box((-half + 0.06, half - 0.06), (0.05, 0.09), (0.75, 1.32), "cushion")
    else:
        for x in (-half, half):
            b.box((x - 0.02, x + 0.02), (0.03, 0.07), (0.5, 1.7), "ceramic")
        for z in np.arange(0.55, 1.7, 0.11):
            b.bar((-half, 0.05, float(z)), (half, 0.05, float(z)), 0.013, "ceramic")
        b.box((-half + 0.04, half - 0.04), (0.065, 0.1), (1.0, 1.5), "cushion")


@furniture_class("bathroom_cabinet", _S.FURNITURE, 0.35)
def _bathroom_cabinet(b: ShapeBuilder, rng: Rng) -> None:
    half, depth, high = float(rng.uniform(0.18, 0.25)), 0.32, float(rng.uniform(1.5, 1.85))
    b.box((-half, half), (0, depth - 0.02), (0.08, high), "painted")
    doors(b, (-half, half), (0.09, high * 0.45), depth - 0.02, 1, "painted")
    doors(b, (-half, half), (high * 0.46, high), depth - 0.02, 1, "painted")
    b.legs((-half + 0.03, half - 0.03), (0.03, depth - 0.05), 0.09, "metal", thick=0.03)


@furniture_class("bath_mat", _S.FLOOR, 0.0)
def _bath_mat(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.3, 0.4)), float(rng.uniform(0.45, 0.55))
    b.box((-half, half), (0, depth), (0.0, 0.015), "cushion", bottom=False)
