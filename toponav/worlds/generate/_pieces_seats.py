"""Things to sit on."""

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate.shapes import ShapeBuilder
from toponav.worlds.grid import SemanticClass

__all__: list[str] = []

_S = SemanticClass
Rng = np.random.Generator


def _couch(b: ShapeBuilder, rng: Rng, seats: int, arms: bool, cloth: str = "fabric") -> None:
    """A row of seats with back, arms, cushions and feet."""
    seat_w = float(rng.uniform(0.58, 0.7))
    arm = float(rng.uniform(0.12, 0.22)) if arms else 0.04
    width = seats * seat_w + 2 * arm
    depth, back = float(rng.uniform(0.82, 0.96)), float(rng.uniform(0.16, 0.24))
    sit, high = float(rng.uniform(0.4, 0.45)), float(rng.uniform(0.72, 0.9))
    foot = float(rng.choice([0.03, 0.06, 0.12]))
    half = width / 2
    b.box((-half, half), (0.02, depth), (foot, sit - 0.13), cloth)
    b.soft((-half, half), (0.0, back), (foot, high), cloth, 0.06)
    if arms:
        tall = sit + float(rng.uniform(0.12, 0.22))
        for side in (-1, 1):
            ends = sorted((side * half, side * (half - arm)))
            b.soft((ends[0], ends[1]), (0.02, depth), (foot, tall), cloth, 0.05)
    low = -half + arm
    for seat in range(seats):
        x = (low + seat * seat_w + 0.008, low + (seat + 1) * seat_w - 0.008)
        b.soft(x, (back - 0.01, depth + 0.02), (sit - 0.13, sit), cloth, 0.05)
        mark = b.mark
        b.soft(x, (back - 0.02, back + 0.14), (sit - 0.01, high - 0.05), cloth, 0.06)
        b.turn_since(mark, 0, 0.12, (0, back, sit))
    b.legs((-half + 0.08, half - 0.08), (0.1, depth - 0.1), foot + 0.02, "wood", is_round=True)
    for _ in range(int(rng.integers(0, 3)) if seats > 1 else int(rng.integers(0, 2))):
        x0 = float(rng.uniform(low, half - arm - 0.42))
        mark = b.mark
        b.soft((x0, x0 + 0.4), (back + 0.12, back + 0.24), (sit, sit + 0.38), "cushion", 0.07)
        b.turn_since(mark, 0, 0.3, (0, back + 0.12, sit))


@furniture_class("sofa", _S.SOFA, 0.55)
def _sofa(b: ShapeBuilder, rng: Rng) -> None:
    _couch(b, rng, int(rng.choice([2, 3, 3])), rng.random() < 0.9)


@furniture_class("corner_sofa", _S.SOFA, 0.4)
def _corner_sofa(b: ShapeBuilder, rng: Rng) -> None:
    """A sofa with a chaise at its left end."""
    seat_w, seats, depth = float(rng.uniform(0.62, 0.72)), 3, float(rng.uniform(0.88, 0.98))
    half, sit, high = seats * seat_w / 2 + 0.14, 0.43, float(rng.uniform(0.72, 0.84))
    long = float(rng.uniform(1.5, 1.75))
    b.box((-half, half), (0.02, depth), (0.05, sit - 0.14), "fabric")
    b.box((-half, -half + 0.14 + seat_w), (depth, long), (0.05, sit - 0.14), "fabric")
    b.soft((-half, half), (0.0, 0.2), (0.05, high), "fabric", 0.07)
    b.soft((half - 0.14, half), (0.02, depth), (0.05, sit + 0.16), "fabric", 0.05)
    b.soft((-half, -half + 0.14), (0.02, long), (0.05, sit + 0.16), "fabric", 0.05)
    for seat in range(seats):
        x = (-half + 0.14 + seat * seat_w + 0.005, -half + 0.14 + (seat + 1) * seat_w - 0.005)
        b.soft(x, (0.18, long if seat == 0 else depth + 0.02), (sit - 0.14, sit), "fabric")
        mark = b.mark
        b.soft(x, (0.18, 0.34), (sit, high - 0.04), "fabric", 0.06)
        b.turn_since(mark, 0, 0.12, (0, 0.2, sit))
    for x0 in (-half + 0.25, half - 0.65):
        mark = b.mark
        b.soft((x0, x0 + 0.42), (0.34, 0.46), (sit, sit + 0.38), "cushion", 0.07)
        b.turn_since(mark, 0, 0.3, (0, 0.34, sit))


@furniture_class("armchair", _S.SOFA, 0.4)
def _armchair(b: ShapeBuilder, rng: Rng) -> None:
    if rng.random() < 0.6:
        _couch(b, rng, 1, True)
        return
    half, sit = float(rng.uniform(0.32, 0.38)), 0.42
    b.soft((-half, half), (0.08, 0.72), (sit - 0.14, sit), "fabric", 0.06)
    mark = b.mark
    b.soft((-half, half), (0.06, 0.18), (sit - 0.05, sit + 0.55), "fabric", 0.06)
    b.turn_since(mark, 0, 0.22, (0, 0.12, sit))
    for side in (-1, 1):
        x = side * (half + 0.03)
        b.bar((x, 0.05, 0.0), (x, 0.1, sit + 0.2), 0.02, "wood")
        b.bar((x, 0.74, 0.0), (x, 0.66, sit + 0.2), 0.02, "wood")
        b.box((x - 0.025, x + 0.025), (0.03, 0.74), (sit + 0.18, sit + 0.21), "wood")


