"""Pinhole cameras: pixels to rays. Image rows run down, columns run right."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from toponav.core.errors import InputError

__all__ = ["PinholeCamera"]


@dataclass(frozen=True)
class PinholeCamera:
    """A depth camera on the robot's axis, looking along x.

    The defaults are GraphNav's: 320x240, 150 degrees, clipped at 3.5 m (section VI-C).
    """

    width: int = 320
    """Image width in pixels."""
    height: int = 240
    """Image height in pixels."""
    hfov_rad: float = math.radians(150.0)
    """Horizontal field of view."""
    mount_height_m: float = 0.6
    """Height of the optical centre above the floor."""
    pitch_rad: float = 0.0
    """Tilt; positive looks down."""
    max_depth_m: float = 3.5
    """Depths beyond this read as this."""

    def __post_init__(self) -> None:
        checks = {
            "width": 1 <= self.width <= 8192,
            "height": 1 <= self.height <= 8192,
            "hfov_rad": 0.0 < self.hfov_rad < math.pi,
            "mount_height_m": 0.0 < self.mount_height_m < 10.0,
            "pitch_rad": abs(self.pitch_rad) < math.pi / 2,
            "max_depth_m": 0.0 < self.max_depth_m < math.inf,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where="PinholeCamera",
                    remedy="sizes 1..8192 px, 0 < field of view < pi, height 0..10 m",
                )

    @property
    def focal_px(self) -> float:
        """Focal length in pixels; pixels are square."""
        return self.width / 2 / math.tan(self.hfov_rad / 2)

    @property
    def vfov_rad(self) -> float:
        """Vertical field of view."""
        return 2 * math.atan(self.height / 2 / self.focal_px)

    def rays_in_robot(self) -> Float32[np.ndarray, "height width 3"]:
        """A direction per pixel in the robot's frame (x forward, y left, z up).

        Scaled so that the component along the optical axis is one: the ray parameter of a
        hit is then its Z-depth in metres (REP-118), not its range.
        """
        columns = (np.arange(self.width) + 0.5 - self.width / 2) / self.focal_px
        rows = (np.arange(self.height) + 0.5 - self.height / 2) / self.focal_px
        left, up = np.meshgrid(-columns, -rows)
        cosine, sine = math.cos(self.pitch_rad), math.sin(self.pitch_rad)
        rays = np.stack([cosine + sine * up, left, -sine + cosine * up], axis=-1)
        return rays.astype(np.float32)
