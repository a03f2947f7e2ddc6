"""The expert's local planner: follows a path with the robot's dynamics and never hits a wall."""

import math

import numpy as np
from jaxtyping import Float, Float32

from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.geometry import Pose2
from toponav.data import tracking_kernels as kernels

__all__ = ["PathFollower"]

_LOST_M = 0.6
_LAG_S = 0.15
_REACH_M = 0.5


class PathFollower:
    """Steers at a point ahead on the path, slowly where it bends or is tight.

    Positions are relative to the corner of the clearance grid.

    Args:
        clearance_m: Distance to the nearest obstacle per cell.
        resolution_m: Side of a cell.
        limits: What the robot can do.
    """

    def __init__(
        self,
        clearance_m: Float32[np.ndarray, "rows cols"],
        resolution_m: float,
        limits: VelocityLimits,
    ) -> None:
        self._clearance_m = clearance_m
        self._resolution_m = resolution_m
        self._limits = np.array(
            [limits.linear_m_s, limits.angular_rad_s, limits.linear_m_s2, limits.angular_rad_s2]
        )
        self.points: Float[np.ndarray, "points 2"] = np.zeros((1, 2))
        self._speed: Float[np.ndarray, " points"] = np.zeros(1)
        self._index = 0

    def set_path(self, points: Float[np.ndarray, "points 2"]) -> None:
        """Follow this path from its beginning."""
        self.points = points
        self._speed = kernels.speed_profile(
            points, self._clearance_m, self._resolution_m, self._limits[0], 0.8, 0.2, 0.3, 0.4
        )
        self._index = 0

    def is_lost(self, pose: Pose2) -> bool:
        """Whether the pose is too far from the path to steer back to it."""
        low, high = max(0, self._index - 10), min(len(self.points), self._index + 30)
        _, away = kernels.nearest_on_path(self.points, pose.x_m, pose.y_m, low, high)
        return bool(away > _LOST_M)

    def follow(self, pose: Pose2, velocity: Velocity) -> Velocity:
        """The command at this pose and measured velocity."""
        linear, angular, self._index, _ = kernels.follow(
            self.points, self._speed, self._index, pose.x_m, pose.y_m, pose.yaw_rad,
            velocity.linear_m_s, velocity.angular_rad_s, self._clearance_m, self._resolution_m,
            self._limits, _LAG_S, _REACH_M, 2.0, math.radians(50.0), 0.19,
        )  # fmt: skip
        return Velocity(linear, angular)
