"""Triangles with a semantic class, an object instance and a material per face."""

import hashlib
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Int32, UInt8

from toponav.core.errors import InputError
from toponav.worlds.materials import GREY, Material, distinct_textures

__all__ = ["SceneMesh"]

_MAX_REPEATS = 1e5


@dataclass(frozen=True, eq=False)
class SceneMesh:
    """A triangle mesh in the map frame, faces counter-clockwise seen from free space.

    Attributes:
        vertices_m: Corner positions.
        faces: Three vertex indices a triangle.
        face_semantic: `SemanticClass` of each triangle.
        face_instance: Object that each triangle belongs to; -1 for floor and ceiling.
        face_material: Index into `materials` of each triangle; default the first.
        corner_uv: Place in the texture of each triangle's corners, in repeats of the texture:
            u to the right and v up from its lower left corner; default zero.
        materials: What surfaces look like; default one grey.
    """

    vertices_m: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    face_semantic: UInt8[np.ndarray, " faces"]
    face_instance: Int32[np.ndarray, " faces"]
    # Empty stands for "not given": filled in below, so that readers never meet a None.
    face_material: Int32[np.ndarray, " faces"] = field(
        default_factory=lambda: np.zeros(0, np.int32)
    )
    corner_uv: Float32[np.ndarray, "faces 3 2"] = field(
        default_factory=lambda: np.zeros((0, 3, 2), np.float32)
    )
    materials: tuple[Material, ...] = (GREY,)

    def __post_init__(self) -> None:
        count = len(self.faces)
        if len(self.face_material) == 0:
            object.__setattr__(self, "face_material", np.zeros(count, np.int32))
        if len(self.corner_uv) == 0:
            object.__setattr__(self, "corner_uv", np.zeros((count, 3, 2), np.float32))
        labels = (self.face_semantic, self.face_instance, self.face_material, self.corner_uv)
        if any(len(label) != count for label in labels):
            raise InputError(
                "every face has a class, an instance, a material and three texture places, got "
                f"{count} faces and {', '.join(str(len(label)) for label in labels)} of those",
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
        self._check_materials()

    def _check_materials(self) -> None:
        """InputError unless each face has a material and a place in its texture."""
        used = self.face_material
        if len(used) and not 0 <= used.min() <= used.max() < len(self.materials):
            raise InputError(
                f"face_material indexes {len(self.materials)} materials, got indices "
                f"{used.min()}..{used.max()}",
                where="SceneMesh",
                remedy="repair the mesh before importing it",
            )
        # Written so that a NaN fails it.
        good = np.abs(self.corner_uv) <= _MAX_REPEATS
        if not good.all():
            bad = int(np.flatnonzero(~good.all(axis=(1, 2)))[0])
            raise InputError(
                f"texture places must be finite and within {_MAX_REPEATS:g} repeats, got "
                f"{self.corner_uv[bad].tolist()}",
                where=f"SceneMesh face {bad}",
                remedy="repair the mesh before importing it",
            )

    def digest(self) -> bytes:
        """SHA-256 of all that the mesh holds but its materials' names, colours and glow."""
        # Adding zero turns -0.0 into 0.0: equal meshes have equal bytes.
        sha = hashlib.sha256((self.vertices_m + np.float32(0)).astype("<f4").tobytes())
        sha.update(self.faces.astype("<i4").tobytes())
        sha.update(self.face_semantic.astype("u1").tobytes())
        sha.update(self.face_instance.astype("<i4").tobytes())
        sha.update(self.face_material.astype("<i4").tobytes())
        sha.update((self.corner_uv + np.float32(0)).astype("<f4").tobytes())
        for texture in distinct_textures(self.materials)[0]:
            sha.update(texture.tobytes())
        return sha.digest()
