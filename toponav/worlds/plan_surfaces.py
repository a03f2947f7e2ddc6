"""What extruded plans look like: one surface per semantic class, laid on by the metre."""

from functools import cache

import numpy as np
from jaxtyping import Float32, Int32, UInt8

from toponav.worlds.generate.surfaces import Surface, surface
from toponav.worlds.grid import SemanticClass

__all__ = ["class_surfaces", "planar_uv"]

# Kind of surface and its variant; a class that is not named is made of wood.
_LOOK_OF = {
    SemanticClass.FLOOR: ("carpet", 12),
    SemanticClass.WALL: ("paint", 1),
    SemanticClass.CEILING: ("white", 0),
    SemanticClass.DOOR: ("wood", 8),
    SemanticClass.COLUMN: ("stone", 6),
    SemanticClass.WINDOW: ("outdoors", 1),
    SemanticClass.TABLE: ("wood", 9),
    SemanticClass.CHAIR: ("fabric", 1),
    SemanticClass.SOFA: ("fabric", 8),
    SemanticClass.BOOKCASE: ("books", 3),
    SemanticClass.BOARD: ("plastic", 14),
    SemanticClass.CLUTTER: ("cardboard", 0),
    SemanticClass.FURNITURE: ("wood", 17),
}
_DEFAULT = ("wood", 17)


@cache
def class_surfaces() -> tuple[Surface, ...]:
    """The surface of each `SemanticClass`, by its value."""
    return tuple(
        surface(*_LOOK_OF.get(SemanticClass(value), _DEFAULT))
        for value in range(max(SemanticClass) + 1)
    )


def planar_uv(
    vertices_m: Float32[np.ndarray, "vertices 3"],
    faces: Int32[np.ndarray, "faces 3"],
    face_semantic: UInt8[np.ndarray, " faces"],
) -> Float32[np.ndarray, "faces 3 2"]:
    """Places in the texture of each class, repeated by the metre, on axis-parallel faces."""
    corners = vertices_m[faces].astype(np.float64)
    flat = np.ptp(corners, axis=1) < 1e-6
    along = np.where(flat[:, 0], 1, 0)  # y on walls that face x, else x
    up = np.where(flat[:, 2], 1, 2)  # y on floors and tops, else z
    places = np.stack(
        [np.take_along_axis(corners, axis[:, None, None], axis=2)[..., 0] for axis in (along, up)],
        axis=-1,
    )
    scales = np.array([each.scale_m or 1.0 for each in class_surfaces()])
    uv = places / scales[face_semantic][:, None, None]
    # Whole repeats make no difference, and small numbers are exact.
    return np.asarray(uv - np.floor(uv.min(axis=1, keepdims=True)), np.float32)
