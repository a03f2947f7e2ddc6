"""Depth frames as the networks see them: resampled, clipped, one byte a pixel."""

import math
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, Int64, UInt8

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.models.graphnav.presets import ImageSpec

__all__ = ["DepthResampler", "FrameHistory", "FrameReducer", "frame_reducer"]

_CORNER_TOLERANCE_RAD = math.radians(2.0)


@runtime_checkable
class _ShowsImage(Protocol):
    """A preset, or the configuration of one network."""

    @property
    def image(self) -> ImageSpec: ...


@runtime_checkable
class FrameReducer(Protocol):
    """Turns a camera's depth frames into what networks see."""

    @property
    def camera(self) -> PinholeCamera:
        """The camera that takes the frames."""

    def __call__(
        self, depth_m: Float32[np.ndarray, "height width"]
    ) -> UInt8[np.ndarray, "rows cols"]:
        """A frame as the networks see it."""


def frame_reducer(camera: PinholeCamera, preset: _ShowsImage) -> FrameReducer:
    """What makes the frames of a preset: a resampler, or a profiler.

    Raises:
        InputError: The camera does not see what the networks want to see.
    """
    if preset.image.projection == "profile":
        from toponav.models.graphnav.metric.profile import DepthProfiler

        return DepthProfiler(camera, preset)
    return DepthResampler(camera, preset)


class DepthResampler:
    """Turns a camera's depth frames into the image a preset's networks see.

    Pixels are gathered by nearest neighbour through an index computed once. Equal angles of
    40 degrees reach 1.4 degrees past the corners of GraphNav's 320x240 camera; those few
    pixels repeat the camera's border. A camera that misses more than 2 degrees is refused.

    Args:
        camera: The camera that took the frames. It has to look ahead along the horizon.
        preset: A preset or a network's configuration; only its `image` matters.

    Raises:
        InputError: The camera does not see what the networks want to see.

    Example:
        >>> from toponav.models.graphnav.presets import get_preset
        >>> resampler = DepthResampler(PinholeCamera(), get_preset("compact"))
        >>> resampler(np.full((240, 320), 3.5, np.float32)).shape
        (32, 96)
    """

    def __init__(self, camera: PinholeCamera, preset: _ShowsImage) -> None:
        self.camera = camera
        self.image = preset.image
        self._check_camera()
        index = self._gather_index()
        identity = np.arange(camera.width * camera.height)
        self._index = None if np.array_equal(index.ravel(), identity) else index

    def __call__(
        self, depth_m: Float32[np.ndarray, "height width"]
    ) -> UInt8[np.ndarray, "rows cols"]:
        """The frame at the preset's size; 255 stands for the preset's greatest depth.

        Raises:
            InputError: The frame is not of the camera's size, or holds NaN or infinity.
        """
        if depth_m.shape != (self.camera.height, self.camera.width):
            raise InputError(
                f"a frame has {self.camera.height} rows and {self.camera.width} columns, "
                f"got {' x '.join(map(str, depth_m.shape))}",
                where="depth frame",
                remedy="give the resampler the camera that took the frame",
            )
        depth = depth_m if self._index is None else depth_m.ravel().take(self._index)
        spec = self.image
        lowest = depth.min()
        if not (np.isfinite(lowest) and np.isfinite(depth.max())):
            raise InputError(
                "depth must be finite, got NaN or infinity",
                where="depth frame",
                remedy="drop the frame, or write holes as 0",
            )
        if lowest <= 0.0:
            hole = spec.max_depth_m if spec.holes_read_as == "far" else spec.min_depth_m
            depth = np.where(depth <= 0.0, np.float32(hole), depth)
        scaled = np.clip(depth, spec.min_depth_m, spec.max_depth_m)
        scaled *= np.float32(255.0 / spec.max_depth_m)
        scaled += np.float32(0.5)
        pixels: np.ndarray = scaled.astype(np.uint8)
        return pixels

    def _check_camera(self) -> None:
        camera, spec = self.camera, self.image
        if camera.max_depth_m < spec.max_depth_m:
            raise InputError(
                f"the networks see {spec.max_depth_m} m, this camera {camera.max_depth_m} m",
                where="camera.max_depth_m",
                remedy=f"use a camera that sees {spec.max_depth_m} m or more",
            )
        if abs(camera.pitch_rad) > _CORNER_TOLERANCE_RAD:
            raise InputError(
                f"the networks look along the horizon, this camera is tilted by "
                f"{math.degrees(camera.pitch_rad):.1f} degrees",
                where="camera.pitch_rad",
                remedy="mount the camera level",
            )

    def _gather_index(self) -> Int64[np.ndarray, "rows cols"]:
        camera, spec = self.camera, self.image
        left, up = _rays(spec)
        col = camera.width / 2 - left * camera.focal_px
        row = camera.height / 2 - up * camera.focal_px
        inside_col = np.clip(col, 0.5, camera.width - 0.5)
        inside_row = np.clip(row, 0.5, camera.height - 0.5)
        # What a pixel's clamping costs, as the angle between the wanted ray and the border's.
        wanted = np.stack([np.ones_like(left), left, up], axis=-1)
        given = np.stack(
            [
                np.ones_like(left),
                (camera.width / 2 - inside_col) / camera.focal_px,
                (camera.height / 2 - inside_row) / camera.focal_px,
            ],
            axis=-1,
        )
        cosine = (wanted * given).sum(-1)
        cosine /= np.linalg.norm(wanted, axis=-1) * np.linalg.norm(given, axis=-1)
        missed_rad = float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())
        if missed_rad > _CORNER_TOLERANCE_RAD:
            raise InputError(
                f"the networks see {math.degrees(spec.hfov_rad):.0f} degrees across in "
                f"{spec.rows}x{spec.cols} pixels ({spec.projection}); this camera of "
                f"{math.degrees(camera.hfov_rad):.0f} x {math.degrees(camera.vfov_rad):.0f} "
                f"degrees misses part of it by {math.degrees(missed_rad):.1f} degrees",
                where="camera",
                remedy="use a wider camera, such as 320x240 pixels with 150 degrees",
            )
        index: np.ndarray = np.floor(inside_row).astype(np.int64) * camera.width
        index += np.floor(inside_col).astype(np.int64)
        return index


