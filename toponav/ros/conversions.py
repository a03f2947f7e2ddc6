"""Between ROS messages' fields and toponav's types; nothing here needs ROS."""

import array
import math
from typing import Final, NamedTuple

import numpy as np
from jaxtyping import Float64, Int8

from toponav.worlds.scene import Scene

__all__ = [
    "OPTICAL_ROTATION",
    "Quaternion",
    "nanoseconds",
    "occupancy_of",
    "odometry_covariance",
    "pixels_of",
    "quaternion_of_yaw",
    "time_parts",
    "yaw_of_quaternion",
]

_NS: Final = 10**9


class Quaternion(NamedTuple):
    """A rotation as ROS orders it."""

    x: float
    y: float
    z: float
    w: float


OPTICAL_ROTATION: Final = Quaternion(-0.5, 0.5, -0.5, 0.5)
"""From a camera's frame (x forward) to its optical frame (z forward, x right), REP-103."""


def nanoseconds(seconds: int, nanosec: int) -> int:
    """A stamp's two fields as one number."""
    return seconds * _NS + nanosec


def time_parts(time_ns: int) -> tuple[int, int]:
    """The two fields of a stamp."""
    return divmod(time_ns, _NS)


def quaternion_of_yaw(yaw_rad: float) -> Quaternion:
    """The rotation about z."""
    return Quaternion(0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))


def yaw_of_quaternion(rotation: Quaternion) -> float:
    """The heading of a rotation."""
    x, y, z, w = rotation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def pixels_of(image: np.ndarray) -> "array.array[int]":
    """An image's bytes as rclpy takes them fast: a list would cost 70 times as much."""
    data = array.array("B")
    data.frombytes(np.ascontiguousarray(image).tobytes())
    return data


def occupancy_of(scene: Scene) -> Int8[np.ndarray, " cells"]:
    """A scene's cells as nav_msgs/OccupancyGrid orders them: 0 free, 100 occupied."""
    cells: np.ndarray = np.where(scene.occupied, 100, 0).astype(np.int8).ravel()
    return cells


def odometry_covariance(position_m: float, yaw_rad: float) -> Float64[np.ndarray, " 36"]:
    """The covariance of a planar pose or velocity; what cannot move is nearly certain."""
    diagonal = [position_m**2, position_m**2, 1e-9, 1e-9, 1e-9, yaw_rad**2]
    return np.diag(diagonal).ravel()
