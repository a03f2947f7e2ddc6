"""Planar poses and angles: metres and radians, x forward, y left, yaw counter-clockwise."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

__all__ = ["Pose2", "angle_difference", "wrap_angle"]


class Pose2(NamedTuple):
    """Position and heading in a right-handed plane.

    Attributes:
        x_m: Position along x, in metres.
        y_m: Position along y, in metres.
        yaw_rad: Heading, counter-clockwise from x, in radians.
    """

    x_m: float
    y_m: float
    yaw_rad: float

    def compose(self, local: "Pose2") -> "Pose2":
        """The pose `local`, given in this pose's frame, in this pose's parent frame."""
        cosine, sine = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose2(
            self.x_m + cosine * local.x_m - sine * local.y_m,
            self.y_m + sine * local.x_m + cosine * local.y_m,
            wrap_angle(self.yaw_rad + local.yaw_rad),
        )

    def relative_to(self, origin: "Pose2") -> "Pose2":
        """This pose seen from `origin`: `origin.compose(result)` is this pose again."""
        cosine, sine = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
        dx, dy = self.x_m - origin.x_m, self.y_m - origin.y_m
        return Pose2(
            cosine * dx + sine * dy,
            -sine * dx + cosine * dy,
            wrap_angle(self.yaw_rad - origin.yaw_rad),
        )

    def distance_to(self, other: "Pose2") -> float:
        """Straight distance between the two positions, in metres."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)

    @property
    def xy(self) -> Float[np.ndarray, "2"]:
        """The position as an array, in metres."""
        return np.array([self.x_m, self.y_m])


def wrap_angle(angle_rad: float) -> float:
    """The same direction in [-pi, pi).

    Example:
        >>> round(wrap_angle(3 * math.pi / 2), 4)
        -1.5708
    """
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi


def angle_difference(to_rad: float, from_rad: float) -> float:
    """The signed turn from one heading to another, in [-pi, pi)."""
    return wrap_angle(to_rad - from_rad)
