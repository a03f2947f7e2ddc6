"""Kernels on paths and clearance grids: sampling, resampling, smoothing.

Positions are metres from the grid's lower-left corner.
"""

import math

import numpy as np
from numba import njit

__all__ = ["chord_clearance", "resample", "sample_bilinear", "smooth"]


@njit(cache=True)
def sample_bilinear(grid, resolution_m, x, y):  # type: ignore[no-untyped-def]
    """The grid's value at a point between cell centres; the border's value outside."""
    rows, cols = grid.shape
    u = min(max(x / resolution_m - 0.5, 0.0), cols - 1.001)
    v = min(max(y / resolution_m - 0.5, 0.0), rows - 1.001)
    col, row = int(u), int(v)
    a, b = u - col, v - row
    low = grid[row, col] * (1 - a) + grid[row, col + 1] * a
    high = grid[row + 1, col] * (1 - a) + grid[row + 1, col + 1] * a
    return low * (1 - b) + high * b


@njit(cache=True)
def resample(points, step_m):  # type: ignore[no-untyped-def]
    """Points along the polyline at equal distances, ends kept."""
    count = points.shape[0]
    along = np.zeros(count)
    for i in range(1, count):
        along[i] = along[i - 1] + math.hypot(
            points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        )
    total = along[-1]
    pieces = max(1, round(total / step_m))
    out = np.empty((pieces + 1, 2))
    j = 0
    for i in range(pieces + 1):
        target = total * i / pieces
        while j < count - 2 and along[j + 1] < target:
            j += 1
        span = along[j + 1] - along[j] if count > 1 else 0.0
        a = (target - along[j]) / span if span > 0 else 0.0
        a = min(max(a, 0.0), 1.0)
        for axis in range(2):
            end = points[j + 1, axis] if count > 1 else points[j, axis]
            out[i, axis] = points[j, axis] * (1 - a) + end * a
    return out


@njit(cache=True)
def smooth(points, clearance, resolution_m, rounds, bend, anchor, push, comfort_m, least_m):  # type: ignore[no-untyped-def]
    """The path bent smooth, pushed off obstacles nearer than `comfort_m`, held near itself."""
    count = points.shape[0]
    out = points.copy()
    h = resolution_m
    for _ in range(rounds):
        for i in range(1, count - 1):
            x, y = out[i]
            gx = bend * (0.5 * (out[i - 1, 0] + out[i + 1, 0]) - x)
            gy = bend * (0.5 * (out[i - 1, 1] + out[i + 1, 1]) - y)
            if 1 < i < count - 2:
                gx += (
                    bend
                    * (4 * (out[i - 1, 0] + out[i + 1, 0]) - out[i - 2, 0] - out[i + 2, 0] - 6 * x)
                    / 16
                )
                gy += (
                    bend
                    * (4 * (out[i - 1, 1] + out[i + 1, 1]) - out[i - 2, 1] - out[i + 2, 1] - 6 * y)
                    / 16
                )
            gx += anchor * (points[i, 0] - x)
            gy += anchor * (points[i, 1] - y)
            near = sample_bilinear(clearance, resolution_m, x, y)
            if near < comfort_m:
                sx = (
                    sample_bilinear(clearance, resolution_m, x + h, y)
                    - sample_bilinear(clearance, resolution_m, x - h, y)
                ) / (2 * h)
                sy = (
                    sample_bilinear(clearance, resolution_m, x, y + h)
                    - sample_bilinear(clearance, resolution_m, x, y - h)
                ) / (2 * h)
                gx += push * (comfort_m - near) * sx
                gy += push * (comfort_m - near) * sy
            moved = sample_bilinear(clearance, resolution_m, x + gx, y + gy)
            if moved >= least_m or moved >= near:
                out[i, 0] = x + gx
                out[i, 1] = y + gy
    return out


@njit(cache=True)
def chord_clearance(clearance, resolution_m, ax, ay, bx, by):  # type: ignore[no-untyped-def]
    """Least clearance along a straight line."""
    length = math.hypot(bx - ax, by - ay)
    pieces = int(length / 0.05) + 1
    least = math.inf
    for i in range(pieces + 1):
        a = i / pieces
        least = min(
            least, sample_bilinear(clearance, resolution_m, ax + a * (bx - ax), ay + a * (by - ay))
        )
    return least
