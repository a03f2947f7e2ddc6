"""Compiled loops over grids: rectangles, exact distances, geodesic distances."""

import numpy as np
from numba import njit

__all__ = ["distance_to_solid", "downhill_cells", "geodesic_cells", "rectangles_of_labels"]


@njit(cache=True)
def rectangles_of_labels(labels):  # type: ignore[no-untyped-def]
    """Disjoint rectangles that cover every non-zero cell, each over one label, greedily.

    Returns int32[n, 5]: row0, col0, row1, col1 (exclusive), label.
    """
    rows, cols = labels.shape
    left = labels.copy()
    found = np.empty((256, 5), np.int32)
    count = 0
    for row in range(rows):
        for col in range(cols):
            label = left[row, col]
            if label == 0:
                continue
            # Widest first, then as deep as that width goes; and the other way round.
            wide = col
            while wide < cols and left[row, wide] == label:
                wide += 1
            wide_row = _full_until(left, row, col, wide, label)
            deep = row
            while deep < rows and left[deep, col] == label:
                deep += 1
            deep_col = col + 1
            while deep_col < wide:
                if not _column_is(left, row, deep, deep_col, label):
                    break
                deep_col += 1
            if (wide_row - row) * (wide - col) >= (deep - row) * (deep_col - col):
                row1, col1 = wide_row, wide
            else:
                row1, col1 = deep, deep_col
            left[row:row1, col:col1] = 0
            if count == len(found):
                grown = np.empty((2 * count, 5), np.int32)
                grown[:count] = found
                found = grown
            found[count, 0] = row
            found[count, 1] = col
            found[count, 2] = row1
            found[count, 3] = col1
            found[count, 4] = label
            count += 1
    return found[:count].copy()


@njit(cache=True)
def _full_until(left, row, col0, col1, label):  # type: ignore[no-untyped-def]
    """The first row after `row` in which not every cell of the span has the label."""
    end = row + 1
    while end < left.shape[0]:
        for col in range(col0, col1):
            if left[end, col] != label:
                return end
        end += 1
    return end


@njit(cache=True)
def _column_is(left, row0, row1, col, label):  # type: ignore[no-untyped-def]
    """Whether every cell of the column span has the label."""
    return np.all(left[row0:row1, col] == label)


@njit(cache=True)
def distance_to_solid(solid):  # type: ignore[no-untyped-def]
    """Distance, in cells, from each cell's centre to the nearest solid square; exact.

    What lies outside the grid is solid. Felzenszwalb and Huttenlocher's lower envelope of
    parabolas, on a lattice of half cells along the row: the nearest point of a square lies
    either beside the centre (same row or column) or at a corner.
    """
    rows, cols = solid.shape
    # Along columns: the squared distance to the nearest solid square of the column.
    beside = np.empty((rows, cols), np.float64)
    for col in range(cols):
        gap = -1
        for row in range(rows):
            gap = -1 if solid[row, col] else gap + 1
            beside[row, col] = gap
        gap = -1
        for row in range(rows - 1, -1, -1):
            gap = -1 if solid[row, col] else gap + 1
            beside[row, col] = min(beside[row, col], gap)
    distance = np.empty((rows, cols), np.float32)
    lattice = 2 * cols + 1
    height = np.empty(lattice, np.float64)
    apex = np.empty(lattice, np.int64)
    bound = np.empty(lattice + 1, np.float64)
    for row in range(rows):
        # Lattice point 2 * col is the cell's left edge, 2 * col + 1 its centre; unit: half cell.
        height[:] = np.inf
        height[0] = 0.0
        height[lattice - 1] = 0.0
        for col in range(cols):
            down = 2.0 * beside[row, col] + 1.0
            square = down * down if beside[row, col] >= 0 else 0.0
            for point in range(2 * col, 2 * col + 3):
                height[point] = min(height[point], square)
        last = 0
        apex[0] = 0
        bound[0] = -np.inf
        bound[1] = np.inf
        for point in range(1, lattice):
            while True:
                other = apex[last]
                cross = (height[point] + point * point - height[other] - other * other) / (
                    2.0 * (point - other)
                )
                if cross > bound[last]:
                    break
                last -= 1
            last += 1
            apex[last] = point
            bound[last] = cross
            bound[last + 1] = np.inf
        at = 0
        for col in range(cols):
            point = 2 * col + 1
            while bound[at + 1] < point:
                at += 1
            other = apex[at]
            square = height[other] + (point - other) * (point - other)
            distance[row, col] = 0.0 if solid[row, col] else 0.5 * np.sqrt(square)
    return distance


