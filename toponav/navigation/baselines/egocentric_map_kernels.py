"""A grid around the start from ranges, and its cut around the robot, compiled."""

import math

import numpy as np
from numba import njit

__all__ = ["add_cylinder", "cut_around"]

FREE, OBSTACLE = 1, 2


@njit(cache=True)
def add_cylinder(grid, cell_m, pose, range_m, yaw, lift, camera_m, low_m, high_m, most_m):  # type: ignore[no-untyped-def]
    """Marks what a depth panorama on a cylinder shows.

    Floor up to the nearest obstacle of each column becomes free, the obstacle's cell an obstacle.

    Args:
        grid: uint8[rows, cols] to change; 0 unknown, 1 free, 2 obstacle. The start lies in its
            middle.
        cell_m: Side of a cell.
        pose: float64[3] of the camera.
        range_m: float32[rows, cols], horizontal distances.
        yaw: float64[cols], to the left of forward.
        lift: float64[rows], height at one metre.
        camera_m: Height of the camera.
        low_m: Obstacles begin here.
        high_m: What is higher does not stop the robot.
        most_m: Nothing farther counts.
    """
    rows, cols = grid.shape
    x, y = pose[0] / cell_m + cols / 2, pose[1] / cell_m + rows / 2
    for c in range(range_m.shape[1]):
        nearest = most_m + 1.0
        for r in range(range_m.shape[0]):
            height = camera_m + lift[r] * range_m[r, c]
            if low_m < height < high_m and range_m[r, c] < nearest:
                nearest = range_m[r, c]
        heading = pose[2] + yaw[c]
        dx, dy = math.cos(heading), math.sin(heading)
        end = min(nearest - 0.5 * cell_m, most_m) / cell_m
        at = 0.0
        while at < end:
            col, row = math.floor(x + at * dx), math.floor(y + at * dy)
            if row < 0 or col < 0 or row >= rows or col >= cols:
                break
            grid[row, col] = FREE
            at += 0.7
        if nearest <= most_m:
            at = nearest / cell_m
            col, row = math.floor(x + at * dx), math.floor(y + at * dy)
            if 0 <= row < rows and 0 <= col < cols:
                grid[row, col] = OBSTACLE


@njit(cache=True)
def cut_around(grid, cell_m, pose, cut_cell_m, out):  # type: ignore[no-untyped-def]
    """Writes the obstacles and the free floor around the robot, its heading to the right.

    A cell of the cut is what any of nine points in it says.

    Args:
        grid: As `add_cylinder` fills it.
        cell_m: Side of its cells.
        pose: float64[3] of the robot.
        cut_cell_m: Side of the cut's cells.
        out: uint8[2, cells, cells]: 255 where there is an obstacle; where there is free floor.
    """
    rows, cols = grid.shape
    cells = out.shape[1]
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    for row in range(cells):
        for col in range(cells):
            is_free, is_obstacle = False, False
            for k in range(9):
                ahead = (col + (k % 3 * 2 + 1) / 6 - cells / 2) * cut_cell_m
                left = (row + (k // 3 * 2 + 1) / 6 - cells / 2) * cut_cell_m
                x = (pose[0] + ahead * cosine - left * sine) / cell_m + cols / 2
                y = (pose[1] + ahead * sine + left * cosine) / cell_m + rows / 2
                if 0 <= x < cols and 0 <= y < rows:
                    value = grid[int(y), int(x)]
                    is_free |= value == FREE
                    is_obstacle |= value == OBSTACLE
            out[0, row, col] = np.uint8(255 if is_obstacle else 0)
            out[1, row, col] = np.uint8(255 if is_free else 0)
