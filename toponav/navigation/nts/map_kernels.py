"""Occupancy from depth and the fast-marching planner, compiled."""

import heapq
import math

import numpy as np
from numba import njit

__all__ = ["add_ranges", "add_view", "march"]

_HIT, _MISS = 3, 1
_MOST, _LEAST = 24, -6


@njit(cache=True)
def _clear_ray(
    evidence: np.ndarray, x: float, y: float, dx: float, dy: float, start: float, end: float
) -> None:
    """Count against obstacles in the cells between two distances, in cells, along a ray."""
    rows, cols = evidence.shape
    at = 0.0
    while at < end:
        col = math.floor(x + at * dx)
        row = math.floor(y + at * dy)
        if row < 0 or col < 0 or row >= rows or col >= cols:
            break
        value = evidence[row, col]
        if value == 0:
            evidence[row, col] = -1
        elif at >= start and value > _LEAST:
            value -= _MISS
            evidence[row, col] = value if value != 0 else -1
        at += 0.7


@njit(cache=True)
def add_view(
    evidence: np.ndarray,
    origin_x: float,
    origin_y: float,
    cell_m: float,
    pose: np.ndarray,
    depth_m: np.ndarray,
    yaw: np.ndarray,
    scale: np.ndarray,
    lift: np.ndarray,
    camera_m: float,
    low_m: float,
    high_m: float,
) -> None:
    """Adds what a depth panorama shows to the map; evidence > 0 is occupied, 0 unknown."""
    rows, cols = evidence.shape
    height, width = depth_m.shape
    x = (pose[0] - origin_x) / cell_m
    y = (pose[1] - origin_y) / cell_m
    blind = 0.7 / cell_m
    hits = np.zeros(height)
    for c in range(width):
        nearest = 1e9
        floor_m = 0.0
        count = 0
        for r in range(height):
            depth = depth_m[r, c]
            if depth <= 0.05 or depth >= 9.9:
                continue
            above = camera_m + lift[r] * depth
            away = depth * scale[c]
            if above < low_m:
                if away > floor_m:
                    floor_m = away
            elif above < high_m:
                nearest = min(nearest, away)
                hits[count] = away
                count += 1
        heading = pose[2] + yaw[c]
        dx, dy = math.cos(heading), math.sin(heading)
        end = min(min(nearest - cell_m, floor_m), 7.0)
        _clear_ray(evidence, x, y, dx, dy, blind, end / cell_m)
        last = -10.0
        for k in range(count):
            if hits[k] > 6.0 or abs(hits[k] - last) < 0.5 * cell_m:
                continue
            last = hits[k]
            col = math.floor(x + hits[k] / cell_m * dx)
            row = math.floor(y + hits[k] / cell_m * dy)
            if 0 <= row < rows and 0 <= col < cols:
                value = evidence[row, col] + _HIT
                evidence[row, col] = min(value, _MOST) if value != 0 else 1


@njit(cache=True)
def add_ranges(
    evidence: np.ndarray,
    origin_x: float,
    origin_y: float,
    cell_m: float,
    pose: np.ndarray,
    range_m: np.ndarray,
    farthest_m: float,
) -> None:
    """Adds ranges all around, one per direction, to the map."""
    rows, cols = evidence.shape
    x = (pose[0] - origin_x) / cell_m
    y = (pose[1] - origin_y) / cell_m
    count = range_m.shape[0]
    parts = 3
    for c in range(count * parts):
        k = (c + parts // 2) // parts % count
        heading = pose[2] + c * 2.0 * math.pi / (count * parts)
        dx, dy = math.cos(heading), math.sin(heading)
        away = range_m[k]
        end = min(away - 0.12, farthest_m)
        _clear_ray(evidence, x, y, dx, dy, 0.0, end / cell_m)
        if away < farthest_m:
            col = math.floor(x + away / cell_m * dx)
            row = math.floor(y + away / cell_m * dy)
            if 0 <= row < rows and 0 <= col < cols:
                value = evidence[row, col] + 2
                evidence[row, col] = min(value, _MOST // 2) if value != 0 else 1


@njit(cache=True)
def march(
    speed: np.ndarray,
    seed_rows: np.ndarray,
    seed_cols: np.ndarray,
    stop_row: int,
    stop_col: int,
    slack: float,
) -> np.ndarray:
    """Time to reach the seeds from every cell, by fast marching; infinite where not needed.

    Stops when the front is `slack` past the cell (`stop_row`, `stop_col`). Cells of speed zero
    are walls.

    Reference:
        Sethian 1996, A fast marching level set method for monotonically advancing fronts.
    """
    rows, cols = speed.shape
    time = np.full((rows, cols), np.inf)
    done = np.zeros((rows, cols), np.bool_)
    front = [(0.0, 0, 0)]
    front.pop()
    for k in range(len(seed_rows)):
        time[seed_rows[k], seed_cols[k]] = 0.0
        heapq.heappush(front, (0.0, seed_rows[k], seed_cols[k]))
    limit = np.inf
    while front:
        now, row, col = heapq.heappop(front)
        if done[row, col]:
            continue
        if now > limit:
            break
        done[row, col] = True
        if row == stop_row and col == stop_col:
            limit = now + slack
        for side in range(4):
            r = row + (1 if side == 0 else -1 if side == 1 else 0)
            c = col + (1 if side == 2 else -1 if side == 3 else 0)
            if r < 0 or c < 0 or r >= rows or c >= cols or done[r, c] or speed[r, c] <= 0.0:
                continue
            up = time[r - 1, c] if r > 0 else np.inf
            down = time[r + 1, c] if r + 1 < rows else np.inf
            left = time[r, c - 1] if c > 0 else np.inf
            right = time[r, c + 1] if c + 1 < cols else np.inf
            a, b = min(up, down), min(left, right)
            cost = 1.0 / speed[r, c]
            if abs(a - b) >= cost:
                value = min(a, b) + cost
            else:
                value = 0.5 * (a + b + math.sqrt(2.0 * cost * cost - (a - b) ** 2))
            if value < time[r, c]:
                time[r, c] = value
                heapq.heappush(front, (value, r, c))
    return time
