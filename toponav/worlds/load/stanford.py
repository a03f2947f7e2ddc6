"""Areas of Stanford 2D-3D-S as GraphNav's authors published them: plan, rooms, pairs.

The scanned meshes are not part of them. The plan is extruded instead: walls to the ceiling,
loose pieces to the height of the furniture that they probably are.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int16

from toponav.core.errors import InputError, did_you_mean, shown
from toponav.core.files import file_beside, read_bytes, read_json
from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.vocabulary import RoomKind
from toponav.worlds.load.matlab import MatlabStruct, read_matlab_variable
from toponav.worlds.load.obstacle_heights import raise_obstacles
from toponav.worlds.load.ros_map import read_ros_map, read_yaml_mapping
from toponav.worlds.rooms import outline_m
from toponav.worlds.scene import GridFrame, Provenance, Room, Scene

__all__ = ["AreaFiles", "StartGoalPair", "load_area", "load_pairs"]

_VERSION = "1"
_MAX_MAT_BYTES = 64_000_000
_MOST_RAD = 1e6
_LARGEST_SIZE = 1000.0
_KINDS = {
    "auditorium": RoomKind.AUDITORIUM,
    "conferenceroom": RoomKind.CONFERENCE_ROOM,
    "copyroom": RoomKind.COPY_ROOM,
    "hallway": RoomKind.HALLWAY,
    # The authors let a robot follow a lobby as it follows a hallway.
    "lobby": RoomKind.HALLWAY,
    "lounge": RoomKind.LOUNGE,
    "office": RoomKind.OFFICE,
    "openspace": RoomKind.OPEN_SPACE,
    "pantry": RoomKind.PANTRY,
    "storage": RoomKind.STORAGE,
    "wc": RoomKind.WC,
}


@dataclass(frozen=True)
class AreaFiles:
    """What an area's yaml says beside the ROS map fields.

    Attributes:
        yaml: The yaml file itself.
        mat: Rooms and clutter (MATLAB), or None for a plain ROS map.
        graph: The authors' drawing of the topological map, or None.
        plans: The published start and goal pairs beside the yaml, or None.
        node_sizes: Size of the nodes that are not of size 1, by node name.
        invalid_rooms: Rooms that the authors leave out.
    """

    yaml: Path
    mat: Path | None
    graph: Path | None
    plans: Path | None
    node_sizes: dict[str, float] = field(default_factory=dict)
    invalid_rooms: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The area's name, such as `area_3`."""
        return self.yaml.stem

    @staticmethod
    def read(yaml_path: str | Path) -> "AreaFiles":
        """The files of an area; that they exist is checked where they are opened.

        Raises:
            InputError: When the yaml is broken.
        """
        path = Path(yaml_path)
        settings = read_yaml_mapping(path)
        sizes = settings.get("node_sizes") or {}
        rooms = settings.get("invalid_rooms") or []
        if not isinstance(sizes, dict) or not all(map(_is_size, sizes.values())):
            raise _broken(path, f"node_sizes must map node names to sizes > 0, got {shown(sizes)}")
        if not isinstance(rooms, list):
            raise _broken(path, f"invalid_rooms must be a list of rooms, got {shown(rooms)}")
        plans = path.with_name(f"{path.stem}_plans.json")
        return AreaFiles(
            yaml=path,
            mat=_beside(path, settings, "mat_filepath"),
            graph=_beside(path, settings, "graph_filepath"),
            plans=plans if plans.is_file() else None,
            node_sizes={str(node): float(size) for node, size in sizes.items()},
            invalid_rooms=tuple(map(str, rooms)),
        )


@dataclass(frozen=True)
class StartGoalPair:
    """One published task: where to start and where to go.

    Attributes:
        start_room: Exact name of the room at the start.
        end_room: Exact name of the room at the goal.
        start_pose: Start in the map frame.
        end_xy: Goal in the map frame, in metres.
    """

    start_room: str
    end_room: str
    start_pose: Pose2
    end_xy: tuple[float, float]


