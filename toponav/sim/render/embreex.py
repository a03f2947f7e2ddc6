"""The plain Embree camera: one ray at a time, through the embreex package."""

import math
from collections.abc import Sequence
from importlib.util import find_spec

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import Camera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render.base import check_camera, check_viewpoint
from toponav.sim.render.images import MODALITIES, Hits, RenderedImages, check_modalities
from toponav.sim.render.shading import images_of, with_lengths
from toponav.worlds.scene import Scene

__all__ = ["EmbreexRenderer", "require_embreex"]


def require_embreex() -> None:
    """Nothing, where embreex is installed; else an error that says what to do."""
    if find_spec("embreex") is None:
        raise InputError(
            "cameras in scanned meshes need the package embreex, which is not installed",
            where="renderer",
            remedy="pip install 'embreex>=4.4,<5' (x86-64 only), or use an extruded plan",
        )


class EmbreexRenderer:
    """Z-depth by Embree, ray by ray; the fallback where packets are not available.

    Args:
        scene: The building.
        camera: The camera.

    Raises:
        InputError: If embreex is not installed, or the camera is above the ceiling.
    """

    backend = "embreex"

    def __init__(self, scene: Scene, camera: Camera) -> None:
        require_embreex()
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        check_camera(scene, camera)
        self.scene = scene
        self.camera = camera
        rays = camera.rays_in_robot()
        self._pixel_rays = with_lengths(rays)
        self._rays = rays.reshape(-1, 3)
        self._embree = EmbreeScene()
        self._mesh = TriangleMesh(self._embree, scene.mesh.vertices_m, scene.mesh.faces)

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum."""
        origins, directions = self._place(pose)
        depth_m = self._embree.run(
            origins, directions, dists=self.camera.max_depth_m, query="DISTANCE"
        )
        image: Float32[np.ndarray, "height width"] = np.minimum(
            depth_m, np.float32(self.camera.max_depth_m)
        ).reshape(self.camera.height, self.camera.width)
        return image

    def render_images(self, pose: Pose2, modalities: Sequence[str] = MODALITIES) -> RenderedImages:
        """The images of one cast, as in `DepthRenderer.render_images`."""
        check_modalities(modalities)
        origins, directions = self._place(pose)
        found = self._embree.run(origins, directions, query="INTERSECT", output=True)
        shape = (self.camera.height, self.camera.width)
        hits = Hits(
            found["tfar"].astype(np.float32).reshape(shape),
            found["primID"].astype(np.int32).reshape(shape),
            np.stack([found["u"], found["v"]], axis=-1).astype(np.float32).reshape(*shape, 2),
        )
        return images_of(self.scene, self.camera, pose, hits, self._pixel_rays, modalities)

    def _place(self, pose: Pose2) -> tuple[np.ndarray, np.ndarray]:
        """Origin and direction of each ray in the world."""
        check_viewpoint(self.scene, self.camera, pose)
        cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float32)
        directions = self._rays @ turn
        place = (pose.x_m, pose.y_m, self.camera.mount_height_m)
        origins = np.broadcast_to(np.array(place, np.float32), directions.shape).copy()
        return origins, directions
