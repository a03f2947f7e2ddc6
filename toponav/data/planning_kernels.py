"""Kernels of the global planner: truth by heading, cost to go over (x, y, heading), paths.

Positions are metres from the grid's lower-left corner, so that no kernel needs an origin.
The planning lattice has `HEADINGS` headings; truth is tabulated at three bins a heading.
"""

import math

import numpy as np
from numba import njit

__all__ = [
    "BINS",
    "BINS_PER_HEADING",
    "HEADINGS",
    "NOWHERE",
    "cost_to_go",
    "descend",
    "distance_to_segments",
    "off_plan_fraction",
    "raise_near",
    "truth_by_heading",
]

HEADINGS = 16
BINS_PER_HEADING = 3
BINS = HEADINGS * BINS_PER_HEADING
NOWHERE = -2
_FAR = 1 << 30
# Lattice moves of the sixteen headings, in cells (columns, rows).
_DX = np.array([1, 2, 1, 1, 0, -1, -1, -2, -1, -2, -1, -1, 0, 1, 1, 2])
_DY = np.array([0, 1, 1, 2, 1, 2, 1, 1, 0, -1, -1, -2, -1, -2, -1, -1])


@njit(cache=True)
def truth_by_heading(cell_xy, cell_room, node_xy, node_size, node_room, node_aligned, out):  # type: ignore[no-untyped-def]
    """Fills `out[cell, bin]` with the protocol's true node, -1 where there is none.

    `cell_room` is -1 outside enclosed rooms and `NOWHERE` where there is no node at all.
    """
    nodes = node_xy.shape[0]
    best = np.empty(BINS)
    for cell in range(cell_xy.shape[0]):
        room = cell_room[cell]
        best[:] = math.inf
        out[cell, :] = -1
        if room == NOWHERE:
            continue
        worst = math.inf
        for node in range(nodes):
            if room >= 0 and node_room[node] != room:
                continue
            dx = cell_xy[cell, 0] - node_xy[node, 0]
            dy = cell_xy[cell, 1] - node_xy[node, 1]
            distance = math.sqrt(dx * dx + dy * dy) / node_size[node]
            if distance >= worst:
                continue
            worst = 0.0
            for b in range(BINS):
                if node_aligned[node, b] and distance < best[b]:
                    best[b] = distance
                    out[cell, b] = node
                worst = max(worst, best[b])


@njit(cache=True)
def off_plan_fraction(truth, cells, on_plan):  # type: ignore[no-untyped-def]
    """How far each (cell, heading) is from being on the plan: 0 safely on, 1 off.

    The heading itself weighs half, 7.5 degrees to either side a quarter each.
    """
    off = np.zeros((cells.shape[0], HEADINGS), dtype=np.float32)
    for i in range(cells.shape[0]):
        cell = cells[i]
        for k in range(HEADINGS):
            middle = truth[cell, BINS_PER_HEADING * k]
            left = truth[cell, (BINS_PER_HEADING * k + 1) % BINS]
            right = truth[cell, (BINS_PER_HEADING * k + BINS - 1) % BINS]
            if middle >= 0 and not on_plan[middle]:
                off[i, k] += 0.5
            if left >= 0 and not on_plan[left]:
                off[i, k] += 0.25
            if right >= 0 and not on_plan[right]:
                off[i, k] += 0.25
    return off


@njit(cache=True)
def raise_near(off, cell_id, poses, cell_m, radius_m, extra):  # type: ignore[no-untyped-def]
    """Adds to `off` about the poses (x, y, yaw): fully there, less to the sides and beside."""
    rows, cols = cell_id.shape
    reach = int(radius_m / cell_m) + 1
    for p in range(poses.shape[0]):
        x, y, yaw = poses[p]
        nearest = round(yaw / (2 * math.pi / HEADINGS))
        for row in range(int(y / cell_m) - reach, int(y / cell_m) + reach + 1):
            for col in range(int(x / cell_m) - reach, int(x / cell_m) + reach + 1):
                if row < 0 or row >= rows or col < 0 or col >= cols or cell_id[row, col] < 0:
                    continue
                away = math.hypot((col + 0.5) * cell_m - x, (row + 0.5) * cell_m - y)
                share = max(0.0, 1.0 - away / radius_m)
                for turn in range(-1, 2):
                    k = (nearest + turn) % HEADINGS
                    part = share * (1.0 if turn == 0 else 0.5)
                    off[cell_id[row, col], k] += extra * part


@njit(cache=True)
def distance_to_segments(rows, cols, cell_m, segments, reach_m):  # type: ignore[no-untyped-def]
    """Distance of each cell's centre to the nearest segment, infinite beyond `reach_m`."""
    distance = np.full((rows, cols), np.inf, dtype=np.float32)
    for s in range(segments.shape[0]):
        ax, ay, bx, by = segments[s]
        low_col = max(0, int((min(ax, bx) - reach_m) / cell_m))
        high_col = min(cols - 1, int((max(ax, bx) + reach_m) / cell_m))
        low_row = max(0, int((min(ay, by) - reach_m) / cell_m))
        high_row = min(rows - 1, int((max(ay, by) + reach_m) / cell_m))
        square = (bx - ax) ** 2 + (by - ay) ** 2
        for row in range(low_row, high_row + 1):
            y = (row + 0.5) * cell_m
            for col in range(low_col, high_col + 1):
                x = (col + 0.5) * cell_m
                along = 0.0
                if square > 0:
                    along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / square
                    along = min(1.0, max(0.0, along))
                away = math.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay))
                if away <= reach_m and away < distance[row, col]:
                    distance[row, col] = away
    return distance


