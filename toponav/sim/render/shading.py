"""Colour, class and instance images of what a cast met.

The light is simple and needs no second cast. Each room has lamps under its ceiling (several in
large ones) that light what faces them, without shadows; everything else is lit from above and
a little from one side, so that the walls of a corner differ; and where a surface comes close to
another, less of that light arrives, by the distance to the nearest surface a step away from it
(Evans 2006, Fast approximations for global illumination on dynamic scenes, section 3).
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8

from toponav.core.camera import Camera
from toponav.core.geometry import Pose2
from toponav.sim.render.images import (
    INSTANCE_OF_NOTHING,
    SEMANTIC_OF_NOTHING,
    Hits,
    RenderedImages,
)
from toponav.sim.render.shading_kernels import look_up, shade_pixels
from toponav.sim.render.surfaces import REACH_M, surfaces_of
from toponav.worlds.scene import Scene

__all__ = ["LIGHT", "Light", "images_of", "srgb_curves", "with_lengths"]


class Light(NamedTuple):
    """How a building is lit.

    Attributes:
        ambient: Light from above on what faces up.
        lamp: Light of a lamp near to it.
        wrap: How far around a surface's edge a lamp still lights it, 0 to 1.
        spread_m2: Share that a lamp's light loses per square metre.
        corner: Share of light that arrives in the deepest corner.
        below: Share of the light from above that what faces down gets.
        tint: How much the walls of a corner differ.
        escape: Brightness where a ray leaves the building, 0 to 255.
    """

    ambient: float = 0.48
    lamp: float = 0.85
    wrap: float = 0.4
    spread_m2: float = 0.12
    corner: float = 0.45
    below: float = 0.7
    tint: float = 0.16
    escape: int = 235


LIGHT = Light()
"""The light that every renderer uses."""


def images_of(
    scene: Scene,
    camera: Camera,
    pose: Pose2,
    hits: Hits,
    rays: np.ndarray,
    modalities: Sequence[str],
) -> RenderedImages:
    """The images of what a cast met.

    Args:
        scene: The building.
        camera: The camera.
        pose: Where the robot is.
        hits: What each pixel's ray meets, however far away.
        rays: `with_lengths(camera.rays_in_robot())`.
        modalities: Names of the images wanted.
    """
    shape = hits.face.shape
    face = hits.face.reshape(-1)
    rgb = depth_m = semantic = instance = None
    if "rgb" in modalities:
        rgb = _colors(scene, camera, pose, hits, rays)
    if "depth" in modalities:
        depth_m = np.minimum(hits.depth_m, np.float32(camera.max_depth_m))
    if "semantic" in modalities:
        semantic = np.empty(shape, np.uint8)
        look_up(face, scene.mesh.face_semantic, SEMANTIC_OF_NOTHING, semantic.reshape(-1))
    if "instance" in modalities:
        instance = np.empty(shape, np.int32)
        look_up(face, scene.mesh.face_instance, INSTANCE_OF_NOTHING, instance.reshape(-1))
    return RenderedImages(rgb, depth_m, semantic, instance)


def with_lengths(
    rays: Float32[np.ndarray, "height width 3"],
) -> Float32[np.ndarray, "4 pixels"]:
    """Rays and one over the length of each."""
    flat = rays.reshape(-1, 3)
    per_length = 1 / np.linalg.norm(flat, axis=1, keepdims=True)
    return np.ascontiguousarray(np.append(flat, per_length, axis=1).T)


def _colors(
    scene: Scene, camera: Camera, pose: Pose2, hits: Hits, rays: np.ndarray
) -> UInt8[np.ndarray, "height width 3"]:
    """The colour image."""
    surfaces, grid = surfaces_of(scene), scene.grid
    openness, lamps = surfaces.openness, surfaces.lamps
    image = np.empty((*hits.face.shape, 3), np.uint8)
    number = np.float32
    shade_pixels(
        (hits.depth_m.reshape(-1), hits.face.reshape(-1), hits.uv.reshape(-1, 2)),
        (
            np.array([pose.x_m, pose.y_m, camera.mount_height_m], np.float32),
            number(math.cos(pose.yaw_rad)),
            number(math.sin(pose.yaw_rad)),
            rays,
            number(camera.pixel_m),
        ),
        (surfaces.face_data, surfaces.face_data.view(np.int32)),
        (surfaces.textures.texels, surfaces.textures.place),
        (
            openness.corners,
            openness.distance.shape,
            openness.origin_m,
            number(1 / openness.voxel_m),
            number(REACH_M),
            number(openness.voxel_m / REACH_M),
        ),
        (
            lamps.place_m,
            lamps.of_cell.reshape(-1),
            lamps.of_cell.shape,
            np.array(grid.origin_m, np.float32),
            number(1 / grid.resolution_m),
        ),
        (*map(number, LIGHT[:-1]), np.uint8(LIGHT.escape)),
        srgb_curves(),
        image.reshape(-1, 3),
    )
    return image


@cache
def srgb_curves() -> tuple[Float32[np.ndarray, " bytes"], UInt8[np.ndarray, " steps"]]:
    """Eighths of an sRGB byte to linear, and 4095ths of linear to sRGB bytes.

    Reference:
        IEC 61966-2-1.
    """
    srgb = np.arange(256 * 8, dtype=np.float64) / (255 * 8)
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    steps = np.arange(4096) / 4095
    bright = np.where(steps <= 0.0031308, steps * 12.92, 1.055 * steps ** (1 / 2.4) - 0.055)
    return linear.astype(np.float32), np.rint(bright * 255).astype(np.uint8)
