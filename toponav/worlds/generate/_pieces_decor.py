"""Lamps, pictures, plants, rugs, machines and the things that lie about."""

import itertools

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate.shapes import Number, ShapeBuilder, Span
from toponav.worlds.grid import SemanticClass

__all__: list[str] = []

_S = SemanticClass
Rng = np.random.Generator


def _shade(
    b: ShapeBuilder,
    at: Span,
    z: Number,
    high: Number,
    wide: Number,
    taper: Number,
) -> None:
    """A lamp shade that glows."""
    b.cylinder(at, (z, z + high), wide, "glow", top_radius=wide * taper, sides=14)


@furniture_class("floor_lamp", _S.CLUTTER, 0.0)
def _floor_lamp(b: ShapeBuilder, rng: Rng) -> None:
    high, r = float(rng.uniform(1.45, 1.7)), float(rng.uniform(0.13, 0.17))
    b.cylinder((0, 0.17), (0, 0.03), r, "metal", sides=14)
    b.bar((0, 0.17, 0.02), (0, 0.17, high - 0.1), 0.014, "metal")
    _shade(
        b, (0, 0.17), high - 0.22, 0.26, float(rng.uniform(0.14, 0.2)), float(rng.uniform(0.6, 1))
    )


@furniture_class("table_lamp", _S.CLUTTER, 0.0)
def _table_lamp(b: ShapeBuilder, rng: Rng) -> None:
    body = str(rng.choice(["ceramic", "metal", "wood"]))
    b.lathe((0, 0.1), [(0.06, 0), (0.07, 0.08), (0.03, 0.16), (0.015, 0.24)], body)
    _shade(b, (0, 0.1), 0.22, 0.17, float(rng.uniform(0.1, 0.13)), 0.65)


@furniture_class("ceiling_lamp", _S.CLUTTER, 0.0)
def _ceiling_lamp(b: ShapeBuilder, rng: Rng) -> None:
    """Hangs from z = 0 downwards."""
    if rng.random() < 0.5:
        r = float(rng.uniform(0.15, 0.25))
        b.lathe((0, r), [(0, -0.1), (r * 0.7, -0.09), (r, -0.03), (r, 0)], "glow", 16)
    else:
        drop, wide = float(rng.uniform(0.25, 0.5)), float(rng.uniform(0.15, 0.25))
        b.bar((0, wide, -drop), (0, wide, 0), 0.006, "dark", 5)
        _shade(b, (0, wide), -drop - 0.18, 0.2, wide, float(rng.uniform(0.3, 0.9)))


@furniture_class("picture", _S.BOARD, 0.0)
def _picture(b: ShapeBuilder, rng: Rng) -> None:
    """Centred on z = 0."""
    wide, high = float(rng.uniform(0.2, 0.5)), float(rng.uniform(0.18, 0.38))
    frame = str(rng.choice(["wood", "dark", "painted", "metal"]))
    b.box((-wide - 0.03, wide + 0.03), (0, 0.02), (-high - 0.03, high + 0.03), frame)
    if rng.random() < 0.4:
        b.box((-wide, wide), (0.02, 0.022), (-high, high), "white")
        wide, high = wide * 0.75, high * 0.75
    b.panel((-wide, wide), (-high, high), 0.024, "picture")


@furniture_class("mirror", _S.BOARD, 0.0)
def _mirror(b: ShapeBuilder, rng: Rng) -> None:
    """Centred on z = 0."""
    wide, high = float(rng.uniform(0.24, 0.38)), float(rng.uniform(0.3, 0.45))
    b.box((-wide - 0.02, wide + 0.02), (0, 0.02), (-high - 0.02, high + 0.02), "metal")
    b.panel((-wide, wide), (-high, high), 0.022, "mirror")


@furniture_class("clock", _S.CLUTTER, 0.0)
def _clock(b: ShapeBuilder, rng: Rng) -> None:
    """Centred on z = 0."""
    r = float(rng.uniform(0.13, 0.19))
    mark = b.mark
    b.cylinder((0, 0), (0, 0.03), r, str(rng.choice(["dark", "wood", "metal"])), sides=20)
    b.cylinder((0, 0), (0.028, 0.034), r * 0.9, "white", sides=20)
    b.turn_since(mark, 0, -np.pi / 2, (0, 0, 0))
    for angle, long in ((rng.uniform(0, 6.3), 0.5), (rng.uniform(0, 6.3), 0.75)):
        x, z = r * long * float(np.sin(angle)), r * long * float(np.cos(angle))
        b.bar((0, 0.038, 0), (x, 0.038, z), 0.006, "dark", 4)


