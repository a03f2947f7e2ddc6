"""The fast Embree camera: eight or sixteen rays at a time through the bundled library."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32, Int32

from toponav.core.camera import Camera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render._embree import EmbreeScene, load_library
from toponav.sim.render.base import check_camera, check_viewpoint
from toponav.sim.render.embreex import require_embreex
from toponav.sim.render.images import MODALITIES, Hits, RenderedImages, check_modalities
from toponav.sim.render.packets_kernels import cast_packets
from toponav.sim.render.shading import images_of, with_lengths
from toponav.worlds.scene import Scene

__all__ = ["Hits", "PacketsRenderer", "packets_available"]


def packets_available() -> bool:
    """Whether embreex is installed with a library whose packet functions can be called."""
    return load_library() is not None


class PacketsRenderer:
    """Z-depth, faces and barycentric coordinates by Embree, in packets of neighbouring pixels.

    Args:
        scene: The building.
        camera: The camera.
        robust: Whether rays may never slip between triangles that share an edge; costs about a
            quarter of the speed, and changes nothing on extruded plans.

    Raises:
        InputError: If embreex or its library is missing, or the camera is above the ceiling.
    """

    backend = "packets"

    def __init__(self, scene: Scene, camera: Camera, robust: bool = False) -> None:
        require_embreex()
        if not packets_available():
            raise InputError(
                "the Embree library that embreex bundles could not be reached",
                where="renderer 'packets'",
                remedy="use backend='auto', or pip install 'embreex>=4.4,<5'",
            )
        check_camera(scene, camera)
        self.scene = scene
        self.camera = camera
        self._embree = EmbreeScene(scene.mesh.vertices_m, scene.mesh.faces, robust)
        self._pixels = _tiles(camera.height, camera.width, self._embree.width)
        rays_in_robot = camera.rays_in_robot()
        self._pixel_rays = with_lengths(rays_in_robot)
        rays = rays_in_robot.reshape(-1, 3)[self._pixels]
        self._rays = np.ascontiguousarray(rays.transpose(0, 2, 1))
        self._no_face = np.empty(0, np.int32)
        self._no_uv = np.empty((0, 2), np.float32)

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum."""
        depth_m = np.empty(self.camera.height * self.camera.width, np.float32)
        self._cast(pose, self.camera.max_depth_m, depth_m, self._no_face, self._no_uv)
        return depth_m.reshape(self.camera.height, self.camera.width)

    def hits(self, pose: Pose2, far_m: float | None = None) -> Hits:
        """Depth, face and barycentric coordinates of what a robot at `pose` sees.

        Args:
            pose: Where the robot is.
            far_m: How far to look; default the camera's maximum.
        """
        height, width = self.camera.height, self.camera.width
        depth_m = np.empty(height * width, np.float32)
        face = np.empty(height * width, np.int32)
        uv = np.empty((height * width, 2), np.float32)
        self._cast(pose, self.camera.max_depth_m if far_m is None else far_m, depth_m, face, uv)
        shape = (height, width)
        return Hits(depth_m.reshape(shape), face.reshape(shape), uv.reshape(height, width, 2))

    def render_images(self, pose: Pose2, modalities: Sequence[str] = MODALITIES) -> RenderedImages:
        """The images of one cast, as in `DepthRenderer.render_images`."""
        check_modalities(modalities)
        hits = self.hits(pose, math.inf)
        return images_of(self.scene, self.camera, pose, hits, self._pixel_rays, modalities)

    def _cast(
        self, pose: Pose2, far_m: float, depth_m: np.ndarray, face: np.ndarray, uv: np.ndarray
    ) -> None:
        check_viewpoint(self.scene, self.camera, pose)
        cast_packets(
            self._embree.function,
            self._embree.scene,
            self._embree.arguments,
            self._rays,
            self._pixels,
            (float(pose.x_m), float(pose.y_m), float(self.camera.mount_height_m)),
            math.cos(pose.yaw_rad),
            math.sin(pose.yaw_rad),
            float(far_m),
            depth_m,
            face,
            uv,
        )


def _tiles(height: int, width: int, packet: int) -> Int32[np.ndarray, "packets rays"]:
    """Pixel numbers in tiles of 4 rows, so that a packet's rays stay together; -1 outside."""
    tile_rows, tile_columns = 4, packet // 4
    rows, columns = -(-height // tile_rows) * tile_rows, -(-width // tile_columns) * tile_columns
    numbers = np.full((rows, columns), -1, np.int32)
    numbers[:height, :width] = np.arange(height * width, dtype=np.int32).reshape(height, width)
    tiles = numbers.reshape(rows // tile_rows, tile_rows, columns // tile_columns, tile_columns)
    return np.ascontiguousarray(tiles.transpose(0, 2, 1, 3).reshape(-1, packet))
