"""The slow and obvious camera: every pixel against every triangle, in double precision."""

import math

import numpy as np
from jaxtyping import Float, Float32

from toponav.core.camera import PinholeCamera
from toponav.core.geometry import Pose2
from toponav.sim.render.base import check_camera, check_viewpoint
from toponav.worlds.scene import Scene

__all__ = ["ReferenceRenderer", "nearest_hit"]

# A ray through a shared edge must hit one of the two triangles.
_EDGE_SLACK = 1e-9


class ReferenceRenderer:
    """Z-depth by intersecting each pixel's ray with each triangle; for tests and small images.

    Args:
        scene: The building.
        camera: The camera.
    """

    backend = "reference"

    def __init__(self, scene: Scene, camera: PinholeCamera) -> None:
        check_camera(scene, camera)
        self.scene = scene
        self.camera = camera
        self._triangles = scene.mesh.vertices_m.astype(np.float64)[scene.mesh.faces]

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum."""
        check_viewpoint(self.scene, self.camera, pose)
        cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        origin = np.array([pose.x_m, pose.y_m, self.camera.mount_height_m])
        directions = self.camera.rays_in_robot().astype(np.float64) @ turn.T
        image = np.empty((self.camera.height, self.camera.width), np.float32)
        for row in range(self.camera.height):
            for column in range(self.camera.width):
                depth_m = nearest_hit(self._triangles, origin, directions[row, column])
                image[row, column] = min(depth_m, self.camera.max_depth_m)
        return image


def nearest_hit(
    triangles_m: Float[np.ndarray, "triangles 3 3"],
    origin_m: Float[np.ndarray, "3"],
    direction: Float[np.ndarray, "3"],
) -> float:
    """The smallest t >= 0 at which `origin + t * direction` is on a triangle, or infinity.

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
    return float(t[hit].min(initial=math.inf))