@furniture_class("plant", _S.CLUTTER, 0.0)
def _plant(b: ShapeBuilder, rng: Rng) -> None:
    """A pot with leaves on a stem or out of the ground."""
    r, high = float(rng.uniform(0.11, 0.17)), float(rng.uniform(0.2, 0.34))
    pot = str(rng.choice(["ceramic", "wicker", "plastic", "dark"]))
    b.lathe(
        (0, 0.3),
        [(r * 0.75, 0), (r, high), (r * 0.9, high), (r * 0.85, high - 0.03), (0, high - 0.03)],
        pot,
    )
    tall = float(rng.uniform(0.35, 1.2))
    if rng.random() < 0.5:
        b.bar((0, 0.3, high - 0.05), (0, 0.3, high + tall * 0.6), 0.015, "wood", 5)
        for _ in range(7):
            x, y = (float(v) for v in rng.uniform(-0.16, 0.16, 2))
            z = high + tall * float(rng.uniform(0.4, 1.0))
            s = float(rng.uniform(0.1, 0.17))
            b.lathe(
                (x, 0.3 + y), [(0, z - s), (s, z), (s * 0.7, z + s * 0.6), (0, z + s)], "leaf", 7
            )
        return
    for _ in range(int(rng.integers(9, 15))):
        angle, lean = float(rng.uniform(0, 6.3)), float(rng.uniform(0.1, 0.28))
        x, y = lean * np.cos(angle), lean * np.sin(angle)
        up = high + tall * float(rng.uniform(0.6, 1.0))
        side = np.array([-np.sin(angle), np.cos(angle), 0]) * 0.035
        root, tip = np.array([0, 0.3, high - 0.04]), np.array([x, 0.3 + y, up])
        bend = (root + tip) / 2 + np.array([0.2 * x, 0.2 * y, 0.08])
        for one, two, w1, w2 in ((root, bend, 0.4, 1.0), (bend, tip, 1.0, 0.1)):
            face = np.array([one - side * w1, one + side * w1, two + side * w2, two - side * w2])
            uv = np.array([[0, 0], [0.1, 0], [0.1, 0.3], [0, 0.3]])
            b.quads(np.stack([face, face[::-1]]), np.stack([uv, uv[::-1]]), "leaf")


@furniture_class("vase", _S.CLUTTER, 0.0)
def _vase(b: ShapeBuilder, rng: Rng) -> None:
    high, r = float(rng.uniform(0.16, 0.3)), float(rng.uniform(0.05, 0.09))
    kind = str(rng.choice(["ceramic", "plastic", "water"]))
    b.lathe(
        (0, 0.1), [(r * 0.6, 0), (r, high * 0.4), (r * 0.4, high * 0.85), (r * 0.6, high)], kind
    )
    for _ in range(int(rng.integers(0, 6))):
        x, y = (float(v) for v in rng.uniform(-0.09, 0.09, 2))
        z = high + float(rng.uniform(0.1, 0.22))
        b.bar((0, 0.1, high * 0.9), (x, 0.1 + y, z), 0.004, "leaf", 4)
        b.lathe((x, 0.1 + y), [(0, z - 0.03), (0.035, z), (0, z + 0.03)], "plastic", 6)


@furniture_class("rug", _S.FLOOR, 0.0)
def _rug(b: ShapeBuilder, rng: Rng) -> None:
    wide, deep = float(rng.uniform(1.4, 2.4)), float(rng.uniform(1.1, 1.7))
    _mat(b, wide / 2, deep)


@furniture_class("runner", _S.FLOOR, 0.0)
def _runner(b: ShapeBuilder, rng: Rng) -> None:
    _mat(b, float(rng.uniform(0.7, 1.2)), float(rng.uniform(0.6, 0.75)))


@furniture_class("door_mat", _S.FLOOR, 0.0)
def _door_mat(b: ShapeBuilder, rng: Rng) -> None:
    half = float(rng.uniform(0.3, 0.4))
    b.box((-half, half), (0, 0.45), (0, 0.012), "carpet", bottom=False)


def _mat(b: ShapeBuilder, half: Number, deep: Number) -> None:
    z = 0.012
    base = np.array([(-half, 0, z), (half, 0, z), (half, deep, z), (-half, deep, z)])
    b.quads(base[None], np.array([[[0, 0], [1, 0], [1, 1], [0, 1]]], float), "rug")
    rim = np.array([(-half, 0), (half, 0), (half, deep), (-half, deep)])
    b.prism(rim, (0, z), "cushion", caps=False)


