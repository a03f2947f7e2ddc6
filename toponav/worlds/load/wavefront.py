"""Wavefront OBJ: triangles by object and material, and the materials of its MTL files."""

from collections.abc import Mapping

import numpy as np

from toponav.core.errors import InputError, shown
from toponav.worlds.load.mesh_parts import MAX_FACES, MeshPart, Notes
from toponav.worlds.load.source_files import SourceFiles, beside
from toponav.worlds.load.textures import named_texture
from toponav.worlds.load.wavefront_kernels import count_obj, fill_obj
from toponav.worlds.materials import GREY, Material, linear_rgb

__all__ = ["MAX_MESH_BYTES", "read_obj"]

MAX_MESH_BYTES = 3 << 30
_MAX_MTL_BYTES = 16_000_000
_MAX_MATERIALS = 20_000
_MAX_NAMES = 1_000_000
_VALUES_OF = {"-mm": 2, "-o": 3, "-s": 3, "-t": 3}
"""Options of a texture in an MTL file that take other than one value."""


def read_obj(
    files: SourceFiles,
    name: str,
    notes: Notes,
    *,
    defaults: Mapping[str, Material] | None = None,
    max_texture_px: int = 512,
) -> list[MeshPart]:
    """One part for each named object; without `o` lines, for each group; else one.

    Textures and material files that are missing are noted, and the surface is grey.

    Args:
        files: Where the file and what it names lie.
        name: The OBJ file.
        notes: Where repairs are written down.
        defaults: Materials that the file may use without naming a library.
        max_texture_px: Longest side of a texture; larger ones are shrunk.

    Raises:
        InputError: It cannot be read, or has more than `MAX_FACES` triangles.
    """
    where = f"{files.label}/{name}"
    text = np.frombuffer(files.read(name, max_bytes=MAX_MESH_BYTES), np.uint8)
    vertex_count, place_count, face_count, name_count = count_obj(text)
    if face_count > MAX_FACES or name_count > _MAX_NAMES:
        raise InputError(
            f"at most {MAX_FACES:,} triangles and {_MAX_NAMES:,} names are read, got "
            f"{face_count:,} and {name_count:,}",
            where=where,
            remedy="simplify the mesh or cut it into parts",
        )
    vertices = np.zeros((vertex_count, 3), np.float32)
    places = np.zeros((place_count, 2), np.float32)
    faces = np.zeros((face_count, 3), np.int32)
    face_places = np.full((face_count, 3), -1, np.int32)
    at, begins = np.zeros(name_count, np.int64), np.zeros(name_count, np.int64)
    with np.errstate(over="ignore"):
        fill_obj(text, vertices, places, faces, face_places, at, begins)
    said = [_words(text, int(start)) for start in at]
    materials = _Materials(files, name, notes, dict(defaults or {}), max_texture_px)
    owner, object_names = _owners(said, begins, face_count)
    surface = materials.of_faces(said, begins, face_count)
    uv = _corner_places(places, face_places, notes)
    parts = []
    for number, first, last in _slices(owner):
        chosen = np.s_[first:last]
        used, corners = np.unique(faces[chosen], return_inverse=True)
        safe = np.clip(used, 0, max(vertex_count - 1, 0))
        if not vertex_count:
            continue
        local = corners.reshape(-1, 3).astype(np.int32)
        bad = (used < 0) | (used >= vertex_count)
        local = np.where(bad[local], np.int32(-1), local) if bad.any() else local
        parts.append(
            MeshPart(
                object_names[number],
                vertices[safe],
                local,
                surface[chosen],
                None if uv is None else uv[chosen],
                materials.listed,
            )
        )
    return parts


def _words(text: np.ndarray, start: int) -> tuple[str, str]:
    """The first word of a line, and the rest of it."""
    line = text[start : start + 1000].tobytes().split(b"\n", 1)[0]
    key, _, rest = line.decode("utf-8", "replace").strip().partition(" ")
    return key, rest.strip()


def _owners(
    said: list[tuple[str, str]], begins: np.ndarray, face_count: int
) -> tuple[np.ndarray, list[str]]:
    """The object of each triangle, and the objects' names."""
    has_objects = any(key == "o" for key, _ in said)
    names = [""]
    number_of = {"": 0}
    owner = np.zeros(face_count, np.int32)
    for (key, rest), first in zip(said, begins.tolist(), strict=True):
        if key == ("o" if has_objects else "g"):
            number = number_of.setdefault(rest, len(names))
            if number == len(names):
                names.append(rest)
            owner[first:] = number
    return owner, names


