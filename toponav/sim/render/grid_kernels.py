"""Compiled traversal of a height grid, for extruded plans. Exact: no sampling along rays.

A ray is `camera + depth * direction`, where `direction` has a unit component along the optical
axis, so the ray parameter is the Z-depth. Cells are visited in the order in which the ray
crosses them (Amanatides and Woo 1987).
"""

import math

import numpy as np
from numba import njit

__all__ = ["render_level", "render_tilted"]


@njit(cache=True, nogil=True, error_model="numpy")
def render_level(  # type: ignore[no-untyped-def]
    heights_m, resolution_m, column, row, yaw_rad, camera_m, ceiling_m, left, up, open_m, far_m
):
    """Z-depth of a level camera: one walk over the plan per image column.

    All pixels of a column look in the same compass direction, so one horizontal walk finds what
    each of them hits: an obstacle hides every ray below its top edge, and what is not hidden
    goes on. The grid's edge is a wall. `open_m` is the depth of floor or ceiling per image row,
    clipped at `far_m`; `column` and `row` are the camera's position in cells, fractional.
    """
    height, width = up.size, left.size
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    image = np.empty((height, width), np.float32)
    wall_m = np.empty(width, np.float32)
    # Pixels on obstacles that do not reach the ceiling, written over the rest at the end.
    low_pixel = np.empty(height * width, np.int32)
    low_m = np.empty(height * width, np.float32)
    n_low = 0
    for u in range(width):
        dx = (cosine - sine * left[u]) / resolution_m
        dy = (sine + cosine * left[u]) / resolution_m
        wall_m[u], first, n_low = _walk_column(
            heights_m, column, row, dx, dy, camera_m, ceiling_m, up, far_m, low_pixel, low_m, n_low
        )
        for k in range(first, n_low):
            low_pixel[k] = low_pixel[k] * width + u
    for k in range(height):
        depth = open_m[k]
        for u in range(width):
            image[k, u] = depth if depth <= wall_m[u] else wall_m[u]
    flat = image.reshape(-1)
    for k in range(n_low):
        flat[low_pixel[k]] = low_m[k]
    return image


@njit(cache=True, nogil=True, error_model="numpy")
def _walk_column(  # type: ignore[no-untyped-def]
    heights_m, column, row, dx, dy, camera_m, ceiling_m, up, far_m, low_row, low_m, n_low
):
    """Depth of the wall that ends one image column, where its list of low pixels began, and ends.

    Rows of the image and depths of what does not reach the ceiling are appended to the list.
    """
    n_rows, n_columns = heights_m.shape
    i, j = math.floor(row), math.floor(column)
    per_x, per_y = abs(1.0 / dx), abs(1.0 / dy)
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    next_x = ((j + 1 - column) if dx > 0 else (column - j)) * per_x if dx != 0 else math.inf
    next_y = ((i + 1 - row) if dy > 0 else (row - i)) * per_y if dy != 0 else math.inf
    first = n_low
    enter_m = 0.0
    v = up.size  # rows v and below are settled
    while 0 <= i < n_rows and 0 <= j < n_columns:
        leave_m = min(next_x, next_y)
        top_m = heights_m[i, j]
        if top_m >= ceiling_m:
            break
        if top_m > 0.0:
            rise_m = top_m - camera_m
            while v > 0 and up[v - 1] * enter_m <= -camera_m:
                v -= 1  # the floor in front of it
            while v > 0 and up[v - 1] * enter_m <= rise_m:
                v -= 1  # its side
                low_row[n_low], low_m[n_low] = v, enter_m
                n_low += 1
            while rise_m < 0.0 and v > 0 and up[v - 1] * leave_m <= rise_m:
                v -= 1  # its top
                low_row[n_low], low_m[n_low] = v, min(rise_m / up[v], far_m)
                n_low += 1
        if leave_m >= far_m or v == 0:
            return far_m, first, n_low
        enter_m = leave_m
        if next_x < next_y:
            j += step_x
            next_x += per_x
        else:
            i += step_y
            next_y += per_y
    return enter_m, first, n_low


@njit(cache=True, nogil=True, error_model="numpy")
def render_tilted(  # type: ignore[no-untyped-def]
    heights_m, resolution_m, column, row, yaw_rad, camera_m, ceiling_m, rays, far_m
):
    """Z-depth of a pitched camera: one walk over the plan per pixel."""
    height, width = rays.shape[0], rays.shape[1]
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    image = np.empty((height, width), np.float32)
    for k in range(height):
        for u in range(width):
            forward, left, up = rays[k, u, 0], rays[k, u, 1], rays[k, u, 2]
            dx = (cosine * forward - sine * left) / resolution_m
            dy = (sine * forward + cosine * left) / resolution_m
            image[k, u] = _walk(heights_m, column, row, dx, dy, up, camera_m, ceiling_m, far_m)
    return image


@njit(cache=True, nogil=True, error_model="numpy")
def _walk(  # type: ignore[no-untyped-def]
    heights_m, column, row, dx, dy, up, camera_m, ceiling_m, far_m
):
    """Depth at which one ray meets floor, ceiling or an obstacle, at most `far_m`."""
    n_rows, n_columns = heights_m.shape
    i, j = math.floor(row), math.floor(column)
    per_x, per_y = abs(1.0 / dx), abs(1.0 / dy)
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    next_x = ((j + 1 - column) if dx > 0 else (column - j)) * per_x if dx != 0 else math.inf
    next_y = ((i + 1 - row) if dy > 0 else (row - i)) * per_y if dy != 0 else math.inf
    open_m = far_m
    if up < 0:
        open_m = min(far_m, -camera_m / up)
    elif up > 0:
        open_m = min(far_m, (ceiling_m - camera_m) / up)
    enter_m = 0.0
    while enter_m < open_m:
        leave_m = min(next_x, next_y)
        top_m = heights_m[i, j]
        if top_m > 0.0:
            if up * enter_m <= top_m - camera_m:
                return enter_m
            if up * leave_m <= top_m - camera_m:
                return min((top_m - camera_m) / up, far_m)
        enter_m = leave_m
        if next_x < next_y:
            j += step_x
            next_x += per_x
            outside = j < 0 or j >= n_columns
        else:
            i += step_y
            next_y += per_y
            outside = i < 0 or i >= n_rows
        if outside:
            return min(open_m, enter_m)
    return open_m