def _rays(
    spec: ImageSpec,
) -> tuple[np.ndarray, np.ndarray]:
    """Left and up components of each pixel's ray, its forward component being one."""
    if spec.projection == "pinhole":
        rays = spec.camera.rays_in_robot().astype(np.float64)
        return rays[..., 1], rays[..., 2]
    azimuth = (0.5 - (np.arange(spec.cols) + 0.5) / spec.cols) * spec.hfov_rad
    elevation = (0.5 - (np.arange(spec.rows) + 0.5) / spec.rows) * 2 * spec.elevation_rad
    left = np.broadcast_to(np.tan(azimuth), (spec.rows, spec.cols))
    up = np.tan(elevation)[:, None] / np.cos(azimuth)[None, :]
    return left, up


class FrameHistory:
    """The last frames of an episode; before its start, the first frame repeated.

    Args:
        length: Frames to remember, the present one included (`preset.history`).
        image: Size of a frame.
    """

    def __init__(self, length: int, image: ImageSpec) -> None:
        self._frames = np.zeros((length, image.rows, image.cols), np.uint8)
        self._newest = 0
        self._is_empty = True

    def clear(self) -> None:
        """Forget everything: an episode begins."""
        self._is_empty = True

    def push(self, frame: UInt8[np.ndarray, "rows cols"]) -> None:
        """Make this the present frame."""
        if self._is_empty:
            self._frames[:] = frame
            self._is_empty = False
            return
        self._newest = (self._newest + 1) % len(self._frames)
        self._frames[self._newest] = frame

    def stack(self, offsets: tuple[int, ...]) -> UInt8[np.ndarray, "frames rows cols"]:
        """The frames at these steps before now, in the order given."""
        assert not self._is_empty, "push a frame first"
        assert max(offsets) < len(self._frames), (offsets, len(self._frames))
        rows = (self._newest - np.asarray(offsets)) % len(self._frames)
        stacked: np.ndarray = self._frames[rows]
        return stacked
