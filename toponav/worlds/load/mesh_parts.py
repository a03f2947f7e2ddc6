"""Pieces of a building on their way from a file to a scene: triangles of one object."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Float32, Int32

from toponav.core.errors import InputError
from toponav.worlds.grid import SemanticClass
from toponav.worlds.materials import GREY, Material
from toponav.worlds.mesh import SceneMesh

__all__ = ["MAX_FACES", "MeshFile", "MeshPart", "Notes", "clean_part", "join_parts", "move_part"]

MAX_FACES = 30_000_000
"""More triangles than this are refused before they fill the memory."""

_FURTHEST_M = 1e5
_MAX_REPEATS = 1e4


class Notes:
    """What was found odd and repaired, each said once and counted."""

    def __init__(self) -> None:
        self._count: dict[str, int] = {}

    def add(self, note: str, count: int = 1) -> None:
        """One more of these."""
        if len(self._count) < 1000 or note in self._count:
            self._count[note] = self._count.get(note, 0) + count

    @property
    def lines(self) -> tuple[str, ...]:
        """Each note, with how often it applied."""
        return tuple(
            note if count == 1 else f"{note} (x {count})" for note, count in self._count.items()
        )


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one object in one frame.

    Attributes:
        name: What the file calls the object.
        vertices: Corner positions, in the file's or the scene's frame.
        faces: Three vertex indices a triangle.
        face_material: Index into `materials` of each triangle.
        corner_uv: Place in the texture of each corner, v up; None where there is none.
        materials: What surfaces look like.
        semantic: Class, where the file's labels tell it.
        room: Name of the room that the file's labels put it in, or None.
        group: Parts of equal group are one object; None is an object of its own.
    """

    name: str
    vertices: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    face_material: Int32[np.ndarray, " faces"] | None = None
    corner_uv: Float32[np.ndarray, "faces 3 2"] | None = None
    materials: tuple[Material, ...] = field(default=(GREY,))
    semantic: SemanticClass | None = None
    room: str | None = None
    group: str | None = None


@dataclass(frozen=True, eq=False)
class MeshFile:
    """What a file holds, in its own frame.

    Attributes:
        parts: Objects.
        unit_m: Length of its unit, or None where the format does not say.
        up: The axis that points up, X, Y or Z, or None where the format does not say.
    """

    parts: list[MeshPart]
    unit_m: float | None = None
    up: str | None = None


def move_part(part: MeshPart, matrix: Float[np.ndarray, "4 4"]) -> MeshPart:
    """The part in another frame; a mirroring transform turns the faces over."""
    vertices = part.vertices.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    moved = replace(part, vertices=vertices.astype(np.float32))
    if np.linalg.det(matrix[:3, :3]) >= 0:
        return moved
    uv = None if part.corner_uv is None else np.ascontiguousarray(part.corner_uv[:, ::-1])
    return replace(moved, faces=np.ascontiguousarray(part.faces[:, ::-1]), corner_uv=uv)


def clean_part(part: MeshPart, notes: Notes) -> MeshPart:
    """The part without triangles that have a corner nowhere, and with texture places in bounds.

    Corners that are not finite or are 100 km away make their triangles vanish, as do triangles
    that name a corner which is not there.
    """
    count = len(part.vertices)
    good = np.asarray(((part.faces >= 0) & (part.faces < count)).all(axis=1))
    if not good.all():
        notes.add("triangles without a corner left out", int((~good).sum()))
    with np.errstate(invalid="ignore"):
        sound = (np.abs(part.vertices) < _FURTHEST_M).all(axis=1)
    if not sound.all():
        notes.add("corners that are not finite left out", int((~sound).sum()))
        safe = np.where(good[:, None], part.faces, 0)
        good &= sound[safe].all(axis=1) if count else False
        part = replace(part, vertices=np.where(sound[:, None], part.vertices, np.float32(0)))
    if not good.all():
        part = replace(
            part,
            faces=part.faces[good],
            face_material=None if part.face_material is None else part.face_material[good],
            corner_uv=None if part.corner_uv is None else part.corner_uv[good],
        )
    if part.corner_uv is not None:
        with np.errstate(invalid="ignore"):
            uv = np.nan_to_num(part.corner_uv, nan=0.0, posinf=0.0, neginf=0.0)
            part = replace(part, corner_uv=np.clip(uv, -_MAX_REPEATS, _MAX_REPEATS))
    return part


def join_parts(
    parts: Sequence[MeshPart], semantics: Sequence[SemanticClass], where: str
) -> SceneMesh:
    """One mesh of parts that are already in the scene's frame; a part is an instance.

    Args:
        parts: Cleaned parts.
        semantics: Class of each.
        where: The file, for messages.

    Raises:
        InputError: There is no triangle, or there are too many.
    """
    faces_in_all = sum(len(part.faces) for part in parts)
    if not faces_in_all or faces_in_all > MAX_FACES:
        rule = "holds no triangles" if not faces_in_all else f"more than {MAX_FACES:,} triangles"
        raise InputError(rule, where=where, remedy="export the building again, or simplify it")
    vertices, faces, material, uv, kinds, instances = [], [], [], [], [], []
    materials: dict[int, int] = {}
    kept: list[Material] = []
    number_of: dict[str, int] = {}
    before = objects = 0
    for part, kind in zip(parts, semantics, strict=True):
        count = len(part.faces)
        number = objects if part.group is None else number_of.setdefault(part.group, objects)
        objects += number == objects
        to = np.zeros(len(part.materials), np.int32)
        for place, one in enumerate(part.materials):
            if id(one) not in materials:
                materials[id(one)] = len(kept)
                kept.append(one)
            to[place] = materials[id(one)]
        vertices.append(part.vertices)
        faces.append(part.faces + np.int32(before))
        before += len(part.vertices)
        of = np.zeros(count, np.int32) if part.face_material is None else part.face_material
        material.append(to[of])
        uv.append(
            np.zeros((count, 3, 2), np.float32) if part.corner_uv is None else part.corner_uv
        )
        kinds.append(np.full(count, kind, np.uint8))
        bare = kind in (SemanticClass.FLOOR, SemanticClass.CEILING)
        instances.append(np.full(count, -1 if bare else number, np.int32))
    return SceneMesh(
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(faces).astype(np.int32),
        np.concatenate(kinds),
        np.concatenate(instances),
        np.concatenate(material).astype(np.int32),
        np.concatenate(uv).astype(np.float32),
        tuple(kept),
    )
