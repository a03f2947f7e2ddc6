"""Scenes as folders that other tools open too.

A folder holds `scene.json` (all but arrays, and the content hash), `arrays.npz` (heights,
rooms and classes, lossless, and the mesh with its textures where the scene is no extruded
plan), `grid.png` with `map.yaml` (for ROS `map_server`) and `mesh.glb` (for viewers). Loading
reads the first two; the others are derived from them.
"""

import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from PIL import Image

from toponav.core.errors import InputError, shown
from toponav.core.files import read_json_object
from toponav.worlds._scene_arrays import read_arrays
from toponav.worlds._scene_json import grid_of, scene_metadata, scene_of
from toponav.worlds.gltf import glb_bytes
from toponav.worlds.materials import distinct_textures
from toponav.worlds.scene import Scene

__all__ = ["load_scene", "save_scene"]

_SCHEMA = 1
_JSON, _ARRAYS, _GRID, _MAP, _MESH = "scene.json", "arrays.npz", "grid.png", "map.yaml", "mesh.glb"
_FREE, _SOLID = 254, 0


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
        scene = _assemble(document, folder)
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
            f"the content hash must be {shown(document.get('content_hash'))}, got "
            f"{scene.content_hash}: {_JSON} or {_ARRAYS} was changed or cut",
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
            "mesh_face_material": mesh.face_material,
            "mesh_corner_uv": mesh.corner_uv,
        }
        for number, texture in enumerate(distinct_textures(mesh.materials)[0]):
            arrays[f"texture_{number}"] = texture
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
    (folder / _MESH).write_bytes(glb_bytes(scene.mesh))
    document = {"schema": _SCHEMA, "content_hash": scene.content_hash, **scene_metadata(scene)}
    (folder / _JSON).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _read_json(path: Path) -> dict[str, Any]:
    """The document, of a schema that this version reads."""
    document = read_json_object(path)
    if document.get("schema") != _SCHEMA:
        raise InputError(
            f"schema must be {_SCHEMA}, got {shown(document.get('schema'))}",
            where=str(path),
            remedy="generate the scene again with this version, or update toponav",
        )
    return document


def _assemble(document: dict[str, Any], folder: Path) -> Scene:
    """The scene of a document whose fields are not checked yet, and its arrays."""
    grid = grid_of(document)
    extruded = bool(document["is_extruded"])
    sizes = () if extruded else document["texture_sizes"]
    arrays = read_arrays(folder / _ARRAYS, grid, extruded, sizes)
    return scene_of(document, grid, arrays)
