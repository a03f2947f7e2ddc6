"""The six rules for topological maps of GraphNav's section IV, as checks.

Each check yields every breach. A room here is an enclosed one: something that has a room node
or a door node. Corridors, open spaces and lounges are passages.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Float

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.faults import Building, Fault, Rule, Severity, edge_fault, node_fault
from toponav.maps.spec import Edge, Node, TopologicalMap

__all__ = [
    "check_corridors_have_two_lanes",
    "check_doors_have_nodes",
    "check_find_door_joins_room_and_door",
    "check_one_node_per_room",
    "check_rooms_are_entered_at_their_node",
    "check_rooms_are_left_from_their_doors",
    "only_door",
    "only_room_node",
]

_PASSAGES = (NodeKind.HALLWAY, NodeKind.OPEN_SPACE)
# Lanes of one corridor lie this close to each other, and end this far from each other.
_LANE_DISTANCE_M = 1.5
_LANE_OVERHANG_M = 0.5
_OPPOSITE_RAD = math.radians(140.0)


def check_one_node_per_room(
    topological_map: TopologicalMap, building: Building
) -> Iterator[Fault]:
    """Rule 1: each room has its own single node."""
    for room, nodes in _enclosed_rooms(topological_map).items():
        centers = [node for node in nodes if node.kind is NodeKind.ROOM]
        if len(centers) > 1:
            names = ", ".join(node.id for node in centers)
            yield node_fault(
                Rule.ONE_NODE_PER_ROOM,
                centers[0],
                f"room {room} has {len(centers)} room nodes: {names}",
                "keep one, and lead every entering edge and find_door edge to and from it",
            )
        elif not centers:
            yield node_fault(
                Rule.ONE_NODE_PER_ROOM,
                nodes[0],
                f"room {room} has no room node",
                f"add a node of kind room in {room}, or correct the node's room",
            )
    for node in topological_map.nodes:
        if node.kind is NodeKind.ROOM and node.room is None:
            yield node_fault(
                Rule.ONE_NODE_PER_ROOM, node, "a room node without a room", "name its room"
            )
    for room, kind in sorted((building.rooms or {}).items()):
        drawn = room in topological_map.rooms or room in building.rooms_left_out
        if kind.is_enclosed and not drawn:
            yield Fault(
                Rule.ONE_NODE_PER_ROOM,
                Severity.WARNING,
                f"room {room}",
                None,
                f"room {room} of the building has no node",
                "draw it if the robot should go there",
            )


def check_doors_have_nodes(topological_map: TopologicalMap, building: Building) -> Iterator[Fault]:
    """Rule 2: each door of a room has its own node, so a room has at least one."""
    for room, nodes in _enclosed_rooms(topological_map).items():
        if not any(node.kind is NodeKind.DOOR for node in nodes):
            yield node_fault(
                Rule.DOOR_HAS_NODE,
                nodes[0],
                f"room {room} has no door node",
                "add a node of kind door at its exit, or correct the rooms of door nodes",
            )
    for node in topological_map.nodes:
        if node.kind is NodeKind.DOOR and node.room is None:
            yield node_fault(
                Rule.DOOR_HAS_NODE, node, "a door node of no room", "name the room it leads out of"
            )


def check_find_door_joins_room_and_door(
    topological_map: TopologicalMap, building: Building
) -> Iterator[Fault]:
    """Rule 3: find_door connects each room node to its door nodes, and nothing else."""
    for edge in topological_map.edges:
        source, target = topological_map.node(edge.source), topological_map.node(edge.target)
        joins = source.kind is NodeKind.ROOM and target.kind is NodeKind.DOOR
        joins = joins and source.room == target.room
        if edge.behavior is Behavior.FIND_DOOR and not joins:
            yield edge_fault(
                topological_map,
                Rule.FIND_DOOR,
                edge,
                f"find_door leads from {_described(source)} to {_described(target)}",
                "lead it from a room's node to a door node of that room",
            )
        elif joins and edge.behavior is not Behavior.FIND_DOOR:
            yield edge_fault(
                topological_map,
                Rule.FIND_DOOR,
                edge,
                f"a room's node leads to its door by {edge.behavior}",
                "make it find_door",
                fixable=True,
            )
    for node in topological_map.nodes:
        if node.kind is not NodeKind.DOOR or node.room is None:
            continue
        incoming = topological_map.in_edges(node.id)
        if not any(edge.behavior is Behavior.FIND_DOOR for edge in incoming):
            yield node_fault(
                Rule.FIND_DOOR,
                node,
                "no find_door edge reaches this door",
                f"add one from the node of {node.room}",
                fixable=_lacks_find_door(topological_map, node),
            )


def check_corridors_have_two_lanes(
    topological_map: TopologicalMap, building: Building
) -> Iterator[Fault]:
    """Rule 4: a corridor has two sets of nodes, one for each direction."""
    lanes = [edge for edge in topological_map.edges if _is_lane(topological_map, edge)]
    segments = np.array(
        [[_xy(topological_map, edge.source), _xy(topological_map, edge.target)] for edge in lanes]
    ).reshape(-1, 2, 2)
    headings = np.array([edge.yaw_rad for edge in lanes])
    for position, edge in enumerate(lanes):
        back = topological_map.edge_between(edge.target, edge.source)
        if back is not None and _is_lane(topological_map, back):
            if edge.source < edge.target:
                yield edge_fault(
                    topological_map,
                    Rule.TWO_LANES,
                    edge,
                    f"{edge.source} and {edge.target} serve both directions of a corridor",
                    "draw a second pair of nodes for the other direction",
                )
            continue
        turn = np.abs((headings - edge.yaw_rad + math.pi) % (2 * math.pi) - math.pi)
        opposite = segments[turn > _OPPOSITE_RAD]
        middle = segments[position].mean(axis=0)
        if not _lies_beside(middle, opposite):
            yield edge_fault(
                topological_map,
                Rule.TWO_LANES,
                edge,
                "no lane leads the other way along this part of the corridor",
                "draw the nodes and the corridor_follow edges of the other direction beside it",
                severity=Severity.WARNING,
            )


def check_rooms_are_entered_at_their_node(
    topological_map: TopologicalMap, building: Building
) -> Iterator[Fault]:
    """Rule 5: an edge that enters a room ends at the room's node, not at its door's."""
    for edge in topological_map.edges:
        source, target = topological_map.node(edge.source), topological_map.node(edge.target)
        if target.kind is NodeKind.DOOR and not _same_room(source, target):
            yield edge_fault(
                topological_map,
                Rule.ENTER_AT_ROOM,
                edge,
                f"it enters room {target.room} at the door node {target.id}",
                f"lead it to the node of {target.room}: a door node looks out of the room",
                fixable=only_room_node(topological_map, target.room) is not None,
            )


def check_rooms_are_left_from_their_doors(
    topological_map: TopologicalMap, building: Building
) -> Iterator[Fault]:
    """Rule 6: a room is left from one of its door nodes."""
    for edge in topological_map.edges:
        source, target = topological_map.node(edge.source), topological_map.node(edge.target)
        if source.kind is NodeKind.ROOM and not _same_room(source, target):
            yield edge_fault(
                topological_map,
                Rule.EXIT_AT_DOOR,
                edge,
                f"it leaves room {source.room} straight from the room's node",
                "lead it from the door node, where the robot looks out",
                fixable=only_door(topological_map, source.room) is not None,
            )


def only_room_node(topological_map: TopologicalMap, room: str | None) -> Node | None:
    """The room node of a room that has just one."""
    return _only(topological_map, room, NodeKind.ROOM)


def only_door(topological_map: TopologicalMap, room: str | None) -> Node | None:
    """The door node of a room that has just one."""
    return _only(topological_map, room, NodeKind.DOOR)


def _only(topological_map: TopologicalMap, room: str | None, kind: NodeKind) -> Node | None:
    if room is None:
        return None
    found = [node for node in topological_map.rooms.get(room, ()) if node.kind is kind]
    return found[0] if len(found) == 1 else None


def _lacks_find_door(topological_map: TopologicalMap, door: Node) -> bool:
    """Whether an edge from the room's node is all that a door lacks."""
    room = only_room_node(topological_map, door.room)
    return room is not None and topological_map.edge_between(room.id, door.id) is None


