"""What the `toponav ros` commands share: ROS 2 itself, robots' topics, the trained camera."""

import dataclasses
import sys
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.core.camera import PinholeCamera
    from toponav.ros.presets import RobotPreset

__all__ = ["Flag", "Name", "Robot", "preset_of", "start_ros", "trained_camera", "with_panorama"]

Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]
Name = Annotated[str, tyro.conf.Positional]
Robot = Literal["toponav", "turtlebot4", "turtlebot3", "locobot"]


def start_ros() -> tuple[str, ...]:
    """Find ROS 2, build messages where they are missing; this process may start again."""
    from toponav.ros.environment import prepare
    from toponav.ros.interfaces import load_interfaces

    def tell(package: str) -> None:
        print(f"building the messages of {package}, once (about ten seconds)...", file=sys.stderr)

    return load_interfaces(prepare(), tell)


def preset_of(
    robot: str,
    depth: str | None = None,
    info: str | None = None,
    cmd_vel: str | None = None,
    camera_height_m: float | None = None,
    max_linear_m_s: float | None = None,
    max_angular_rad_s: float | None = None,
) -> "RobotPreset":
    """The preset, with other topics, another height or lower limits where they are given."""
    from toponav.ros.presets import robot_preset

    preset = robot_preset(robot)
    limits = preset.limits
    for name, wanted in (("linear_m_s", max_linear_m_s), ("angular_rad_s", max_angular_rad_s)):
        if wanted is not None:
            if not 0 < wanted <= getattr(limits, name):
                raise InputError(
                    f"at most {getattr(limits, name)} for {robot}, and more than 0; got {wanted}",
                    where=f"--max-{name.replace('_', '-')}",
                    remedy="leave it out, or choose a robot that is faster",
                )
            limits = dataclasses.replace(limits, **{name: wanted})
    changes: dict[str, Any] = {"depth": depth, "camera_info": info, "cmd_vel": cmd_vel}
    changes["camera_height_m"] = camera_height_m
    given = {name: value for name, value in changes.items() if value is not None}
    return dataclasses.replace(preset, limits=limits, **given)


def with_panorama(preset: "RobotPreset") -> "RobotPreset":
    """The preset with the panorama's topics for colour and depth."""
    return dataclasses.replace(preset, rgb="/panorama/image_raw", depth="/panorama/depth")


def trained_camera(preset: "RobotPreset") -> "PinholeCamera":
    """GraphNav's camera at this robot's height: what the networks were trained with."""
    from toponav.core.camera import PinholeCamera

    return PinholeCamera(mount_height_m=preset.camera_height_m)
