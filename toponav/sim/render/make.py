"""Picks a depth camera for a scene."""

from typing import Literal, get_args

from toponav.core.camera import Camera, PanoramaCamera
from toponav.core.errors import InputError, did_you_mean
from toponav.sim.render.base import DepthRenderer
from toponav.sim.render.grid import GridRenderer
from toponav.worlds.scene import Scene

__all__ = ["Backend", "check_backend", "make_renderer"]

Backend = Literal["auto", "grid", "packets", "embreex", "reference"]


def check_backend(backend: str) -> None:
    """Nothing, when there is a backend of this name; else an error with the nearest one."""
    if backend not in get_args(Backend):
        raise InputError(
            f"no renderer is called '{backend}'",
            where="backend",
            remedy=did_you_mean(backend, get_args(Backend)),
        )


def make_renderer(scene: Scene, camera: Camera, backend: str = "auto") -> DepthRenderer:
    """The depth camera for a scene: the fastest exact one unless a backend is named.

    Args:
        scene: The building.
        camera: Size, field of view, place on the robot and clipping depth.
        backend: `auto`: `grid` for an extruded plan (unless the camera is an equirectangular
            panorama), else `packets`, else `embreex`.
            `grid`: walks the plan. `packets`: Embree, many rays at a time. `embreex`: plain
            embreex. `reference`: slow and obvious, for tests.

    Raises:
        InputError: If the backend is unknown or cannot show the scene.

    Example:
        >>> renderer = make_renderer(scene, PinholeCamera(width=80, height=60))
        >>> depth_m = renderer.render(Pose2(1.0, 2.0, 0.0))
    """
    check_backend(backend)
    # On a plan, equal angles are the one kind of level image for which casting is faster.
    walks_well = not isinstance(camera, PanoramaCamera) or camera.kind == "stitched"
    if backend == "grid" or (backend == "auto" and scene.is_extruded and walks_well):
        return GridRenderer(scene, camera)
    if backend == "reference":
        from toponav.sim.render.reference import ReferenceRenderer

        return ReferenceRenderer(scene, camera)
    from toponav.sim.render.embreex import EmbreexRenderer

    if backend == "embreex":
        return EmbreexRenderer(scene, camera)
    from toponav.sim.render.packets import PacketsRenderer, packets_available

    if backend == "auto" and not packets_available():
        return EmbreexRenderer(scene, camera)
    return PacketsRenderer(scene, camera)