@furniture_class("tv", _S.CLUTTER, 0.0)
def _tv(b: ShapeBuilder, rng: Rng) -> None:
    half = float(rng.uniform(0.4, 0.62))
    high = half * 1.13
    b.box((-half, half), (0.06, 0.1), (0.06, 0.06 + high), "dark")
    b.box((-half, half), (0.1, 0.104), (0.06, 0.075), "metal")
    b.box((-0.15, 0.15), (0.0, 0.2), (0.0, 0.012), "dark")
    b.box((-0.03, 0.03), (0.06, 0.09), (0.01, 0.1), "dark")
    if rng.random() < 0.4:
        b.panel((-half + 0.02, half - 0.02), (0.085, 0.045 + high), 0.103, "picture")


@furniture_class("computer", _S.CLUTTER, 0.0)
def _computer(b: ShapeBuilder, rng: Rng) -> None:
    """A monitor, a keyboard and a mouse."""
    half = float(rng.uniform(0.24, 0.34))
    b.box((-half, half), (0.08, 0.11), (0.12, 0.12 + half * 1.2), "dark")
    b.panel((-half + 0.015, half - 0.015), (0.14, 0.1 + half * 1.2), 0.112, "picture")
    b.box((-0.03, 0.03), (0.06, 0.08), (0.0, 0.25), "metal")
    b.box((-0.12, 0.12), (0.0, 0.18), (0.0, 0.015), "metal")
    b.box((-0.22, 0.16), (0.3, 0.43), (0.0, 0.02), "dark" if rng.random() < 0.5 else "ceramic")
    b.soft((0.22, 0.28), (0.32, 0.42), (0, 0.03), "dark", 0.02)


@furniture_class("book_pile", _S.CLUTTER, 0.0)
def _book_pile(b: ShapeBuilder, rng: Rng) -> None:
    z = 0.0
    for _ in range(int(rng.integers(2, 6))):
        half, thick = float(rng.uniform(0.08, 0.12)), float(rng.uniform(0.015, 0.04))
        kind = str(rng.choice(["plastic", "cushion", "dark", "fabric"]))
        mark = b.mark
        b.box((-half, half), (0, 0.18), (z, z + thick), kind)
        b.turn_since(mark, 2, float(rng.normal(0, 0.15)), (0, 0.09, 0))
        z += thick


@furniture_class("printer", _S.CLUTTER, 0.0)
def _printer(b: ShapeBuilder, rng: Rng) -> None:
    body = "dark" if rng.random() < 0.5 else "ceramic"
    b.soft((-0.22, 0.22), (0, 0.34), (0, 0.2), body, 0.03)
    b.box((-0.15, 0.15), (0.34, 0.42), (0.05, 0.06), "white")
    b.box((-0.15, 0.15), (0.0, 0.05), (0.18, 0.32), "white")


@furniture_class("radiator", _S.FURNITURE, 0.0)
def _radiator(b: ShapeBuilder, rng: Rng) -> None:
    half, high = float(rng.uniform(0.35, 0.6)), float(rng.uniform(0.5, 0.6))
    for x in np.arange(-half, half - 0.05, 0.075):
        b.box((float(x), float(x) + 0.06), (0.03, 0.1), (0.12, 0.12 + high), "ceramic")
    for z in (0.16, 0.08 + high):
        b.box((-half, half), (0.05, 0.08), (z, z + 0.03), "ceramic")


@furniture_class("coat_rack", _S.FURNITURE, 0.0)
def _coat_rack(b: ShapeBuilder, rng: Rng) -> None:
    """A board with hooks and coats."""
    half = float(rng.uniform(0.35, 0.55))
    b.box((-half, half), (0, 0.025), (1.6, 1.72), "wood")
    b.box((-half, half), (0, 0.2), (1.8, 1.82), "wood")
    for x in np.linspace(-half + 0.1, half - 0.1, 5):
        at = float(x)
        b.bar((at, 0.02, 1.66), (at, 0.09, 1.68), 0.01, "metal", 5)
        if rng.random() < 0.6:
            long = float(rng.uniform(0.6, 0.95))
            kind = str(rng.choice(["fabric", "cushion", "dark"]))
            b.soft((at - 0.11, at + 0.11), (0.03, 0.16), (1.66 - long, 1.66), kind, 0.07)


@furniture_class("umbrella_stand", _S.CLUTTER, 0.0)
def _umbrella_stand(b: ShapeBuilder, rng: Rng) -> None:
    b.lathe((0, 0.13), [(0.11, 0), (0.12, 0.5), (0.1, 0.5), (0.1, 0.1), (0, 0.1)], "metal")
    for x in (-0.04, 0.04):
        b.bar((x, 0.13, 0.1), (x * 1.8, 0.13, 0.85), 0.018, "plastic")


