"""Doors and drawers on the front of a body, with their handles."""

import itertools

import numpy as np

from toponav.worlds.generate.shapes import Number, ShapeBuilder, Span

__all__ = ["carcass", "doors", "drawers", "shelves"]


def doors(b: ShapeBuilder, x: Span, z: Span, y: Number, count: int, surface: str) -> None:
    """Door panels side by side at `y`, hinged in pairs."""
    edges = np.linspace(x[0], x[1], count + 1)
    for number in range(count):
        left, right = float(edges[number]) + 0.004, float(edges[number + 1]) - 0.004
        b.box((left, right), (y, y + 0.018), (z[0] + 0.004, z[1] - 0.004), surface)
        at = right - 0.04 if number % 2 == 0 else left + 0.04
        middle = z[0] + 0.55 * (z[1] - z[0])
        b.box(
            (at - 0.01, at + 0.01), (y + 0.018, y + 0.042), (middle - 0.06, middle + 0.06), "metal"
        )


def drawers(b: ShapeBuilder, x: Span, z: Span, y: Number, count: int, surface: str) -> None:
    """Drawer fronts one above the other at `y`."""
    edges = np.linspace(z[0], z[1], count + 1)
    middle = (x[0] + x[1]) / 2
    wide = min(0.08, (x[1] - x[0]) / 4)
    for low, high in itertools.pairwise(edges):
        b.box(
            (x[0] + 0.004, x[1] - 0.004),
            (y, y + 0.018),
            (float(low) + 0.004, float(high) - 0.004),
            surface,
        )
        at = float(low + 0.6 * (high - low))
        b.box(
            (middle - wide, middle + wide), (y + 0.018, y + 0.042), (at - 0.01, at + 0.01), "metal"
        )


def shelves(
    b: ShapeBuilder,
    x: Span,
    y: Span,
    z: Span,
    count: int,
    surface: str,
    board_m: Number = 0.025,
) -> list[float]:
    """An open body with this many compartments; the height of each one's floor."""
    b.box((x[0], x[0] + board_m), y, z, surface)
    b.box((x[1] - board_m, x[1]), y, z, surface)
    b.box((x[0] + board_m, x[1] - board_m), (y[0], y[0] + 0.012), z, surface)
    levels = np.linspace(z[0] + 0.04, z[1] - board_m, count + 1)
    for level in levels:
        b.box(
            (x[0] + board_m, x[1] - board_m),
            (y[0] + 0.012, y[1] - 0.004),
            (float(level), float(level) + board_m),
            surface,
        )
    b.box(
        (x[0] + board_m, x[1] - board_m), (y[1] - 0.04, y[1] - 0.02), (z[0], z[0] + 0.05), surface
    )
    return [float(level) + board_m for level in levels[:-1]]


def carcass(b: ShapeBuilder, half: Number, depth: Number, z: Span, surface: str) -> None:
    """A closed body with room for fronts 2 cm thick before it."""
    b.box((-half, half), (0.0, depth - 0.02), z, surface)
