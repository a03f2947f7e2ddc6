"""What the local policy asks of its map at every step, compiled."""

import math

import numpy as np
from numba import njit

__all__ = ["best_turn", "clearance_cells"]


@njit(cache=True)
def clearance_cells(occupied: np.ndarray, reach: int) -> np.ndarray:
    """Distance in cells from each cell's middle to the nearest occupied one, `reach` at most."""
    rows, cols = occupied.shape
    along = np.full((rows, cols), np.float32(reach))
    for r in range(rows):
        last = -1000000
        for c in range(cols):
            if occupied[r, c]:
                last = c
            along[r, c] = min(along[r, c], c - last)
        last = 1000000
        for c in range(cols - 1, -1, -1):
            if occupied[r, c]:
                last = c
            along[r, c] = min(along[r, c], last - c)
    squared = np.full((rows, cols), np.float32(reach * reach))
    for r in range(rows):
        for other in range(max(r - reach, 0), min(r + reach + 1, rows)):
            off = np.float32((r - other) * (r - other))
            for c in range(cols):
                value = along[other, c] * along[other, c] + off
                if value < squared[r, c]:
                    squared[r, c] = value
    return np.sqrt(squared)


@njit(cache=True)
def _time_at(times: np.ndarray, row: int, col: int) -> float:
    rows, cols = times.shape
    if row < 1 or col < 1 or row >= rows - 1 or col >= cols - 1:
        return np.inf
    value = times[row, col]
    if not math.isfinite(value):
        value = np.inf
        for r in range(row - 1, row + 2):
            for c in range(col - 1, col + 2):
                value = min(value, times[r, c])
        value += 0.1
    return float(value)


@njit(cache=True)
def _clearance_at(clearance_m: np.ndarray, row: int, col: int) -> float:
    rows, cols = clearance_m.shape
    if row < 0 or col < 0 or row >= rows or col >= cols:
        return 0.0
    return float(clearance_m[row, col])


@njit(cache=True)
def best_turn(
    times: np.ndarray,
    clearance_m: np.ndarray,
    row: float,
    col: float,
    yaw_rad: float,
    turn_rad: float,
    forward_cells: float,
    radius_m: float,
    turn_cost_m: float,
) -> tuple[int, float]:
    """How many turns to the left make the next step best, and the metres left after it.

    Looks one step ahead in all directions; what a step squeezes past costs too.

    Args:
        times: Metres left from each cell.
        clearance_m: Distance to the nearest obstacle.
        row: Where the robot is, in cells.
        col: Where the robot is, in cells.
        yaw_rad: Its heading.
        turn_rad: What one turn turns.
        forward_cells: What one step drives.
        radius_m: The robot's.
        turn_cost_m: A turn is worth this much driving.
    """
    start = _clearance_at(clearance_m, math.floor(row), math.floor(col))
    best, best_cost = 0, np.inf
    for number in range(round(2.0 * math.pi / turn_rad)):
        turns = (number + 1) // 2 * (1 if number % 2 else -1)
        heading = yaw_rad + turns * turn_rad
        dx, dy = math.cos(heading) * forward_cells, math.sin(heading) * forward_cells
        cost = _time_at(times, math.floor(row + dy), math.floor(col + dx))
        for part in range(1, 4):
            share = 0.4 * part
            clear = _clearance_at(
                clearance_m, math.floor(row + share * dy), math.floor(col + share * dx)
            )
            # Where it is too tight already, any way that widens is good.
            if clear < radius_m and clear < start + 0.01:
                cost += (radius_m - clear) * 8.0 + 0.4
        cost += abs(turns) * turn_cost_m
        if cost < best_cost - 1e-9:
            best, best_cost = turns, cost
    return best, best_cost