@furniture_class("piano", _S.FURNITURE, 0.7)
def _piano(b: ShapeBuilder, rng: Rng) -> None:
    body = "dark" if rng.random() < 0.6 else "wood"
    b.box((-0.74, 0.74), (0, 0.32), (0.0, 1.2), body)
    b.box((-0.74, 0.74), (0.3, 0.6), (0.6, 0.7), body)
    b.box((-0.66, 0.66), (0.42, 0.58), (0.7, 0.72), "white")
    for x in np.linspace(-0.63, 0.63, 24):
        b.box((float(x) - 0.01, float(x) + 0.01), (0.42, 0.51), (0.72, 0.735), "dark")
    b.legs((-0.7, 0.7), (0.55, 0.55), 0.6, body, thick=0.06)


@furniture_class("fireplace", _S.FURNITURE, 0.6)
def _fireplace(b: ShapeBuilder, rng: Rng) -> None:
    half = float(rng.uniform(0.6, 0.75))
    kind = "brick" if rng.random() < 0.6 else "stone"
    for side in (-1, 1):
        ends = sorted((side * half, side * (half - 0.25)))
        b.box((ends[0], ends[1]), (0, 0.4), (0, 0.95), kind)
    b.box((-half, half), (0, 0.4), (0.75, 1.1), kind)
    b.box((-half, half), (0, 0.05), (0, 0.9), "dark")
    b.box((-half - 0.06, half + 0.06), (0, 0.45), (1.1, 1.16), "wood")
    b.box((-half, half), (0.05, 0.42), (0, 0.05), "stone")
    for x in (-0.12, 0.02, 0.12):
        b.bar((x - 0.15, 0.2, 0.1), (x + 0.15, 0.24, 0.12), 0.045, "wood", 7)
    b.box((-half * 0.6, half * 0.6), (0, 0.28), (1.16, 2.3), kind)


@furniture_class("ladder", _S.CLUTTER, 0.0)
def _ladder(b: ShapeBuilder, rng: Rng) -> None:
    for x in (-0.2, 0.2):
        b.bar((x, 0.3, 0), (x * 0.8, 0.04, 1.7), 0.022, "metal")
    for k in range(1, 7):
        t = k / 7
        b.bar(
            (-0.2 + 0.04 * t, 0.3 - 0.26 * t, 1.7 * t),
            (0.2 - 0.04 * t, 0.3 - 0.26 * t, 1.7 * t),
            0.015,
            "metal",
            5,
        )


@furniture_class("vacuum_cleaner", _S.CLUTTER, 0.0)
def _vacuum_cleaner(b: ShapeBuilder, rng: Rng) -> None:
    b.soft((-0.14, 0.14), (0.1, 0.5), (0.03, 0.26), "plastic", 0.08)
    for x in (-0.15, 0.15):
        b.box((x - 0.02, x + 0.02), (0.12, 0.3), (0, 0.17), "dark")
    b.bar((0, 0.48, 0.2), (0.05, 0.1, 1.0), 0.018, "metal")
    b.box((-0.08, 0.18), (0.48, 0.6), (0, 0.06), "dark")


@furniture_class("ironing_board", _S.CLUTTER, 0.3)
def _ironing_board(b: ShapeBuilder, rng: Rng) -> None:
    b.soft((-0.62, 0.62), (0.0, 0.34), (0.84, 0.88), "cushion", 0.1)
    for x in (-1, 1):
        b.bar((-0.4 * x, 0.17, 0.02), (0.4 * x, 0.17, 0.84), 0.014, "metal")
        b.bar((-0.4 * x, 0.02, 0.015), (-0.4 * x, 0.32, 0.015), 0.015, "metal")


