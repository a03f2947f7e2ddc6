"""Names of topics and limits of robots that people have."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from toponav.core.episode import VelocityLimits
from toponav.core.errors import InputError, did_you_mean

__all__ = ["PRESETS", "RobotPreset", "robot_preset"]


@dataclass(frozen=True)
class RobotPreset:
    """How a robot speaks ROS 2, and what it can do.

    Attributes:
        name: Name of the preset.
        depth: Depth images, 32FC1 in metres or 16UC1 in millimetres.
        camera_info: Calibration of the depth camera.
        rgb: Colour images.
        odom: Odometry.
        cmd_vel: Where velocity commands go.
        stamped: Whether they are TwistStamped; else Twist.
        camera_height_m: Height of the depth camera above the floor.
        limits: Speeds and accelerations that the agent never asks more of.
    """

    name: str
    depth: str = "/camera/depth/image_raw"
    camera_info: str = "/camera/depth/camera_info"
    rgb: str = "/camera/color/image_raw"
    odom: str = "/odom"
    cmd_vel: str = "/cmd_vel"
    stamped: bool = True
    camera_height_m: float = 0.6
    limits: VelocityLimits = field(default_factory=VelocityLimits)

    def topics(self) -> Mapping[Literal["depth", "camera_info", "rgb", "odom", "cmd_vel"], str]:
        """Every topic by what it is."""
        return {
            "depth": self.depth,
            "camera_info": self.camera_info,
            "rgb": self.rgb,
            "odom": self.odom,
            "cmd_vel": self.cmd_vel,
        }


PRESETS: Mapping[str, RobotPreset] = {
    preset.name: preset
    for preset in (
        RobotPreset("toponav"),
        RobotPreset(
            "turtlebot4",
            depth="/oakd/stereo/image_raw",
            camera_info="/oakd/stereo/camera_info",
            rgb="/oakd/rgb/preview/image_raw",
            camera_height_m=0.24,
            limits=VelocityLimits(linear_m_s=0.3, angular_rad_s=1.5),
        ),
        RobotPreset(
            "turtlebot3",
            depth="/camera/camera/depth/image_rect_raw",
            camera_info="/camera/camera/depth/camera_info",
            rgb="/camera/camera/color/image_raw",
            camera_height_m=0.12,
            limits=VelocityLimits(linear_m_s=0.22, angular_rad_s=1.5),
        ),
        RobotPreset(
            "locobot",
            depth="/locobot/camera/depth/image_rect_raw",
            camera_info="/locobot/camera/depth/camera_info",
            rgb="/locobot/camera/color/image_raw",
            odom="/locobot/mobile_base/odom",
            cmd_vel="/locobot/mobile_base/cmd_vel",
            stamped=False,
            camera_height_m=0.6,
            limits=VelocityLimits(linear_m_s=0.5, angular_rad_s=math.pi / 2),
        ),
    )
}
"""Robots by name; `toponav` is the simulator's. Drivers change: `ros2 topic list` has the last
word, and every name can be given by itself."""


def robot_preset(name: str) -> RobotPreset:
    """The preset of that name.

    Raises:
        InputError: There is none; offers the nearest.
    """
    if name not in PRESETS:
        raise InputError(
            f"no robot preset is called '{name}'",
            where="--robot",
            remedy=did_you_mean(name, PRESETS),
        )
    return PRESETS[name]
