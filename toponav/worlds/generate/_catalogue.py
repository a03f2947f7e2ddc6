"""Furniture classes: what builds their parametric models, and each model by its number."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from toponav.worlds.generate.shapes import Shape, ShapeBuilder
from toponav.worlds.grid import SemanticClass

__all__ = ["CLASSES", "FurnitureClass", "furniture_class", "parametric_model"]

Build = Callable[[ShapeBuilder, np.random.Generator], None]


@dataclass(frozen=True, eq=False)
class FurnitureClass:
    """A kind of thing that homes hold.

    Attributes:
        name: Its class, in the words of `furniture_names.CLASS_OF` where those have one.
        semantic: What cameras report.
        front_m: Floor before it that people need to use it.
        build: Makes a model of it.
    """

    name: str
    semantic: SemanticClass
    front_m: float
    build: Build


CLASSES: dict[str, FurnitureClass] = {}
"""Every furniture class by name; filled by the modules of pieces."""


def furniture_class(
    name: str, semantic: SemanticClass = SemanticClass.FURNITURE, front_m: float = 0.0
) -> Callable[[Build], Build]:
    """Enters the decorated builder as the one of a class."""

    def enter(build: Build) -> Build:
        assert name not in CLASSES, name
        CLASSES[name] = FurnitureClass(name, semantic, front_m, build)
        return build

    return enter


@lru_cache(maxsize=4096)
def parametric_model(name: str, variant: int) -> Shape:
    """One model of a class, centred in x with its back at y = 0; always the same one."""
    seed = [7002, *name.encode(), variant]
    builder = ShapeBuilder()
    CLASSES[name].build(builder, np.random.default_rng(seed))
    shape = builder.finish()
    points = shape.corners_m.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    shift = np.array([-(low[0] + high[0]) / 2, -low[1], 0.0])
    corners = shape.corners_m + shift
    corners.setflags(write=False)
    return Shape(corners, shape.corner_uv, shape.slot, shape.slots)
