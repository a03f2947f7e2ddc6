"""The agent's eyes: the newest depth frame in the trained geometry, and the robot's clock.

A node of its own, with a thread of its own: clock and camera wake it sixty times a second, and
rclpy's executor for several threads would spend more on that than the agent does on driving.
Call `toponav.ros.runtime.start` before importing this.
"""

import threading
from typing import Any, Final, NamedTuple

import numpy as np
import rclpy
from jaxtyping import Float32
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.data.image_messages import CameraModel, Reprojector, depth_of_image
from toponav.ros import _fill, _qos
from toponav.ros.presets import RobotPreset

__all__ = ["CameraNode", "Frame", "SpinningNode", "time_source"]

_NS: Final = 10**9
_SIGNALS_S: Final = 0.2


class Frame(NamedTuple):
    """A depth image as the agent's own camera would have taken it, and when it was taken."""

    depth_m: Float32[np.ndarray, "height width"]
    stamp_ns: int


def time_source(use_sim_time: bool) -> list[Parameter]:
    """The parameter that says whether a node's time comes from /clock."""
    return [Parameter("use_sim_time", Parameter.Type.BOOL, use_sim_time)]


class SpinningNode(Node):  # type: ignore[misc]
    """A node that a thread of its own serves.

    Args:
        name: Name of the node.
        use_sim_time: Whether time comes from /clock.
    """

    def __init__(self, name: str, use_sim_time: bool) -> None:
        super().__init__(
            name, parameter_overrides=time_source(use_sim_time), start_parameter_services=False
        )
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._spin, name=name, daemon=True)

    def begin(self) -> None:
        """Serve from now on."""
        self._thread.start()

    def close(self) -> None:
        """Serve no longer."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(5.0)

    def now_ns(self) -> int:
        """ROS time: the system's clock, or the simulator's."""
        nanoseconds: int = self.get_clock().now().nanoseconds
        return nanoseconds

    def now_s(self) -> float:
        """ROS time in seconds."""
        return self.now_ns() / _NS

    def _spin(self) -> None:
        executor = SingleThreadedExecutor()
        executor.add_node(self)
        try:
            while rclpy.ok() and not self._closing.is_set():
                executor.spin_once(timeout_sec=_SIGNALS_S)
        except ExternalShutdownException:
            pass
        finally:
            executor.remove_node(self)
            executor.shutdown(timeout_sec=1.0)


class CameraNode(SpinningNode):
    """Keeps the newest frame, brought to the camera that the agent was trained with.

    Args:
        robot: Names of the topics.
        camera: The camera that the agent was trained with, at this robot's height.
        use_sim_time: Whether time comes from /clock.
    """

    def __init__(self, robot: RobotPreset, camera: PinholeCamera, use_sim_time: bool) -> None:
        super().__init__("toponav_agent_camera", use_sim_time)
        self._camera = camera
        self._fresh = threading.Condition()
        self._frame: Frame | None = None
        self._reprojector: Reprojector | None = None
        self._complaint = ""
        self.active = False
        """Whether anybody wants frames; others are not even converted."""
        self.create_subscription(Image, robot.depth, self._on_depth, _qos.SENSOR)
        self.create_subscription(CameraInfo, robot.camera_info, self._on_info, _qos.SENSOR)

    def forget(self) -> None:
        """The frames up to now are those of another drive."""
        with self._fresh:
            self._frame = None

    def next_frame(self, after_ns: int, patience_s: float) -> Frame | None:
        """The newest frame taken after a time, once there is one."""
        with self._fresh:
            if self._frame is None or self._frame.stamp_ns <= after_ns:
                self._fresh.wait(patience_s)
            frame = self._frame
        return frame if frame is not None and frame.stamp_ns > after_ns else None

    def _on_info(self, message: CameraInfo) -> None:
        k = message.k
        model = CameraModel(message.width, message.height, k[0], k[4], k[2], k[5])
        known = self._reprojector
        if known is not None and known.source == model:
            return
        try:
            self._reprojector = Reprojector(model, self._camera)
        except InputError as error:
            self._complain(str(error))
            return
        share = self._reprojector.seen_share
        if share < 0.95:
            self.get_logger().warning(
                f"this camera covers {share:.0%} of what the networks were trained to see; "
                "expect worse driving, and see docs/ros.md for what helps"
            )

    def _on_depth(self, message: Any) -> None:
        if not self.active or self._reprojector is None:
            return
        try:
            depth_m = depth_of_image(
                message.encoding,
                message.height,
                message.width,
                message.step,
                bool(message.is_bigendian),
                message.data,
            )
            frame = Frame(self._reprojector(depth_m), _fill.stamp_ns(message.header))
        except InputError as error:
            self._complain(str(error))
            return
        with self._fresh:
            self._frame = frame
            self._fresh.notify_all()

    def _complain(self, what: str) -> None:
        """Log a fault of the robot's messages, once."""
        if what != self._complaint:
            self._complaint = what
            self.get_logger().error(what)
