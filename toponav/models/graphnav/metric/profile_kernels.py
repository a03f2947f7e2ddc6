"""Depth image to obstacle profile, compiled."""

import numpy as np
from numba import njit

__all__ = ["FARTHEST", "NOTHING", "profile"]

NOTHING = 255
"""A bin in which nothing was seen up to the greatest depth."""
FARTHEST = 254
"""The byte that stands for the greatest depth."""


@njit(cache=True, fastmath=True)
def profile(
    depth_m: np.ndarray,
    ray_up: np.ndarray,
    ray_left: np.ndarray,
    bin_of_column: np.ndarray,
    camera_height_m: float,
    bands_m: np.ndarray,
    max_depth_m: float,
    out: np.ndarray,
) -> None:
    """Fill `out` [bands, bins] with the least depth of each band of heights in each bin.

    `ray_up` [rows] and `ray_left` [cols] are a pixel's offsets at depth one; `bands_m`
    [bands, 2] the lowest and highest height of each band; `bin_of_column` [cols, 2] the first
    and last bin that a column fills.
    """
    rows, cols = depth_m.shape
    bands = bands_m.shape[0]
    least = np.full((bands, out.shape[1]), np.float32(1e9))
    for row in range(rows):
        up = ray_up[row]
        for col in range(cols):
            depth = depth_m[row, col]
            if depth <= 0.0 or depth >= max_depth_m:
                continue
            height = camera_height_m + up * depth
            for band in range(bands):
                if bands_m[band, 0] < height < bands_m[band, 1]:
                    for bin_ in range(bin_of_column[col, 0], bin_of_column[col, 1] + 1):
                        if depth < least[band, bin_]:
                            least[band, bin_] = depth
    for band in range(bands):
        for bin_ in range(out.shape[1]):
            if least[band, bin_] >= max_depth_m:
                out[band, bin_] = NOTHING
            else:
                out[band, bin_] = np.uint8(least[band, bin_] / max_depth_m * FARTHEST + 0.5)
