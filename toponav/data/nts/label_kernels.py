"""Compiled loops of the labels of panoramas."""

import numpy as np
from numba import njit

from toponav.worlds.sight_kernels import is_clear

__all__ = ["pairs_in_sight", "shortest_via"]


@njit(cache=True)
def pairs_in_sight(opaque, points, reach):  # type: ignore[no-untyped-def]
    """Which points see each other within so many cells; bool[n, n], true on the diagonal.

    Args:
        opaque: bool[rows, cols].
        points: float64[n, 2], rows and columns in cells.
        reach: In cells.
    """
    count = len(points)
    seen = np.zeros((count, count), np.bool_)
    for one in range(count):
        seen[one, one] = True
        for other in range(one):
            down = points[other, 0] - points[one, 0]
            right = points[other, 1] - points[one, 1]
            if down * down + right * right > reach * reach:
                continue
            clear = is_clear(
                opaque, points[one, 0], points[one, 1], points[other, 0], points[other, 1]
            )
            seen[one, other] = clear
            seen[other, one] = clear
    return seen


@njit(cache=True)
def shortest_via(to_cell, from_source, bins, directions):  # type: ignore[no-untyped-def]
    """Length of the shortest way to each goal through the exits of each direction.

    Args:
        to_cell: float32[exits, goals], from each exit to each goal.
        from_source: float32[exits], from the source to each exit.
        bins: int64[exits], direction of each exit.
        directions: How many directions there are.

    Returns:
        float32[goals, directions], infinite where a direction has no exit.
    """
    exits, goals = to_cell.shape
    via = np.full((goals, directions), np.inf, np.float32)
    for number in range(exits):
        for goal in range(goals):
            length = from_source[number] + to_cell[number, goal]
            if length < via[goal, bins[number]]:
                via[goal, bins[number]] = length
    return via