def load_area(yaml_path: str | Path, seed: int = 0) -> Scene:
    """The scene of an area; a ROS map without rooms loads too.

    Args:
        yaml_path: The area's yaml, as the authors published it.
        seed: Chooses the ceiling and the heights of the furniture.

    Raises:
        InputError: When a file is missing or broken; the message names it.

    Example:
        >>> load_area("graphnav_areas/area_3.yaml").room_at(21.0, -2.0)
        'hallway_1'
    """
    files = AreaFiles.read(yaml_path)
    plan = read_ros_map(files.yaml)
    rng = np.random.default_rng(seed)
    ceiling_m = round(float(rng.uniform(2.6, 3.0)), 2)
    room_index = np.full(plan.grid.shape, -1, np.int16)
    rooms: tuple[Room, ...] = ()
    if files.mat is not None:
        rooms, room_index = _read_rooms(files.mat, plan.grid)
    obstacles = raise_obstacles(plan.occupied, room_index, plan.grid.resolution_m, ceiling_m, rng)
    try:
        return Scene(
            name=files.name,
            grid=plan.grid,
            heights_m=obstacles.heights_m,
            ceiling_m=ceiling_m,
            room_index=room_index,
            rooms=rooms,
            doors=(),
            semantics=obstacles.semantics,
            provenance=Provenance("stanford", _VERSION, seed, files.yaml.name),
        )
    except InputError as error:
        where = str(files.mat or files.yaml)
        raise InputError(error.rule, where=where, remedy=error.remedy) from None


def load_pairs(plans_json: str | Path, area_yaml: str | Path | None = None) -> list[StartGoalPair]:
    """The published start and goal pairs, in the map frame.

    Args:
        plans_json: A list of {start_room, end_room, start_px, end_px (row, column), start_yaw}.
        area_yaml: The area that the pixels refer to; default `X.yaml` beside `X_plans.json`.

    Raises:
        InputError: When a file is broken or a pixel lies outside the plan.
    """
    path = Path(plans_json)
    if area_yaml is None:
        area_yaml = path.with_name(path.stem.removesuffix("_plans") + ".yaml")
    entries = read_json(path)
    if not isinstance(entries, list):
        raise _broken(path, f"must hold a list of pairs, got {type(entries).__name__}")
    grid = read_ros_map(area_yaml).grid
    return [_pair(entry, number, grid, path) for number, entry in enumerate(entries)]


def _pair(entry: Any, number: int, grid: GridFrame, path: Path) -> StartGoalPair:
    """One entry of the list, checked."""
    where = f"{path} pair {number}"
    if not isinstance(entry, dict):
        raise _broken(where, f"must be an object, got {type(entry).__name__}")
    yaw = entry.get("start_yaw")
    if isinstance(yaw, bool) or not isinstance(yaw, int | float) or not abs(yaw) <= _MOST_RAD:
        raise _broken(where, f"start_yaw must be an angle in radians, got {shown(yaw)}")
    for key in ("start_room", "end_room"):
        if not isinstance(entry.get(key), str):
            raise _broken(where, f"{key} must be a room's name, got {shown(entry.get(key))}")
    start, end = (_point(entry.get(key), key, grid, where) for key in ("start_px", "end_px"))
    return StartGoalPair(
        entry["start_room"], entry["end_room"], Pose2(*start, wrap_angle(float(yaw))), end
    )


def _point(pixel: Any, key: str, grid: GridFrame, where: str) -> tuple[float, float]:
    """The centre, in the map frame, of an image pixel (row from the top, column)."""
    if not (
        isinstance(pixel, list)
        and len(pixel) == 2
        and all(type(value) is int for value in pixel)
        and 0 <= pixel[0] < grid.rows
        and 0 <= pixel[1] < grid.cols
    ):
        raise _broken(
            where,
            f"{key} must be a [row, column] in {grid.rows} x {grid.cols}, got {shown(pixel)}",
        )
    return grid.center_of(grid.rows - 1 - pixel[0], pixel[1])


