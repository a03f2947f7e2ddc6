"""Office floors that look to a depth camera like scanned ones, as a pure function of a seed."""

import math
from typing import Literal, get_args

import numpy as np
from jaxtyping import Bool
from scipy import ndimage

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import NodeKind, RoomKind
from toponav.worlds.generate._canvas import Canvas
from toponav.worlds.generate._furnish import (
    furnish_hallways,
    furnish_room,
    hang_door,
    keep_ways_free,
    passable,
    room_heart,
)
from toponav.worlds.generate._partitions import partition_room
from toponav.worlds.generate._rooms import PlacedRoom, place_rooms
from toponav.worlds.generate._skeleton import CELL_M, Skeleton, draw_skeleton
from toponav.worlds.generate._walls import Shell, door_boxes, hall_floor, raise_walls
from toponav.worlds.grid import SemanticClass
from toponav.worlds.layout import Doorway, HallwayLayout, Junction, Passage
from toponav.worlds.scene import Door, GridFrame, Provenance, Room, Scene, scene_from_heights

__all__ = ["OFFICE_VERSION", "OfficeSize", "generate_office"]

OFFICE_VERSION = "1"

OfficeSize = Literal["small", "medium", "large"]

_MARGIN = 180  # cells around the hallways in which rooms may stand
_FEWEST_ROOMS, _MOST_ROOMS = 8, 40
_ROBOT_RADIUS_M = 0.24


def generate_office(seed: int, size: str | None = None, *, partitions: float = 0.0) -> Scene:
    """An office floor: hallways, rooms, doors, furniture, clutter and its hallway layout.

    Every room can be reached from every other by a robot 0.36 m wide.

    Args:
        seed: Any number from 0; the same seed makes the same building, byte for byte.
        size: An `OfficeSize`: up to 16, 28 or 40 rooms; drawn from the seed where None.
        partitions: Share of the rooms that walls with gaps divide into chambers, as in
            washrooms and old offices. The suites have none.

    Raises:
        InputError: When the seed is negative, the size has no such name, or the share is not
            within 0 to 1.

    Example:
        >>> scene = generate_office(3, size="small")
        >>> scene.provenance.seed
        3
    """
    if seed < 0:
        raise InputError(
            f"seed must be 0 or more, got {seed}",
            where="office generator",
            remedy="give a number from 0 up",
        )
    if size is not None and size not in get_args(OfficeSize):
        raise InputError(
            f"no office size is called '{size}'",
            where="office generator",
            remedy=did_you_mean(size, get_args(OfficeSize)),
        )
    if not 0.0 <= partitions <= 1.0:
        raise InputError(
            f"partitions must be a share from 0 to 1, got {partitions}",
            where="office generator",
            remedy="give a number such as 0.5",
        )
    for attempt in range(40):
        rng = np.random.default_rng([seed, attempt])
        chosen = size or str(rng.choice(get_args(OfficeSize), p=[0.3, 0.45, 0.25]))
        scene = _attempt(rng, seed, chosen, partitions)
        if scene is not None:
            return scene
    raise AssertionError(f"no office came of seed {seed}")


def _attempt(rng: np.random.Generator, seed: int, size: str, partitions: float) -> Scene | None:
    """One building, or None where too few rooms fitted or one cannot be reached."""
    skeleton = draw_skeleton(rng, size)
    shape = _shift_inside(skeleton)
    most = {"small": 16, "medium": 28, "large": _MOST_ROOMS}[size]
    rooms = place_rooms(rng, skeleton, hall_floor(skeleton, shape), most)
    if len(rooms) < _FEWEST_ROOMS:
        return None
    _name(rng, skeleton, rooms)
    hearts = [room_heart(rng, room) for room in rooms]
    keep = keep_ways_free(skeleton, rooms, hearts, shape)
    shell = raise_walls(rng, skeleton, rooms, keep)
    ceiling_m = round(float(rng.uniform(2.5, 3.2)), 2)
    canvas = Canvas.over(shell.wall, ceiling_m, keep)
    leaves = _furnish(rng, canvas, skeleton, rooms, hearts, shell, partitions)
    if leaves is None:
        return None
    name = f"office-{seed}" + (f"-partitioned-{partitions:g}" if partitions else "")
    return _scene(name, seed, skeleton, rooms, shell, canvas, leaves, ceiling_m)


