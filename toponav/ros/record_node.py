"""Records a drive as the bags of `toponav collect`. Call `runtime.start` before importing this."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.image_messages import (
    CameraModel,
    Reprojector,
    depth_of_image,
    pose_in_map,
    without_holes,
)
from toponav.data.recording import TrajectoryMetadata
from toponav.data.storage import TrajectoryWriter
from toponav.maps.task import NavigationTask
from toponav.ros import _fill, _qos
from toponav.ros.conversions import Quaternion, yaw_of_quaternion
from toponav.ros.presets import RobotPreset

__all__ = ["RecordNode"]

_PERIOD_NS = 200_000_000


class RecordNode(Node):  # type: ignore[misc]
    """Five times a second: a depth frame, where the robot is, and what it was told.

    Args:
        task: Map and plan that is driven. The robot stands at the plan's first node when the
            first frame comes, looking along its first edge; odometry tells the rest.
        camera: The camera that frames are brought to.
        robot: Names of the topics.
        out: The bag to write.
        building: Name of the building.
        use_sim_time: Whether time comes from /clock.
    """

    def __init__(
        self,
        task: NavigationTask,
        camera: PinholeCamera,
        robot: RobotPreset,
        out: Path,
        building: str,
        use_sim_time: bool,
    ) -> None:
        time_source = Parameter("use_sim_time", Parameter.Type.BOOL, use_sim_time)
        super().__init__("toponav_record", parameter_overrides=[time_source])
        self._camera = camera
        first = task.map.node(task.plan.nodes[0])
        yaw_rad = task.map.edge(task.plan.edges[0]).yaw_rad
        self._start = Pose2(first.x_m, first.y_m, yaw_rad)
        metadata = TrajectoryMetadata(
            index=0,
            dataset_seed=0,
            building=building,
            scene_hash="",
            map_hash="",
            plan=task.plan,
            camera=camera,
            source="ros",
            noise_scale=0.0,
        )
        self._writer = TrajectoryWriter(out, metadata)
        self._reprojector: Reprojector | None = None
        self._odometry: tuple[Pose2, Velocity] | None = None
        self._first_pose: Pose2 | None = None
        self._command = Velocity(0.0, 0.0)
        self._pending: tuple[np.ndarray, Pose2, Velocity] | None = None
        self._last_ns = -_PERIOD_NS
        self.frames = 0
        kind = TwistStamped if robot.stamped else Twist
        self.create_subscription(Image, robot.depth, self._on_depth, _qos.SENSOR_KEPT)
        self.create_subscription(CameraInfo, robot.camera_info, self._on_info, _qos.SENSOR)
        self.create_subscription(Odometry, robot.odom, self._on_odometry, _qos.SENSOR)
        self.create_subscription(kind, robot.cmd_vel, self._on_command, _qos.RELIABLE)

    def run(self, seconds: float | None) -> None:
        """Record until Ctrl-C, or for so long."""
        end_s = None if seconds is None else time.monotonic() + seconds
        while rclpy.ok() and (end_s is None or time.monotonic() < end_s):
            rclpy.spin_once(self, timeout_sec=0.1)

    def finish(self, outcome: str) -> int:
        """Write the bag; returns its frames.

        Raises:
            InputError: Nothing was recorded.
        """
        self._write_pending()
        if self.frames == 0:
            raise InputError(
                "no frame came with camera_info and odometry",
                where="toponav ros record",
                remedy="check the topic names with `ros2 topic list`, and --robot",
            )
        self._writer.finish(outcome)
        return self.frames

    def _on_info(self, message: CameraInfo) -> None:
        k = message.k
        model = CameraModel(message.width, message.height, k[0], k[4], k[2], k[5])
        if self._reprojector is None or self._reprojector.source != model:
            self._reprojector = Reprojector(model, self._camera)

    def _on_odometry(self, message: Odometry) -> None:
        place, turned = message.pose.pose.position, message.pose.pose.orientation
        yaw = yaw_of_quaternion(Quaternion(turned.x, turned.y, turned.z, turned.w))
        pose = Pose2(place.x, place.y, yaw)
        self._odometry = (pose, _fill.velocity_of(message.twist.twist))

    def _on_command(self, message: Any) -> None:
        twist = message.twist if isinstance(message, TwistStamped) else message
        self._command = _fill.velocity_of(twist)

    def _on_depth(self, message: Image) -> None:
        stamp_ns = _fill.stamp_ns(message.header)
        is_due = stamp_ns - self._last_ns >= 0.9 * _PERIOD_NS
        if not is_due or self._reprojector is None or self._odometry is None:
            return
        self._write_pending()
        depth_m = depth_of_image(
            message.encoding,
            message.height,
            message.width,
            message.step,
            bool(message.is_bigendian),
            message.data,
        )
        seen = without_holes(self._reprojector(depth_m), self._camera.max_depth_m)
        pose, velocity = self._odometry
        if self._first_pose is None:
            self._first_pose = pose
        self._last_ns = stamp_ns
        self._pending = (seen, pose_in_map(pose, self._first_pose, self._start), velocity)

    def _write_pending(self) -> None:
        """A frame is written with the command that came after it: the answer to it."""
        if self._pending is None:
            return
        depth_m, pose, velocity = self._pending
        self._writer.append(depth_m, pose, velocity, self._command, self._command)
        self._pending = None
        self.frames += 1
