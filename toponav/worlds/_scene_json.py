"""All of a scene but its arrays, as JSON and back."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame
from toponav.worlds.layout import HallwayLayout
from toponav.worlds.materials import Attribution, Material, distinct_textures
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Door, Provenance, Room, Scene

__all__ = ["grid_of", "scene_metadata", "scene_of"]


def scene_metadata(scene: Scene) -> dict[str, Any]:
    """All but the arrays, as JSON; also what `scene.json` holds.

    What most scenes lack is left out, so that their hashes stay what they were.
    """
    more: dict[str, Any] = {}
    if scene.attribution:
        more["attribution"] = [dataclasses.asdict(entry) for entry in scene.attribution]
    if scene.imported_mesh is not None:
        more |= _materials_to_json(scene.imported_mesh.materials)
    return more | {
        "name": scene.name,
        "grid": {
            "resolution_m": float(scene.grid.resolution_m),
            "origin_m": [float(value) for value in scene.grid.origin_m],
            "rows": int(scene.grid.rows),
            "cols": int(scene.grid.cols),
        },
        "ceiling_m": float(scene.ceiling_m),
        "is_extruded": scene.is_extruded,
        "rooms": [
            {
                "name": room.name,
                "kind": str(room.kind),
                "polygon_m": None if room.polygon_m is None else room.polygon_m.tolist(),
            }
            for room in scene.rooms
        ],
        "doors": [
            {
                "name": door.name,
                "segment_m": door.segment_m.tolist(),
                "width_m": float(door.width_m),
                "rooms": list(door.rooms),
                "open_fraction": float(door.open_fraction),
            }
            for door in scene.doors
        ],
        "provenance": {
            "generator": scene.provenance.generator,
            "version": scene.provenance.version,
            "seed": scene.provenance.seed,
            "source": scene.provenance.source,
        },
        "layout": None if scene.layout is None else scene.layout.to_json(),
    }


def grid_of(document: dict[str, Any]) -> GridFrame:
    """The grid of a document; KeyError, TypeError or ValueError where it holds none."""
    place = document["grid"]
    return GridFrame(
        float(place["resolution_m"]),
        (float(place["origin_m"][0]), float(place["origin_m"][1])),
        int(place["rows"]),
        int(place["cols"]),
    )


def scene_of(document: dict[str, Any], grid: GridFrame, arrays: dict[str, np.ndarray]) -> Scene:
    """The scene of a document; KeyError, TypeError or ValueError where it holds none."""
    origin = document["provenance"]
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
        imported_mesh=None if document["is_extruded"] else _mesh_of(document, arrays),
        attribution=tuple(
            Attribution(*(str(entry[key]) for key in ("work", "creator", "licence", "source")))
            for entry in document.get("attribution", [])
        ),
    )


def _mesh_of(document: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> SceneMesh:
    """The mesh of a document that is not an extruded plan."""
    return SceneMesh(
        arrays["mesh_vertices_m"],
        arrays["mesh_faces"],
        arrays["mesh_face_semantic"],
        arrays["mesh_face_instance"],
        arrays["mesh_face_material"],
        arrays["mesh_corner_uv"],
        tuple(
            Material(
                str(entry["name"]),
                (float(entry["color"][0]), float(entry["color"][1]), float(entry["color"][2])),
                None if entry["texture"] is None else arrays[f"texture_{int(entry['texture'])}"],
                float(entry["emission"]),
            )
            for entry in document["materials"]
        ),
    )


def _materials_to_json(materials: Sequence[Material]) -> dict[str, Any]:
    """Materials, whose textures are numbered, and the size of each texture."""
    textures, numbers = distinct_textures(materials)
    return {
        "materials": [
            {
                "name": material.name,
                "color": [float(part) for part in material.color],
                "texture": number,
                "emission": float(material.emission),
            }
            for material, number in zip(materials, numbers, strict=True)
        ],
        "texture_sizes": [list(texture.shape) for texture in textures],
    }


def _points(value: Any) -> np.ndarray:
    """A list of [x, y] as an array."""
    points = np.array(value, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must be [x, y] pairs, got shape {points.shape}")
    return points
