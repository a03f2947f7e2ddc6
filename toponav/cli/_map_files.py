"""What the map commands read: maps, buildings, and floor plans beside them."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from toponav.core.errors import InputError
from toponav.core.files import check_out_file

if TYPE_CHECKING:
    from toponav.maps.spec import TopologicalMap
    from toponav.maps.validate import Building
    from toponav.worlds.load.ros_map import RosMap
    from toponav.worlds.scene import Scene

__all__ = [
    "Json",
    "MapPath",
    "NodeId",
    "area_map",
    "building_of",
    "building_of_scene",
    "floor_of",
    "is_yaml",
    "load_any_map",
    "load_building",
    "require_map_name",
    "with_plan",
]

_ROBOT_RADIUS_M = 0.18

Json = Annotated[bool, tyro.conf.arg(name="json")]
MapPath = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="MAP")]
NodeId = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="NODE")]


def is_yaml(path: Path) -> bool:
    """Whether a path names an area or a ROS map rather than a folder or our JSON."""
    return path.suffix.lower() in (".yaml", ".yml")


def require_map_name(path: Path) -> None:
    """Raises InputError unless the path can be written and ends in .json."""
    if not path.name.endswith(".json"):
        raise InputError(
            f"a map is a JSON file, got '{path.name}'",
            where=str(path),
            remedy=f"name it {path.stem or 'map'}.topo.json",
        )
    check_out_file(path, flag="map")


def load_any_map(path: Path) -> "TopologicalMap":
    """The map in a `*.topo.json`, or the authors' drawing of an area's yaml."""
    from toponav.maps.spec import load_map

    return area_map(path) if is_yaml(path) else load_map(path)


def area_map(area_yaml: Path) -> "TopologicalMap":
    """The authors' drawing of an area."""
    from toponav.maps.formats.canvas import load_area_map

    return load_area_map(area_yaml)


def load_building(path: Path) -> "Scene":
    """The scene in a folder, of a Stanford area's yaml, or of a ROS map's."""
    from toponav.worlds.load.stanford import load_area
    from toponav.worlds.storage import load_scene

    return load_area(path) if is_yaml(path) else load_scene(path)


def building_of(path: Path) -> "Building":
    """What the checks may ask about the building."""
    return building_of_scene(load_building(path), path)


def building_of_scene(scene: "Scene", path: Path) -> "Building":
    """What the checks may ask about a building that was loaded from a path."""
    from toponav.maps.validate import Building
    from toponav.worlds.free_space import FreeSpace
    from toponav.worlds.load.stanford import AreaFiles

    left_out: tuple[str, ...] = ()
    if is_yaml(path):
        left_out = AreaFiles.read(path).invalid_rooms
    has_rooms = bool(scene.rooms)
    return Building(
        rooms={room.name: room.kind for room in scene.rooms} if has_rooms else None,
        rooms_left_out=frozenset(left_out),
        room_at=scene.room_at if has_rooms else None,
        is_free=FreeSpace.of(scene, _ROBOT_RADIUS_M).is_free,
    )


def floor_of(topological_map: "TopologicalMap", source: Path) -> "RosMap | None":
    """The floor plan that a map names, where it is there."""
    from toponav.worlds.load.ros_map import read_ros_map

    plan = topological_map.frame.plan
    path = source.parent / plan if plan else None
    return read_ros_map(path) if path is not None and path.is_file() else None


def with_plan(made: "TopologicalMap", plan_yaml: Path, out: Path) -> "TopologicalMap":
    """The map with a reference to its floor plan that holds where the map is written."""
    from dataclasses import replace

    relative = os.path.relpath(plan_yaml.absolute(), out.absolute().parent)
    frame = replace(made.frame, plan=Path(relative).as_posix() if plan_yaml.is_file() else None)
    return replace(made, frame=frame)
