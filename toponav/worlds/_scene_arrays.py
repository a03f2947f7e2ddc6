"""The arrays of a saved scene."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from toponav.core.arrays import Shape, read_npz
from toponav.worlds.grid import GridFrame

__all__ = ["read_arrays"]

_MAX_ITEMS = 200_000_000
_MAX_TEXTURES = 4096


def read_arrays(
    path: Path, grid: GridFrame, extruded: bool, texture_sizes: Sequence[Sequence[int]] = ()
) -> dict[str, np.ndarray]:
    """The arrays of a scene, of exactly these types and sizes; nothing else is read."""
    wanted: dict[str, tuple[str, Shape]] = {
        "heights_m": ("<f4", grid.shape),
        "room_index": ("<i2", grid.shape),
        "semantics": ("|u1", grid.shape),
    }
    if not extruded:
        wanted |= {
            "mesh_vertices_m": ("<f4", (None, 3)),
            "mesh_faces": ("<i4", (None, 3)),
            "mesh_face_semantic": ("|u1", (None,)),
            "mesh_face_instance": ("<i4", (None,)),
            "mesh_face_material": ("<i4", (None,)),
            "mesh_corner_uv": ("<f4", (None, 3, 2)),
        }
        if len(texture_sizes) > _MAX_TEXTURES:
            raise ValueError(
                f"at most {_MAX_TEXTURES} textures are read, got {len(texture_sizes)}"
            )
        for number, (height, width, _) in enumerate(texture_sizes):
            wanted[f"texture_{number}"] = ("|u1", (int(height), int(width), 3))
    remedy = "copy the folder again or generate the scene again"
    return read_npz(path, wanted, remedy=remedy, max_items=_MAX_ITEMS)
