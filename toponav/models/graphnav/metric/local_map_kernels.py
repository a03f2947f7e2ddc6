"""The rolling evidence grid of `LocalMap`, compiled."""

import math

import numpy as np
from numba import njit

from toponav.models.graphnav.metric.profile_kernels import FARTHEST, NOTHING

__all__ = ["insert", "move", "replay", "view"]

_HIT = np.float32(0.5)
_FREE = np.float32(0.2)
_MOST = np.float32(1.0)


@njit(cache=True)
def move(grid: np.ndarray, cell_m: float, pose: np.ndarray, step: np.ndarray) -> None:
    """Advance `pose` [x, y, yaw] by `step` [forward, left, turn] and clear what rolls in.

    The grid [2, n, n] is anchored in the frame that dead reckoning began in; a cell holds the
    place whose cell coordinates are its own modulo n. Cells more than half the grid away are
    forgotten.
    """
    n = grid.shape[1]
    before_row, before_col = math.floor(pose[0] / cell_m), math.floor(pose[1] / cell_m)
    middle = pose[2] + 0.5 * step[2]
    pose[0] += step[0] * math.cos(middle) - step[1] * math.sin(middle)
    pose[1] += step[0] * math.sin(middle) + step[1] * math.cos(middle)
    pose[2] += step[2]
    row, col = math.floor(pose[0] / cell_m), math.floor(pose[1] / cell_m)
    half = n // 2
    for moved in range(before_row, row):
        grid[:, (moved + half) % n, :] = 0.0
    for moved in range(row, before_row):
        grid[:, (moved - half) % n, :] = 0.0
    for moved in range(before_col, col):
        grid[:, :, (moved + half) % n] = 0.0
    for moved in range(col, before_col):
        grid[:, :, (moved - half) % n] = 0.0


@njit(cache=True, fastmath=True)
def insert(
    grid: np.ndarray,
    cell_m: float,
    pose: np.ndarray,
    profile: np.ndarray,
    azimuth: np.ndarray,
    max_depth_m: float,
    reach_m: float,
) -> None:
    """Mark what a profile [2, bins] saw free or occupied from `pose`."""
    n = grid.shape[1]
    bands, bins = profile.shape
    for band in range(bands):
        for bin_ in range(bins):
            byte = profile[band, bin_]
            depth = max_depth_m if byte == NOTHING else byte * max_depth_m / FARTHEST
            along = depth / math.cos(azimuth[bin_])
            end = min(along, reach_m) - (0.0 if byte == NOTHING else cell_m)
            c, s = math.cos(pose[2] + azimuth[bin_]), math.sin(pose[2] + azimuth[bin_])
            steps = int(end / cell_m)
            for k in range(steps):
                r = (k + 0.5) * cell_m
                row = math.floor((pose[0] + r * c) / cell_m) % n
                col = math.floor((pose[1] + r * s) / cell_m) % n
                grid[band, row, col] = max(-_MOST, grid[band, row, col] - _FREE)
    for band in range(bands):
        for bin_ in range(bins):
            byte = profile[band, bin_]
            if byte == NOTHING:
                continue
            along = (byte * max_depth_m / FARTHEST) / math.cos(azimuth[bin_])
            if along > reach_m:
                continue
            c, s = math.cos(pose[2] + azimuth[bin_]), math.sin(pose[2] + azimuth[bin_])
            row = math.floor((pose[0] + along * c) / cell_m) % n
            col = math.floor((pose[1] + along * s) / cell_m) % n
            grid[band, row, col] = min(_MOST, grid[band, row, col] + _HIT)


@njit(cache=True, fastmath=True)
def view(
    grid: np.ndarray, cell_m: float, pose: np.ndarray, view_cell_m: float, out: np.ndarray
) -> None:
    """Fill `out` [rows, cols] with the grid around the robot, forward rows, leftward columns.

    A byte holds both bands in four bits each: 0 for free, 7 for unknown, 15 for occupied.
    """
    n = grid.shape[1]
    rows, cols = out.shape
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(rows):
        forward = (i + 0.5 - rows / 2) * view_cell_m
        for j in range(cols):
            left = (j + 0.5 - cols / 2) * view_cell_m
            x = (pose[0] + forward * c - left * s) / cell_m - 0.5
            y = (pose[1] + forward * s + left * c) / cell_m - 0.5
            row, col = math.floor(x), math.floor(y)
            u, v = x - row, y - col
            row0, col0 = row % n, col % n
            row1, col1 = (row + 1) % n, (col + 1) % n
            code = 0
            for band in range(2):
                value = (1 - u) * (
                    (1 - v) * grid[band, row0, col0] + v * grid[band, row0, col1]
                ) + u * ((1 - v) * grid[band, row1, col0] + v * grid[band, row1, col1])
                code = code * 16 + min(15, max(0, int(7.5 + 7.5 * value)))
            out[i, j] = code


@njit(cache=True)
def replay(
    profiles: np.ndarray,
    steps: np.ndarray,
    is_first: np.ndarray,
    cell_m: float,
    size: int,
    azimuth: np.ndarray,
    max_depth_m: float,
    reach_m: float,
    cells_m: np.ndarray,
    near: np.ndarray,
    far: np.ndarray,
) -> None:
    """The near and the far view of recorded frames.

    `steps[i]` is the motion from frame i to i + 1; `is_first[i]` is true where a trajectory
    begins; `cells_m` the sides of the two views' cells.
    """
    grid = np.zeros((2, size, size), np.float32)
    pose = np.zeros(3)
    for i in range(profiles.shape[0]):
        if is_first[i]:
            grid[:] = 0.0
            pose[:] = 0.0
        else:
            move(grid, cell_m, pose, steps[i - 1])
        insert(grid, cell_m, pose, profiles[i], azimuth, max_depth_m, reach_m)
        view(grid, cell_m, pose, cells_m[0], near[i])
        view(grid, cell_m, pose, cells_m[1], far[i])
