"""The plain Embree camera: one ray at a time, through the embreex package."""

import math
from importlib.util import find_spec

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render.base import check_camera, check_viewpoint
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

    def __init__(self, scene: Scene, camera: PinholeCamera) -> None:
        require_embreex()
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        check_camera(scene, camera)
        self.scene = scene
        self.camera = camera
        self._rays = camera.rays_in_robot().reshape(-1, 3)
        self._embree = EmbreeScene()
        self._mesh = TriangleMesh(self._embree, scene.mesh.vertices_m, scene.mesh.faces)

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum."""
        check_viewpoint(self.scene, self.camera, pose)
        cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float32)
        directions = self._rays @ turn
        place = (pose.x_m, pose.y_m, self.camera.mount_height_m)
        origins = np.broadcast_to(np.array(place, np.float32), directions.shape).copy()
        depth_m = self._embree.run(
            origins, directions, dists=self.camera.max_depth_m, query="DISTANCE"
        )
        image: Float32[np.ndarray, "height width"] = np.minimum(
            depth_m, np.float32(self.camera.max_depth_m)
        ).reshape(self.camera.height, self.camera.width)
        return image
