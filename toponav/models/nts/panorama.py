"""What the networks see of a panorama: equal angles a column, from forward to the left.

A stitched panorama has equal angles neither along its rows nor along its columns: turning the
robot warps it. On a cylinder, turning only shifts the columns.
"""

import math
from functools import lru_cache

import numpy as np
from jaxtyping import Float32, Int64, UInt8

from toponav.core.camera import CYLINDER_LIFT
from toponav.models.nts.presets import NTSConfig

__all__ = [
    "CAMERA_HEIGHT_M",
    "DEPTH_SCALE_M",
    "MAX_RANGE_M",
    "OBSTACLE_HEIGHTS_M",
    "column_yaw_rad",
    "horizontal_scale",
    "network_input",
    "obstacle_profile",
    "sight_profile",
]

CAMERA_HEIGHT_M = 0.6
"""Height of the panoramic camera."""
MAX_RANGE_M = 10.0
"""What is farther reads as this."""
OBSTACLE_HEIGHTS_M = (0.06, 0.52)
"""What stands between these heights stops the robot."""
DEPTH_SCALE_M = 4.0
"""Ranges reach the network as exp(-range / this)."""

_SAMPLES = 2


def column_yaw_rad(width: int) -> Float32[np.ndarray, " width"]:
    """The direction that each column of a stitched panorama looks in, to the left of forward."""
    quarter = width // 4
    across = np.arctan((quarter / 2 - np.arange(quarter) - 0.5) / (quarter / 2))
    around = np.concatenate([across + start for start in (np.pi, np.pi / 2, 0.0, -np.pi / 2)])
    yaw = np.roll(around, -(quarter // 2))
    return ((yaw + np.pi) % (2 * np.pi) - np.pi).astype(np.float32)


def horizontal_scale(width: int) -> Float32[np.ndarray, " width"]:
    """Horizontal distance of what is seen in each column, for a Z-depth of one."""
    quarter = width // 4
    across = (quarter / 2 - np.arange(quarter) - 0.5) / (quarter / 2)
    return np.roll(np.tile(np.hypot(1.0, across), 4), -(quarter // 2)).astype(np.float32)


@lru_cache(maxsize=8)
def _samples(rows: int, cols: int, height: int, width: int) -> Int64[np.ndarray, "rows cols"]:
    """Which pixel of a flattened stitched panorama each pixel of a finer cylinder shows."""
    rows, fine = rows * _SAMPLES, cols * _SAMPLES
    step = 2 * math.pi / cols
    # The middle of every four columns, which become one direction, is a multiple of their angle.
    yaw = -2.0 * step + (np.arange(fine) + 0.5) * step / _SAMPLES
    yaw = (yaw + math.pi) % (2 * math.pi) - math.pi
    side = np.floor(yaw / (math.pi / 2) + 0.5)
    within = yaw - side * (math.pi / 2)
    quarter = width // 4
    across = width / 2 - side * quarter - np.tan(within) * quarter / 2
    column = np.floor(across).astype(np.int64) % width
    lift = CYLINDER_LIFT * (1.0 - (np.arange(rows) + 0.5) * 2 / rows)
    row = height / 2 - lift[:, None] / np.cos(within)[None, :] * quarter / 2
    row = np.clip(np.floor(row).astype(np.int64), 0, height - 1)
    flat: np.ndarray = row * width + column[None, :]
    return flat


def network_input(
    rgb: UInt8[np.ndarray, "height width 3"],
    depth_m: Float32[np.ndarray, "height width"] | None,
    config: NTSConfig,
) -> UInt8[np.ndarray, "channels rows cols"]:
    """The panorama as the network sees it; depth is asked for where `config.depth` says so."""
    height, width = rgb.shape[:2]
    where = _samples(config.rows, config.cols, height, width)
    planes = np.empty((config.channels, *where.shape), np.float32)
    planes[:3] = np.moveaxis(rgb.reshape(-1, 3)[where], -1, 0)
    if config.depth:
        assert depth_m is not None
        range_m = depth_m * horizontal_scale(width)
        planes[3] = 255.0 * np.exp(-range_m.reshape(-1)[where] / DEPTH_SCALE_M)
    shape = (config.channels, config.rows, _SAMPLES, config.cols, _SAMPLES)
    small: np.ndarray = np.rint(planes.reshape(shape).mean(axis=(2, 4)))
    return small.astype(np.uint8)


def obstacle_profile(
    depth_m: Float32[np.ndarray, "height width"], directions: int
) -> Float32[np.ndarray, " directions"]:
    """Horizontal distance to what would stop the robot, per direction from forward to the left."""
    height, width = depth_m.shape
    across = width // 8
    lift = (height / 2 - np.arange(height) - 0.5) / across
    above_m = CAMERA_HEIGHT_M + lift[:, None] * depth_m
    low_m, high_m = OBSTACLE_HEIGHTS_M
    stops = (above_m > low_m) & (above_m < high_m) & (depth_m > 0)
    range_m = np.where(stops, depth_m, MAX_RANGE_M).min(axis=0) * horizontal_scale(width)
    return _nearest_per_direction(np.minimum(range_m, MAX_RANGE_M), directions)


def sight_profile(
    depth_m: Float32[np.ndarray, "height width"], directions: int
) -> Float32[np.ndarray, " directions"]:
    """Horizontal distance to what ends the camera's level sight, per direction."""
    height, width = depth_m.shape
    level = depth_m[height // 2 - 2 : height // 2 + 2]
    range_m = np.median(np.where(level > 0, level, MAX_RANGE_M), axis=0)
    range_m = np.minimum(range_m * horizontal_scale(width), MAX_RANGE_M)
    number = _direction_of_column(width, directions)
    total = np.bincount(number, range_m, directions)
    return (total / np.bincount(number, minlength=directions)).astype(np.float32)


def _direction_of_column(width: int, directions: int) -> Int64[np.ndarray, " width"]:
    number = np.floor(column_yaw_rad(width) / (2 * np.pi / directions) + 0.5)
    return np.asarray(number.astype(np.int64) % directions)


def _nearest_per_direction(
    range_m: Float32[np.ndarray, " width"], directions: int
) -> Float32[np.ndarray, " directions"]:
    nearest = np.full(directions, MAX_RANGE_M, np.float32)
    np.minimum.at(nearest, _direction_of_column(len(range_m), directions), range_m)
    return nearest