def _shift_inside(skeleton: Skeleton) -> tuple[int, int]:
    """Moves the skeleton so that rooms fit on all sides; the shape of the grid."""
    cols = [col for col, _ in skeleton.junctions]
    rows = [row for _, row in skeleton.junctions]
    left, low = _MARGIN - min(cols), _MARGIN - min(rows)
    skeleton.junctions = [(col + left, row + low) for col, row in skeleton.junctions]
    for run in skeleton.runs:
        run.across += low if run.horizontal else left
        for stop in run.stops:
            stop.along += left if run.horizontal else low
    return max(rows) + low + _MARGIN, max(cols) + left + _MARGIN


def _name(rng: np.random.Generator, skeleton: Skeleton, rooms: list[PlacedRoom]) -> None:
    """Names rooms and runs as Stanford 2D-3D-S does: the kind and a number."""
    counts: dict[str, int] = {}

    def numbered(kind: RoomKind) -> str:
        counts[kind] = counts.get(kind, 0) + 1
        return f"{kind}_{counts[kind]}"

    for room in rooms:
        room.name = numbered(room.kind)
    for run in skeleton.runs:
        kind = RoomKind.HALLWAY
        if run.is_open:
            kind = RoomKind.LOUNGE if rng.random() < 0.5 else RoomKind.OPEN_SPACE
        run.name = numbered(kind)


def _furnish(
    rng: np.random.Generator,
    canvas: Canvas,
    skeleton: Skeleton,
    rooms: list[PlacedRoom],
    hearts: list[tuple[int, int]],
    shell: Shell,
    partitions: float,
) -> dict[str, float | None] | None:
    """How far each room's door stands open; None where a room cannot be reached."""
    leaves = {room.name: hang_door(rng, canvas, skeleton, room) for room in rooms}
    for number, room in enumerate(rooms):
        opening, _recess = door_boxes(skeleton, room)
        within = shell.room_index == number
        within[opening] = False
        if partitions and rng.random() < partitions:
            partition_room(rng, canvas, room, within)
        furnish_room(rng, canvas, room.kind, room.box, within)
    halls = shell.room_index >= len(rooms)
    furnish_hallways(rng, canvas, skeleton, halls)
    if not _clear_ways(canvas, skeleton, hearts, shell.floor):
        return None
    return leaves


def _clear_ways(
    canvas: Canvas,
    skeleton: Skeleton,
    hearts: list[tuple[int, int]],
    floor: Bool[np.ndarray, "rows cols"],
) -> bool:
    """Takes away what blocks the way to a room; False where walls do."""
    for _ in range(4):
        labels, _count = ndimage.label(passable(canvas, _ROBOT_RADIUS_M) & floor)
        col, row = skeleton.junctions[skeleton.runs[0].stops[0].junction]
        home = _label_near(labels, row, col)
        if home == 0:
            return False
        lost = [heart for heart in hearts if _label_near(labels, *heart) != home]
        lost += [(r, c) for c, r in skeleton.junctions if _label_near(labels, r, c) != home]
        if not lost:
            return True
        for row, col in lost:
            near = slice(max(row - 60, 0), row + 60), slice(max(col - 60, 0), col + 60)
            leaves = canvas.semantics[near] == SemanticClass.DOOR
            things = canvas.things[near]
            blocking = things[leaves] if leaves.any() else things
            canvas.remove([int(number) for number in np.unique(blocking) if number > 0])
    return False


def _label_near(labels: np.ndarray, row: int, col: int) -> int:
    """The commonest component within half a metre, or 0."""
    window = labels[max(row - 10, 0) : row + 11, max(col - 10, 0) : col + 11]
    found = np.bincount(window[window > 0].ravel())
    return int(found.argmax()) if len(found) else 0


def _scene(
    name: str,
    seed: int,
    skeleton: Skeleton,
    rooms: list[PlacedRoom],
    shell: Shell,
    canvas: Canvas,
    leaves: dict[str, float | None],
    ceiling_m: float,
) -> Scene:
    """The finished building, cut to what is used."""
    window, (low, left) = _used(shell.floor)
    index = shell.room_index[window]
    grid = GridFrame(CELL_M, (0.0, 0.0), *index.shape)
    named = [Room(room.name, room.kind, _polygon(room.row, room.col, low, left)) for room in rooms]
    for run in skeleton.runs:
        row, col = run.floor()
        kind = next(kind for kind in RoomKind if run.name.startswith(kind))
        named.append(
            Room(run.name, kind, _polygon((row.start, row.stop), (col.start, col.stop), low, left))
        )
    layout = _layout(skeleton, rooms, low, left)
    doors = [
        _door(room, skeleton, doorway, leaves[room.name])
        for room, doorway in zip(rooms, layout.doorways, strict=True)
    ]
    return scene_from_heights(
        name,
        grid,
        canvas.heights_m[window],
        ceiling_m=ceiling_m,
        room_index=index,
        rooms=named,
        doors=doors,
        semantics=canvas.semantics[window],
        provenance=Provenance("office", OFFICE_VERSION, seed),
        layout=layout,
    )


