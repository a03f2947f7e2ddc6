"""Any building that a user already has, as a scene."""

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toponav.core.errors import InputError
from toponav.core.files import check_is_file
from toponav.worlds.load._mesh_rooms import rooms_from_walls
from toponav.worlds.load.gazebo import read_gazebo
from toponav.worlds.load.mesh_files import MESH_SUFFIXES, UNITS_M, UP_AXES, read_mesh, upright
from toponav.worlds.load.mesh_parts import Notes, clean_part
from toponav.worlds.load.mesh_scene import MeshOptions, RoomLabels, scene_of_parts
from toponav.worlds.load.source_files import FolderFiles
from toponav.worlds.load.stanford import load_area
from toponav.worlds.load.stanford_mesh import face_rooms, split_by_labels
from toponav.worlds.load.sweet_home import read_sweet_home
from toponav.worlds.scene import Door, Provenance, Scene

__all__ = ["ImportOptions", "Imported", "import_building"]

_VERSION = "1"
_MAP_SUFFIXES = (".yaml", ".yml")
_SDF_SUFFIXES = (".world", ".sdf")
_HOME_SUFFIXES = (".sh3d", ".sh3x")


@dataclass(frozen=True)
class ImportOptions:
    """What a file does not say of itself.

    Attributes:
        units: Unit of a mesh, one of `UNITS_M`; default what the file says, else metres.
        up: Axis of a mesh that points up, one of `UP_AXES`; default what the file says, else
            the one across which the largest flat surface lies.
        floor_height_m: Take the level nearest to this height instead of the largest.
        models: Folders in which a Gazebo world's `model://` is looked up.
        seed: Chooses the heights of the furniture where a plan does not give them.
    """

    units: str | None = None
    up: str | None = None
    floor_height_m: float | None = None
    models: tuple[Path, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        checks = {
            "units": self.units is None or self.units in UNITS_M,
            "up": self.up is None or self.up in UP_AXES,
            "floor_height_m": self.floor_height_m is None or abs(self.floor_height_m) < 1e5,
            "seed": self.seed >= 0,
        }
        remedies = {"units": f"one of {', '.join(UNITS_M)}", "up": f"one of {', '.join(UP_AXES)}"}
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where="ImportOptions",
                    remedy=remedies.get(name, "give a number in range"),
                )


@dataclass(frozen=True, eq=False)
class Imported:
    """A scene and how it came about.

    Attributes:
        scene: The building.
        kind: What the file was taken for.
        notes: What was assumed, repaired or left out.
    """

    scene: Scene
    kind: str
    notes: tuple[str, ...]


def import_building(path: str | Path, options: ImportOptions | None = None) -> Imported:
    """The scene of a building in any format that we read.

    Formats are told by extension, and by content where the extension says too little: meshes
    (GLB, glTF, OBJ, PLY, DAE, STL) and the `semantic.obj` of Stanford 2D-3D-S, Gazebo worlds
    (.world, .sdf), ROS maps and Stanford areas (.yaml), Sweet Home 3D (.sh3d).

    Raises:
        InputError: It is of no known format, or broken; the message names the place.

    Example:
        >>> import_building("graphnav_areas/area_3.yaml").kind
        'Stanford area'
    """
    path, options = Path(path), options or ImportOptions()
    kind = _kind(path)
    notes = Notes()
    if kind in _MAP_SUFFIXES:
        scene = load_area(path, seed=options.seed)
        if scene.rooms:
            return Imported(scene, "Stanford area", ())
        return Imported(_with_rooms(scene, notes), "ROS map", notes.lines)
    name = "".join(letter for letter in path.stem if letter.isprintable()) or "building"
    mesh_options = MeshOptions(floor_height_m=options.floor_height_m)
    if kind in _SDF_SUFFIXES:
        parts = read_gazebo(path, options.models, notes)
        scene = scene_of_parts(
            parts,
            name=name,
            provenance=Provenance("gazebo", _VERSION, None, path.name),
            where=str(path),
            notes=notes,
            options=mesh_options,
        )
        return Imported(scene, "Gazebo world", notes.lines)
    if kind in _HOME_SUFFIXES:
        return _sweet_home(path, name, options, notes)
    return _mesh(path, kind, name, options, mesh_options, notes)


