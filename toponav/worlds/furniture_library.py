"""Furniture by people who model it: the `.sh3f` libraries of Sweet Home 3D.

A library is a zip archive with a properties file, Wavefront models and their textures.
Nothing of it is unpacked to the disk; a model is read when its mesh is first asked for.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError, did_you_mean
from toponav.worlds.furniture_names import CLASS_OF, furniture_class
from toponav.worlds.load.properties import read_properties
from toponav.worlds.load.source_files import ZipFiles
from toponav.worlds.load.sweet_home_model import read_model
from toponav.worlds.materials import Attribution
from toponav.worlds.mesh import SceneMesh

__all__ = ["FurnitureLibrary", "FurnitureModel", "join_libraries", "load_sh3f"]

_CATALOGUE = "PluginFurnitureCatalog.properties"
_MAX_CATALOGUE_BYTES = 16_000_000
_MAX_MODELS = 20_000
_LARGEST_M = 20.0
_HELD_OUT_SHARE = 0.2
_NOT_INDOORS = frozenset({"characters", "exterior", "vehicles", "animals"})


@dataclass(frozen=True, eq=False)
class FurnitureModel:
    """A piece of furniture; its mesh is read when it is first asked for.

    The mesh stands on z = 0 with its middle at x = y = 0, as large as `size_m` says. Its back,
    the side that stands against a wall, is at +y; its front looks along -y.

    Attributes:
        id: Unique in its library, such as `Scopia#bed1`.
        name: For display.
        category: Furniture class, one of `CLASS_OF`.
        size_m: Width (x), depth (y) and height (z).
        elevation_m: How high above the floor it hangs or stands; 0 on the floor.
        creator: Who made it.
        licence: Terms that it may be used under.
        source: Name of the library's file.
        top_m: Height on which other things can be put down, or None.
        is_front: Whether the catalogue calls it a door or a window.
    """

    id: str
    name: str
    category: str
    size_m: tuple[float, float, float]
    creator: str
    licence: str
    source: str = ""
    elevation_m: float = 0.0
    top_m: float | None = None
    is_front: bool = False
    load: Callable[[], SceneMesh] | None = field(default=None, repr=False)

    @cached_property
    def mesh(self) -> SceneMesh:
        """Its triangles, materials and textures.

        Raises:
            InputError: The library's file is broken or gone; the message names it.
        """
        assert self.load is not None, "a library gives every model its loader"
        return self.load()

    @property
    def is_held_out(self) -> bool:
        """Whether it is kept from training scenes: one in five, by the hash of its id."""
        digest = hashlib.sha256(self.id.encode("utf-8", "surrogatepass")).digest()
        return digest[0] < 256 * _HELD_OUT_SHARE

    @property
    def attribution(self) -> Attribution:
        """What the licence wants said where the model is used."""
        return Attribution(self.name, self.creator, self.licence, self.source)


@dataclass(frozen=True, eq=False)
class FurnitureLibrary:
    """Furniture models of one or more libraries.

    Attributes:
        name: For display.
        models: In the catalogue's order.
    """

    name: str
    models: tuple[FurnitureModel, ...]

    def of(self, category: str, *, held_out: bool | None = None) -> tuple[FurnitureModel, ...]:
        """The models of a furniture class.

        Args:
            category: One of `CLASS_OF`.
            held_out: True for those of test scenes alone, False for those of training scenes;
                None for all.

        Raises:
            InputError: There is no such class.
        """
        if category not in CLASS_OF:
            raise InputError(
                f"no furniture class is called '{category}'",
                where=f"furniture library {self.name}",
                remedy=did_you_mean(category, CLASS_OF),
            )
        return tuple(
            model
            for model in self._by_category.get(category, ())
            if held_out is None or model.is_held_out == held_out
        )

    @property
    def categories(self) -> tuple[str, ...]:
        """The furniture classes of which there is at least one model."""
        return tuple(sorted(self._by_category))

    @cached_property
    def _by_category(self) -> dict[str, list[FurnitureModel]]:
        found: dict[str, list[FurnitureModel]] = {}
        for model in self.models:
            found.setdefault(model.category, []).append(model)
        return found


def load_sh3f(
    path: str | Path, *, max_faces: int = 3000, max_texture_px: int = 256
) -> FurnitureLibrary:
    """The furniture of an `.sh3f` library that belongs indoors and that we have a class for.

    Args:
        path: The library.
        max_faces: Models with more triangles are simplified when they are read.
        max_texture_px: Longest side of a texture; larger ones are shrunk.

    Raises:
        InputError: It is no such library; the message names the file and the property.

    Example:
        >>> load_sh3f("Scopia.sh3f").of("bed")[0].size_m  # doctest: +SKIP
        (1.705, 2.165, 0.922)
    """
    path = Path(path)
    files = ZipFiles(path)
    where = f"{path}:{_CATALOGUE}"
    if _CATALOGUE not in files:
        raise InputError(
            f"must hold {_CATALOGUE}",
            where=str(path),
            remedy="give a furniture library of Sweet Home 3D (.sh3f)",
        )
    said = read_properties(files.read(_CATALOGUE, max_bytes=_MAX_CATALOGUE_BYTES), where)
    models = []
    for number in range(1, _MAX_MODELS + 1):
        if f"name#{number}" not in said and f"model#{number}" not in said:
            break
        model = _model(said, number, files, where, max_faces, max_texture_px)
        if model is not None:
            models.append(model)
    else:
        raise InputError(
            f"at most {_MAX_MODELS:,} models are read", where=where, remedy="split the library"
        )
    double = len(models) - len({model.id for model in models})
    if double:
        raise InputError(
            f"ids must be unique, {double} come twice", where=where, remedy="repair the catalogue"
        )
    return FurnitureLibrary(_line(said.get("name", path.stem)), tuple(models))


def join_libraries(libraries: Sequence[FurnitureLibrary]) -> FurnitureLibrary:
    """All models of several libraries; of equal ids the first stays."""
    models: dict[str, FurnitureModel] = {}
    for library in libraries:
        for model in library.models:
            models.setdefault(model.id, model)
    return FurnitureLibrary(" + ".join(one.name for one in libraries), tuple(models.values()))


def _model(
    said: dict[str, str],
    number: int,
    files: ZipFiles,
    where: str,
    max_faces: int,
    max_texture_px: int,
) -> FurnitureModel | None:
    """One entry of the catalogue, or None where it is nothing to furnish a room with."""
    file = said.get(f"model#{number}", "").lstrip("/")
    if _text(said, "category", number).lower() in _NOT_INDOORS or not file.lower().endswith(
        ".obj"
    ):
        return None
    category = furniture_class(_text(said, "name", number)) or furniture_class(
        file.rpartition("/")[2]
    )
    if category is None:
        return None
    size_m = (
        _metres(said, "width", number, where),
        _metres(said, "depth", number, where),
        _metres(said, "height", number, where),
    )
    rotation = _rotation(said.get(f"modelRotation#{number}"), f"{where} modelRotation#{number}")
    top = said.get(f"dropOnTopElevation#{number}")
    top_m = _number(top, f"{where} dropOnTopElevation#{number}") / 100 if top else -1.0
    identity = _text(said, "id", number) or f"{files.path.stem}#{number}"
    return FurnitureModel(
        id=identity,
        name=_text(said, "name", number) or identity,
        category=category,
        size_m=size_m,
        creator=_text(said, "creator", number) or _line(said.get("provider", "unknown")),
        licence=_text(said, "license", number) or _line(said.get("license", "unknown")),
        source=files.path.name,
        elevation_m=_metres(said, "elevation", number, where, least_m=0.0, default="0"),
        top_m=top_m if 0 < top_m <= _LARGEST_M else None,
        is_front=_text(said, "doorOrWindow", number).lower() == "true",
        load=lambda: read_model(
            files, file, size_m, rotation, CLASS_OF[category], max_faces, max_texture_px
        ),
    )


def _text(said: dict[str, str], key: str, number: int) -> str:
    return _line(said.get(f"{key}#{number}", ""))


def _metres(
    said: dict[str, str],
    key: str,
    number: int,
    where: str,
    *,
    least_m: float = 1e-3,
    default: str = "",
) -> float:
    """A length, given in centimetres."""
    place = f"{where} {key}#{number}"
    value_m = _number(said.get(f"{key}#{number}", default), place) / 100
    if not least_m <= value_m <= _LARGEST_M:
        raise InputError(
            f"must lie in {100 * least_m:g}..{100 * _LARGEST_M:g} cm, got {100 * value_m:g}",
            where=place,
            remedy="give the size in centimetres",
        )
    return round(value_m, 6)


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e6:
        raise InputError(
            f"must be a number, got {text[:40]!r}", where=where, remedy="repair the catalogue"
        )
    return value


def _rotation(text: str | None, where: str) -> Float[np.ndarray, "3 3"]:
    """Nine numbers, row by row."""
    if text is None:
        return np.eye(3)
    values = np.array([_number(word, where) for word in text.split()[:10]])
    if values.shape != (9,):
        raise InputError(
            f"must be nine numbers, got {len(values)}", where=where, remedy="repair the catalogue"
        )
    matrix = values.reshape(3, 3)
    if not 1e-3 < abs(np.linalg.det(matrix)) < 1e3:
        raise InputError("must turn and not flatten", where=where, remedy="repair the catalogue")
    return matrix


def _line(text: str) -> str:
    """Printable, and no longer than a line."""
    return "".join(letter if letter.isprintable() else " " for letter in text).strip()[:400]
