"""What every depth camera shares: its contract, and the checks on where it is put."""

import math
from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import Camera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render.images import MODALITIES, RenderedImages
from toponav.worlds.scene import Scene

__all__ = ["DepthRenderer", "check_camera", "check_viewpoint"]


@runtime_checkable
class DepthRenderer(Protocol):
    """A camera in a building: depth, and colour, class and instance images on request."""

    backend: str
    """Which of the backends this is."""
    scene: Scene
    """The building it sees."""
    camera: Camera
    """The camera it stands for."""

    def render(self, pose: Pose2) -> Float32[np.ndarray, "height width"]:
        """Z-depth in metres seen by a robot at `pose`, clipped at the camera's maximum.

        A ray that meets nothing reads the maximum, as does one that meets something beyond it.
        """

    def render_images(self, pose: Pose2, modalities: Sequence[str] = MODALITIES) -> RenderedImages:
        """Colour, depth, class and instance seen by a robot at `pose`, from one cast.

        Colour, class and instance reach beyond the depth's maximum.

        Args:
            pose: Where the robot is.
            modalities: Which of `rgb`, `depth`, `semantic` and `instance`.

        Raises:
            InputError: If a modality is unknown, or no camera can be there.
        """


def check_camera(scene: Scene, camera: Camera) -> None:
    """Nothing, when the camera is below the scene's ceiling; else an error that says so."""
    if camera.mount_height_m >= scene.ceiling_m:
        raise InputError(
            f"the camera must be below the ceiling at {scene.ceiling_m:.2f} m, "
            f"got mount_height_m = {camera.mount_height_m:.2f}",
            where=f"scene {scene.name}",
            remedy="lower the camera",
        )


def check_viewpoint(scene: Scene, camera: Camera, pose: Pose2) -> None:
    """Nothing, when a camera can be there; else an error that says why not."""
    if not (math.isfinite(pose.x_m) and math.isfinite(pose.y_m) and math.isfinite(pose.yaw_rad)):
        raise InputError(
            f"a pose must be finite, got {tuple(pose)}",
            where=f"scene {scene.name}",
            remedy="pass finite metres and radians",
        )
    if not scene.grid.contains(pose.x_m, pose.y_m):
        raise InputError(
            f"a camera must be inside the scene, got ({pose.x_m:.2f}, {pose.y_m:.2f}) m",
            where=f"scene {scene.name}",
            remedy="pick a pose in the scene's free space",
        )
    row, column = scene.grid.cell_of(pose.x_m, pose.y_m)
    if scene.is_extruded and scene.heights_m[row, column] > camera.mount_height_m:
        raise InputError(
            f"a camera cannot be inside an obstacle, got ({pose.x_m:.2f}, {pose.y_m:.2f}) m, "
            f"where something {float(scene.heights_m[row, column]):.2f} m high stands",
            where=f"scene {scene.name}",
            remedy="pick a pose in the scene's free space",
        )
