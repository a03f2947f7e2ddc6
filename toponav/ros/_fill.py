"""Fields of ROS messages filled from toponav's types; imports message packages, not rclpy."""

import numpy as np
from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import CameraInfo, Image

from toponav.core.episode import Velocity
from toponav.core.geometry import Pose2
from toponav.data.image_messages import CameraModel
from toponav.ros.conversions import (
    Quaternion,
    nanoseconds,
    occupancy_of,
    odometry_covariance,
    pixels_of,
    quaternion_of_yaw,
    time_parts,
)
from toponav.worlds.scene import Scene

__all__ = [
    "camera_info_message",
    "fill_odometry",
    "image_message",
    "map_message",
    "odometry_message",
    "set_stamp",
    "stamp_ns",
    "transform_message",
    "twist_message",
    "velocity_of",
]


def set_stamp(header, time_ns: int) -> None:  # type: ignore[no-untyped-def]
    """Write a header's stamp."""
    header.stamp.sec, header.stamp.nanosec = time_parts(time_ns)


def stamp_ns(header) -> int:  # type: ignore[no-untyped-def]
    """A header's stamp."""
    return nanoseconds(header.stamp.sec, header.stamp.nanosec)


def image_message(pixels: np.ndarray, encoding: str, frame: str, time_ns: int) -> Image:
    """An image."""
    message = Image()
    set_stamp(message.header, time_ns)
    message.header.frame_id = frame
    message.height, message.width = pixels.shape[:2]
    message.encoding = encoding
    message.step = pixels.strides[0]
    message.data = pixels_of(pixels)
    return message


def camera_info_message(model: CameraModel, frame: str) -> CameraInfo:
    """The calibration of a rectified camera."""
    message = CameraInfo(width=model.width, height=model.height, distortion_model="plumb_bob")
    message.header.frame_id = frame
    message.d = [0.0] * 5
    message.k = [model.fx, 0.0, model.cx, 0.0, model.fy, model.cy, 0.0, 0.0, 1.0]
    message.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    message.p = [model.fx, 0.0, model.cx, 0.0, 0.0, model.fy, model.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return message


def odometry_message(frame: str, child: str) -> Odometry:
    """Odometry with its covariances, to be filled with poses by `fill_odometry`."""
    message = Odometry(child_frame_id=child)
    message.header.frame_id = frame
    message.pose.covariance = odometry_covariance(0.01, 0.01)
    message.twist.covariance = odometry_covariance(0.02, 0.02)
    return message


def fill_odometry(message: Odometry, pose: Pose2, velocity: Velocity, time_ns: int) -> None:
    """Write where the robot is and how it moves."""
    set_stamp(message.header, time_ns)
    place = message.pose.pose
    place.position.x, place.position.y = pose.x_m, pose.y_m
    _set_rotation(place.orientation, quaternion_of_yaw(pose.yaw_rad))
    message.twist.twist.linear.x = velocity.linear_m_s
    message.twist.twist.angular.z = velocity.angular_rad_s


def transform_message(
    parent: str,
    child: str,
    at_m: tuple[float, float, float],
    rotation: Quaternion = Quaternion(0.0, 0.0, 0.0, 1.0),  # noqa: B008 - immutable
    time_ns: int = 0,
) -> TransformStamped:
    """Where one frame is in another."""
    message = TransformStamped(child_frame_id=child)
    set_stamp(message.header, time_ns)
    message.header.frame_id = parent
    place = message.transform.translation
    place.x, place.y, place.z = (float(each) for each in at_m)
    _set_rotation(message.transform.rotation, rotation)
    return message


def map_message(scene: Scene, frame: str) -> OccupancyGrid:
    """The floor plan."""
    grid, message = scene.grid, OccupancyGrid()
    message.header.frame_id = frame
    message.info.resolution = float(grid.resolution_m)
    message.info.width, message.info.height = grid.shape[1], grid.shape[0]
    left, _, bottom, _ = grid.extent_m
    message.info.origin.position.x, message.info.origin.position.y = float(left), float(bottom)
    message.data = occupancy_of(scene).tolist()
    return message


def twist_message(command: Velocity, stamped: bool, time_ns: int) -> Twist | TwistStamped:
    """A velocity command."""
    message = TwistStamped() if stamped else Twist()
    twist = message.twist if stamped else message
    if stamped:
        set_stamp(message.header, time_ns)
        message.header.frame_id = "base_footprint"
    twist.linear.x = float(command.linear_m_s)
    twist.angular.z = float(command.angular_rad_s)
    return message


def velocity_of(twist: Twist) -> Velocity:
    """What a differential-drive robot does of a twist."""
    return Velocity(twist.linear.x, twist.angular.z)


def _set_rotation(message, rotation: Quaternion) -> None:  # type: ignore[no-untyped-def]
    message.x, message.y, message.z, message.w = rotation