def _mesh(
    path: Path,
    kind: str,
    name: str,
    options: ImportOptions,
    mesh_options: MeshOptions,
    notes: Notes,
) -> Imported:
    check_is_file(path)
    read = read_mesh(FolderFiles(path.parent), path.name, notes)
    unit_m = None if options.units is None else UNITS_M[options.units]
    up = options.up
    labelled = split_by_labels(read.parts) if kind == ".obj" else None
    if labelled is not None:
        read = replace(read, parts=labelled, unit_m=1.0, up="Z")
    parts = [clean_part(part, notes) for part in upright(read, notes, unit_m=unit_m, up=up)]
    parts = [part for part in parts if len(part.faces)]
    labels: RoomLabels | None = None
    if labelled is not None:
        labels = face_rooms(parts)
    scene = scene_of_parts(
        parts,
        name=name,
        provenance=Provenance("mesh", _VERSION, None, path.name),
        where=str(path),
        notes=notes,
        options=mesh_options,
        labels=labels,
    )
    what = "2D-3D-S semantic mesh" if labelled is not None else f"{kind[1:].upper()} mesh"
    return Imported(scene, what, notes.lines)


def _sweet_home(path: Path, name: str, options: ImportOptions, notes: Notes) -> Imported:
    home = read_sweet_home(path, notes, floor_height_m=options.floor_height_m)
    scene = scene_of_parts(
        home.parts,
        name=name,
        provenance=Provenance("sweet_home_3d", _VERSION, None, path.name),
        where=str(path),
        notes=notes,
        labels=home.rooms,
        attribution=home.attribution,
    )
    names = {room.name for room in scene.rooms}
    drawn = [door for door in home.doors if set(door.rooms) <= names]
    joined = {frozenset(door.rooms) for door in drawn}
    open_plan = [door for door in scene.doors if frozenset(door.rooms) not in joined]
    doors = [
        Door(f"door_{number}", door.segment_m, door.width_m, door.rooms, door.open_fraction)
        for number, door in enumerate([*drawn, *open_plan], start=1)
    ]
    return Imported(replace(scene, doors=tuple(doors)), "Sweet Home 3D home", notes.lines)


def _with_rooms(scene: Scene, notes: Notes) -> Scene:
    """A plan whose floor is cut into rooms; what is not free there belongs to none."""
    walls = scene.heights_m >= scene.ceiling_m
    everywhere = np.ones(scene.grid.shape, bool)
    rooms, doors, room_index = rooms_from_walls(
        scene.grid, walls, ~scene.occupied, everywhere, (), notes
    )
    return replace(scene, rooms=rooms, doors=doors, room_index=room_index)


def _kind(path: Path) -> str:
    """The suffix of the format: by the file's own, else by how it begins."""
    suffix = path.suffix.lower()
    known: Sequence[str] = (*_MAP_SUFFIXES, *_SDF_SUFFIXES, *_HOME_SUFFIXES, *MESH_SUFFIXES)
    if suffix in known:
        return suffix
    if path.is_file():
        with path.open("rb") as file:
            head = file.read(4096)
        if head[:4] == b"glTF":
            return ".glb"
        if head[:3] == b"ply":
            return ".ply"
        if b"<sdf" in head:
            return ".sdf"
        if b"<COLLADA" in head:
            return ".dae"
        if head[:2] == b"PK" and zipfile.is_zipfile(path):
            return ".sh3d"
    raise InputError(
        "is no building that can be read" if path.exists() else "no such file",
        where=str(path),
        remedy=f"give one of {', '.join(known)}",
    )
