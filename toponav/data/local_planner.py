"""The expert's local planner: follows a path with the robot's dynamics and never hits a wall."""

import math

import numpy as np
from jaxtyping import Float, Float32

from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.geometry import Pose2
from toponav.data import tracking_kernels as kernels

__all__ = ["PathFollower"]

_LOST_M = 0.4
_PERIOD_S = 0.2
_SETTINGS = kernels.FollowSettings(
    lag_s=0.15,
    reach_m=0.5,
    gain=2.0,
    pivot_angle_rad=math.radians(50.0),
    left_angle_rad=math.radians(90.0),
    turn_rad_s=1.2,
    hard_m=0.19,
    least_m=0.18,
)


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
        self._ground = kernels.Ground(clearance_m, resolution_m)
        self._limits = np.array(
            [limits.linear_m_s, limits.angular_rad_s, limits.linear_m_s2, limits.angular_rad_s2]
        )
        self.path = kernels.PathArrays(np.zeros((1, 2)), np.zeros(1), 0.0)
        self._index = 0

    @property
    def points_m(self) -> Float[np.ndarray, "points 2"]:
        """The path that it follows."""
        return self.path.points

    def set_path(self, points_m: Float[np.ndarray, "points 2"], final_yaw_rad: float) -> None:
        """Follow this path from its beginning, and face `final_yaw_rad` at its end."""
        speed = kernels.speed_profile(points_m, *self._ground, self._limits[0], 0.8, 0.2, 0.3, 0.4)
        self.path = kernels.PathArrays(points_m, speed, final_yaw_rad)
        self._index = 0

    def is_lost(self, pose: Pose2) -> bool:
        """Whether the pose is too far from the path to steer back to it."""
        points = self.path.points
        low, high = max(0, self._index - 10), min(len(points), self._index + 30)
        _, away = kernels.nearest_on_path(points, pose.x_m, pose.y_m, low, high)
        return bool(away > _LOST_M)

    def follow(self, pose: Pose2, velocity: Velocity) -> Velocity:
        """The command at this pose and measured velocity."""
        linear, angular, self._index, _ = kernels.follow(
            self.path,
            self._index,
            (float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)),
            (float(velocity.linear_m_s), float(velocity.angular_rad_s)),
            self._ground,
            self._limits,
            _SETTINGS,
        )
        return Velocity(linear, angular)

    def rehearse(self, pose: Pose2) -> Float[np.ndarray, "steps 3"]:
        """The poses (x, y, yaw) of a drive along the whole path from rest, one a control step."""
        steps = 100 + 3 * int(0.05 * len(self.path.points) / (self._limits[0] * _PERIOD_S))
        poses: np.ndarray = kernels.rehearse(
            self.path,
            (float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)),
            self._ground,
            self._limits,
            _SETTINGS,
            steps,
            _PERIOD_S,
        )
        return poses
