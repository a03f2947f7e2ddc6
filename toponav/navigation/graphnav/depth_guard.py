"""Depth frames that must not become a velocity."""

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import PinholeCamera

__all__ = ["fault_in_depth"]


def fault_in_depth(depth_m: Float32[np.ndarray, "..."], camera: PinholeCamera) -> str:
    """Why this depth image cannot be trusted, or an empty string when it can.

    Args:
        depth_m: Z-depth in metres as the sensor gave it; 0 marks a hole.
        camera: The camera that the agent was built for.

    Returns:
        A sentence for people, such as "12 depth values are NaN", or "".

    Example:
        >>> fault_in_depth(np.zeros((240, 320), np.float32), PinholeCamera())
        'the depth frame is all zero: the sensor sees nothing'
    """
    if depth_m.shape != (camera.height, camera.width):
        got = "x".join(str(size) for size in depth_m.shape[::-1])
        return f"the depth frame is {got} pixels, expected {camera.width}x{camera.height}"
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