@njit(cache=True)
def geodesic_cells(free, weight, weight_max, goals):  # type: ignore[no-untyped-def]
    """Least cost, in cells, from each free cell to the nearest goal; infinite elsewhere.

    Dijkstra over eight neighbours, a diagonal step only between two free cells. A step costs
    its length times the mean weight (at least one) of its two cells. The queue is a ring of
    buckets one cell wide: no step is shorter, so a bucket is final when its turn comes.

    Args:
        free: bool[rows, cols].
        weight: float32[rows, cols], or shape (1, 1) for ones everywhere.
        weight_max: Largest weight.
        goals: int32[n, 2], rows and columns of the goals.
    """
    rows, cols = free.shape
    weighted = weight.shape[0] == rows and weight.shape[1] == cols
    cost = np.full(rows * cols, np.inf, np.float32)
    after = np.full(rows * cols, -1, np.int32)
    before = np.full(rows * cols, -1, np.int32)
    ring = int(np.ceil(1.4143 * weight_max)) + 2
    head = np.full(ring, -1, np.int32)
    waiting = 0
    for index in range(len(goals)):
        cell = goals[index, 0] * cols + goals[index, 1]
        if free[goals[index, 0], goals[index, 1]] and cost[cell] > 0:
            cost[cell] = 0.0
            _link(head, after, before, 0, cell)
            waiting += 1
    bucket = 0
    while waiting > 0:
        slot = bucket % ring
        while head[slot] >= 0:
            cell = head[slot]
            _unlink(head, after, before, slot, cell)
            waiting -= 1
            row = cell // cols
            col = cell - row * cols
            for down in range(-1, 2):
                to_row = row + down
                if to_row < 0 or to_row >= rows:
                    continue
                for right in range(-1, 2):
                    to_col = col + right
                    if to_col < 0 or to_col >= cols or not free[to_row, to_col]:
                        continue
                    step = 1.0
                    if down != 0 and right != 0:
                        if not (free[row, to_col] and free[to_row, col]):
                            continue
                        step = 1.4142135
                    if weighted:
                        step *= 0.5 * (weight[row, col] + weight[to_row, to_col])
                    reached = np.float32(cost[cell] + step)
                    to = to_row * cols + to_col
                    if reached < cost[to]:
                        if cost[to] < np.inf:
                            _unlink(head, after, before, int(cost[to]) % ring, to)
                            waiting -= 1
                        cost[to] = reached
                        _link(head, after, before, int(reached) % ring, to)
                        waiting += 1
        bucket += 1
    return cost.reshape((rows, cols))


@njit(cache=True)
def downhill_cells(free, field, row, col, cell_m):  # type: ignore[no-untyped-def]
    """The cells of the steepest way down a geodesic field, the first and the goal included.

    Each next cell is the lower neighbour over which the way to the goal is shortest; a diagonal
    step needs both cells beside it. Returns int32[n, 2].

    Args:
        free: bool[rows, cols].
        field: float32[rows, cols], finite at the first cell.
        row: Of the first cell.
        col: Of the first cell.
        cell_m: Length of a straight step.
    """
    rows, cols = field.shape
    cells = np.empty((256, 2), np.int32)
    cells[0] = row, col
    count = 1
    while field[row, col] > 0:
        best_row, best_col, best_cost = row, col, np.inf
        for to_row in range(max(row - 1, 0), min(row + 2, rows)):
            for to_col in range(max(col - 1, 0), min(col + 2, cols)):
                diagonal = to_row != row and to_col != col
                if diagonal and not (free[row, to_col] and free[to_row, col]):
                    continue
                step = cell_m * (np.sqrt(2.0) if diagonal else 1.0)
                cost = np.float64(field[to_row, to_col]) + step
                if field[to_row, to_col] < field[row, col] and cost < best_cost:
                    best_row, best_col, best_cost = to_row, to_col, cost
        if best_row == row and best_col == col:
            break
        row, col = best_row, best_col
        if count == len(cells):
            longer = np.empty((2 * count, 2), np.int32)
            longer[:count] = cells
            cells = longer
        cells[count] = row, col
        count += 1
    return cells[:count]


@njit(cache=True)
def _link(head, after, before, slot, cell):  # type: ignore[no-untyped-def]
    """Puts the cell first in the bucket."""
    first = head[slot]
    after[cell] = first
    before[cell] = -1
    if first >= 0:
        before[first] = cell
    head[slot] = cell


@njit(cache=True)
def _unlink(head, after, before, slot, cell):  # type: ignore[no-untyped-def]
    """Takes the cell out of the bucket."""
    if before[cell] >= 0:
        after[before[cell]] = after[cell]
    else:
        head[slot] = after[cell]
    if after[cell] >= 0:
        before[after[cell]] = before[cell]
