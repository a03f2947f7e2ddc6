"""Meshes as binary glTF, for viewers and modelling programs."""

import numpy as np

from toponav.worlds.grid import SemanticClass
from toponav.worlds.mesh import SceneMesh

__all__ = ["glb_bytes"]

# glTF is y up, toponav is z up.
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
_COLORS = {
    SemanticClass.FLOOR: (184, 172, 156),
    SemanticClass.WALL: (226, 224, 218),
    SemanticClass.CEILING: (240, 240, 240),
    SemanticClass.DOOR: (166, 112, 60),
    SemanticClass.COLUMN: (200, 200, 196),
    SemanticClass.WINDOW: (170, 200, 220),
    SemanticClass.TABLE: (176, 136, 92),
    SemanticClass.CHAIR: (70, 90, 120),
    SemanticClass.SOFA: (120, 80, 90),
    SemanticClass.BOOKCASE: (132, 98, 66),
    SemanticClass.BOARD: (235, 235, 240),
    SemanticClass.CLUTTER: (150, 150, 110),
    SemanticClass.FURNITURE: (150, 120, 90),
}


def glb_bytes(mesh: SceneMesh) -> bytes:
    """The mesh as binary glTF, y up, one named and coloured part per semantic class."""
    import trimesh

    parts = trimesh.Scene()
    for value in np.unique(mesh.face_semantic):
        kind = SemanticClass(int(value))
        used, faces = np.unique(mesh.faces[mesh.face_semantic == value], return_inverse=True)
        part = trimesh.Trimesh(mesh.vertices_m[used], faces.reshape(-1, 3), process=False)
        part.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
            material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
                name=kind.name.lower(), baseColorFactor=(*_COLORS[kind], 255), roughnessFactor=0.9
            )
        )
        name = kind.name.lower()
        parts.add_geometry(part, node_name=name, geom_name=name, transform=_Y_UP)
    binary: bytes = parts.export(file_type="glb")  # type: ignore[no-untyped-call]
    return binary
