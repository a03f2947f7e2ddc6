"""Furniture models of Sweet Home 3D: turned upright, scaled to their catalogue size."""

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.mesh_parts import MeshPart, Notes, clean_part, join_parts, move_part
from toponav.worlds.load.source_files import SourceFiles
from toponav.worlds.load.wavefront import read_obj
from toponav.worlds.materials import Material, linear_rgb
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.simplify import simplify_mesh

__all__ = ["FROM_SWEET_HOME", "fit_parts", "read_model"]

FROM_SWEET_HOME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Sweet Home 3D has y up and the front towards +z; we have z up and the front towards -y."""

_DEFAULTS = {
    name: Material(name, linear_rgb(colour))
    for name, colour in {
        "white": "#f4f4f4",
        "flwhite": "#f4f4f4",
        "black": "#181818",
        "flblack": "#181818",
        "red": "#c02020",
        "flred": "#c02020",
        "green": "#20a020",
        "blue": "#2040c0",
        "brown": "#7a5030",
        "grey": "#808080",
        "dkgrey": "#404040",
        "ltgrey": "#c0c0c0",
        "gray": "#808080",
        "gold": "#c0a040",
        "silver": "#c8c8c8",
        "chrome": "#b0b0b0",
        "brass": "#b09040",
        "bronze": "#8a6030",
        "copper": "#b07040",
        "yellow": "#e0c020",
        "orange": "#e08020",
    }.items()
}
"""Materials that models use by name alone."""


def read_model(
    files: SourceFiles,
    name: str,
    size_m: tuple[float, float, float],
    rotation: Float[np.ndarray, "3 3"],
    semantic: SemanticClass,
    max_faces: int,
    max_texture_px: int,
    notes: Notes | None = None,
) -> SceneMesh:
    """The model as one object of this size, standing on z = 0 around x = y = 0, back at +y.

    Raises:
        InputError: It cannot be read, or is empty.
    """
    notes = notes or Notes()
    where = f"{files.label}:{name}"
    parts = [
        clean_part(part, notes)
        for part in read_obj(files, name, notes, defaults=_DEFAULTS, max_texture_px=max_texture_px)
    ]
    fitted = fit_parts(parts, size_m, FROM_SWEET_HOME @ rotation, where)
    joined = join_parts(fitted, [semantic] * len(fitted), where)
    one = np.zeros(len(joined.faces), np.int32)
    mesh = SceneMesh(
        joined.vertices_m,
        joined.faces,
        joined.face_semantic,
        one,
        joined.face_material,
        joined.corner_uv,
        joined.materials,
    )
    return simplify_mesh(_without_unused(mesh), max_faces)


def fit_parts(
    parts: list[MeshPart],
    size_m: tuple[float, float, float],
    turn: Float[np.ndarray, "3 3"],
    where: str,
) -> list[MeshPart]:
    """The parts turned and stretched into a box of this size that stands on the origin."""
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise InputError("holds no triangles", where=where, remedy="export the model again")
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    turned = [move_part(part, matrix) for part in parts]
    corners = [part.vertices[np.unique(part.faces)] for part in turned]
    low = np.min([part.min(axis=0) for part in corners], axis=0).astype(np.float64)
    high = np.max([part.max(axis=0) for part in corners], axis=0).astype(np.float64)
    scale = np.array(size_m) / np.maximum(high - low, 1e-9)
    scale = np.where(high - low > 1e-9, scale, 1.0)
    fit = np.diag([*scale, 1.0])
    fit[:3, 3] = -scale * [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]
    return [move_part(part, fit) for part in turned]


def _without_unused(mesh: SceneMesh) -> SceneMesh:
    """The mesh with only the materials that a triangle has."""
    used, numbers = np.unique(mesh.face_material, return_inverse=True)
    return SceneMesh(
        mesh.vertices_m,
        mesh.faces,
        mesh.face_semantic,
        mesh.face_instance,
        numbers.ravel().astype(np.int32),
        mesh.corner_uv,
        tuple(mesh.materials[number] for number in used.tolist()),
    )