@furniture_class("bicycle", _S.CLUTTER, 0.3)
def _bicycle(b: ShapeBuilder, rng: Rng) -> None:
    """Leans on a wall."""
    for x in (-0.5, 0.5):
        angles = 2 * np.pi * np.arange(17) / 16
        ring = np.column_stack([x + 0.33 * np.cos(angles), 0.33 + 0.33 * np.sin(angles)])
        for one, two in itertools.pairwise(ring):
            b.bar((one[0], 0.2, one[1]), (two[0], 0.2, two[1]), 0.018, "dark", 5)
        for angle in np.arange(0, np.pi, np.pi / 4):
            c, s = 0.32 * float(np.cos(angle)), 0.32 * float(np.sin(angle))
            b.bar((x - c, 0.2, 0.33 - s), (x + c, 0.2, 0.33 + s), 0.003, "metal", 3)
    pedal, saddle, head = (-0.1, 0.3), (-0.22, 0.8), (0.35, 0.8)
    frame = [
        ((-0.5, 0.33), pedal),
        (pedal, head),
        (saddle, head),
        (pedal, (-0.25, 0.9)),
        ((-0.5, 0.33), saddle),
        ((0.5, 0.33), (0.33, 0.95)),
    ]
    for (x0, z0), (x1, z1) in frame:
        b.bar((x0, 0.2, z0), (x1, 0.2, z1), 0.018, "plastic")
    b.soft((-0.36, -0.14), (0.13, 0.27), (0.9, 0.95), "dark", 0.03)
    b.bar((0.33, 0.0, 0.97), (0.33, 0.4, 0.97), 0.014, "metal")


@furniture_class("guitar", _S.CLUTTER, 0.0)
def _guitar(b: ShapeBuilder, rng: Rng) -> None:
    mark = b.mark
    for z, r in ((0.2, 0.18), (0.42, 0.14)):
        start = b.mark
        b.cylinder((0, 0), (0, 0.09), r, "wood", sides=14)
        b.turn_since(start, 0, -np.pi / 2, (0, 0, 0))
        b.move_since(start, (0, 0.05, z))
    b.box((-0.025, 0.025), (0.1, 0.13), (0.5, 1.0), "dark")
    b.turn_since(mark, 0, 0.2, (0, 0.05, 0))


@furniture_class("fan", _S.CLUTTER, 0.0)
def _fan(b: ShapeBuilder, rng: Rng) -> None:
    b.cylinder((0, 0.2), (0, 0.03), 0.17, "dark", sides=14)
    b.bar((0, 0.2, 0), (0, 0.2, 1.1), 0.016, "metal")
    mark = b.mark
    b.cylinder((0, 0), (0, 0.08), 0.2, "metal", sides=16)
    b.cylinder((0, 0), (0.08, 0.1), 0.06, "dark")
    b.turn_since(mark, 0, -np.pi / 2, (0, 0, 0))
    b.move_since(mark, (0, 0.17, 1.15))


@furniture_class("fitness", _S.FURNITURE, 0.5)
def _fitness(b: ShapeBuilder, rng: Rng) -> None:
    """An exercise bicycle."""
    for y in (0.15, 0.85):
        b.bar((-0.25, y, 0.03), (0.25, y, 0.03), 0.03, "dark")
    b.box((-0.04, 0.04), (0.15, 0.85), (0.03, 0.1), "metal")
    mark = b.mark
    b.cylinder((0, 0), (-0.05, 0.05), 0.24, "dark", sides=18)
    b.turn_since(mark, 1, np.pi / 2, (0, 0, 0))
    b.move_since(mark, (0, 0.72, 0.36))
    b.bar((0, 0.3, 0.1), (0, 0.22, 0.85), 0.03, "metal")
    b.soft((-0.11, 0.11), (0.1, 0.34), (0.84, 0.91), "dark", 0.04)
    b.bar((0, 0.75, 0.3), (0, 0.8, 1.1), 0.03, "metal")
    b.bar((-0.24, 0.72, 1.12), (0.24, 0.72, 1.12), 0.016, "dark")
    b.box((-0.09, 0.09), (0.78, 0.82), (1.08, 1.22), "dark")


def build_curtain(b: ShapeBuilder, width: Number, low: Number, high: Number) -> None:
    """One half of a pair, in folds, between two heights."""
    folds = max(3, round(width / 0.07))
    x = np.linspace(-width / 2, width / 2, folds + 1)
    y = np.where(np.arange(folds + 1) % 2, 0.055, 0.015)
    points, uv = [], []
    for n in range(folds):
        (x0, x1), (y0, y1) = (x[n], x[n + 1]), (y[n], y[n + 1])
        points.append([(x1, y1, low), (x0, y0, low), (x0, y0, high), (x1, y1, high)])
        uv.append([(x1, low), (x0, low), (x0, high), (x1, high)])
    b.quads(np.array(points), np.array(uv), "curtain")
    b.quads(np.array(points)[:, ::-1], np.array(uv)[:, ::-1], "curtain")


@furniture_class("curtain", _S.CLUTTER, 0.0)
def _curtain(b: ShapeBuilder, rng: Rng) -> None:
    build_curtain(b, float(rng.uniform(0.3, 0.5)), 0.1, 2.2)
