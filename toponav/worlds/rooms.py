"""Outlines of rooms known by their cells."""

import numpy as np
from jaxtyping import Bool, Float

from toponav.worlds.grid import GridFrame

__all__ = ["outline_m"]


def outline_m(
    cells: Bool[np.ndarray, "rows cols"], grid: GridFrame
) -> Float[np.ndarray, "corners 2"] | None:
    """The exact outline of the largest piece, in metres, counter-clockwise; None if empty.

    Holes are left out. The outline runs along cell sides and starts at its lowest, leftmost
    corner, so equal cells give equal outlines on every machine.
    """
    rows, cols = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    if not len(rows):
        return None
    window = cells[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    outline = max(_loops(np.pad(window, 1)), key=_area)
    before, after = np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0)
    into, out = outline - before, after - outline
    corners = outline[into[:, 0] * out[:, 1] != into[:, 1] * out[:, 0]]
    corners = np.roll(corners, -np.lexsort(corners.T)[0], axis=0)
    in_grid = corners - 1 + np.array([cols[0], rows[0]])
    return np.asarray(np.round(in_grid * grid.resolution_m + grid.origin_m, 9))


def _loops(padded: np.ndarray) -> list[np.ndarray]:
    """All outlines as corners (col, row), the inside on the left; holes run clockwise."""
    follow: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for (down, right), start, end in (
        ((-1, 0), (0, 0), (0, 1)),
        ((0, 1), (0, 1), (1, 1)),
        ((1, 0), (1, 1), (1, 0)),
        ((0, -1), (1, 0), (0, 0)),
    ):
        edge = padded & ~np.roll(padded, (-down, -right), axis=(0, 1))
        for row, col in np.argwhere(edge).tolist():
            corner = (col + start[1], row + start[0])
            follow.setdefault(corner, []).append((col + end[1], row + end[0]))
    loops = []
    while follow:
        here = min(follow)
        loop = []
        while here in follow:
            loop.append(here)
            ends = follow[here]
            step = ends.pop()
            if not ends:
                del follow[here]
            here = step
        loops.append(np.array(loop))
    return loops


def _area(loop: np.ndarray) -> float:
    """Twice the signed area, in cells."""
    x, y = loop.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
