"""Depth and colour of ROS image messages, and one camera's view as another would have it.

Works on plain fields, so that a live node and a bag are read by the same code.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2

__all__ = [
    "CameraModel",
    "Reprojector",
    "color_of_image",
    "depth_of_image",
    "pose_in_map",
    "without_holes",
]

_MOST_PIXELS: Final = 64 << 20


class CameraModel(NamedTuple):
    """What sensor_msgs/CameraInfo says of a rectified camera, in pixels."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @staticmethod
    def of(camera: PinholeCamera) -> "CameraModel":
        """The model of one of toponav's cameras; pixel centres are whole numbers, as in ROS."""
        focal = camera.focal_px
        cx, cy = camera.width / 2 - 0.5, camera.height / 2 - 0.5
        return CameraModel(camera.width, camera.height, focal, focal, cx, cy)

    @property
    def hfov_rad(self) -> float:
        """Horizontal field of view."""
        left, right = self.cx + 0.5, self.width - 0.5 - self.cx
        return math.atan(left / self.fx) + math.atan(right / self.fx)


def depth_of_image(
    encoding: str,
    height: int,
    width: int,
    step: int,
    is_bigendian: bool,
    data: bytes | UInt8[np.ndarray, " bytes"],
) -> Float32[np.ndarray, "height width"]:
    """The Z-depth in metres of an image message; holes stay 0 or NaN as they came.

    Raises:
        InputError: The message is not a depth image, or its sizes do not fit its data.
    """
    kinds = {"32FC1": ("f4", 1.0), "16UC1": ("u2", 1e-3), "mono16": ("u2", 1e-3)}
    if encoding not in kinds:
        raise _bad_image(f"depth is 32FC1 or 16UC1, got {encoding[:20]!r}")
    kind, scale = kinds[encoding]
    rows = _rows(data, height, width * np.dtype(kind).itemsize, step)
    pixels = np.ascontiguousarray(rows).view(f"{'>' if is_bigendian else '<'}{kind}")
    if scale == 1.0:
        return pixels.astype(np.float32)
    metres: np.ndarray = pixels.astype(np.float32) * np.float32(scale)
    return metres


def color_of_image(
    encoding: str, height: int, width: int, step: int, data: bytes | UInt8[np.ndarray, " bytes"]
) -> UInt8[np.ndarray, "height width 3"]:
    """The red, green and blue of an image message.

    Raises:
        InputError: The message is not a colour image of 8 bits, or its sizes do not fit.
    """
    channels = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
    if encoding not in channels:
        raise _bad_image(f"colour is rgb8 or bgr8, got {encoding[:20]!r}")
    count = channels[encoding]
    pixels = _rows(data, height, width * count, step).reshape(height, width, count)[..., :3]
    return np.ascontiguousarray(pixels[..., ::-1] if encoding.startswith("b") else pixels)


def _rows(
    data: bytes | UInt8[np.ndarray, " bytes"], height: int, used: int, step: int
) -> UInt8[np.ndarray, "rows used"]:
    if not (height > 0 and 0 < used <= step and height * step <= min(len(data), _MOST_PIXELS)):
        raise _bad_image(f"{height} rows of {step} bytes do not fit {len(data)} bytes")
    return np.frombuffer(data, np.uint8, height * step).reshape(height, step)[:, :used]


def _bad_image(rule: str) -> InputError:
    return InputError(
        rule,
        where="sensor_msgs/Image",
        remedy="remap the topic to the depth camera's raw or rectified image, not compressed",
    )


def without_holes(
    depth_m: Float32[np.ndarray, "height width"], max_depth_m: float
) -> Float32[np.ndarray, "height width"]:
    """Depth as agents take it (REP-118): NaN and too near become 0, out of range the maximum."""
    out = np.where(np.isnan(depth_m) | (depth_m < 0), np.float32(0), depth_m)
    np.minimum(out, np.float32(max_depth_m), out=out)
    return out.astype(np.float32, copy=False)


class Reprojector:
    """A robot's depth images as another camera in the same place would have taken them.

    Pixels are gathered by nearest neighbour through an index that is computed once; what the
    robot's camera does not see becomes 0, a hole. A camera that already fits costs nothing.

    Args:
        source: The robot's rectified camera. It looks ahead along the horizon.
        target: The camera that the agent was trained with.
    """

    def __init__(self, source: CameraModel, target: PinholeCamera) -> None:
        if not (source.fx > 0 and source.fy > 0 and source.width > 0 and source.height > 0):
            raise InputError(
                f"a camera needs focal lengths and sizes above zero, got {tuple(source)}",
                where="sensor_msgs/CameraInfo",
                remedy="calibrate the camera, or remap camera_info to the depth camera's own",
            )
        self.source, self.target = source, target
        wanted = CameraModel.of(target)
        right = (np.arange(target.width) - wanted.cx) / wanted.fx
        down = (np.arange(target.height) - wanted.cy) / wanted.fy
        cols = np.rint(source.cx + right * source.fx).astype(np.int64)
        rows = np.rint(source.cy + down * source.fy).astype(np.int64)
        seen = (
            ((rows >= 0) & (rows < source.height))[:, None] & (cols >= 0) & (cols < source.width)
        )
        index = np.clip(rows, 0, source.height - 1)[:, None] * source.width
        self._index = index + np.clip(cols, 0, source.width - 1)
        self._unseen = ~seen
        self._is_identity = wanted == source or (
            (source.height, source.width) == (target.height, target.width)
            and bool(seen.all())
            and np.array_equal(self._index.ravel(), np.arange(self._index.size))
        )

    @property
    def seen_share(self) -> float:
        """Share of the wanted image that the robot's camera covers."""
        return 1.0 - float(self._unseen.mean())

    def __call__(
        self, depth_m: Float32[np.ndarray, "rows cols"]
    ) -> Float32[np.ndarray, "height width"]:
        """The image that the other camera would have taken.

        Raises:
            InputError: The frame is not of the camera's size.
        """
        if depth_m.shape != (self.source.height, self.source.width):
            raise InputError(
                f"camera_info says {self.source.width}x{self.source.height} pixels, the image has "
                f"{depth_m.shape[1]}x{depth_m.shape[0]}",
                where="depth image",
                remedy="remap camera_info to that of the same camera",
            )
        if self._is_identity:
            return depth_m
        out: np.ndarray = depth_m.ravel().take(self._index)
        out[self._unseen] = 0.0
        return out


def pose_in_map(odometry: Pose2, odometry_at_start: Pose2, start: Pose2) -> Pose2:
    """Where a robot is in the map, from its odometry and where it stood at the start."""
    return start.compose(odometry.relative_to(odometry_at_start))
