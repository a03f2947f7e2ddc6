"""The image agent's senses: newest panorama, odometry and bumper, and the robot's clock.

Call `toponav.ros.runtime.start` before importing this.
"""

import threading
import time
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image
from std_msgs.msg import Bool

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.ros import _fill, _qos
from toponav.ros.camera_node import SpinningNode
from toponav.ros.conversions import Quaternion, yaw_of_quaternion
from toponav.ros.pictures import depth_of, rgb_of
from toponav.ros.presets import RobotPreset

__all__ = ["PanoramaNode", "Sensed"]

_STILL_M_S: Final = 0.02
_STILL_RAD_S: Final = 0.02
_WAIT_S: Final = 0.1


class Sensed(NamedTuple):
    """What the robot sees, standing still.

    Attributes:
        rgb: The panorama.
        depth_m: Its depth, where wanted.
        odometry: Where the wheels say that the robot is.
    """

    rgb: UInt8[np.ndarray, "height width 3"]
    depth_m: Float32[np.ndarray, "height width"] | None
    odometry: Pose2


class PanoramaNode(SpinningNode):
    """Keeps what was sensed last.

    Args:
        robot: Names of the topics; `rgb` and `depth` are those of the panorama.
        wants_depth: Whether depth is listened to.
        use_sim_time: Whether time comes from /clock.
        name: Name of the node.
    """

    def __init__(
        self,
        robot: RobotPreset,
        wants_depth: bool,
        use_sim_time: bool,
        name: str = "toponav_image_agent_senses",
    ) -> None:
        super().__init__(name, use_sim_time)
        self._wants_depth = wants_depth
        self._news = threading.Condition()
        self._rgb: tuple[np.ndarray, float] | None = None
        self._depth: tuple[np.ndarray, float] | None = None
        self._odometry: Pose2 | None = None
        self._still_since_s: float | None = None
        self._heard_s = 0.0
        self._complaint = ""
        self.touching = False
        """Whether the bumper is pressed."""
        self.create_subscription(Image, robot.rgb, self._on_rgb, _qos.SENSOR)
        if wants_depth:
            self.create_subscription(Image, robot.depth, self._on_depth, _qos.SENSOR)
        self.create_subscription(Odometry, robot.odom, self._on_odometry, _qos.SENSOR)
        self.create_subscription(Bool, "/bumper", self._on_bumper, _qos.SENSOR)

    def look(
        self, after_s: float, patience_s: float, is_over: Callable[[], bool]
    ) -> Sensed | None:
        """What a robot that stands still sees, or None where it is not shown in time.

        Args:
            after_s: Nothing older than this.
            patience_s: How long to wait, by the clock of people.
            is_over: Ends the wait.
        """
        end_s = time.monotonic() + patience_s
        with self._news:
            while time.monotonic() < end_s and not is_over():
                found = self._sensed(after_s)
                if found is not None:
                    return found
                self._news.wait(_WAIT_S)
        return None

    def next_odometry(self) -> tuple[Pose2 | None, float]:
        """The next odometry, or the last where none comes at once, and how old it is."""
        with self._news:
            self._news.wait(_WAIT_S)
            return self._odometry, time.monotonic() - self._heard_s

    def _sensed(self, after_s: float) -> Sensed | None:
        if self._rgb is None or self._odometry is None or self._still_since_s is None:
            return None
        since_s = max(after_s, self._still_since_s)
        depth = self._depth
        if self._rgb[1] < since_s:
            return None
        if self._wants_depth and (depth is None or depth[1] < since_s):
            return None
        return Sensed(self._rgb[0], None if depth is None else depth[0], self._odometry)

    def _on_rgb(self, message: Image) -> None:
        try:
            seen = (rgb_of(message), _fill.stamp_ns(message.header) / 1e9)
        except InputError as error:
            self._complain(str(error))
            return
        with self._news:
            self._rgb = seen
            self._news.notify_all()

    def _on_depth(self, message: Image) -> None:
        try:
            seen = (depth_of(message), _fill.stamp_ns(message.header) / 1e9)
        except InputError as error:
            self._complain(str(error))
            return
        with self._news:
            self._depth = seen
            self._news.notify_all()

    def _on_odometry(self, message: Odometry) -> None:
        place, turned = message.pose.pose.position, message.pose.pose.orientation
        yaw = yaw_of_quaternion(Quaternion(turned.x, turned.y, turned.z, turned.w))
        twist = message.twist.twist
        is_still = abs(twist.linear.x) < _STILL_M_S and abs(twist.angular.z) < _STILL_RAD_S
        with self._news:
            self._odometry, self._heard_s = Pose2(place.x, place.y, yaw), time.monotonic()
            if not is_still:
                self._still_since_s = None
            elif self._still_since_s is None:
                self._still_since_s = _fill.stamp_ns(message.header) / 1e9
            self._news.notify_all()

    def _on_bumper(self, message: Bool) -> None:
        self.touching = message.data

    def _complain(self, what: str) -> None:
        """Log a fault of the robot's messages, once."""
        if what != self._complaint:
            self._complaint = what
            self.get_logger().error(what)
