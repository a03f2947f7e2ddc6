"""Compiled lines of sight over grids.

All that calls `is_clear` from compiled code is here: numba's cache does not notice when a
function in another file changes.
"""

import numpy as np
from numba import njit

__all__ = ["cells_in_sight", "is_clear", "pairs_in_sight", "shortest_polyline"]


@njit(cache=True)
def is_clear(blocked, row0, col0, row1, col1):  # type: ignore[no-untyped-def]
    """Whether the segment between two points enters no blocked cell; points are in cells.

    A point (row, col) lies in the cell of its whole part. A segment through a corner enters both
    cells beside it. What lies outside the grid is blocked.
    """
    rows, cols = blocked.shape
    row, col = int(np.floor(row0)), int(np.floor(col0))
    end_row, end_col = int(np.floor(row1)), int(np.floor(col1))
    if not (0 <= end_row < rows and 0 <= end_col < cols) or blocked[end_row, end_col]:
        return False
    down, right = row1 - row0, col1 - col0
    step_row = 1 if down > 0 else -1
    step_col = 1 if right > 0 else -1
    per_row = np.inf if down == 0 else abs(1.0 / down)
    per_col = np.inf if right == 0 else abs(1.0 / right)
    next_row = np.inf if down == 0 else ((row + (step_row > 0)) - row0) / down
    next_col = np.inf if right == 0 else ((col + (step_col > 0)) - col0) / right
    for _ in range(rows + cols + 4):
        if row < 0 or row >= rows or col < 0 or col >= cols or blocked[row, col]:
            return False
        if (row == end_row and col == end_col) or min(next_row, next_col) >= 1.0:
            return True
        if abs(next_row - next_col) < 1e-9:
            beside = row + step_row
            if 0 <= beside < rows and blocked[beside, col]:
                return False
            beside = col + step_col
            if 0 <= beside < cols and blocked[row, beside]:
                return False
            row += step_row
            col += step_col
            next_row += per_row
            next_col += per_col
        elif next_row < next_col:
            row += step_row
            next_row += per_row
        else:
            col += step_col
            next_col += per_col
    return False


@njit(cache=True)
def cells_in_sight(opaque, row, col, reach):  # type: ignore[no-untyped-def]
    """The cells whose centre can be seen from a point within so many cells; bool[rows, cols].

    The cell of the point and the cell looked at do not hide themselves.
    """
    rows, cols = opaque.shape
    seen = np.zeros((rows, cols), np.bool_)
    own_row, own_col = int(np.floor(row)), int(np.floor(col))
    if not (0 <= own_row < rows and 0 <= own_col < cols):
        return seen
    first_row = max(int(np.floor(row - reach)), 0)
    last_row = min(int(np.floor(row + reach)), rows - 1)
    first_col = max(int(np.floor(col - reach)), 0)
    last_col = min(int(np.floor(col + reach)), cols - 1)
    for to_row in range(first_row, last_row + 1):
        for to_col in range(first_col, last_col + 1):
            down, right = to_row + 0.5 - row, to_col + 0.5 - col
            if down * down + right * right > reach * reach:
                continue
            seen[to_row, to_col] = not opaque[to_row, to_col] and is_clear(
                opaque, row, col, to_row + 0.5, to_col + 0.5
            )
    return seen


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
def shortest_polyline(blocked, points):  # type: ignore[no-untyped-def]
    """Length, in cells, of the shortest clear polyline through some points of a path, in order.

    Consecutive points are taken to be joined whatever lies between them.

    Args:
        blocked: bool[rows, cols].
        points: float64[n, 2], rows and columns; the first and last are kept.
    """
    count = len(points)
    length = np.full(count, np.inf)
    length[0] = 0.0
    for to in range(1, count):
        for start in range(to):
            step = np.hypot(points[to, 0] - points[start, 0], points[to, 1] - points[start, 1])
            if length[start] + step >= length[to]:
                continue
            if start == to - 1 or is_clear(
                blocked, points[start, 0], points[start, 1], points[to, 0], points[to, 1]
            ):
                length[to] = length[start] + step
    return length[count - 1]
