"""Two offices on a corridor, with their map: the smallest building that a robot can cross.

+---------+-+---------+
| office_1| | office_2|     y = 2.2 .. 5.2 m
+---   ---+-+---   ---+     doors at x = 2 m and x = 6 m
|      hallway_1      |     y = 0 .. 2 m
+---------------------+
"""

import math
from pathlib import Path

import numpy as np

from toponav.core.vocabulary import Behavior, NodeKind, RoomKind
from toponav.maps.plan import Plan, shortest_plan
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, save_map
from toponav.worlds.scene import GridFrame, Room, Scene, scene_from_heights
from toponav.worlds.storage import save_scene

CELL_M = 0.1


def make_scene() -> Scene:
    grid = GridFrame(CELL_M, (-0.2, -0.2), 56, 84)
    heights = np.full((56, 84), 2.5, np.float32)
    rooms = np.full((56, 84), -1, np.int16)

    def carve(x0: float, x1: float, y0: float, y1: float, room: int) -> None:
        rows = slice(round((y0 + 0.2) / CELL_M), round((y1 + 0.2) / CELL_M))
        cols = slice(round((x0 + 0.2) / CELL_M), round((x1 + 0.2) / CELL_M))
        heights[rows, cols] = 0.0
        rooms[rows, cols] = room

    carve(0.0, 8.0, 0.0, 2.0, 2)
    carve(0.5, 3.5, 2.2, 5.2, 0)
    carve(4.5, 7.5, 2.2, 5.2, 1)
    carve(1.4, 2.6, 2.0, 2.2, 0)
    carve(5.4, 6.6, 2.0, 2.2, 1)
    return scene_from_heights(
        "small_office",
        grid,
        heights,
        room_index=rooms,
        rooms=(
            Room("office_1", RoomKind.OFFICE),
            Room("office_2", RoomKind.OFFICE),
            Room("hallway_1", RoomKind.HALLWAY),
        ),
    )


def make_map() -> TopologicalMap:
    places = {
        "office_1": (NodeKind.ROOM, 2.0, 3.7, "office_1"),
        "office_2": (NodeKind.ROOM, 6.0, 3.7, "office_2"),
        "office_1_door": (NodeKind.DOOR, 2.0, 2.5, "office_1"),
        "office_2_door": (NodeKind.DOOR, 6.0, 2.5, "office_2"),
        "east_1": (NodeKind.HALLWAY, 3.2, 1.0, "hallway_1"),
        "east_2": (NodeKind.HALLWAY, 4.8, 1.0, "hallway_1"),
        "west_1": (NodeKind.HALLWAY, 3.2, 1.0, "hallway_1"),
        "west_2": (NodeKind.HALLWAY, 4.8, 1.0, "hallway_1"),
    }
    south, north, east, west = -math.pi / 2, math.pi / 2, 0.0, math.pi
    moves = [
        ("office_1", "office_1_door", Behavior.FIND_DOOR, south),
        ("office_1_door", "east_1", Behavior.TURN_LEFT, south),
        ("east_1", "east_2", Behavior.CORRIDOR_FOLLOW, east),
        ("east_2", "office_2", Behavior.TURN_LEFT, north),
        ("office_2", "office_2_door", Behavior.FIND_DOOR, south),
        ("office_2_door", "west_2", Behavior.TURN_RIGHT, south),
        ("west_2", "west_1", Behavior.CORRIDOR_FOLLOW, west),
        ("west_1", "office_1", Behavior.TURN_RIGHT, north),
    ]
    nodes = tuple(Node(name, *place) for name, place in places.items())
    at = {name: place[1:3] for name, place in places.items()}
    edges = tuple(
        Edge(f"{a}->{b}", a, b, behavior, yaw, math.dist(at[a], at[b]))
        for a, b, behavior, yaw in moves
    )
    return TopologicalMap("small_office", MapFrame(), nodes, edges)


def make_plan() -> Plan:
    return shortest_plan(make_map(), "office_1", "office_2")


def save_building(directory: Path) -> Path:
    """A saved scene with its map, as `--buildings` takes it."""
    folder = directory / "small_office"
    save_scene(make_scene(), folder)
    save_map(make_map(), folder / "map.topo.json")
    return folder
