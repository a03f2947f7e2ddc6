"""Triangles with a semantic class and an object instance per face."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int32, UInt8

from toponav.core.errors import InputError

__all__ = ["SceneMesh"]


@dataclass(frozen=True, eq=False)
class SceneMesh:
    """A triangle mesh in the map frame, faces counter-clockwise seen from free space.

    Attributes:
        vertices_m: Corner positions.
        faces: Three vertex indices a triangle.
        face_semantic: `SemanticClass` of each triangle.
        face_instance: Object that each triangle belongs to; -1 for floor and ceiling.
    """

    vertices_m: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    face_semantic: UInt8[np.ndarray, " faces"]
    face_instance: Int32[np.ndarray, " faces"]

    def __post_init__(self) -> None:
        count = len(self.faces)
        if not (len(self.face_semantic) == len(self.face_instance) == count):
            raise InputError(
                f"every face has a class and an instance, got {count} faces, "
                f"{len(self.face_semantic)} classes, {len(self.face_instance)} instances",
                where="SceneMesh",
                remedy="give one label per face",
            )
        if not np.isfinite(self.vertices_m).all():
            bad = int(np.flatnonzero(~np.isfinite(self.vertices_m).all(axis=1))[0])
            raise InputError(
                f"vertices must be finite, got {self.vertices_m[bad].tolist()}",
                where=f"SceneMesh vertex {bad}",
                remedy="repair the mesh before importing it",
            )
        if count and not 0 <= self.faces.min() <= self.faces.max() < len(self.vertices_m):
            raise InputError(
                f"faces index {len(self.vertices_m)} vertices, got indices "
                f"{self.faces.min()}..{self.faces.max()}",
                where="SceneMesh",
                remedy="repair the mesh before importing it",
            )
