"""Steps of 0.25 m and 10 degrees on a robot that takes velocities, by odometry. Without ROS."""

import math
from dataclasses import dataclass
from typing import Final

from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.geometry import Pose2, angle_difference
from toponav.core.imagenav import FORWARD_M, TURN_RAD, Action

__all__ = ["ActionStep", "StepConfig"]

_STOP: Final = Velocity(0.0, 0.0)


@dataclass(frozen=True)
class StepConfig:
    """How a step is driven."""

    linear_gain_1_s: float = 2.5
    """Speed for each metre that is left."""
    angular_gain_1_s: float = 3.0
    """Turn rate for each radian that is left."""
    slowest_m_s: float = 0.06
    slowest_rad_s: float = 0.15
    near_m: float = 0.015
    near_rad: float = math.radians(1.0)
    timeout_s: float = 4.0
    """A step that takes longer was blocked."""


class ActionStep:
    """Drives one action, and says when it is done and whether it was blocked.

    Args:
        action: What to do; not `STOP`.
        start: Odometry at its beginning.
        now_s: The clock then.
        limits: Speeds that are never exceeded.
        config: How.
    """

    def __init__(
        self,
        action: Action,
        start: Pose2,
        now_s: float,
        limits: VelocityLimits,
        config: StepConfig | None = None,
    ) -> None:
        assert action is not Action.STOP
        self._action, self._start, self._began_s = action, start, now_s
        self._limits, self._config = limits, config or StepConfig()
        self.blocked = False
        """Whether the step ended without having moved far enough."""

    def command(self, odometry: Pose2, now_s: float, touching: bool) -> Velocity | None:
        """The velocity now, or None once the step is over.

        Args:
            odometry: Where the wheels say that the robot is.
            now_s: The clock.
            touching: Whether the bumper is pressed.
        """
        config = self._config
        if now_s - self._began_s > config.timeout_s or (
            touching and self._action is Action.FORWARD
        ):
            self.blocked = True
            return None
        moved = odometry.relative_to(self._start)
        turned_rad = angle_difference(odometry.yaw_rad, self._start.yaw_rad)
        if self._action is Action.FORWARD:
            left_m = FORWARD_M - moved.x_m
            if left_m < config.near_m:
                return None
            speed = max(config.linear_gain_1_s * left_m, config.slowest_m_s)
            return self._limits.clip(Velocity(speed, -config.angular_gain_1_s * turned_rad))
        sign = 1.0 if self._action is Action.LEFT else -1.0
        left_rad = TURN_RAD - sign * turned_rad
        if left_rad < config.near_rad:
            return None
        rate = max(config.angular_gain_1_s * left_rad, config.slowest_rad_s)
        return self._limits.clip(Velocity(0.0, sign * rate))
