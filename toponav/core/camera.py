"""Cameras: pixels to rays. Image rows run down, columns run right."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float32

from toponav.core.errors import InputError, did_you_mean

__all__ = ["CYLINDER_LIFT", "Camera", "PanoramaCamera", "PanoramaKind", "PinholeCamera"]


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

    @property
    def pixel_m(self) -> float:
        """Width in metres of what a pixel shows at one metre, in the middle of the image."""
        return 1.0 / self.focal_px

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


PanoramaKind = Literal["stitched", "equirectangular", "cylindrical"]

CYLINDER_LIFT = 0.7
"""Half the height of a cylindrical panorama at one metre: what stitched ones show everywhere."""


@dataclass(frozen=True)
class PanoramaCamera:
    """A camera that sees all around; the middle column looks forward.

    The first column looks backwards, and yaw falls from pi at the left edge to -pi at the right.
    The defaults are those of the later behavioural navigation papers: 128x512, four pinholes of
    90 degrees.
    """

    height: int = 128
    """Image height in pixels."""
    width: int = 512
    """Image width in pixels; a multiple of 8 where pinholes are stitched."""
    kind: str = "stitched"
    """`stitched`: four 90 degree pinholes side by side, each with its own Z-depth; the one that
    looks backwards is cut in two halves at the edges. `equirectangular`: equal angles per pixel,
    depth along the ray. `cylindrical`: equal angles per column, equal heights per row, depth is
    the horizontal distance; what compact networks see."""
    mount_height_m: float = 0.6
    """Height of the optical centre above the floor."""
    max_depth_m: float = 10.0
    """Depths beyond this read as this."""

    def __post_init__(self) -> None:
        if self.kind not in get_args(PanoramaKind):
            raise InputError(
                f"no panorama is called '{self.kind}'",
                where="PanoramaCamera",
                remedy=did_you_mean(str(self.kind), get_args(PanoramaKind)),
            )
        stitched = self.kind == "stitched"
        round_ = self.kind == "equirectangular"
        checks = {
            "width": 8 <= self.width <= 8192 and not (stitched and self.width % 8),
            "height": 1 <= self.height <= (self.width // 2 if round_ else 8192),
            "mount_height_m": 0.0 < self.mount_height_m < 10.0,
            "max_depth_m": 0.0 < self.max_depth_m < math.inf,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where="PanoramaCamera",
                    remedy="width 8..8192 px, of 8 px each where stitched; height at most half of "
                    "it where equirectangular; mount_height_m 0..10 m",
                )

    @property
    def quarter(self) -> PinholeCamera:
        """One of the four pinholes of a stitched panorama."""
        return PinholeCamera(
            width=self.width // 4,
            height=self.height,
            hfov_rad=math.pi / 2,
            mount_height_m=self.mount_height_m,
            max_depth_m=self.max_depth_m,
        )

    @property
    def vfov_rad(self) -> float:
        """Vertical field of view; pixels are square."""
        if self.kind == "stitched":
            return self.quarter.vfov_rad
        if self.kind == "cylindrical":
            return 2 * math.atan(CYLINDER_LIFT)
        return 2 * math.pi * self.height / self.width

    @property
    def pixel_m(self) -> float:
        """Width in metres of what a pixel shows at one metre, in the middle of the image."""
        return self.quarter.pixel_m if self.kind == "stitched" else 2 * math.pi / self.width

    def rays_in_robot(self) -> Float32[np.ndarray, "height width 3"]:
        """A direction per pixel in the robot's frame (x forward, y left, z up).

        Where stitched, each has a unit component along its own pinhole's axis, so the ray
        parameter of a hit is that pinhole's Z-depth; on a cylinder a unit horizontal component;
        else it has unit length.
        """
        if self.kind == "cylindrical":
            yaw = math.pi - (np.arange(self.width) + 0.5) * (2 * math.pi / self.width)
            up = CYLINDER_LIFT * (1.0 - (np.arange(self.height) + 0.5) * 2 / self.height)
            yaw, up = np.meshgrid(yaw, up)
            return np.stack([np.cos(yaw), np.sin(yaw), up], axis=-1).astype(np.float32)
        if self.kind == "equirectangular":
            yaw = math.pi - (np.arange(self.width) + 0.5) * (2 * math.pi / self.width)
            lift = (self.height / 2 - np.arange(self.height) - 0.5) * (2 * math.pi / self.width)
            yaw, lift = np.meshgrid(yaw, lift)
            parts = [np.cos(lift) * np.cos(yaw), np.cos(lift) * np.sin(yaw), np.sin(lift)]
            return np.stack(parts, axis=-1).astype(np.float32)
        forward, left, up = np.moveaxis(self.quarter.rays_in_robot(), -1, 0)
        quarters = [
            np.stack([-forward, -left, up], axis=-1),
            np.stack([-left, forward, up], axis=-1),
            np.stack([forward, left, up], axis=-1),
            np.stack([left, -forward, up], axis=-1),
        ]
        return self.stitch(quarters)

    def stitch(self, quarters: Sequence[np.ndarray]) -> np.ndarray:
        """The panorama of the images of four pinholes: back, left, front and right."""
        back, left, front, right = quarters
        half = self.width // 8
        return np.concatenate([back[:, half:], left, front, right, back[:, :half]], axis=1)


Camera = PinholeCamera | PanoramaCamera
"""Any camera that a renderer can stand for."""
