"""A small building for the expert: a corridor, two offices and a junction, with its map."""

import numpy as np

from toponav.core.vocabulary import Behavior, NodeKind, RoomKind
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.worlds.scene import GridFrame, Room, Scene, scene_from_heights

_CELL_M = 0.05


def small_office() -> tuple[Scene, TopologicalMap]:
    """A 12 m corridor with office_1 above its west end and office_2 below its east end."""
    rows, cols = 240, 260
    heights = np.full((rows, cols), 2.7, dtype=np.float32)
    room_index = np.full((rows, cols), -1, dtype=np.int16)

    def carve(x0: float, y0: float, x1: float, y1: float, room: int) -> None:
        area = np.s_[
            round(y0 / _CELL_M) : round(y1 / _CELL_M), round(x0 / _CELL_M) : round(x1 / _CELL_M)
        ]
        heights[area] = 0.0
        room_index[area] = room

    carve(0.5, 5.0, 12.5, 7.0, 0)
    carve(0.5, 7.2, 4.5, 11.2, 1)
    carve(8.5, 0.8, 12.5, 4.8, 2)
    carve(2.0, 7.0, 2.9, 7.2, 1)
    carve(10.0, 4.8, 10.9, 5.0, 2)
    heights[round(9.0 / _CELL_M) : round(9.8 / _CELL_M), 50:60] = 0.8
    rooms = (
        Room("hallway_1", RoomKind.HALLWAY),
        Room("office_1", RoomKind.OFFICE),
        Room("office_2", RoomKind.OFFICE),
    )
    scene = scene_from_heights(
        "small_office",
        GridFrame(_CELL_M, (0.0, 0.0), rows, cols),
        heights,
        room_index=room_index,
        rooms=rooms,
    )
    return scene, _map()


def _map() -> TopologicalMap:
    room, door, hallway = NodeKind.ROOM, NodeKind.DOOR, NodeKind.HALLWAY
    nodes = {
        node.id: node
        for node in (
            Node("office_1", room, 2.0, 8.5, "office_1"),
            Node("office_1_door", door, 2.45, 7.4, "office_1"),
            Node("office_2", room, 10.5, 3.5, "office_2"),
            Node("office_2_door", door, 10.45, 4.6, "office_2"),
            Node("hallway_1_1r", hallway, 4.0, 5.9, "hallway_1"),
            Node("hallway_1_2r", hallway, 9.0, 5.9, "hallway_1"),
            Node("hallway_1_1l", hallway, 4.0, 6.1, "hallway_1"),
            Node("hallway_1_2l", hallway, 9.0, 6.1, "hallway_1"),
        )
    }
    edges = tuple(
        edge_along(nodes[source], nodes[target], behavior)
        for source, target, behavior in (
            ("office_1", "office_1_door", Behavior.FIND_DOOR),
            ("office_2", "office_2_door", Behavior.FIND_DOOR),
            ("office_1_door", "hallway_1_1r", Behavior.TURN_LEFT),
            ("hallway_1_1r", "hallway_1_2r", Behavior.CORRIDOR_FOLLOW),
            ("hallway_1_2r", "office_2", Behavior.TURN_RIGHT),
            ("office_2_door", "hallway_1_2l", Behavior.TURN_LEFT),
            ("hallway_1_2l", "hallway_1_1l", Behavior.CORRIDOR_FOLLOW),
            ("hallway_1_1l", "office_1", Behavior.TURN_RIGHT),
        )
    )
    return TopologicalMap("small_office", MapFrame(), tuple(nodes.values()), edges)
