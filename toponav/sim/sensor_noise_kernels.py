"""Compiled depth noise, row by row."""

import math

import numpy as np
from numba import njit

__all__ = ["mark_shadows", "measure"]


@njit(cache=True, nogil=True)
def mark_shadows(depth_m, shift_px, shadow):  # type: ignore[no-untyped-def]
    """Marks pixels that the projector (or second camera) does not see past something nearer.

    A pixel in column c at depth z lies in column `c - shift / z` of a projector to the right of
    the camera. Going from right to left, what lies no further left than something before it is
    hidden behind that.

    Args:
        depth_m: float32 [rows, columns].
        shift_px: Baseline times focal length, in metres times pixels.
        shadow: bool [rows, columns], written.
    """
    rows, columns = depth_m.shape
    for row in range(rows):
        nearest = np.float32(np.inf)
        for column in range(columns - 1, -1, -1):
            there = np.float32(column) - shift_px / depth_m[row, column]
            hidden = there >= nearest
            shadow[row, column] = hidden
            if not hidden:
                nearest = there


@njit(cache=True, nogil=True)
def measure(  # type: ignore[no-untyped-def]
    depth_m, rays, shadow, dark, model, normal, chance, noisy_m
):
    """Writes what the sensor reports, 0 where it reports nothing.

    Args:
        depth_m: float32 [rows, columns], the truth.
        rays: float32 [rows, columns, 3], scaled as depth is.
        shadow: bool [rows, columns].
        dark: float32 [rows, columns], brightness 0 to 1, or empty.
        model: The numbers of `DepthSensor`, in the order of `DepthSensor.numbers`.
        normal: float32 [2, rows, columns], standard normal numbers.
        chance: float32 [3, rows, columns], uniform numbers from 0 to 1.
        noisy_m: float32 [rows, columns], written.
    """
    near, far, disparity_m, step_px, match_px, floor_m, square, tilt, lateral, flying, grazing = (
        model[:11]
    )
    dropout, dark_below = model[11], model[12]
    rows, columns = depth_m.shape
    for row in range(rows):
        for column in range(columns):
            noisy_m[row, column] = 0.0
            if shadow[row, column]:
                continue
            # Where an edge seems to be wanders: the pixel beside is seen instead.
            aside = round(lateral * normal[1, row, column])
            beside = min(max(column + aside, 0), columns - 1)
            z = depth_m[row, beside]
            if not near <= z <= far:
                continue
            cosine = _facing(depth_m, rays, row, column)
            if cosine < grazing * (0.75 + 0.5 * chance[0, row, column]):
                continue
            if dark.size > 0 and dark[row, column] * far < dark_below * z * chance[1, row, column]:
                continue
            if chance[2, row, column] < dropout * (z / far) ** 2:
                continue
            other = depth_m[row, min(column + 1, columns - 1)]
            if flying > 0 and abs(other - z) > 0.05 * z and chance[1, row, column] < flying:
                z += (other - z) * chance[0, row, column]
            angle = math.acos(min(cosine, 1.0))
            slope = angle / max(math.pi / 2 - angle, 0.05)
            spread = floor_m + square * z * z + tilt / math.sqrt(z) * slope * slope
            if match_px > 0:
                spread += match_px * z * z / disparity_m
            z += spread * normal[0, row, column]
            if z <= near:
                continue
            if step_px > 0:
                steps = round(disparity_m / z / step_px)
                if steps < 1:
                    continue
                z = disparity_m / (steps * step_px)
            if z <= far:
                noisy_m[row, column] = z


@njit(cache=True, nogil=True)
def _facing(depth_m, rays, row, column):  # type: ignore[no-untyped-def]
    """Cosine between the ray and the surface, from the pixels on either side."""
    rows, columns = depth_m.shape
    left, right = max(column - 1, 0), min(column + 1, columns - 1)
    above, below = max(row - 1, 0), min(row + 1, rows - 1)
    # The flatter of the two neighbours' planes, so that an edge is not taken for a slope.
    if right > column and left < column:
        step_left = abs(depth_m[row, left] - depth_m[row, column])
        if step_left < abs(depth_m[row, right] - depth_m[row, column]):
            right = column
        else:
            left = column
    if below > row and above < row:
        step_up = abs(depth_m[above, column] - depth_m[row, column])
        if step_up < abs(depth_m[below, column] - depth_m[row, column]):
            below = row
        else:
            above = row
    if left == right or above == below:
        return 1.0
    ax = rays[row, right, 0] * depth_m[row, right] - rays[row, left, 0] * depth_m[row, left]
    ay = rays[row, right, 1] * depth_m[row, right] - rays[row, left, 1] * depth_m[row, left]
    az = rays[row, right, 2] * depth_m[row, right] - rays[row, left, 2] * depth_m[row, left]
    bx = rays[below, column, 0] * depth_m[below, column]
    by = rays[below, column, 1] * depth_m[below, column]
    bz = rays[below, column, 2] * depth_m[below, column]
    bx -= rays[above, column, 0] * depth_m[above, column]
    by -= rays[above, column, 1] * depth_m[above, column]
    bz -= rays[above, column, 2] * depth_m[above, column]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    rx, ry, rz = rays[row, column, 0], rays[row, column, 1], rays[row, column, 2]
    length = math.sqrt((nx * nx + ny * ny + nz * nz) * (rx * rx + ry * ry + rz * rz))
    return abs(nx * rx + ny * ry + nz * rz) / length if length > 0 else 1.0
