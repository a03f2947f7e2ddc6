"""The fastest camera: walks the plan of an extruded scene instead of casting rays at a mesh."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import Camera, PanoramaCamera, PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render.base import check_camera, check_viewpoint
from toponav.sim.render.embreex import EmbreexRenderer
from toponav.sim.render.grid_kernels import render_level, render_tilted
from toponav.sim.render.images import MODALITIES, RenderedImages
from toponav.sim.render.packets import PacketsRenderer, packets_available
from toponav.worlds.scene import Scene

__all__ = ["GridRenderer"]


class GridRenderer:
    """Exact Z-depth of an extruded plan: what a ray caster sees on the scene's mesh.

    Args:
        scene: A building whose solids all stand on the floor (`scene.is_extruded`).
        camera: The camera; a level one (no pitch, or a stitched panorama) is some thirty times
            as fast.

    Raises:
        InputError: If the scene is not extruded, or the camera is above its ceiling.
    """

    backend = "grid"

    def __init__(self, scene: Scene, camera: Camera) -> None:
        if not scene.is_extruded:
            raise InputError(
                "the grid camera needs an extruded plan",
                where=f"scene {scene.name}",
                remedy="use backend='packets' or backend='auto'",
            )
        check_camera(scene, camera)
        self.scene = scene
        self.camera = camera
        # A stitched panorama is four level cameras.
        level: Camera = camera
        if isinstance(camera, PanoramaCamera) and camera.kind == "stitched":
            level = camera.quarter
        rays = level.rays_in_robot().astype(np.float64)
        self._rays = rays
        self._is_level = isinstance(level, PinholeCamera) and level.pitch_rad == 0.0
        self._left = np.ascontiguousarray(rays[0, :, 1])
        self._up = np.ascontiguousarray(rays[:, 0, 2])
        self._heights_m = np.ascontiguousarray(scene.heights_m, dtype=np.float32)
        # A solid that reaches the ceiling in float32 reaches it in the comparison too.
        self._ceiling_m = float(np.float32(scene.ceiling_m))
        to_plane_m = np.where(self._up < 0, camera.mount_height_m, self._above_m())
        with np.errstate(divide="ignore"):
            open_m = to_plane_m / np.abs(self._up)
        self._open_m = np.minimum(open_m, camera.max_depth_m).astype(np.float32)
        self._caster: PacketsRenderer | EmbreexRenderer | None = None

    def _above_m(self) -> float:
        return self._ceiling_m - self.camera.mount_height_m

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum."""
        check_viewpoint(self.scene, self.camera, pose)
        if isinstance(self.camera, PanoramaCamera) and self.camera.kind == "stitched":
            turns = (math.pi, math.pi / 2, 0.0, -math.pi / 2)
            return self.camera.stitch([self._walk(pose, pose.yaw_rad + turn) for turn in turns])
        return self._walk(pose, pose.yaw_rad)

    def render_images(self, pose: Pose2, modalities: Sequence[str] = MODALITIES) -> RenderedImages:
        """The images of one cast at the plan's mesh, as in `DepthRenderer.render_images`."""
        if self._caster is None:
            kind = PacketsRenderer if packets_available() else EmbreexRenderer
            self._caster = kind(self.scene, self.camera)
        return self._caster.render_images(pose, modalities)

    def _walk(self, pose: Pose2, yaw_rad: float) -> Float32[np.ndarray, "height width"]:
        """Z-depth of one level or tilted camera."""
        grid, camera = self.scene.grid, self.camera
        column = (pose.x_m - grid.origin_m[0]) / grid.resolution_m
        row = (pose.y_m - grid.origin_m[1]) / grid.resolution_m
        place = (
            self._heights_m,
            float(grid.resolution_m),
            float(column),
            float(row),
            float(yaw_rad),
            float(camera.mount_height_m),
            self._ceiling_m,
        )
        far_m = float(camera.max_depth_m)
        image: Float32[np.ndarray, "height width"]
        if self._is_level:
            image = render_level(*place, self._left, self._up, self._open_m, far_m)
        else:
            image = render_tilted(*place, self._rays, far_m)
        return image
