"""The `semantic.obj` of Stanford 2D-3D-S: every object named by its class and room."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.mesh_parts import MeshPart
from toponav.worlds.load.room_labels import FaceRooms, kind_of_words

__all__ = ["face_rooms", "split_by_labels"]

# class_instanceNum_roomType_roomNum_areaNum
_LABEL = re.compile(r"^(<?[A-Za-z]+>?)_(\d+)_(<?[A-Za-z]+>?)_(\d+)_(\d+[a-z]?)$")
_CLASSES = {
    "beam": SemanticClass.COLUMN,
    "board": SemanticClass.BOARD,
    "bookcase": SemanticClass.BOOKCASE,
    "ceiling": SemanticClass.CEILING,
    "chair": SemanticClass.CHAIR,
    "clutter": SemanticClass.CLUTTER,
    "column": SemanticClass.COLUMN,
    "door": SemanticClass.DOOR,
    "floor": SemanticClass.FLOOR,
    "sofa": SemanticClass.SOFA,
    "table": SemanticClass.TABLE,
    "wall": SemanticClass.WALL,
    "window": SemanticClass.WINDOW,
    "<unk>": SemanticClass.CLUTTER,
}


def split_by_labels(parts: Sequence[MeshPart]) -> list[MeshPart] | None:
    """A part for each labelled object, with its class and room; None where labels are few.

    Labels are names of objects or, as in the published files, of materials:
    `class_instanceNum_roomType_roomNum_areaNum`.

    Reference:
        Armeni, Sax, Zamir, Savarese 2017, arXiv:1702.01105; the data set's README, 3D modalities.
    """
    found: list[MeshPart] = []
    labelled = total = 0
    for part in parts:
        total += len(part.faces)
        match = _LABEL.match(part.name)
        if match:
            labelled += len(part.faces)
            found.append(_labelled(part, match))
            continue
        of = part.face_material
        if of is None:
            found.append(part)
            continue
        for number in np.unique(of).tolist():
            chosen = of == number
            name = part.materials[number].name
            match = _LABEL.match(name)
            piece = replace(
                part,
                name=name if match else part.name,
                faces=part.faces[chosen],
                face_material=of[chosen],
                corner_uv=None if part.corner_uv is None else part.corner_uv[chosen],
            )
            labelled += int(chosen.sum()) if match else 0
            found.append(_labelled(piece, match) if match else piece)
    return found if labelled > 0.5 * total else None


def _labelled(part: MeshPart, match: re.Match[str]) -> MeshPart:
    kind, _, room, number, _ = match.groups()
    known = not room.startswith("<")
    return replace(
        part,
        semantic=_CLASSES.get(kind.lower(), SemanticClass.FURNITURE),
        room=f"{room}_{number}" if known else None,
        group=part.name,
    )


def face_rooms(parts: Sequence[MeshPart]) -> FaceRooms:
    """The rooms that the parts are labelled with, by the triangles of their floors."""
    names = sorted({part.room for part in parts if part.room is not None}, key=_natural)
    number_of = {name: number for number, name in enumerate(names)}
    of = [
        number_of[part.room] if part.room and part.semantic == SemanticClass.FLOOR else -1
        for part in parts
    ]
    counts = [len(part.faces) for part in parts]
    kinds = [(name, kind_of_words(name) or RoomKind.OFFICE) for name in names]
    return FaceRooms(kinds, np.repeat(np.array(of, np.int32), counts).astype(np.int32))


def _natural(name: str) -> tuple[str, int]:
    kind, _, number = name.rpartition("_")
    return kind, int(number)
