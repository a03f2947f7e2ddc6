"""Checks that hold for any map that a robot is to drive on, beyond the paper's six rules."""

import math
from collections.abc import Iterator

import networkx as nx

from toponav.core.geometry import angle_difference
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.faults import Building, Fault, Rule, Severity, edge_fault, node_fault
from toponav.maps.spec import Edge, Node, TopologicalMap

__all__ = [
    "check_behaviors",
    "check_edges",
    "check_geometry",
    "check_places",
    "check_reachability",
    "free_spot_near",
]

_SHORTEST_EDGE_M = 0.01
_LANE_DISTANCE_M = 1.5
_MOVE_M = 0.5
_MOVE_STEP_M = 0.05
_LENGTH_TOLERANCE_M = 0.1
_LONGEST_DETOUR = 3.0
_YAW_TOLERANCE_RAD = 0.2 * math.pi
# The heading at a door is only as good as the place of the room's node.
_CONTRADICTION_RAD = {True: math.radians(45.0), False: math.radians(30.0)}
_BEND_RAD = math.radians(75.0)


def check_edges(topological_map: TopologicalMap, building: Building) -> Iterator[Fault]:
    """An edge joins two different nodes, and is the only one from the first to the second."""
    for edge in topological_map.edges:
        if edge.source == edge.target:
            yield edge_fault(
                topological_map,
                Rule.NO_SELF_LOOP,
                edge,
                f"it leads from {edge.source} to itself",
                "remove it",
                fixable=True,
            )
        first = topological_map.edge_between(edge.source, edge.target)
        if first is not edge and first is not None:
            yield edge_fault(
                topological_map,
                Rule.ONE_EDGE_PER_PAIR,
                edge,
                f"it doubles {first.id}: plans use {first.id} ({first.behavior})",
                "keep the edge with the right behaviour",
                fixable=first.behavior is edge.behavior,
            )


def check_geometry(topological_map: TopologicalMap, building: Building) -> Iterator[Fault]:
    """Lengths and yaws agree with where the nodes are."""
    for edge in topological_map.edges:
        if edge.source == edge.target:
            continue
        source, target = topological_map.node(edge.source), topological_map.node(edge.target)
        straight_m = source.distance_to(target)
        if straight_m < _SHORTEST_EDGE_M or edge.length_m < _SHORTEST_EDGE_M:
            yield edge_fault(
                topological_map,
                Rule.POSITIVE_LENGTH,
                edge,
                f"its length is {edge.length_m:.3f} m and its nodes are {straight_m:.3f} m apart",
                "move one of its nodes, or set the length that the robot drives",
            )
            continue
        if (
            not straight_m - _LENGTH_TOLERANCE_M
            <= edge.length_m
            <= straight_m * _LONGEST_DETOUR + 1
        ):
            yield edge_fault(
                topological_map,
                Rule.LENGTH_FITS,
                edge,
                f"its length is {edge.length_m:.2f} m, its nodes are {straight_m:.2f} m apart",
                f"set the length to {straight_m:.2f} or to what the robot drives",
                severity=Severity.WARNING,
                fixable=True,
            )
        direction_rad = math.atan2(target.y_m - source.y_m, target.x_m - source.x_m)
        off_rad = abs(angle_difference(edge.yaw_rad, direction_rad))
        if off_rad > _YAW_TOLERANCE_RAD:
            yield edge_fault(
                topological_map,
                Rule.YAW_FITS,
                edge,
                f"its yaw {edge.yaw_rad:.2f} is {math.degrees(off_rad):.0f} degrees off the "
                f"direction from {edge.source} to {edge.target}",
                f"set the yaw to {direction_rad:.2f}",
                fixable=True,
            )


def check_behaviors(topological_map: TopologicalMap, building: Building) -> Iterator[Fault]:
    """Behaviours do not contradict the way that the edges bend (a warning: maps are sketches)."""
    for edge in topological_map.edges:
        before_rad = _heading_before(topological_map, edge)
        if before_rad is None or edge.behavior is Behavior.FIND_DOOR:
            continue
        turn_rad = angle_difference(edge.yaw_rad, before_rad)
        tolerance_rad = _CONTRADICTION_RAD[topological_map.node(edge.source).kind is NodeKind.DOOR]
        wrong = {
            Behavior.TURN_LEFT: turn_rad < -tolerance_rad,
            Behavior.TURN_RIGHT: turn_rad > tolerance_rad,
            Behavior.STRAIGHT: abs(turn_rad) > _BEND_RAD,
            Behavior.CORRIDOR_FOLLOW: abs(turn_rad) > _BEND_RAD,
        }[edge.behavior]
        if wrong:
            side = "left" if turn_rad > 0 else "right"
            yield edge_fault(
                topological_map,
                Rule.BEHAVIOR_FITS,
                edge,
                f"{edge.behavior}, but the edge bends {abs(math.degrees(turn_rad)):.0f} degrees "
                f"to the {side}",
                "correct the behaviour, or move the nodes",
                severity=Severity.WARNING,
            )


