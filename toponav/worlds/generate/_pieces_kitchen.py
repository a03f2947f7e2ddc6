"""What kitchens are made of: modules 60 cm deep that stand side by side under one worktop."""

import numpy as np

from toponav.worlds.generate._catalogue import furniture_class
from toponav.worlds.generate._fronts import carcass, doors, drawers
from toponav.worlds.generate.shapes import Number, ShapeBuilder
from toponav.worlds.grid import SemanticClass

__all__ = ["MODULE_M"]

_S = SemanticClass
Rng = np.random.Generator

MODULE_M = 0.6
_DEEP, _HIGH, _PLINTH, _TOP = 0.6, 0.9, 0.1, 0.04


def _base(b: ShapeBuilder, half: Number = MODULE_M / 2, *, top: bool = True) -> None:
    """Plinth, body and worktop."""
    b.box((-half, half), (0, _DEEP - 0.06), (0, _PLINTH), "dark")
    b.box((-half, half), (0, _DEEP - 0.04), (_PLINTH, _HIGH - _TOP), "front")
    if top:
        b.box((-half, half), (0, _DEEP), (_HIGH - _TOP, _HIGH), "stone")
        b.box((-half, half), (0, 0.012), (_HIGH, _HIGH + 0.08), "stone")


_FRONT_Z = (_PLINTH + 0.01, _HIGH - _TOP - 0.01)


@furniture_class("kitchen_cabinet", _S.FURNITURE, 0.7)
def _kitchen_cabinet(b: ShapeBuilder, rng: Rng) -> None:
    half = MODULE_M / 2
    _base(b)
    if rng.random() < 0.4:
        drawers(b, (-half, half), _FRONT_Z, _DEEP - 0.04, 3, "front")
    else:
        drawers(b, (-half, half), (0.7, _FRONT_Z[1]), _DEEP - 0.04, 1, "front")
        doors(b, (-half, half), (_FRONT_Z[0], 0.7), _DEEP - 0.04, 1, "front")
    style = rng.random()
    if style < 0.2:
        b.lathe((0.05, 0.25), [(0.05, 0.9), (0.13, 0.96), (0.1, 0.94), (0, 0.93)], "wood")
        for x, y in ((0.02, 0.22), (0.09, 0.27), (0.05, 0.3)):
            b.lathe((x, y), [(0, 0.93), (0.04, 0.96), (0, 1.0)], "plastic", 8)
    elif style < 0.4:
        for x in (-0.15, -0.04, 0.07):
            b.cylinder((x, 0.15), (0.9, 1.06), 0.045, "ceramic")
    elif style < 0.55:
        b.box((-0.2, 0.1), (0.2, 0.4), (0.9, 0.92), "wood")


@furniture_class("sink", _S.FURNITURE, 0.7)
def _sink(b: ShapeBuilder, rng: Rng) -> None:
    half = MODULE_M / 2
    _base(b, top=False)
    doors(b, (-half, half), _FRONT_Z, _DEEP - 0.04, 2, "front")
    low, high = _HIGH - _TOP, _HIGH
    b.box((-half, -half + 0.06), (0, _DEEP), (low, high), "stone")
    b.box((half - 0.06, half), (0, _DEEP), (low, high), "stone")
    b.box((-half + 0.06, half - 0.06), (0, 0.12), (low, high), "stone")
    b.box((-half + 0.06, half - 0.06), (_DEEP - 0.1, _DEEP), (low, high), "stone")
    b.box((-half + 0.06, half - 0.06), (0.12, _DEEP - 0.1), (low - 0.1, low - 0.09), "metal")
    b.box((-half, half), (0, 0.012), (_HIGH, _HIGH + 0.08), "stone")
    b.bar((0, 0.08, high), (0, 0.08, high + 0.24), 0.014, "metal")
    b.bar((0, 0.08, high + 0.24), (0, 0.25, high + 0.22), 0.012, "metal")
    b.box((0.05, 0.08), (0.06, 0.1), (high, high + 0.05), "metal")