@furniture_class("chair", _S.CHAIR, 0.0)
def _chair(b: ShapeBuilder, rng: Rng) -> None:
    """A dining chair: rungs, a slatted or a padded back."""
    half, deep = float(rng.uniform(0.2, 0.23)), float(rng.uniform(0.4, 0.46))
    sit, high = float(rng.uniform(0.44, 0.47)), float(rng.uniform(0.8, 1.0))
    body = "metal" if rng.random() < 0.2 else ("painted" if rng.random() < 0.3 else "wood")
    padded = rng.random() < 0.5
    thick = float(rng.uniform(0.03, 0.045))
    b.legs(
        (-half + 0.03, half - 0.03),
        (0.06, deep - 0.02),
        sit - 0.03,
        body,
        thick=thick,
        is_round=rng.random() < 0.5,
        splay=float(rng.choice([0.0, 0.03])),
    )
    if padded:
        b.soft((-half, half), (0.03, deep + 0.02), (sit - 0.05, sit), "cushion", 0.03)
    else:
        b.box((-half, half), (0.03, deep + 0.02), (sit - 0.035, sit), body)
    mark = b.mark
    style = int(rng.integers(3))
    if style == 0:
        b.soft(
            (-half, half), (0.02, 0.07), (sit + 0.02, high), "cushion" if padded else body, 0.02
        )
    else:
        for x in (-half + 0.02, half - 0.02):
            b.bar((x, 0.05, sit - 0.04), (x, 0.05, high), thick / 2, body)
        bars = np.linspace(sit + 0.14, high - 0.03, 3 if style == 1 else 2)
        for z in bars:
            b.box((-half, half), (0.035, 0.06), (float(z) - 0.03, float(z) + 0.03), body)
        if style == 2:
            for x in np.linspace(-half + 0.07, half - 0.07, 4):
                b.bar((float(x), 0.047, bars[0]), (float(x), 0.047, bars[-1]), 0.01, body, 5)
    b.turn_since(mark, 0, 0.1, (0, 0.06, sit))


@furniture_class("office_chair", _S.CHAIR, 0.0)
def _office_chair(b: ShapeBuilder, rng: Rng) -> None:
    sit = float(rng.uniform(0.44, 0.5))
    cloth = "fabric" if rng.random() < 0.6 else "dark"
    for leg in range(5):
        angle = 2 * np.pi * leg / 5 + 0.3
        x, y = 0.28 * float(np.cos(angle)), 0.3 + 0.28 * float(np.sin(angle))
        b.bar((0, 0.3, 0.1), (x, y, 0.07), 0.02, "dark")
        b.cylinder((x, y), (0.0, 0.06), 0.03, "dark", sides=6)
    b.cylinder((0, 0.3), (0.08, sit - 0.06), 0.03, "metal", sides=8)
    b.soft((-0.25, 0.25), (0.08, 0.56), (sit - 0.07, sit + 0.01), cloth, 0.05)
    mark = b.mark
    b.soft((-0.23, 0.23), (0.03, 0.1), (sit + 0.1, sit + float(rng.uniform(0.45, 0.65))), cloth)
    b.bar((0, 0.06, sit - 0.05), (0, 0.05, sit + 0.3), 0.025, "dark")
    b.turn_since(mark, 0, 0.12, (0, 0.08, sit))
    if rng.random() < 0.6:
        for x in (-0.28, 0.28):
            b.box((x - 0.03, x + 0.03), (0.18, 0.42), (sit + 0.19, sit + 0.22), "dark")
            b.bar((x, 0.3, sit - 0.04), (x, 0.3, sit + 0.2), 0.015, "dark")


@furniture_class("stool", _S.CHAIR, 0.0)
def _stool(b: ShapeBuilder, rng: Rng) -> None:
    high = float(rng.choice([0.45, 0.65, 0.72]))
    radius = float(rng.uniform(0.16, 0.2))
    body = "metal" if rng.random() < 0.4 else "wood"
    top = "cushion" if rng.random() < 0.4 else body
    inner = radius * 0.6
    b.legs((-inner, inner), (0.2 - inner, 0.2 + inner), high - 0.03, body, thick=0.03, splay=0.05)
    b.cylinder((0, 0.2), (high - 0.04, high), radius, top, sides=14)
    if high > 0.6:
        for y in (0.2 - inner, 0.2 + inner):
            b.bar((-inner - 0.02, y, 0.25), (inner + 0.02, y, 0.25), 0.012, body)


@furniture_class("bench", _S.CHAIR, 0.3)
def _bench(b: ShapeBuilder, rng: Rng) -> None:
    half, deep = float(rng.uniform(0.45, 0.65)), float(rng.uniform(0.32, 0.4))
    b.box((-half, half), (0, deep), (0.4, 0.44), "wood")
    b.legs((-half + 0.05, half - 0.05), (0.05, deep - 0.05), 0.4, "wood", thick=0.05)
    if rng.random() < 0.6:
        b.soft((-half, half), (0.0, deep), (0.44, 0.49), "cushion", 0.03)


@furniture_class("ottoman", _S.SOFA, 0.0)
def _ottoman(b: ShapeBuilder, rng: Rng) -> None:
    if rng.random() < 0.5:
        radius, high = float(rng.uniform(0.22, 0.32)), float(rng.uniform(0.33, 0.45))
        b.lathe(
            (0, radius),
            [(0.0, 0), (radius * 0.92, 0.0), (radius, 0.08), (radius, high - 0.08),
             (radius * 0.9, high - 0.01), (0, high)],
            "cushion", 16,
        )  # fmt: skip
    else:
        half = float(rng.uniform(0.22, 0.35))
        b.soft((-half, half), (0, 2 * half), (0.04, 0.42), "fabric", 0.06)
        b.legs((-half + 0.06, half - 0.06), (0.06, 2 * half - 0.06), 0.06, "wood", is_round=True)
