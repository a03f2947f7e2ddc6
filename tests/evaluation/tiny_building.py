"""Two offices on a hallway, drawn by hand, and their map."""

import numpy as np

from toponav.core.vocabulary import Behavior, NodeKind, RoomKind
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Room, Scene, scene_from_heights

PLAN = ("office_1", "office_1_door", "hallway_1-1r", "hallway_1-2r", "office_2")


def tiny_scene() -> Scene:
    """8 x 6 m: the hallway above, office_1 and office_2 below, a door from each."""
    grid = GridFrame(0.1, (0.0, 0.0), rows=60, cols=80)
    heights = np.full(grid.shape, 2.5)
    index = np.full(grid.shape, -1)
    for number, (row0, row1, col0, col1) in enumerate(
        [(1, 35, 1, 39), (1, 35, 41, 79), (36, 59, 1, 79)]
    ):
        heights[row0:row1, col0:col1] = 0.0
        index[row0:row1, col0:col1] = number
    for col in (14, 54):
        heights[35, col : col + 12] = 0.0
        index[35, col : col + 12] = 2
    rooms = (
        Room("office_1", RoomKind.OFFICE),
        Room("office_2", RoomKind.OFFICE),
        Room("hallway_1", RoomKind.HALLWAY),
    )
    return scene_from_heights("tiny", grid, heights, ceiling_m=2.5, room_index=index, rooms=rooms)


def tiny_map() -> TopologicalMap:
    """From office_1 through the hallway to office_2, and one node to go astray to."""
    nodes = {
        node.id: node
        for node in (
            Node("office_1", NodeKind.ROOM, 2.0, 1.8, "office_1"),
            Node("office_1_door", NodeKind.DOOR, 2.0, 3.2, "office_1"),
            Node("hallway_1-1l", NodeKind.HALLWAY, 1.0, 4.75, "hallway_1"),
            Node("hallway_1-1r", NodeKind.HALLWAY, 3.2, 4.75, "hallway_1"),
            Node("hallway_1-2r", NodeKind.HALLWAY, 4.8, 4.75, "hallway_1"),
            Node("office_2", NodeKind.ROOM, 6.0, 2.6, "office_2"),
        )
    }
    edges = [
        ("office_1", "office_1_door", Behavior.FIND_DOOR),
        ("office_1_door", "hallway_1-1l", Behavior.TURN_LEFT),
        ("office_1_door", "hallway_1-1r", Behavior.TURN_RIGHT),
        ("hallway_1-1r", "hallway_1-2r", Behavior.CORRIDOR_FOLLOW),
        ("hallway_1-2r", "office_2", Behavior.TURN_RIGHT),
    ]
    return TopologicalMap(
        "tiny",
        MapFrame(),
        tuple(nodes.values()),
        tuple(edge_along(nodes[a], nodes[b], behavior) for a, b, behavior in edges),
    )