@furniture_class("stove", _S.FURNITURE, 0.7)
def _stove(b: ShapeBuilder, rng: Rng) -> None:
    half = MODULE_M / 2 - 0.005
    body = str(rng.choice(["metal", "ceramic", "dark"]))
    b.box((-half, half), (0, _DEEP - 0.02), (0, _HIGH - 0.02), body)
    b.box((-half, half), (0, _DEEP), (_HIGH - 0.02, _HIGH), "dark")
    for x in (-0.14, 0.14):
        for y, r in ((0.17, 0.07), (0.42, 0.095)):
            b.cylinder((x, y), (_HIGH, _HIGH + 0.012), r, "metal", sides=14)
    b.box((-half + 0.05, half - 0.05), (_DEEP - 0.02, _DEEP - 0.005), (0.28, 0.66), "dark")
    b.box((-half + 0.06, half - 0.06), (_DEEP - 0.005, _DEEP + 0.035), (0.68, 0.7), "metal")
    for x in np.linspace(-0.2, 0.2, 5):
        b.bar((float(x), _DEEP - 0.02, 0.8), (float(x), _DEEP + 0.015, 0.8), 0.02, "metal", 8)
    if rng.random() < 0.5:
        b.cylinder((0.14, 0.42), (_HIGH + 0.012, _HIGH + 0.15), 0.1, "metal", sides=14)
        b.bar((0.24, 0.42, _HIGH + 0.12), (0.4, 0.45, _HIGH + 0.13), 0.012, "dark")


@furniture_class("dishwasher", _S.FURNITURE, 0.7)
def _dishwasher(b: ShapeBuilder, rng: Rng) -> None:
    half = MODULE_M / 2
    _base(b)
    body = "metal" if rng.random() < 0.6 else "ceramic"
    b.box((-half + 0.005, half - 0.005), (_DEEP - 0.04, _DEEP - 0.01), _FRONT_Z, body)
    b.box((-half + 0.03, half - 0.03), (_DEEP - 0.01, _DEEP), (0.76, 0.83), "dark")
    b.box((-0.2, 0.2), (_DEEP - 0.01, _DEEP + 0.03), (0.7, 0.72), "metal")


@furniture_class("refrigerator", _S.FURNITURE, 0.7)
def _refrigerator(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.29, 0.34)), float(rng.uniform(0.62, 0.68))
    high = float(rng.uniform(1.6, 2.0))
    body = str(rng.choice(["ceramic", "metal", "metal", "plastic"], p=[0.4, 0.25, 0.2, 0.15]))
    b.box((-half, half), (0, depth - 0.05), (0.03, high), body)
    split = float(rng.choice([0.55, 0.7])) if rng.random() < 0.5 else high * 0.7
    for z in ((0.06, split - 0.006), (split + 0.006, high)):
        b.box((-half, half), (depth - 0.045, depth), z, body)
        middle = (z[0] + z[1]) / 2
        tall = (z[1] - z[0]) * 0.3
        b.box(
            (half - 0.07, half - 0.045),
            (depth, depth + 0.035),
            (middle - tall, middle + tall),
            "metal",
        )
    if rng.random() < 0.5:
        b.panel((-0.1, 0.05), (high * 0.8, high * 0.8 + 0.2), depth + 0.002, "picture")


@furniture_class("upper_cabinet", _S.FURNITURE, 0.0)
def _upper_cabinet(b: ShapeBuilder, rng: Rng) -> None:
    half = MODULE_M / 2
    b.box((-half, half), (0, 0.32), (1.42, 2.08), "front")
    doors(b, (-half, half), (1.42, 2.08), 0.32, int(rng.integers(1, 3)), "front")