def _slices(owner: np.ndarray) -> list[tuple[int, int, int]]:
    """Runs of triangles of one object: its number, the first and the end."""
    if not len(owner):
        return []
    cuts = np.flatnonzero(np.diff(owner)) + 1
    firsts = np.concatenate([[0], cuts]).tolist()
    lasts = np.concatenate([cuts, [len(owner)]]).tolist()
    return [(int(owner[first]), first, last) for first, last in zip(firsts, lasts, strict=True)]


def _corner_places(places: np.ndarray, corners: np.ndarray, notes: Notes) -> np.ndarray | None:
    """The place in the texture of each corner; zero where a corner has none."""
    if not len(places) or not (corners >= 0).any():
        return None
    bad = corners >= len(places)
    if bad.any():
        notes.add("corners with a texture place that is not there", int(bad.sum()))
    known = (corners >= 0) & ~bad
    uv = places[np.where(known, corners, 0)]
    uv[~known] = 0
    return np.asarray(uv, np.float32)


class _Materials:
    """The materials that an OBJ file uses, by name."""

    def __init__(
        self,
        files: SourceFiles,
        name: str,
        notes: Notes,
        known: dict[str, Material],
        max_texture_px: int,
    ) -> None:
        self._files, self._name, self._notes = files, name, notes
        self._known = known
        self._max_texture_px = max_texture_px
        self._listed: list[Material] = [GREY]
        self._textures: dict[str, np.ndarray | None] = {}

    @property
    def listed(self) -> tuple[Material, ...]:
        """What the numbers given by `of_faces` stand for."""
        return tuple(self._listed)

    def of_faces(
        self, said: list[tuple[str, str]], begins: np.ndarray, face_count: int
    ) -> np.ndarray:
        """The number of each triangle's material."""
        number_of: dict[str, int] = {}
        surface = np.zeros(face_count, np.int32)
        read: set[str] = set()
        for (key, rest), first in zip(said, begins.tolist(), strict=True):
            if key == "mtllib" and rest and rest not in read and len(read) < 100:
                read.add(rest)
                self._read_library(rest)
            elif key == "usemtl":
                if rest not in number_of:
                    material = self._known.get(rest)
                    if material is None:
                        self._notes.add(f"no material {shown(rest, 60)}: grey instead")
                        material = Material(_plain(rest))
                    number_of[rest] = len(self._listed)
                    self._listed.append(material)
                surface[first:] = number_of[rest]
        return surface

    def _read_library(self, reference: str) -> None:
        """Adds the materials of an MTL file; a missing one leaves its surfaces grey."""
        library = beside(self._name, reference)
        try:
            data = self._files.read(library, max_bytes=_MAX_MTL_BYTES)
        except InputError as error:
            self._notes.add(f"material file {shown(reference, 60)} left out: {error.rule[:120]}")
            return
        settings: dict[str, str] = {}
        name: str | None = None
        for raw in data.decode("utf-8", "replace").splitlines():
            words = raw.strip().split(None, 1)
            key, rest = (
                (words[0].lower(), words[1] if len(words) > 1 else "") if words else ("", "")
            )
            if key == "newmtl":
                self._add(name, settings, library)
                name, settings = rest, {}
            else:
                settings[key] = rest
        self._add(name, settings, library)

    def _add(self, name: str | None, settings: dict[str, str], library: str) -> None:
        if name is None or len(self._known) >= _MAX_MATERIALS:
            return
        texture = self._texture(settings.get("map_kd", ""), library)
        color = linear_rgb(_three(settings.get("kd", ""), 0.8))
        glow = max(_three(settings.get("ke", ""), 0.0))
        self._known[name] = Material(
            _plain(name),
            (1.0, 1.0, 1.0) if texture is not None else color,
            texture,
            min(glow, 1.0),
        )

    def _texture(self, line: str, library: str) -> np.ndarray | None:
        """The picture that a `map_Kd` line names, without its options."""
        reference = _without_options(line)
        if not reference:
            return None
        name = beside(library, reference)
        if name not in self._textures:
            self._textures[name] = named_texture(
                self._files, library, reference, self._notes, max_px=self._max_texture_px
            )
        return self._textures[name]


def _plain(name: str) -> str:
    """A name that can be shown."""
    return "".join(letter for letter in name if letter.isprintable())[:100] or "material"


def _without_options(line: str) -> str:
    """The file name at the end of a texture line; it may hold spaces."""
    words = line.split()
    while words and words[0].startswith("-") and len(words) > 1:
        words = words[1 + _VALUES_OF.get(words[0].lower(), 1) :]
    return " ".join(words)


def _three(text: str, default: float) -> tuple[float, float, float]:
    """Three numbers from 0 to 1; one stands for all."""
    try:
        values = [min(max(float(word), 0.0), 1.0) for word in text.split()[:3]]
    except ValueError:
        values = []
    if any(value != value for value in values) or not values:
        return (default,) * 3
    return (values[0], values[1], values[2]) if len(values) == 3 else (values[0],) * 3
