"""What a robot publishes, on the topics of a preset: state, floor plan, pictures.

Call `toponav.ros.runtime.start` before importing this.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from toponav.core.camera import PinholeCamera
from toponav.data.image_messages import CameraModel
from toponav.ros import _fill, _qos
from toponav.ros.conversions import (
    OPTICAL_ROTATION,
    Quaternion,
    quaternion_of_yaw,
    time_parts,
)
from toponav.ros.presets import RobotPreset
from toponav.sim.simulation import SimState, Simulation

__all__ = ["FRAMES", "RobotTopics"]


class _Frames(NamedTuple):
    """Names of coordinate frames (REP-105), and of the camera's (REP-103)."""

    map: str = "map"
    odom: str = "odom"
    footprint: str = "base_footprint"
    base: str = "base_link"
    camera: str = "camera_link"
    optical: str = "camera_depth_optical_frame"


FRAMES: Final = _Frames()
_ORIGIN: Final = (0.0, 0.0, 0.0)


class RobotTopics:
    """Publishers of everything that a robot tells, and the messages that they reuse.

    Args:
        node: Whose they are.
        simulation: The robot; its camera and modalities say which pictures there are.
        robot: Names of the topics.
    """

    def __init__(self, node: Node, simulation: Simulation, robot: RobotPreset) -> None:
        make = node.create_publisher
        self._clock = make(Clock, "/clock", _qos.RELIABLE)
        self._odom = make(Odometry, robot.odom, _qos.RELIABLE)
        self._tf = make(TFMessage, "/tf", _qos.RELIABLE)
        self._tf_static = make(TFMessage, "/tf_static", _qos.LATCHED)
        self._map = make(OccupancyGrid, "/map", _qos.LATCHED)
        self._bumper = make(Bool, "/bumper", _qos.RELIABLE)
        self._depth = make(Image, robot.depth, _qos.SENSOR)
        self._info = make(CameraInfo, robot.camera_info, _qos.SENSOR)
        self._odometry = _fill.odometry_message(FRAMES.odom, FRAMES.footprint)
        self._info_message: CameraInfo | None = None
        if isinstance(simulation.camera, PinholeCamera):
            model = CameraModel.of(simulation.camera)
            self._info_message = _fill.camera_info_message(model, FRAMES.optical)
        self._rgb = self._rgb_info = None
        if "rgb" in simulation.modalities:
            self._rgb = make(Image, robot.rgb, _qos.SENSOR)
            info = robot.rgb.rsplit("/", 1)[0] + "/camera_info"
            self._rgb_info = make(CameraInfo, info, _qos.SENSOR)
        self._publish_latched(simulation)

    def show_state(self, state: SimState, time_ns: int) -> None:
        """Clock, odometry, transform and bumper."""
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = time_parts(time_ns)
        self._clock.publish(clock)
        _fill.fill_odometry(self._odometry, state.pose, state.velocity, time_ns)
        self._odom.publish(self._odometry)
        x, y, yaw = state.pose
        turned = quaternion_of_yaw(yaw)
        moved = _fill.transform_message(
            FRAMES.odom, FRAMES.footprint, (x, y, 0.0), turned, time_ns
        )
        self._tf.publish(TFMessage(transforms=[moved]))
        self._bumper.publish(Bool(data=state.contact is not None))

    def show_depth(self, depth_m: Float32[np.ndarray, "height width"], time_ns: int) -> None:
        """A depth image with its calibration."""
        self._depth.publish(_fill.image_message(depth_m, "32FC1", FRAMES.optical, time_ns))
        self._publish_info(self._info, time_ns)

    def show_rgb(self, rgb: UInt8[np.ndarray, "height width 3"], time_ns: int) -> None:
        """A colour image with its calibration."""
        assert self._rgb is not None
        self._rgb.publish(_fill.image_message(rgb, "rgb8", FRAMES.optical, time_ns))
        self._publish_info(self._rgb_info, time_ns)

    def _publish_info(self, publisher: Any, time_ns: int) -> None:
        if self._info_message is not None:
            _fill.set_stamp(self._info_message.header, time_ns)
            publisher.publish(self._info_message)

    def _publish_latched(self, simulation: Simulation) -> None:
        camera = simulation.camera
        height_m = camera.mount_height_m if camera is not None else 0.0
        pitch_rad = camera.pitch_rad if isinstance(camera, PinholeCamera) else 0.0
        tilt = Quaternion(0.0, math.sin(pitch_rad / 2), 0.0, math.cos(pitch_rad / 2))
        make = _fill.transform_message
        self._tf_static.publish(
            TFMessage(
                transforms=[
                    make(FRAMES.map, FRAMES.odom, _ORIGIN),
                    make(FRAMES.footprint, FRAMES.base, _ORIGIN),
                    make(FRAMES.base, FRAMES.camera, (0.0, 0.0, height_m), tilt),
                    make(FRAMES.camera, FRAMES.optical, _ORIGIN, OPTICAL_ROTATION),
                ]
            )
        )
        self._map.publish(_fill.map_message(simulation.scene, FRAMES.map))
