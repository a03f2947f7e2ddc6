"""Compiled loops of the labels of panoramas."""

import numpy as np
from numba import njit

__all__ = ["shortest_via"]


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
