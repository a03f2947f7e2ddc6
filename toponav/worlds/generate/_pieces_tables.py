"""Things to put things on."""

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate.shapes import Number, ShapeBuilder
from toponav.worlds.grid import SemanticClass

__all__: list[str] = []

_S = SemanticClass
Rng = np.random.Generator


def _table(
    b: ShapeBuilder,
    rng: Rng,
    width: Number,
    depth: Number,
    height: Number,
    top: str = "wood",
) -> None:
    """A rectangular table with an apron and legs, or with two frames."""
    half, thick = width / 2, float(rng.uniform(0.025, 0.045))
    b.box((-half, half), (0, depth), (height - thick, height), top)
    body = str(rng.choice(["wood", "wood", "painted", "metal"]))
    inset = float(rng.uniform(0.04, 0.09))
    x, y = (-half + inset, half - inset), (inset, depth - inset)
    style = rng.random()
    if style < 0.65:
        leg = float(rng.uniform(0.045, 0.075))
        b.legs(
            x,
            y,
            height - thick,
            body,
            thick=leg,
            is_round=rng.random() < 0.4,
            splay=float(rng.choice([0.0, 0.0, 0.05])) if height < 0.6 else 0.0,
        )
        if rng.random() < 0.7:
            low = height - thick - 0.08
            for edge in y:
                b.box(x, (edge - 0.01, edge + 0.01), (low, height - thick), body)
            for edge in x:
                b.box((edge - 0.01, edge + 0.01), y, (low, height - thick), body)
    else:
        for edge in (x[0] + 0.06, x[1] - 0.06):
            b.box((edge - 0.03, edge + 0.03), (y[0], y[1]), (0, 0.05), body)
            b.box(
                (edge - 0.03, edge + 0.03),
                (depth / 2 - 0.06, depth / 2 + 0.06),
                (0.05, height - thick),
                body,
            )
        b.box(
            (x[0] + 0.06, x[1] - 0.06),
            (depth / 2 - 0.02, depth / 2 + 0.02),
            (0.3 * height, 0.3 * height + 0.06),
            body,
        )


def _round_table(b: ShapeBuilder, rng: Rng, radius: Number, height: Number) -> None:
    """A disc on one foot."""
    b.cylinder((0, radius), (height - 0.035, height), radius, "wood", sides=20)
    b.lathe(
        (0, radius),
        [(radius * 0.5, 0.0), (radius * 0.5, 0.03), (0.05, 0.08), (0.045, height * 0.6),
         (0.09, height - 0.035)],
        "wood" if rng.random() < 0.7 else "metal",
    )  # fmt: skip


@furniture_class("dining_table", _S.TABLE, 0.0)
def _dining_table(b: ShapeBuilder, rng: Rng) -> None:
    height = float(rng.uniform(0.72, 0.77))
    if rng.random() < 0.25:
        _round_table(b, rng, float(rng.uniform(0.5, 0.62)), height)
    else:
        _table(b, rng, float(rng.uniform(1.35, 1.9)), float(rng.uniform(0.8, 0.95)), height)


@furniture_class("kitchen_table", _S.TABLE, 0.0)
def _kitchen_table(b: ShapeBuilder, rng: Rng) -> None:
    if rng.random() < 0.4:
        _round_table(b, rng, float(rng.uniform(0.38, 0.46)), 0.74)
    else:
        _table(b, rng, float(rng.uniform(0.75, 1.1)), float(rng.uniform(0.65, 0.78)), 0.74)


@furniture_class("coffee_table", _S.TABLE, 0.0)
def _coffee_table(b: ShapeBuilder, rng: Rng) -> None:
    height, style = float(rng.uniform(0.34, 0.46)), rng.random()
    if style < 0.25:
        _round_table(b, rng, float(rng.uniform(0.32, 0.45)), height)
        return
    width, depth = float(rng.uniform(0.8, 1.2)), float(rng.uniform(0.45, 0.62))
    _table(b, rng, width, depth, height, "stone" if style > 0.85 else "wood")
    if rng.random() < 0.4:
        b.box((-width / 2 + 0.08, width / 2 - 0.08), (0.08, depth - 0.08), (0.13, 0.15), "wood")
    if rng.random() < 0.6:
        at = float(rng.uniform(-0.25, 0.1))
        for level in range(int(rng.integers(1, 4))):
            z = height + 0.025 * level
            b.box((at, at + 0.2), (0.15, 0.3), (z, z + 0.024), "plastic")


