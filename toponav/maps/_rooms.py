"""Nodes of enclosed rooms and of their doors."""

import math
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Int32

from toponav.core.vocabulary import NodeKind
from toponav.maps._openings import Opening
from toponav.maps._places import Entrance
from toponav.maps._segmented import LEAST_ROOM_M2
from toponav.maps.spec import Node
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["RoomNodes", "room_nodes"]

_DOOR_M = 0.15
_ROOM_M = 0.6


@dataclass
class RoomNodes:
    """Room and door nodes with what they are for."""

    nodes: dict[str, Node] = field(default_factory=dict)
    """By id."""
    exits: dict[str, Entrance] = field(default_factory=dict)
    """Each door node's way back into its room."""
    entrances: list[tuple[Opening, Entrance]] = field(default_factory=list)
    """Doors to passages; the openings lead into the rooms."""
    through: list[tuple[str, str]] = field(default_factory=list)
    """From the door of one room straight to the node of the next."""


def room_nodes(
    scene: Scene,
    territory: Int32[np.ndarray, "rows cols"],
    free: FreeSpace,
    openings: list[Opening],
    passage_rooms: set[int],
) -> RoomNodes:
    """Nodes for every room with a door that is of use.

    Doors between two enclosed rooms are drawn where the building names its doors, and else
    only to get into rooms that no passage leads to: people draw maps this way.
    """
    drawn = RoomNodes()
    outward: dict[int, list[Opening]] = defaultdict(list)
    for opening in openings:
        first, second = opening.rooms
        if first in passage_rooms and second in passage_rooms:
            continue
        if first not in passage_rooms and second not in passage_rooms:
            continue
        inward = opening if first in passage_rooms else opening.reversed()
        outward[inward.rooms[1]].append(inward)
    between = _between(scene, openings, passage_rooms, set(outward))
    for opening in between:
        for inward in (opening, opening.reversed()):
            outward[inward.rooms[1]].append(inward)
    entrance_of: dict[tuple[int, int, float, float], Entrance] = {}
    for number in sorted(outward):
        doors = sorted(outward[number], key=lambda door: (-door.width_m, door.x_m, door.y_m))
        name = scene.rooms[number].name
        for index, door in enumerate(doors, start=1):
            door_id = f"{name}_door" if len(doors) == 1 else f"{name}_door-{index}"
            entrance = Entrance(door_id, name, door.heading_rad)
            x_m, y_m = _ahead(door, _DOOR_M)
            drawn.nodes[door_id] = Node(door_id, NodeKind.DOOR, x_m, y_m, name)
            drawn.exits[door_id] = entrance
            entrance_of[number, door.rooms[0], door.x_m, door.y_m] = entrance
            if door.rooms[0] in passage_rooms:
                drawn.entrances.append((door, entrance))
        main = [door for door in doors if door.rooms[0] in passage_rooms][:1] or doors
        x_m, y_m = _room_spot(scene, territory, free, number, main)
        drawn.nodes[name] = Node(name, NodeKind.ROOM, x_m, y_m, name)
    for opening in between:
        first, second = opening.rooms
        there = entrance_of[second, first, opening.x_m, opening.y_m]
        back = entrance_of[first, second, opening.x_m, opening.y_m]
        drawn.through += [(back.door, there.room), (there.door, back.room)]
    return drawn


def _between(
    scene: Scene, openings: list[Opening], passage_rooms: set[int], reached: set[int]
) -> list[Opening]:
    """Openings between enclosed rooms to draw; where no door is named, none into cupboards."""
    inner = [o for o in openings if not set(o.rooms) & passage_rooms]
    if scene.doors:
        return inner
    area_m2 = [
        (scene.room_index == n).sum() * scene.grid.resolution_m**2 for n in range(len(scene.rooms))
    ]
    inner = [o for o in inner if min(area_m2[n] for n in o.rooms) >= LEAST_ROOM_M2]
    chosen: list[Opening] = []
    reached = set(reached)
    if not reached and inner:
        reached = {max(inner, key=lambda o: o.width_m).rooms[0]}
    while True:
        onward = [o for o in inner if len(set(o.rooms) & reached) == 1]
        if not onward:
            return chosen
        best = max(onward, key=lambda o: o.width_m)
        chosen.append(best)
        reached |= set(best.rooms)


def _ahead(opening: Opening, distance_m: float) -> tuple[float, float]:
    return (
        opening.x_m + distance_m * math.cos(opening.heading_rad),
        opening.y_m + distance_m * math.sin(opening.heading_rad),
    )


def _room_spot(
    scene: Scene,
    territory: Int32[np.ndarray, "rows cols"],
    free: FreeSpace,
    number: int,
    doors: list[Opening],
) -> tuple[float, float]:
    """A free place of the room just behind a door, or between several."""
    wanted = np.array([_ahead(door, _ROOM_M) for door in doors]).mean(axis=0)
    own = scene.room_index == number
    for cells in (own & free.free, own & ~scene.occupied, own, territory == number + 1):
        if cells.any():
            at = np.argwhere(cells)
            centers = (at[:, ::-1] + 0.5) * scene.grid.resolution_m + scene.grid.origin_m
            away = np.hypot(centers[:, 0] - wanted[0], centers[:, 1] - wanted[1])
            best = int(away.argmin())
            return float(centers[best, 0]), float(centers[best, 1])
    return float(wanted[0]), float(wanted[1])