@furniture_class("range_hood", _S.FURNITURE, 0.0)
def _range_hood(b: ShapeBuilder, rng: Rng) -> None:
    half = MODULE_M / 2
    low = float(rng.uniform(1.5, 1.6))
    base = np.array([(-half, 0), (half, 0), (half, 0.48), (-half, 0.48)])
    upper = np.array([(-0.13, 0), (0.13, 0), (0.13, 0.26), (-0.13, 0.26)])
    b.box((-half, half), (0, 0.48), (low, low + 0.05), "metal")
    b.prism(base, (low + 0.05, low + 0.25), "metal", top=upper)
    b.box((-0.13, 0.13), (0, 0.26), (low + 0.25, 2.3), "metal")


@furniture_class("kitchen_island", _S.FURNITURE, 0.0)
def _kitchen_island(b: ShapeBuilder, rng: Rng) -> None:
    half, depth = float(rng.uniform(0.6, 0.9)), float(rng.uniform(0.65, 0.8))
    b.box((-half + 0.05, half - 0.05), (0.05, depth - 0.05), (0, _HIGH - _TOP), "front")
    b.box((-half, half), (0, depth), (_HIGH - _TOP, _HIGH), "stone")
    doors(b, (-half + 0.05, half - 0.05), (0.08, 0.84), depth - 0.05, 3, "front")
    b.lathe((0.2, depth / 2), [(0.06, 0.9), (0.15, 0.97), (0.12, 0.95), (0, 0.93)], "ceramic")


@furniture_class("microwave", _S.CLUTTER, 0.0)
def _microwave(b: ShapeBuilder, rng: Rng) -> None:
    body = str(rng.choice(["metal", "dark", "ceramic"]))
    b.box((-0.24, 0.24), (0, 0.34), (0.01, 0.28), body)
    b.box((-0.22, 0.12), (0.34, 0.355), (0.04, 0.25), "dark")
    b.box((0.14, 0.22), (0.34, 0.35), (0.04, 0.25), "dark")
    b.box((0.115, 0.13), (0.35, 0.38), (0.06, 0.23), "metal")


@furniture_class("kettle", _S.CLUTTER, 0.0)
def _kettle(b: ShapeBuilder, rng: Rng) -> None:
    body = str(rng.choice(["metal", "plastic", "ceramic"]))
    b.lathe((0, 0.1), [(0.08, 0), (0.09, 0.06), (0.065, 0.18), (0.03, 0.2), (0, 0.22)], body)
    b.bar((0.06, 0.1, 0.17), (0.13, 0.1, 0.15), 0.01, "dark")
    b.bar((0.13, 0.1, 0.15), (0.1, 0.1, 0.03), 0.01, "dark")


@furniture_class("trash_can", _S.CLUTTER, 0.0)
def _trash_can(b: ShapeBuilder, rng: Rng) -> None:
    radius, high = float(rng.uniform(0.12, 0.17)), float(rng.uniform(0.3, 0.65))
    body = str(rng.choice(["metal", "plastic", "dark"]))
    b.cylinder((0, radius), (0, high), radius * 0.9, body, top_radius=radius, sides=14)
    b.lathe(
        (0, radius), [(radius * 1.02, high), (radius * 0.8, high + 0.04), (0, high + 0.05)], "dark"
    )


@furniture_class("washing_machine", _S.FURNITURE, 0.6)
def _washing_machine(b: ShapeBuilder, rng: Rng) -> None:
    depth = float(rng.uniform(0.52, 0.6))
    carcass(b, 0.3, depth, (0.0, 0.85), "ceramic")
    b.box((-0.3, 0.3), (depth - 0.02, depth), (0.04, 0.7), "ceramic")
    b.box((-0.29, 0.29), (depth - 0.02, depth - 0.005), (0.71, 0.84), "dark")
    mark = b.mark
    b.cylinder((0, 0), (0, 0.04), 0.19, "metal", sides=18)
    b.cylinder((0, 0), (0.03, 0.05), 0.14, "dark", sides=18)
    b.turn_since(mark, 0, -np.pi / 2, (0, 0, 0))
    b.move_since(mark, (0, depth - 0.01, 0.4))