@furniture_class("side_table", _S.TABLE, 0.0)
def _side_table(b: ShapeBuilder, rng: Rng) -> None:
    height = float(rng.uniform(0.45, 0.58))
    if rng.random() < 0.5:
        _round_table(b, rng, float(rng.uniform(0.2, 0.27)), height)
    else:
        _table(b, rng, float(rng.uniform(0.4, 0.5)), float(rng.uniform(0.38, 0.45)), height)


@furniture_class("desk", _S.TABLE, 0.75)
def _desk(b: ShapeBuilder, rng: Rng) -> None:
    """A top on a pedestal with drawers and two legs."""
    half, depth = float(rng.uniform(0.55, 0.8)), float(rng.uniform(0.6, 0.75))
    height = 0.74
    b.box((-half, half), (0, depth), (height - 0.03, height), "wood")
    side = int(rng.choice([-1, 1]))
    if rng.random() < 0.7:
        ends = sorted((side * half, side * (half - 0.4)))
        x = (ends[0] + 0.01, ends[1] - 0.01)
        b.box(x, (0.03, depth - 0.03), (0.04, height - 0.03), "wood")
        for z in (0.07, 0.29, 0.5):
            b.box((x[0] + 0.02, x[1] - 0.02), (depth - 0.03, depth - 0.015), (z, z + 0.19), "wood")
            b.box(
                ((x[0] + x[1]) / 2 - 0.06, (x[0] + x[1]) / 2 + 0.06),
                (depth - 0.015, depth),
                (z + 0.12, z + 0.14),
                "metal",
            )
        other = -side * (half - 0.04)
        for y in (0.06, depth - 0.06):
            b.box(
                (other - 0.025, other + 0.025), (y - 0.025, y + 0.025), (0, height - 0.03), "wood"
            )
    else:
        b.legs((-half + 0.05, half - 0.05), (0.06, depth - 0.06), height - 0.03, "metal")
    b.box((-half + 0.05, half - 0.05), (0.04, 0.06), (0.35, height - 0.03), "wood")


@furniture_class("console_table", _S.TABLE, 0.3)
def _console_table(b: ShapeBuilder, rng: Rng) -> None:
    width, depth = float(rng.uniform(0.75, 1.1)), float(rng.uniform(0.26, 0.36))
    _table(b, rng, width, depth, float(rng.uniform(0.76, 0.84)))
    b.box((-width / 2 + 0.07, width / 2 - 0.07), (0.05, depth - 0.05), (0.18, 0.2), "wood")


@furniture_class("nightstand", _S.FURNITURE, 0.0)
def _nightstand(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.2, 0.26)), float(rng.uniform(0.34, 0.42))
    height, foot = float(rng.uniform(0.48, 0.6)), float(rng.choice([0.03, 0.12]))
    body = "painted" if rng.random() < 0.4 else "wood"
    b.box((-half, half), (0, depth), (foot, height), body)
    b.legs((-half + 0.03, half - 0.03), (0.03, depth - 0.03), foot + 0.01, body, thick=0.035)
    count = int(rng.integers(1, 4))
    step = (height - foot - 0.04) / count
    for drawer in range(count):
        z = foot + 0.02 + drawer * step
        b.box((-half + 0.02, half - 0.02), (depth, depth + 0.012), (z, z + step - 0.02), body)
        b.box(
            (-0.04, 0.04),
            (depth + 0.012, depth + 0.03),
            (z + step * 0.6, z + step * 0.6 + 0.015),
            "metal",
        )