def _read_rooms(
    path: Path, grid: GridFrame
) -> tuple[tuple[Room, ...], Int16[np.ndarray, "rows cols"]]:
    """Rooms and the room of each cell from the authors' MATLAB file."""
    labels, listed = _read_mat(path)
    if labels.shape != grid.shape or labels.dtype.kind not in "iuf":
        raise _broken(
            f"{path} semantic_map",
            f"must label the {grid.rows} x {grid.cols} pixels of the plan, got {labels.shape}",
        )
    rooms: list[Room] = []
    room_index = np.full(grid.shape, -1, np.int16)
    known = np.asarray(labels == 0)
    for name, value in zip(listed.values("name"), listed.values("id"), strict=True):
        number = _room_number(value)
        if not isinstance(name, str) or not name.isprintable() or number is None:
            raise _broken(
                f"{path} rooms",
                f"a room has a name and an id, got {shown(name)}, {shown(value)}",
            )
        here = labels == number
        room_index[here[::-1]] = len(rooms)
        known |= here
        rooms.append(Room(name, _kind(name, path), outline_m(here[::-1], grid)))
    if not known.all():
        row, col = np.argwhere(~known)[0].tolist()
        raise _broken(
            f"{path} semantic_map row {row} column {col}",
            f"label {labels[row, col]} is the id of no room",
        )
    return tuple(rooms), room_index


def _read_mat(path: Path) -> tuple[np.ndarray, MatlabStruct]:
    """The map of labels and the rooms in the struct `area_data` of a MATLAB file."""
    content = read_bytes(path, max_bytes=_MAX_MAT_BYTES)
    try:
        data = read_matlab_variable(content, "area_data")
    except ValueError as error:
        raise _broken(path, f"is not a whole MATLAB 5 file ({error})") from None
    if not isinstance(data, MatlabStruct) or data.count != 1:
        raise _broken(path, "must hold area_data with semantic_map and rooms")
    (labels,), (rooms,) = data.values("semantic_map"), data.values("rooms")
    missing = [
        name for name, value in (("semantic_map", labels), ("rooms", rooms)) if value is None
    ]
    if missing:
        raise _broken(path, f"must hold area_data with {' and '.join(missing)}")
    if not isinstance(labels, np.ndarray):
        raise _broken(f"{path} semantic_map", f"must be numbers, got {type(labels).__name__}")
    if isinstance(rooms, np.ndarray) and not rooms.size:
        rooms = MatlabStruct(0, {})
    if not isinstance(rooms, MatlabStruct):
        raise _broken(f"{path} rooms", "a room has a name and an id, got numbers or text")
    return labels, rooms


def _room_number(value: Any) -> int | None:
    """The id of a room: the whole number in a matrix of one element."""
    if not isinstance(value, np.ndarray) or value.size != 1:
        return None
    number = float(value.item())
    return int(number) if number.is_integer() and 0 < number < 2**31 else None


def _kind(name: str, path: Path) -> RoomKind:
    """What a room called `kind_number` is used for."""
    kind = name.rsplit("_", 1)[0]
    if kind.lower() not in _KINDS:
        raise InputError(
            f"room '{name}' is of no known kind",
            where=f"{path} rooms",
            remedy=did_you_mean(kind.lower(), _KINDS),
        )
    return _KINDS[kind.lower()]


def _beside(path: Path, settings: dict[str, Any], key: str) -> Path | None:
    """The file that the yaml names under this key, if any."""
    value = settings.get(key)
    return None if value is None else file_beside(path, value, key)


def _is_size(value: Any) -> bool:
    return type(value) in (int, float) and 0 < value <= _LARGEST_SIZE


def _broken(where: str | Path, rule: str) -> InputError:
    return InputError(rule, where=str(where), remedy="copy the published file again or repair it")
