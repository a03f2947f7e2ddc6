"""Obstacle profiles: how far the nearest obstacle is in each direction, in two bands of heights.

What a depth image says about where a robot may drive fits into two rows: in each direction,
the depth of the nearest thing that the robot would touch, and of the nearest thing above
furniture, which is a wall. A wall shows in both rows, a chair in the lower one.
"""

import math
from typing import Final, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, Int64, UInt8

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.models.graphnav.metric import profile_kernels as kernels
from toponav.models.graphnav.presets import ImageSpec

__all__ = ["BANDS_M", "DepthProfiler", "bin_azimuths_rad"]

BANDS_M: Final = ((0.04, 0.5), (1.25, 2.1))
"""Heights above the floor of the two rows: what the robot's body may touch, and walls."""
_CORNER_TOLERANCE_RAD: Final = math.radians(2.0)


@runtime_checkable
class _ShowsImage(Protocol):
    @property
    def image(self) -> ImageSpec: ...


def bin_azimuths_rad(spec: ImageSpec) -> Float32[np.ndarray, " bins"]:
    """The direction of each bin's middle in the robot's frame: left of ahead is positive."""
    share = (np.arange(spec.cols) + 0.5) / spec.cols
    azimuths: np.ndarray = ((0.5 - share) * spec.hfov_rad).astype(np.float32)
    return azimuths


class DepthProfiler:
    """Turns a level camera's depth frames into obstacle profiles.

    Args:
        camera: The camera that took the frames.
        preset: A preset or a configuration whose `image` is a profile.

    Raises:
        InputError: The camera is tilted, sees too little to the sides, or not far enough.

    Example:
        >>> from toponav.models.graphnav.presets import profile_image
        >>> class Shows:
        ...     image = profile_image()
        >>> DepthProfiler(PinholeCamera(), Shows())(np.ones((240, 320), np.float32)).shape
        (2, 128)
    """

    def __init__(self, camera: PinholeCamera, preset: _ShowsImage) -> None:
        self.camera, self.image = camera, preset.image
        self._check_camera()
        columns = np.arange(camera.width) + 0.5 - camera.width / 2
        rows = np.arange(camera.height) + 0.5 - camera.height / 2
        self._ray_left = (-columns / camera.focal_px).astype(np.float32)
        self._ray_up = (-rows / camera.focal_px).astype(np.float32)
        self._bins = self._bins_of_columns()
        self._bands_m = np.array(BANDS_M, np.float32)

    def __call__(
        self, depth_m: Float32[np.ndarray, "height width"]
    ) -> UInt8[np.ndarray, "bands bins"]:
        """The profile of a frame: 254 stands for the greatest depth, 255 for nothing seen.

        Holes (depth 0) count as nothing seen.

        Raises:
            InputError: The frame is not of the camera's size, or holds NaN or infinity.
        """
        if depth_m.shape != (self.camera.height, self.camera.width):
            raise InputError(
                f"a frame has {self.camera.height} rows and {self.camera.width} columns, "
                f"got {' x '.join(map(str, depth_m.shape))}",
                where="depth frame",
                remedy="give the profiler the camera that took the frame",
            )
        if not (np.isfinite(depth_m.min()) and np.isfinite(depth_m.max())):
            raise InputError(
                "depth must be finite, got NaN or infinity",
                where="depth frame",
                remedy="drop the frame, or write holes as 0",
            )
        out = np.empty((self.image.rows, self.image.cols), np.uint8)
        kernels.profile(
            depth_m,
            self._ray_up,
            self._ray_left,
            self._bins,
            self.camera.mount_height_m,
            self._bands_m,
            self.image.max_depth_m,
            out,
        )
        return out

    def _check_camera(self) -> None:
        camera, spec = self.camera, self.image
        if abs(camera.pitch_rad) > _CORNER_TOLERANCE_RAD:
            raise InputError(
                f"the networks look along the horizon, this camera is tilted by "
                f"{math.degrees(camera.pitch_rad):.1f} degrees",
                where="camera.pitch_rad",
                remedy="mount the camera level",
            )
        if camera.hfov_rad < spec.hfov_rad - _CORNER_TOLERANCE_RAD:
            raise InputError(
                f"the networks see {math.degrees(spec.hfov_rad):.0f} degrees across, this "
                f"camera {math.degrees(camera.hfov_rad):.0f}",
                where="camera.hfov_rad",
                remedy="use a wider camera, such as 320x240 pixels with 150 degrees",
            )
        if camera.max_depth_m < spec.max_depth_m:
            raise InputError(
                f"the networks see {spec.max_depth_m} m, this camera {camera.max_depth_m} m",
                where="camera.max_depth_m",
                remedy=f"use a camera that sees {spec.max_depth_m} m or more",
            )

    def _bins_of_columns(self) -> Int64[np.ndarray, "cols 2"]:
        """The bins that a column covers; where columns are wider than bins, several."""
        edges = np.arange(self.camera.width + 1) - self.camera.width / 2
        azimuth = -np.arctan(edges / self.camera.focal_px)
        place = (0.5 - azimuth / self.image.hfov_rad) * self.image.cols
        first = np.floor(place[:-1] + 1e-6).astype(np.int64)
        last = np.ceil(place[1:] - 1e-6).astype(np.int64) - 1
        bins = np.stack([first, np.maximum(first, last)], axis=1)
        clipped: np.ndarray = np.clip(bins, 0, self.image.cols - 1)
        return clipped
