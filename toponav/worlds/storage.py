"""Scenes as folders that other tools open too.

A folder holds `scene.json` (all but arrays, and the content hash), `arrays.npz` (heights,
rooms and classes, lossless), `grid.png` with `map.yaml` (for ROS `map_server`) and
`mesh.glb` (for viewers). Loading reads the first two; the others are derived from them.
"""

import json
import math
import os
import shutil
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np
import yaml
from PIL import Image

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame, SemanticClass
from toponav.worlds.layout import HallwayLayout
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Door, Provenance, Room, Scene, scene_metadata

__all__ = ["load_scene", "save_scene"]

_SCHEMA = 1
_JSON, _ARRAYS, _GRID, _MAP, _MESH = "scene.json", "arrays.npz", "grid.png", "map.yaml", "mesh.glb"
_MAX_JSON_BYTES = 256_000_000
_MAX_ITEMS = 200_000_000
_FREE, _SOLID = 254, 0

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


def save_scene(scene: Scene, directory: str | Path) -> Path:
    """The folder in which the scene now lies, whole or not at all.

    An existing scene in the folder is replaced; other files there stay.

    Raises:
        InputError: When the folder holds something that is no scene, or cannot be written.
    """
    target = Path(directory)
    if target.exists() and not target.is_dir():
        raise InputError("is a file", where=str(target), remedy="name a folder")
    if target.is_dir() and any(target.iterdir()) and not (target / _JSON).is_file():
        raise InputError(
            "the folder holds files but no scene", where=str(target), remedy="name a new folder"
        )
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
        try:
            _write_files(scene, staging)
            _move_in(staging, target)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    except OSError as error:
        raise InputError(
            f"cannot be written ({error.strerror})",
            where=str(target),
            remedy="choose a folder on a disk with room that you may write to",
        ) from None
    return target


def load_scene(directory: str | Path) -> Scene:
    """The scene in a folder, exactly as it was saved.

    Raises:
        InputError: When a file is missing, broken or changed; the message names it.
    """
    folder = Path(directory)
    if folder.name == _JSON:
        folder = folder.parent
    document = _read_json(folder / _JSON)
    try:
        scene = _from_json(document, folder)
    except InputError as error:
        if error.where.startswith(str(folder)):
            raise
        raise InputError(
            f"{error.where}: {error.rule}", where=str(folder / _JSON), remedy=error.remedy
        ) from None
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        what = f"field {error} is missing" if isinstance(error, KeyError) else str(error)
        raise InputError(
            f"does not describe a scene ({what})",
            where=str(folder / _JSON),
            remedy="copy the folder again or generate the scene again",
        ) from None
    if document.get("content_hash") != scene.content_hash:
        raise InputError(
            f"the content hash must be {document.get('content_hash')}, got {scene.content_hash}: "
            f"{_JSON} or {_ARRAYS} was changed or cut",
            where=str(folder),
            remedy="copy the folder again or generate the scene again",
        )
    return scene


def _move_in(staging: Path, target: Path) -> None:
    """Puts the finished files in place; `scene.json`, which carries the hash, comes last."""
    staging.chmod(0o777 & ~_umask())
    if not target.exists():
        os.replace(staging, target)
        return
    for name in (_GRID, _MAP, _MESH, _ARRAYS, _JSON):
        os.replace(staging / name, target / name)


