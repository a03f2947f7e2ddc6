"""Depth frames that must not become a velocity."""

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Velocity

__all__ = ["DepthGuard", "fault_in_depth"]

_PERIOD_S = 0.2
_MOST_REPEATS = 5
_STANDING = 0.01
_FLAT_M = 1e-3


def fault_in_depth(depth_m: object, camera: PinholeCamera) -> str:
    """Why this depth image cannot be trusted, or an empty string when it can.

    Args:
        depth_m: Z-depth in metres as the sensor gave it, float32; 0 marks a hole.
        camera: The camera that the agent was built for.

    Returns:
        A sentence for people, such as "12 depth values are NaN", or "".

    Example:
        >>> fault_in_depth(np.zeros((240, 320), np.float32), PinholeCamera())
        'the depth frame is all zero: the sensor sees nothing'
    """
    if not isinstance(depth_m, np.ndarray):
        return f"the depth frame is a {type(depth_m).__name__}, expected an array"
    if depth_m.shape != (camera.height, camera.width):
        got = "x".join(str(size) for size in depth_m.shape[::-1])
        return f"the depth frame is {got} pixels, expected {camera.width}x{camera.height}"
    if depth_m.dtype != np.float32:
        return f"the depth frame holds {depth_m.dtype}, expected metres as float32"
    finite = np.isfinite(depth_m)
    if not finite.all():
        nans = int(np.isnan(depth_m).sum())
        infinite = depth_m.size - int(finite.sum()) - nans
        return f"{nans} depth values are NaN and {infinite} infinite"
    if not depth_m.any():
        return "the depth frame is all zero: the sensor sees nothing"
    if depth_m.min() < 0:
        return f"depth reaches {depth_m.min():.3f} m: it cannot be negative"
    return ""


class DepthGuard:
    """Judges the frames of an episode one by one, and notices a sensor that is frozen.

    While a robot moves, no two frames of what stands around it are the same, bit for bit. A
    frame that comes five times more while the robot is told to drive says that the sensor has
    stopped. Frames that show only floor and ceiling stay the same in motion too and are not
    held against the sensor. The first frame that differs ends the suspicion.

    Args:
        camera: The camera that the agent was built for.
    """

    def __init__(self, camera: PinholeCamera) -> None:
        self._camera = camera
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._last: Float32[np.ndarray, "height width"] | None = None
        self._repeats = 0

    def fault(self, depth_m: object, last_command: Velocity) -> str:
        """Why this frame cannot be trusted, or an empty string when it can.

        Args:
            depth_m: The frame, as `fault_in_depth` takes it.
            last_command: What the robot was told after the frame before.
        """
        fault = fault_in_depth(depth_m, self._camera)
        if fault:
            return fault
        assert isinstance(depth_m, np.ndarray)
        if self._last is None or not np.array_equal(self._last, depth_m):
            # A copy: simulators and drivers may write every frame to the same place.
            self._last, self._repeats = depth_m.copy(), 0
            return ""
        if _is_moving(last_command) and not _shows_only_planes(depth_m):
            self._repeats += 1
        if self._repeats >= _MOST_REPEATS:
            seconds = _MOST_REPEATS * _PERIOD_S
            return f"the depth frame stayed the same for {seconds:g} s of driving: it is frozen"
        return ""


def _is_moving(command: Velocity) -> bool:
    return abs(command.linear_m_s) > _STANDING or abs(command.angular_rad_s) > _STANDING


def _shows_only_planes(depth_m: Float32[np.ndarray, "height width"]) -> bool:
    """Whether every row is of one depth, as floor and ceiling are to a level camera."""
    return bool((np.abs(depth_m - depth_m[:, :1]) < _FLAT_M).all())