def check_reachability(topological_map: TopologicalMap, building: Building) -> Iterator[Fault]:
    """Every room can be reached from and left to the main part; no node is a dead end."""
    if not topological_map.nodes:
        return
    graph = topological_map.to_networkx()
    # Of parts with the same size the one with the first node, so that reports repeat.
    parts = sorted(
        nx.strongly_connected_components(graph), key=lambda part: (-len(part), min(part))
    )
    inside = min(parts[0])
    reached = nx.descendants(graph, inside) | parts[0]
    returning = nx.ancestors(graph, inside) | parts[0]
    open_ends = _open_ends(topological_map)
    for node in topological_map.nodes:
        if node.kind is NodeKind.ROOM:
            for holds, what, how in (
                (node.id in reached, "reached from", "an edge that enters it"),
                (node.id in returning, "left to", "a find_door edge and exits at its door"),
            ):
                if not holds:
                    yield node_fault(
                        Rule.REACHABLE,
                        node,
                        f"it cannot be {what} the main part of the map",
                        f"add {how}",
                    )
        elif node.id in open_ends and not _ends_a_corridor(topological_map, node, open_ends):
            yield node_fault(
                Rule.CONNECTED,
                node,
                f"no edge {' or '.join(open_ends[node.id])} it",
                "add the missing edges, or remove the node",
                severity=Severity.WARNING,
            )


def check_places(topological_map: TopologicalMap, building: Building) -> Iterator[Fault]:
    """Nodes stand where a robot fits, in the room that they name, as far as that is known."""
    for node in topological_map.nodes:
        if building.is_free is not None and not building.is_free(node.x_m, node.y_m):
            yield node_fault(
                Rule.IN_FREE_SPACE,
                node,
                "a robot does not fit here",
                "move it away from walls and furniture",
                severity=Severity.WARNING,
                fixable=free_spot_near(node, building) is not None,
            )
        if (
            building.rooms is not None
            and node.room is not None
            and node.room not in building.rooms
        ):
            yield node_fault(
                Rule.KNOWN_ROOM,
                node,
                f"the building has no room {node.room}",
                "correct the name: the truth matches rooms by exact name",
            )
        elif building.room_at is not None and node.kind in (NodeKind.ROOM, NodeKind.DOOR):
            room = building.room_at(node.x_m, node.y_m)
            if room != node.room:
                is_door = node.kind is NodeKind.DOOR
                yield node_fault(
                    Rule.IN_ITS_ROOM,
                    node,
                    f"it stands in {room or 'no room'}, not in {node.room}",
                    f"move it into {node.room}, or correct its room",
                    severity=Severity.WARNING if is_door else Severity.ERROR,
                )


def free_spot_near(node: Node, building: Building) -> tuple[float, float] | None:
    """The nearest place within half a metre where a robot fits, in the room that it is in now."""
    if building.is_free is None:
        return None
    here = None if building.room_at is None else building.room_at(node.x_m, node.y_m)
    for ring in range(1, round(_MOVE_M / _MOVE_STEP_M) + 1):
        for turn in range(8 * ring):
            angle = math.tau * turn / (8 * ring)
            x_m = node.x_m + ring * _MOVE_STEP_M * math.cos(angle)
            y_m = node.y_m + ring * _MOVE_STEP_M * math.sin(angle)
            in_room = building.room_at is None or building.room_at(x_m, y_m) in (here, node.room)
            if in_room and building.is_free(x_m, y_m):
                return x_m, y_m
    return None


def _open_ends(topological_map: TopologicalMap) -> dict[str, tuple[str, ...]]:
    """What no edge does to a node, of the nodes that lack an edge in or out."""
    found: dict[str, tuple[str, ...]] = {}
    for node in topological_map.nodes:
        edges = {
            "reaches": topological_map.in_edges(node.id),
            "leaves": topological_map.out_edges(node.id),
        }
        lacking = tuple(how for how, present in edges.items() if not present)
        if lacking:
            found[node.id] = lacking
    return found


def _ends_a_corridor(
    topological_map: TopologicalMap, node: Node, open_ends: dict[str, tuple[str, ...]]
) -> bool:
    """Whether one lane of a corridor ends here where the other begins, as drawings do."""
    if node.kind is NodeKind.DOOR or len(open_ends[node.id]) > 1:
        return False
    others = (topological_map.node(other) for other in open_ends if other != node.id)
    return any(
        len(open_ends[other.id]) == 1
        and open_ends[other.id] != open_ends[node.id]
        and other.kind is node.kind
        and other.distance_to(node) < _LANE_DISTANCE_M
        for other in others
    )


def _heading_before(topological_map: TopologicalMap, edge: Edge) -> float | None:
    """The robot's heading at the source of an edge, or None where the map does not say.

    It comes along a find_door edge at doors, else along corridor_follow edges, or goes on along
    them; several are averaged as directions.
    """
    source = topological_map.node(edge.source)
    incoming, outgoing = topological_map.in_edges(source.id), topological_map.out_edges(source.id)
    wanted = Behavior.FIND_DOOR if source.kind is NodeKind.DOOR else Behavior.CORRIDOR_FOLLOW
    headings = [other.yaw_rad for other in incoming if other.behavior is wanted]
    if not headings and source.kind is not NodeKind.DOOR:
        headings = [
            other.yaw_rad for other in outgoing if other.behavior is wanted and other is not edge
        ]
    if not headings:
        return None
    cosine, sine = sum(map(math.cos, headings)), sum(map(math.sin, headings))
    return math.atan2(sine, cosine) if math.hypot(cosine, sine) > 0.5 else None