def _umask() -> int:
    """The process's file mode mask."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def _write_files(scene: Scene, folder: Path) -> None:
    """All five files of a scene."""
    arrays = {
        "heights_m": scene.heights_m,
        "room_index": scene.room_index,
        "semantics": scene.semantics,
    }
    if scene.imported_mesh is not None:
        mesh = scene.imported_mesh
        arrays |= {
            "mesh_vertices_m": mesh.vertices_m,
            "mesh_faces": mesh.faces,
            "mesh_face_semantic": mesh.face_semantic,
            "mesh_face_instance": mesh.face_instance,
        }
    # Named one by one: savez takes its arrays as keywords.
    np.savez_compressed(folder / _ARRAYS, **arrays)  # type: ignore[arg-type]
    pixels = np.where(scene.occupied[::-1], np.uint8(_SOLID), np.uint8(_FREE))
    Image.fromarray(pixels).save(folder / _GRID)
    ros = {
        "image": _GRID,
        "resolution": float(scene.grid.resolution_m),
        "origin": [*map(float, scene.grid.origin_m), 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    (folder / _MAP).write_text(yaml.safe_dump(ros, sort_keys=False), encoding="utf-8")
    (folder / _MESH).write_bytes(_glb(scene.mesh))
    document = {"schema": _SCHEMA, "content_hash": scene.content_hash, **scene_metadata(scene)}
    (folder / _JSON).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _glb(mesh: SceneMesh) -> bytes:
    """The mesh as binary glTF, y up, one named and coloured part per semantic class."""
    import trimesh

    parts = trimesh.Scene()
    for value in np.unique(mesh.face_semantic):
        kind = SemanticClass(int(value))
        used, faces = np.unique(mesh.faces[mesh.face_semantic == value], return_inverse=True)
        part = trimesh.Trimesh(mesh.vertices_m[used], faces.reshape(-1, 3), process=False)
        part.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=kind.name.lower(), baseColorFactor=(*_COLORS[kind], 255), roughnessFactor=0.9
            )
        )
        name = kind.name.lower()
        parts.add_geometry(part, node_name=name, geom_name=name, transform=_Y_UP)
    binary: bytes = parts.export(file_type="glb")
    return binary


def _read_json(path: Path) -> dict[str, Any]:
    """The document, of a schema that this version reads."""

    def refuse(constant: str) -> float:
        raise ValueError(f"{constant} is no JSON number")

    try:
        if path.stat().st_size > _MAX_JSON_BYTES:
            raise ValueError("it is too large")
        document = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
        if not isinstance(document, dict):
            raise ValueError("it must hold an object")
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})",
            where=str(path),
            remedy="name a folder that `toponav scene generate` or `import` wrote",
        ) from None
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"is not the JSON of a scene ({error})",
            where=str(path),
            remedy="copy the folder again or generate the scene again",
        ) from None
    if document.get("schema") != _SCHEMA:
        raise InputError(
            f"schema must be {_SCHEMA}, got {document.get('schema')!r}",
            where=str(path),
            remedy="generate the scene again with this version, or update toponav",
        )
    return document


def _from_json(document: dict[str, Any], folder: Path) -> Scene:
    """The scene of a document whose fields are not checked yet."""
    place = document["grid"]
    grid = GridFrame(
        float(place["resolution_m"]),
        (float(place["origin_m"][0]), float(place["origin_m"][1])),
        int(place["rows"]),
        int(place["cols"]),
    )
    origin = document["provenance"]
    extruded = bool(document["is_extruded"])
    arrays = _read_arrays(folder / _ARRAYS, grid, extruded)
    layout = document["layout"]
    return Scene(
        name=str(document["name"]),
        grid=grid,
        heights_m=arrays["heights_m"],
        ceiling_m=float(document["ceiling_m"]),
        room_index=arrays["room_index"],
        rooms=tuple(
            Room(
                str(room["name"]),
                RoomKind(room["kind"]),
                None if room["polygon_m"] is None else _points(room["polygon_m"]),
            )
            for room in document["rooms"]
        ),
        doors=tuple(
            Door(
                str(door["name"]),
                _points(door["segment_m"]),
                float(door["width_m"]),
                (str(door["rooms"][0]), str(door["rooms"][1])),
                float(door["open_fraction"]),
            )
            for door in document["doors"]
        ),
        semantics=arrays["semantics"],
        provenance=Provenance(
            str(origin["generator"]),
            str(origin["version"]),
            None if origin["seed"] is None else int(origin["seed"]),
            str(origin["source"]),
        ),
        layout=None if layout is None else HallwayLayout.from_json(layout),
        imported_mesh=None
        if extruded
        else SceneMesh(
            arrays["mesh_vertices_m"],
            arrays["mesh_faces"],
            arrays["mesh_face_semantic"],
            arrays["mesh_face_instance"],
        ),
    )


def _points(value: Any) -> np.ndarray:
    """A list of [x, y] as an array."""
    points = np.array(value, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must be [x, y] pairs, got shape {points.shape}")
    return points


def _read_arrays(path: Path, grid: GridFrame, extruded: bool) -> dict[str, np.ndarray]:
    """The arrays of a scene, of exactly these types and sizes; nothing else is read."""
    wanted: dict[str, tuple[str, tuple[int | None, ...]]] = {
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
        }
    arrays = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for name, (dtype, shape) in wanted.items():
                with archive.open(f"{name}.npy") as stream:
                    arrays[name] = _read_npy(stream, name, np.dtype(dtype), shape)
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror or error})",
            where=str(path),
            remedy="copy the folder again or generate the scene again",
        ) from None
    except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, ValueError) as error:
        raise InputError(
            f"does not hold the scene's arrays ({error})",
            where=str(path),
            remedy="copy the folder again or generate the scene again",
        ) from None
    return arrays


def _read_npy(
    stream: IO[bytes], name: str, dtype: np.dtype[Any], shape: tuple[int | None, ...]
) -> np.ndarray:
    """One array, its header checked before any memory is taken for it."""
    version = np.lib.format.read_magic(stream)  # type: ignore[no-untyped-call]
    if version != (1, 0):
        raise ValueError(f"{name} is of an unknown format")
    found, in_columns, found_dtype = np.lib.format.read_array_header_1_0(stream)  # type: ignore[no-untyped-call]
    fits = len(found) == len(shape) and all(
        size is None or size == got for size, got in zip(shape, found, strict=True)
    )
    if not fits or in_columns or found_dtype != dtype or math.prod(found) > _MAX_ITEMS:
        raise ValueError(f"{name} must be {dtype}{list(shape)}, got {found_dtype}{list(found)}")
    size = math.prod(found) * dtype.itemsize
    data = stream.read(size)
    if len(data) != size:
        raise ValueError(f"{name} is cut")
    return np.frombuffer(data, dtype).reshape(found).copy()
