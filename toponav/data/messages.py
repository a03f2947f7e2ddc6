"""ROS 2 messages to and from bytes, fast: templates from `rosbags`, numbers packed in place.

Every message of one kind has the same length and differs in a few numbers, so each is
serialized once by `rosbags` and then only its numbers are overwritten. Fields are addressed
from the end of the message, where no string of variable length comes in between.
"""

import functools
import math
import struct
from typing import Any, Final

import numpy as np
from jaxtyping import UInt8, UInt16
from rosbags.typesys import Stores, get_typestore

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Velocity
from toponav.core.geometry import Pose2

__all__ = [
    "ImageCodec",
    "OdometryCodec",
    "TwistCodec",
    "camera_info",
    "definition_of",
    "string_of",
    "text_message",
]

WORLD_FRAME: Final = "map"
ROBOT_FRAME: Final = "base_footprint"
CAMERA_FRAME: Final = "camera_depth_optical_frame"

_STAMP = struct.Struct("<iI")
_STAMP_AT = 4
_POSE = struct.Struct("<7d")
_TWIST = struct.Struct("<6d")
_COVARIANCE_BYTES = 36 * 8
_ENCODINGS: Final = {
    "16UC1": (("16UC1", "mono16"), "<u2", 1),
    "rgb8": (("rgb8",), "u1", 3),
    "mono8": (("mono8", "8UC1"), "u1", 1),
}
"""Of each encoding that is written: what readers take for it, numbers and how many a pixel."""


@functools.cache
def _store() -> Any:
    return get_typestore(Stores.ROS2_JAZZY)


def definition_of(type_name: str) -> bytes:
    """The message definition that travels inside a bag, in ROS 2's concatenated form."""
    text, _ = _store().generate_msgdef(type_name, ros_version=2)
    return str(text).encode()


def _serialized(message: Any) -> bytes:
    return bytes(_store().serialize_cdr(message, message.__msgtype__))


def _header(frame_id: str, time_ns: int = 0) -> Any:
    types = _store().types
    stamp = types["builtin_interfaces/msg/Time"](*divmod(time_ns, 10**9))
    return types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame_id)


def _vector3() -> Any:
    return _store().types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)


def _twist() -> Any:
    return _store().types["geometry_msgs/msg/Twist"](linear=_vector3(), angular=_vector3())


class ImageCodec:
    """Packs images as sensor_msgs/msg/Image.

    Args:
        width: Columns.
        height: Rows.
        encoding: `16UC1`, depth in millimetres; `rgb8`, colour; or `mono8`, classes.
    """

    TYPE: Final = "sensor_msgs/msg/Image"

    def __init__(self, width: int, height: int, encoding: str = "16UC1") -> None:
        _, self._numbers, channels = _ENCODINGS[encoding]
        self._shape = (height, width, 3) if channels == 3 else (height, width)
        step = width * channels * np.dtype(self._numbers).itemsize
        self._bytes = step * height
        message = _store().types[self.TYPE](
            header=_header(CAMERA_FRAME),
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=0,
            step=step,
            data=np.zeros(self._bytes, np.uint8),
        )
        self._prefix = bytearray(_serialized(message)[: -self._bytes])

    def pack(
        self,
        image: UInt16[np.ndarray, "rows cols"]
        | UInt8[np.ndarray, "rows cols"]
        | UInt8[np.ndarray, "rows cols 3"],
        time_ns: int,
    ) -> bytes:
        """The message for one image."""
        assert image.shape == self._shape, (image.shape, self._shape)
        _STAMP.pack_into(self._prefix, _STAMP_AT, *divmod(time_ns, 10**9))
        return b"".join((self._prefix, np.ascontiguousarray(image, self._numbers).data))

    @staticmethod
    def unpack(
        message: memoryview | bytes, encoding: str = "16UC1"
    ) -> (
        UInt16[np.ndarray, "rows cols"]
        | UInt8[np.ndarray, "rows cols"]
        | UInt8[np.ndarray, "rows cols 3"]
    ):
        """The image of one message, without a copy.

        Raises:
            ValueError: It has another encoding, or less in it than it says.
        """
        (length,) = struct.unpack_from("<I", message, 12)
        at = 16 + (length + 3) // 4 * 4
        height, width, length = struct.unpack_from("<3I", message, at)
        found = bytes(message[at + 12 : at + 11 + length])
        names, numbers, channels = _ENCODINGS[encoding]
        count = height * width * channels
        size = count * np.dtype(numbers).itemsize
        if found not in (name.encode() for name in names) or size > len(message):
            raise ValueError(f"expected a {encoding} image, got {found!r}, {width}x{height}")
        pixels = np.frombuffer(message, numbers, count, len(message) - size)
        return pixels.reshape((height, width, 3) if channels == 3 else (height, width))


