"""The slow and obvious camera: every pixel against every triangle, in double precision."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32

from toponav.core.camera import Camera
from toponav.core.geometry import Pose2
from toponav.sim.render.base import check_camera, check_viewpoint
from toponav.sim.render.images import (
    INSTANCE_OF_NOTHING,
    MODALITIES,
    SEMANTIC_OF_NOTHING,
    RenderedImages,
    check_modalities,
)
from toponav.sim.render.reference_shading import color_of
from toponav.worlds.scene import Scene

__all__ = ["ReferenceHit", "ReferenceRenderer", "nearest_hit"]

# A ray through a shared edge must hit one of the two triangles.
_EDGE_SLACK = 1e-9


class ReferenceHit(NamedTuple):
    """Where one ray meets a triangle; face -1 and an infinite depth where it meets none."""

    depth_m: float
    face: int
    u: float
    v: float


class ReferenceRenderer:
    """Images by intersecting each pixel's ray with each triangle; for tests and small images.

    Args:
        scene: The building.
        camera: The camera.
    """

    backend = "reference"

    def __init__(self, scene: Scene, camera: Camera) -> None:
        check_camera(scene, camera)
        self.scene = scene
        self.camera = camera
        self._triangles = scene.mesh.vertices_m.astype(np.float64)[scene.mesh.faces]

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum."""
        origin, directions = self._rays(pose)
        image = np.empty((self.camera.height, self.camera.width), np.float32)
        for row in range(self.camera.height):
            for column in range(self.camera.width):
                hit = nearest_hit(self._triangles, origin, directions[row, column])
                image[row, column] = min(hit.depth_m, self.camera.max_depth_m)
        return image

    def render_images(self, pose: Pose2, modalities: Sequence[str] = MODALITIES) -> RenderedImages:
        """The images, pixel by pixel, as in `DepthRenderer.render_images`."""
        check_modalities(modalities)
        origin, directions = self._rays(pose)
        shape = (self.camera.height, self.camera.width)
        rgb = np.empty((*shape, 3), np.uint8)
        depth_m = np.empty(shape, np.float32)
        semantic = np.full(shape, SEMANTIC_OF_NOTHING, np.uint8)
        instance = np.full(shape, INSTANCE_OF_NOTHING, np.int32)
        for row, column in np.ndindex(shape):
            ray = directions[row, column]
            hit = nearest_hit(self._triangles, origin, ray)
            depth_m[row, column] = min(hit.depth_m, self.camera.max_depth_m)
            place = origin + hit.depth_m * ray if hit.face >= 0 else origin
            rgb[row, column] = color_of(
                self.scene, hit.face, (hit.u, hit.v), place, ray, hit.depth_m * self.camera.pixel_m
            )
            if hit.face >= 0:
                semantic[row, column] = self.scene.mesh.face_semantic[hit.face]
                instance[row, column] = self.scene.mesh.face_instance[hit.face]
        return RenderedImages(
            rgb if "rgb" in modalities else None,
            depth_m if "depth" in modalities else None,
            semantic if "semantic" in modalities else None,
            instance if "instance" in modalities else None,
        )

    def _rays(self, pose: Pose2) -> tuple[np.ndarray, np.ndarray]:
        """The optical centre and each pixel's direction, in the world."""
        check_viewpoint(self.scene, self.camera, pose)
        cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        origin = np.array([pose.x_m, pose.y_m, self.camera.mount_height_m])
        return origin, self.camera.rays_in_robot().astype(np.float64) @ turn.T


def nearest_hit(
    triangles_m: Float[np.ndarray, "triangles 3 3"],
    origin_m: Float[np.ndarray, "3"],
    direction: Float[np.ndarray, "3"],
) -> ReferenceHit:
    """The smallest t >= 0 at which `origin + t * direction` is on a triangle, and where on it.

    Reference:
        Moeller and Trumbore 1997, Fast, minimum storage ray-triangle intersection.
    """
    corner = triangles_m[:, 0]
    edge_1, edge_2 = triangles_m[:, 1] - corner, triangles_m[:, 2] - corner
    across = np.cross(direction, edge_2)
    volume = np.einsum("ij,ij->i", edge_1, across)
    to_origin = origin_m - corner
    around = np.cross(to_origin, edge_1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u = np.einsum("ij,ij->i", to_origin, across) / volume
        v = around @ direction / volume
        t = np.einsum("ij,ij->i", edge_2, around) / volume
        # A comparison with the NaN of a degenerate triangle is false: it is never hit.
        hit = (u >= -_EDGE_SLACK) & (v >= -_EDGE_SLACK) & (u + v <= 1 + _EDGE_SLACK) & (t >= 0)
    hit &= volume != 0
    if not hit.any():
        return ReferenceHit(math.inf, -1, 0.0, 0.0)
    nearest = int(np.flatnonzero(hit)[t[hit].argmin()])
    return ReferenceHit(float(t[nearest]), nearest, float(u[nearest]), float(v[nearest]))