def _used(floor: Bool[np.ndarray, "rows cols"]) -> tuple[tuple[slice, slice], tuple[int, int]]:
    """The part of the grid that holds the building with half a metre around it."""
    rows, cols = np.flatnonzero(floor.any(axis=1)), np.flatnonzero(floor.any(axis=0))
    low, left = int(rows[0]) - 10, int(cols[0]) - 10
    return (slice(low, int(rows[-1]) + 11), slice(left, int(cols[-1]) + 11)), (low, left)


def _polygon(row: tuple[int, int], col: tuple[int, int], low: int, left: int) -> np.ndarray:
    """Corners of a rectangle of cells, counter-clockwise, in metres."""
    x0, x1 = ((value - left) * CELL_M for value in col)
    y0, y1 = ((value - low) * CELL_M for value in row)
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def _door(room: PlacedRoom, skeleton: Skeleton, doorway: Doorway, leaf: float | None) -> Door:
    """The door at the middle of the wall that its doorway leads through."""
    inward = np.array([math.cos(doorway.inward_rad), math.sin(doorway.inward_rad)])
    middle = np.array([doorway.x_m, doorway.y_m]) + inward * doorway.depth_m / 2
    beside = np.array([-inward[1], inward[0]]) * doorway.width_m / 2
    hallway = skeleton.runs[room.door.run].name
    return Door(
        doorway.door,
        np.stack([middle - beside, middle + beside]),
        doorway.width_m,
        (hallway, room.name),
        1.0 if leaf is None else leaf,
    )


def _layout(skeleton: Skeleton, rooms: list[PlacedRoom], low: int, left: int) -> HallwayLayout:
    """The hallways in metres."""
    junctions = tuple(
        Junction(
            f"junction_{index}", round((col - left) * CELL_M, 4), round((row - low) * CELL_M, 4)
        )
        for index, (col, row) in enumerate(skeleton.junctions)
    )
    passages: list[Passage] = []
    spans: list[tuple[int, int, int, str]] = []
    for number, run in enumerate(skeleton.runs):
        kind = NodeKind.OPEN_SPACE if run.is_open else NodeKind.HALLWAY
        for here, after in zip(run.stops, run.stops[1:], strict=False):
            name = f"passage_{len(passages)}"
            spans.append((number, here.along, after.along, name))
            passages.append(
                Passage(
                    name,
                    run.name,
                    kind,
                    f"junction_{here.junction}",
                    f"junction_{after.junction}",
                    round(here.reach_m[1], 3),
                    round(after.reach_m[0], 3),
                    round(2 * run.half * CELL_M, 3),
                )
            )
    doorways = tuple(_doorway(skeleton, room, spans, low, left) for room in rooms)
    return HallwayLayout(junctions, tuple(passages), doorways)


def _doorway(
    skeleton: Skeleton,
    room: PlacedRoom,
    spans: list[tuple[int, int, int, str]],
    low: int,
    left: int,
) -> Doorway:
    """Where a room's opening lies, on a passage or at a junction."""
    door = room.door
    run = skeleton.runs[door.run]
    along_run = run.horizontal == (door.side == 0)
    sign = 1 if door.depth > 0 else -1
    inward_rad = (0.0 if sign > 0 else math.pi) if along_run else sign * math.pi / 2
    half = (door.width % 2) / 2  # an odd opening is centred on a cell, not between two
    x, y = (door.face, door.along + half) if along_run else (door.along + half, door.face)
    passage, offset = None, 0.0
    if door.junction is None:
        low_end, passage = next(
            (start, name)
            for number, start, end, name in spans
            if number == door.run
            and start - 60 <= door.along <= end + 60
            and (start <= door.along or start == run.stops[0].along)
            and (door.along <= end or end == run.stops[-1].along)
        )
        offset = (door.along + half - low_end) * CELL_M
    return Doorway(
        f"{room.name}_door",
        room.name,
        round((x - left) * CELL_M, 4),
        round((y - low) * CELL_M, 4),
        inward_rad,
        round(abs(door.depth) * CELL_M, 3),
        round(door.width * CELL_M, 3),
        passage,
        round(offset, 4),
        None if door.junction is None else f"junction_{door.junction}",
    )