class OdometryCodec:
    """Packs a planar pose and a measured velocity as nav_msgs/msg/Odometry."""

    TYPE: Final = "nav_msgs/msg/Odometry"
    _POSE_FROM_END = 2 * _COVARIANCE_BYTES + _TWIST.size + _POSE.size
    _TWIST_FROM_END = _COVARIANCE_BYTES + _TWIST.size

    def __init__(self) -> None:
        types = _store().types
        pose = types["geometry_msgs/msg/Pose"](
            position=types["geometry_msgs/msg/Point"](0.0, 0.0, 0.0),
            orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        )
        message = types[self.TYPE](
            header=_header(WORLD_FRAME),
            child_frame_id=ROBOT_FRAME,
            pose=types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
            twist=types["geometry_msgs/msg/TwistWithCovariance"](_twist(), np.zeros(36)),
        )
        self._message = bytearray(_serialized(message))

    def pack(self, pose: Pose2, velocity: Velocity, time_ns: int) -> bytes:
        """The message for one pose in the world and one velocity in the robot's frame."""
        message, size = self._message, len(self._message)
        sine, cosine = math.sin(pose.yaw_rad / 2), math.cos(pose.yaw_rad / 2)
        _STAMP.pack_into(message, _STAMP_AT, *divmod(time_ns, 10**9))
        _POSE.pack_into(
            message, size - self._POSE_FROM_END, pose.x_m, pose.y_m, 0.0, 0.0, 0.0, sine, cosine
        )
        _TWIST.pack_into(
            message,
            size - self._TWIST_FROM_END,
            *(velocity.linear_m_s, 0.0, 0.0, 0.0, 0.0, velocity.angular_rad_s),
        )
        return bytes(message)

    @classmethod
    def unpack(cls, message: memoryview | bytes) -> tuple[float, float, float, float, float]:
        """x, y, yaw, linear and angular velocity of one message."""
        size = len(message)
        x, y, _, qx, qy, qz, qw = _POSE.unpack_from(message, size - cls._POSE_FROM_END)
        linear, _, _, _, _, angular = _TWIST.unpack_from(message, size - cls._TWIST_FROM_END)
        yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        return x, y, yaw, linear, angular


class TwistCodec:
    """Packs a velocity command as geometry_msgs/msg/TwistStamped."""

    TYPE: Final = "geometry_msgs/msg/TwistStamped"

    def __init__(self) -> None:
        message = _store().types[self.TYPE](header=_header(ROBOT_FRAME), twist=_twist())
        self._message = bytearray(_serialized(message))

    def pack(self, command: Velocity, time_ns: int) -> bytes:
        """The message for one command."""
        message = self._message
        _STAMP.pack_into(message, _STAMP_AT, *divmod(time_ns, 10**9))
        _TWIST.pack_into(
            message,
            len(message) - _TWIST.size,
            *(command.linear_m_s, 0.0, 0.0, 0.0, 0.0, command.angular_rad_s),
        )
        return bytes(message)

    @staticmethod
    def unpack(message: memoryview | bytes) -> tuple[float, float]:
        """Linear and angular velocity of one message."""
        linear, _, _, _, _, angular = _TWIST.unpack_from(message, len(message) - _TWIST.size)
        return linear, angular


def text_message(text: str) -> bytes:
    """A std_msgs/msg/String."""
    return _serialized(_store().types["std_msgs/msg/String"](text))


def string_of(message: memoryview | bytes) -> str:
    """The text of a std_msgs/msg/String."""
    (length,) = struct.unpack_from("<I", message, 4)
    return bytes(message[8 : 8 + length - 1]).decode()


def camera_info(camera: PinholeCamera) -> bytes:
    """A sensor_msgs/msg/CameraInfo: with it, other tools turn depth into points."""
    types = _store().types
    focal, cx, cy = camera.focal_px, camera.width / 2 - 0.5, camera.height / 2 - 0.5
    roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    message = types["sensor_msgs/msg/CameraInfo"](
        header=_header(CAMERA_FRAME),
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([focal, 0, cx, 0, focal, cy, 0, 0, 1], np.float64),
        r=np.eye(3).ravel(),
        p=np.array([focal, 0, cx, 0, 0, focal, cy, 0, 0, 0, 1, 0], np.float64),
        binning_x=0,
        binning_y=0,
        roi=roi,
    )
    return _serialized(message)