def _enclosed_rooms(topological_map: TopologicalMap) -> Mapping[str, tuple[Node, ...]]:
    """Room and door nodes of each room that has any."""
    rooms = {
        room: tuple(node for node in nodes if node.kind not in _PASSAGES)
        for room, nodes in topological_map.rooms.items()
    }
    return {room: nodes for room, nodes in rooms.items() if nodes}


def _is_lane(topological_map: TopologicalMap, edge: Edge) -> bool:
    return (
        edge.behavior is Behavior.CORRIDOR_FOLLOW
        and edge.source != edge.target
        and topological_map.node(edge.source).kind is NodeKind.HALLWAY
        and topological_map.node(edge.target).kind is NodeKind.HALLWAY
    )


def _same_room(first: Node, second: Node) -> bool:
    return first.room is not None and first.room == second.room


def _xy(topological_map: TopologicalMap, node_id: str) -> tuple[float, float]:
    node = topological_map.node(node_id)
    return node.x_m, node.y_m


def _lies_beside(
    point: Float[np.ndarray, "2"], segments: Float[np.ndarray, "segments 2 2"]
) -> bool:
    """Whether any of some segments passes beside a point, at the distance of a lane."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    length_m = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)
    unit = along / length_m[:, None]
    offset = point - start
    forward_m = (offset * unit).sum(axis=1)
    aside_m = np.abs(offset[:, 0] * unit[:, 1] - offset[:, 1] * unit[:, 0])
    within = (forward_m > -_LANE_OVERHANG_M) & (forward_m < length_m + _LANE_OVERHANG_M)
    return bool((within & (aside_m < _LANE_DISTANCE_M)).any())


def _described(node: Node) -> str:
    return f"{node.id} ({node.kind}{'' if node.room is None else f' of {node.room}'})"