@njit(cache=True)
def cost_to_go(cell_id, cells, weight, off, goal, off_cost, turn_cost, pivot_cost, units_per_cell):  # type: ignore[no-untyped-def]
    """Least cost to reach the goal from each (cell, heading), in integer units.

    Dijkstra backwards with a ring of buckets (Dial). A move goes one lattice step along its
    heading and may end one heading to either side; the robot may also pivot on the spot.
    """
    count = cells.shape[0]
    states = count * HEADINGS
    value = np.full(states, _FAR, dtype=np.int32)
    after = np.full(states, -1, dtype=np.int32)
    before = np.full(states, -1, dtype=np.int32)
    done = np.zeros(states, dtype=np.bool_)
    ring = 1 << 14
    head = np.full(ring, -1, dtype=np.int32)
    queued = 0
    for i in range(count):
        for k in range(HEADINGS):
            if goal[i, k]:
                state = i * HEADINGS + k
                value[state] = 0
                after[state] = head[0]
                if head[0] >= 0:
                    before[head[0]] = state
                head[0] = state
                queued += 1
    bucket = 0
    rows, cols = cell_id.shape
    turn_units = int(turn_cost * units_per_cell)
    pivot_units = int(pivot_cost * units_per_cell)
    while queued > 0:
        slot = bucket & (ring - 1)
        state = head[slot]
        if state < 0:
            bucket += 1
            continue
        head[slot] = after[state]
        if after[state] >= 0:
            before[after[state]] = -1
        queued -= 1
        done[state] = True
        i = state // HEADINGS
        k = state - i * HEADINGS
        for choice in range(5):
            if choice < 3:
                heading = (k + choice - 1 + HEADINGS) % HEADINGS
                row = cells[i, 0] - _DY[heading]
                col = cells[i, 1] - _DX[heading]
                if row < 0 or row >= rows or col < 0 or col >= cols:
                    continue
                j = cell_id[row, col]
                if j < 0:
                    continue
                length = math.sqrt(_DX[heading] ** 2 + _DY[heading] ** 2)
                rate = 0.5 * (weight[i] + weight[j])
                rate += off_cost * 0.5 * (off[j, heading] + off[i, k])
                step = int(length * rate * units_per_cell)
                if choice != 1:
                    step += turn_units
            else:
                heading = (k + (1 if choice == 3 else HEADINGS - 1)) % HEADINGS
                j = i
                step = pivot_units + int(off_cost * off[i, heading] * units_per_cell)
            other = j * HEADINGS + heading
            if done[other]:
                continue
            total = value[state] + max(1, min(step, ring - 2))
            if total >= value[other]:
                continue
            if value[other] < _FAR:
                old = value[other] & (ring - 1)
                if before[other] >= 0:
                    after[before[other]] = after[other]
                else:
                    head[old] = after[other]
                if after[other] >= 0:
                    before[after[other]] = before[other]
                queued -= 1
            value[other] = total
            new = total & (ring - 1)
            before[other] = -1
            after[other] = head[new]
            if head[new] >= 0:
                before[head[new]] = other
            head[new] = other
            queued += 1
    return value


@njit(cache=True)
def descend(value, cell_id, cells, weight, off, start, off_cost, turn_cost, pivot_cost, units):  # type: ignore[no-untyped-def]
    """States of a cheapest way from `start` to the goal, or an empty array when there is none."""
    rows, cols = cell_id.shape
    path = np.empty(20000, dtype=np.int32)
    path[0] = start
    size = 1
    state = start
    turn_units = int(turn_cost * units)
    pivot_units = int(pivot_cost * units)
    while value[state] > 0 and size < path.shape[0]:
        i = state // HEADINGS
        k = state - i * HEADINGS
        best = _FAR
        chosen = -1
        row = cells[i, 0] + _DY[k]
        col = cells[i, 1] + _DX[k]
        if 0 <= row < rows and 0 <= col < cols and cell_id[row, col] >= 0:
            j = cell_id[row, col]
            length = math.sqrt(_DX[k] ** 2 + _DY[k] ** 2)
            for turn in (0, 1, -1):
                heading = (k + turn + HEADINGS) % HEADINGS
                rate = 0.5 * (weight[i] + weight[j])
                rate += off_cost * 0.5 * (off[i, k] + off[j, heading])
                step = int(length * rate * units) + (0 if turn == 0 else turn_units)
                other = j * HEADINGS + heading
                if value[other] < _FAR and value[other] + step < best:
                    best = value[other] + step
                    chosen = other
        for turn in (1, -1):
            heading = (k + turn + HEADINGS) % HEADINGS
            step = pivot_units + int(off_cost * off[i, k] * units)
            other = i * HEADINGS + heading
            if value[other] < _FAR and value[other] + step < best:
                best = value[other] + step
                chosen = other
        if chosen < 0 or value[chosen] >= value[state]:
            return path[:0].copy()
        state = chosen
        path[size] = state
        size += 1
    return path[:size].copy()
