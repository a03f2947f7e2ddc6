"""Rooms along the hallways, each with a doorway that a turn can reach, in cells."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._skeleton import CELL_M, Run, Skeleton

__all__ = ["PlacedDoor", "PlacedRoom", "place_rooms"]

_SNAP = round(0.3 / CELL_M)
_DOOR_GAP = round(1.35 / CELL_M)
_BORDER = 26  # cells at the edge of the grid where bays may come but no rooms


@dataclass
class PlacedDoor:
    """A doorway in cells, seen from the hallway.

    Attributes:
        run: Index of the run that it opens to.
        along: Centre of the opening along that run.
        side: +1 where the room lies at higher `across`, -1 lower; 0 at the end of a run.
        face: Wall face towards the hallway: along `across`, or along the run at its end.
        depth: Thickness of the wall; signed, positive towards higher coordinates.
        width: Free width.
        recess: How far the hallway's floor is let into the wall in front of it.
        junction: Junction that it faces, if it does.
    """

    run: int
    along: int
    side: int
    face: int
    depth: int
    width: int
    recess: int = 0
    junction: int | None = None


@dataclass
class PlacedRoom:
    """A rectangle of floor with a door; `row`, `col` are half-open ranges of cells."""

    kind: RoomKind
    row: tuple[int, int]
    col: tuple[int, int]
    door: PlacedDoor
    name: str = ""

    @property
    def box(self) -> tuple[slice, slice]:
        """Its floor in the grid."""
        return slice(*self.row), slice(*self.col)


@dataclass
class _Site:
    """What is taken so far."""

    skeleton: Skeleton
    halls: Bool[np.ndarray, "rows cols"]
    rooms: Bool[np.ndarray, "rows cols"]
    doors: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    ended: set[int] = field(default_factory=set)

    def is_free(self, row: tuple[int, int], col: tuple[int, int], wall: int) -> bool:
        """Whether a room fits with one cell to other rooms and `wall` cells to hallways."""
        rows, cols = self.halls.shape
        if min(row[0], col[0], rows - row[1], cols - col[1]) < _BORDER:
            return False
        beside = self.rooms[row[0] - 1 : row[1] + 1, col[0] - 1 : col[1] + 1]
        near = self.halls[row[0] - wall : row[1] + wall, col[0] - wall : col[1] + wall]
        return not beside.any() and not near.any()


def place_rooms(
    rng: np.random.Generator, skeleton: Skeleton, halls: Bool[np.ndarray, "rows cols"], limit: int
) -> list[PlacedRoom]:
    """Up to `limit` rooms at dead ends and along both sides of every hallway."""
    site = _Site(skeleton, halls, np.zeros_like(halls))
    rooms: list[PlacedRoom] = []
    for junction in range(len(skeleton.junctions)):
        if skeleton.is_dead_end(junction) and rng.random() < 0.55:
            room = _end_room(rng, site, junction)
            if room is not None:
                rooms.append(room)
    sides = [
        (index, side)
        for index, run in enumerate(skeleton.runs)
        if not run.is_open
        for side in (-1, 1)
    ]
    for position in rng.permutation(len(sides)):
        index, side = sides[int(position)]
        rooms += _side_rooms(rng, site, index, side)
    return rooms[:limit]


_SIZES_M = {
    RoomKind.OFFICE: ((2.7, 4.6), (3.4, 6.0)),
    RoomKind.CONFERENCE_ROOM: ((4.2, 7.0), (4.5, 6.6)),
    RoomKind.STORAGE: ((2.0, 3.2), (2.4, 4.5)),
    RoomKind.WC: ((3.0, 5.2), (4.0, 6.2)),
    RoomKind.COPY_ROOM: ((2.5, 4.0), (2.8, 4.5)),
    RoomKind.PANTRY: ((2.8, 4.5), (3.0, 5.0)),
}
"""Width and depth ranges of each kind of room."""

_SHARES = (0.74, 0.08, 0.05, 0.05, 0.04, 0.04)


def _wish(rng: np.random.Generator) -> tuple[RoomKind, int, int]:
    """A kind of room with a width and a depth."""
    kind = list(_SIZES_M)[int(rng.choice(len(_SHARES), p=_SHARES))]
    width, depth = _SIZES_M[kind]
    return kind, round(rng.uniform(*width) / CELL_M), round(rng.uniform(*depth) / CELL_M)


def _wall(rng: np.random.Generator) -> int:
    """Thickness of a hallway wall in cells: mostly two scanned faces 15 to 30 cm apart."""
    return int(rng.choice([2, 3, 4, 5, 6, 8, 12], p=[0.1, 0.14, 0.2, 0.22, 0.18, 0.1, 0.06]))


def _door_width(rng: np.random.Generator) -> int:
    return int(rng.choice([15, 16, 17, 18, 20, 22], p=[0.2, 0.5, 0.15, 0.08, 0.04, 0.03]))


def _end_room(rng: np.random.Generator, site: _Site, junction: int) -> PlacedRoom | None:
    """A room that a hallway leads straight into at its dead end."""
    index, direction = site.skeleton.arms[junction][0]
    run = site.skeleton.runs[index]
    if run.is_open:
        return None
    kind, width, depth = _wish(rng)
    wall = _wall(rng)
    end = run.low if direction > 0 else run.high
    outward = -direction
    near = end + outward * wall
    for shrink in (1.0, 0.8, 0.65):
        deep = round(depth * shrink)
        along = (near, near + deep) if outward > 0 else (near - deep, near)
        left = run.across - int(rng.integers(13, max(14, width - 12)))
        across = (left, left + width)
        row, col = (across, along) if run.horizontal else (along, across)
        if site.is_free(row, col, 2):
            # The door faces the axis of the hallway, so that the way in is straight.
            door = PlacedDoor(
                index, run.across, 0, end, outward * wall, _door_width(rng), junction=junction
            )
            site.rooms[slice(*row), slice(*col)] = True
            site.ended.add(junction)
            return PlacedRoom(kind, row, col, door)
    return None


def _side_rooms(rng: np.random.Generator, site: _Site, index: int, side: int) -> list[PlacedRoom]:
    """Rooms side by side along one side of a run."""
    run = site.skeleton.runs[index]
    rooms: list[PlacedRoom] = []
    usual = _wall(rng)
    position = run.low - int(rng.integers(0, 14))
    while position < run.high - 30:
        if rng.random() < 0.06:
            position += int(rng.integers(10, 60))
            continue
        kind, width, depth = _wish(rng)
        wall = usual if rng.random() < 0.7 else _wall(rng)
        room = _fit(rng, site, (index, side), (kind, position, width, depth, wall))
        if room is None:
            position += 5
            continue
        rooms.append(room)
        along = room.col if run.horizontal else room.row
        position = along[1] + int(rng.choice([1, 2, 3, 6], p=[0.6, 0.2, 0.1, 0.1]))
    return rooms


def _fit(
    rng: np.random.Generator,
    site: _Site,
    where: tuple[int, int],
    wish: tuple[RoomKind, int, int, int, int],
) -> PlacedRoom | None:
    """The wished room at a position, smaller where it must be, or None."""
    index, side = where
    kind, start, width, depth, wall = wish
    run = site.skeleton.runs[index]
    smallest = _SIZES_M[kind]
    edge = run.across + side * run.half
    for wide in {width: 0, round(width * 0.8): 0, round(smallest[0][0] / CELL_M): 0}:
        along = (start, start + wide)
        for deep in range(depth, round(smallest[1][0] / CELL_M) - 1, -6):
            near = edge + side * wall
            across = (near, near + deep) if side > 0 else (near - deep, near)
            row, col = (across, along) if run.horizontal else (along, across)
            if not site.is_free(row, col, 2):
                continue
            door = _side_door(rng, site, where, along, wall)
            if door is None:
                break
            site.rooms[slice(*row), slice(*col)] = True
            site.doors.setdefault(index, []).append((door.along, side))
            return PlacedRoom(kind, row, col, door)
    return None


def _side_door(
    rng: np.random.Generator, site: _Site, where: tuple[int, int], span: tuple[int, int], wall: int
) -> PlacedDoor | None:
    """A door in the front wall at a place where the map can have one, or None."""
    index, side = where
    run = site.skeleton.runs[index]
    width = _door_width(rng)
    margin = width // 2 + 3
    low, high = max(span[0], run.low) + margin, min(span[1], run.high) - margin
    if low >= high:
        return None
    opposite = [
        along + int(rng.integers(-4, 5))
        for along, other in site.doors.get(index, [])
        if other != side and rng.random() < 0.2
    ]
    facing = [stop.along for stop in run.stops[1:-1] if rng.random() < 0.6]
    near_corner = [low + int(rng.integers(0, 6)), high - int(rng.integers(0, 6))]
    rng.shuffle(near_corner)
    anywhere = [int(value) for value in rng.integers(low, high + 1, size=8)]
    for along in facing + opposite + near_corner + anywhere:
        if low <= along <= high:
            place = _place(site, run, (index, side), along, along in opposite)
            if place is not None:
                along, junction = place
                recess = wall - 2 if wall >= 6 and rng.random() < 0.3 else 0
                face = run.across + side * (run.half + recess)
                return PlacedDoor(
                    index, along, side, face, side * (wall - recess), width, recess, junction
                )
    return None


def _place(
    site: _Site, run: Run, where: tuple[int, int], along: int, may_face: bool
) -> tuple[int, int | None] | None:
    """Where exactly the door may go and which junction it faces; None where it may not."""
    index, side = where
    junction: int | None = None
    for stop in run.stops:
        apart = abs(along - stop.along)
        if site.skeleton.is_dead_end(stop.junction):
            least_m = stop.reach_m[0] + 0.75 if stop.junction in site.ended else 0.85
            if apart * CELL_M < least_m:
                return None
            continue
        if apart <= _SNAP:
            if not _is_open_side(site.skeleton, stop.junction, index, side):
                return None
            along, junction = stop.along, stop.junction
        elif apart * CELL_M < max(stop.reach_m) + 0.75:
            return None
    for other, other_side in site.doors.get(index, []):
        apart = abs(along - other)
        if may_face and other_side != side and apart <= _SNAP:
            continue
        if apart < _DOOR_GAP:
            return None
    return along, junction


def _is_open_side(skeleton: Skeleton, junction: int, index: int, side: int) -> bool:
    """Whether no passage leaves a junction on this side of a run."""
    run = skeleton.runs[index]
    return not any(
        skeleton.runs[other].horizontal != run.horizontal and direction == side
        for other, direction in skeleton.arms[junction]
    )
