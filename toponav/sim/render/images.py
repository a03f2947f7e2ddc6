"""What a camera can see besides depth, and the images of one cast."""

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np
from jaxtyping import Float32, Int32, UInt8

from toponav.core.errors import InputError, did_you_mean

__all__ = [
    "INSTANCE_OF_NOTHING",
    "MODALITIES",
    "SEMANTIC_OF_NOTHING",
    "Hits",
    "Modality",
    "RenderedImages",
    "check_modalities",
]

Modality = Literal["rgb", "depth", "semantic", "instance"]
MODALITIES: tuple[Modality, ...] = get_args(Modality)
"""Every modality by name."""

SEMANTIC_OF_NOTHING = 255
"""Class of a pixel whose ray leaves the building."""

INSTANCE_OF_NOTHING = -2
"""Instance of a pixel whose ray leaves the building; -1 is floor and ceiling."""


class Hits(NamedTuple):
    """What each pixel's ray meets.

    Attributes:
        depth_m: Z-depth, clipped at the farthest that was looked for.
        face: Index into the scene mesh's faces; -1 where nothing is within that.
        uv: Barycentric coordinates of the hit on that face.
    """

    depth_m: Float32[np.ndarray, "height width"]
    face: Int32[np.ndarray, "height width"]
    uv: Float32[np.ndarray, "height width 2"]


class RenderedImages(NamedTuple):
    """The images of one cast; None where one was not asked for.

    Attributes:
        rgb: Colour, sRGB.
        depth_m: Z-depth in metres, clipped at the camera's maximum.
        semantic: `SemanticClass` of what is seen, also beyond the depth's maximum.
        instance: Object that is seen, as in `SceneMesh.face_instance`.
    """

    rgb: UInt8[np.ndarray, "height width 3"] | None = None
    depth_m: Float32[np.ndarray, "height width"] | None = None
    semantic: UInt8[np.ndarray, "height width"] | None = None
    instance: Int32[np.ndarray, "height width"] | None = None


def check_modalities(modalities: Sequence[str]) -> None:
    """Nothing, when each is a modality and there is one; else an error with the nearest."""
    if isinstance(modalities, str) or not modalities:
        raise InputError(
            f"modalities must be a list of at least one name, got {modalities!r}",
            where="modalities",
            remedy=f"choose from {', '.join(MODALITIES)}",
        )
    for modality in modalities:
        if modality not in MODALITIES:
            raise InputError(
                f"no modality is called '{modality}'",
                where="modalities",
                remedy=did_you_mean(str(modality), MODALITIES),
            )
