"""Repairs of the faults that the checks mark as fixable, each only if no new fault comes of it."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from toponav.core.vocabulary import Behavior
from toponav.maps.faults import Building, Fault, Rule
from toponav.maps.paper_rules import only_door, only_room_node
from toponav.maps.sanity_rules import free_spot_near
from toponav.maps.spec import Edge, Node, TopologicalMap, edge_along
from toponav.maps.validate import validate

__all__ = ["Repair", "repair"]


@dataclass(frozen=True)
class Repair:
    """A map after its repair."""

    topological_map: TopologicalMap
    """The repaired map; the one given where nothing could be done."""
    fixed: tuple[Fault, ...]
    """Faults that are gone, in the order in which they were repaired."""
    left: tuple[Fault, ...]
    """Faults that remain."""


def repair(topological_map: TopologicalMap, building: Building | None = None) -> Repair:
    """The map without the faults that a program can fix without asking anything.

    Each fix is kept only if no fault comes up that was not there before, so the result never
    has a fault that the map given lacks.

    Args:
        topological_map: Map to repair.
        building: What is known of its building, as for `validate`.

    Example:
        >>> repaired = repair(load_map("office.topo.json"))  # doctest: +SKIP
        >>> [fault.rule.value for fault in repaired.fixed]  # doctest: +SKIP
        ['yaw-fits-geometry']
    """
    building = building or Building()
    current = topological_map
    faults = validate(current, building)
    fixed: list[Fault] = []
    given_up: set[tuple[Rule, str]] = set()
    while True:
        fault = next(
            (one for one in faults if one.fixable and (one.rule, one.element) not in given_up),
            None,
        )
        if fault is None:
            return Repair(current, tuple(fixed), faults)
        changed = _FIXES[fault.rule](current, fault, building)
        after = validate(changed, building) if changed is not None else ()
        if changed is None or not _improves(faults, after, fault):
            given_up.add((fault.rule, fault.element))
            continue
        current, faults = changed, after
        fixed.append(fault)
        given_up.clear()  # what stood in the way of another fix may be gone


def _improves(before: Sequence[Fault], after: Sequence[Fault], fault: Fault) -> bool:
    """Whether the fault is gone and none came."""
    then = Counter((one.rule, one.element) for one in before)
    now = Counter((one.rule, one.element) for one in after)
    key = (fault.rule, fault.element)
    return now[key] < then[key] and not now - then


def _edge_of(topological_map: TopologicalMap, fault: Fault) -> Edge:
    return topological_map.edge(fault.element.removeprefix("edge "))


def _node_of(topological_map: TopologicalMap, fault: Fault) -> Node:
    return topological_map.node(fault.element.removeprefix("node "))


def _with_edge(topological_map: TopologicalMap, old: Edge, new: Edge | None) -> TopologicalMap:
    """The map with one edge replaced, or removed where the new one is None."""
    edges = [edge for edge in topological_map.edges if edge is not old]
    return replace(topological_map, edges=(*edges, *(() if new is None else (new,))))


def _remove_edge(topological_map: TopologicalMap, fault: Fault, _: Building) -> TopologicalMap:
    return _with_edge(topological_map, _edge_of(topological_map, fault), None)


def _set_yaw(topological_map: TopologicalMap, fault: Fault, _: Building) -> TopologicalMap:
    edge = _edge_of(topological_map, fault)
    straight = _straight(topological_map, edge)
    return _with_edge(topological_map, edge, replace(edge, yaw_rad=straight.yaw_rad))


def _set_length(topological_map: TopologicalMap, fault: Fault, _: Building) -> TopologicalMap:
    edge = _edge_of(topological_map, fault)
    straight = _straight(topological_map, edge)
    return _with_edge(topological_map, edge, replace(edge, length_m=straight.length_m))


def _straight(topological_map: TopologicalMap, edge: Edge) -> Edge:
    source, target = topological_map.node(edge.source), topological_map.node(edge.target)
    return edge_along(source, target, edge.behavior, edge_id=edge.id)


def _fix_find_door(
    topological_map: TopologicalMap, fault: Fault, _: Building
) -> TopologicalMap | None:
    """The edge from a room to its door by find_door, or the missing one added."""
    if fault.element.startswith("edge "):
        edge = _edge_of(topological_map, fault)
        return _with_edge(topological_map, edge, replace(edge, behavior=Behavior.FIND_DOOR))
    door = _node_of(topological_map, fault)
    room = only_room_node(topological_map, door.room)
    if room is None or topological_map.edge_between(room.id, door.id) is not None:
        return None
    new = edge_along(room, door, Behavior.FIND_DOOR)
    if new.id in topological_map.edge_index:
        return None
    return replace(topological_map, edges=(*topological_map.edges, new))


def _enter_at_room(
    topological_map: TopologicalMap, fault: Fault, _: Building
) -> TopologicalMap | None:
    """The edge led on from the door node to the room's node."""
    edge = _edge_of(topological_map, fault)
    room = only_room_node(topological_map, topological_map.node(edge.target).room)
    return None if room is None else _moved(topological_map, edge, edge.source, room.id)


def _exit_at_door(
    topological_map: TopologicalMap, fault: Fault, _: Building
) -> TopologicalMap | None:
    """The edge led from the room's only door node."""
    edge = _edge_of(topological_map, fault)
    door = only_door(topological_map, topological_map.node(edge.source).room)
    return None if door is None else _moved(topological_map, edge, door.id, edge.target)


def _moved(
    topological_map: TopologicalMap, edge: Edge, source: str, target: str
) -> TopologicalMap | None:
    """The map with the edge between other nodes, or without it where they are joined already."""
    there = topological_map.edge_between(source, target)
    if there is not None:
        same = there.behavior is edge.behavior
        return _with_edge(topological_map, edge, None) if same else None
    ends = topological_map.node(source), topological_map.node(target)
    new = edge_along(*ends, edge.behavior)
    if new.id in topological_map.edge_index and new.id != edge.id:
        new = replace(new, id=edge.id)
    return _with_edge(topological_map, edge, new)


def _move_node(
    topological_map: TopologicalMap, fault: Fault, building: Building
) -> TopologicalMap | None:
    """The node moved to where the robot fits; straight edges stay straight."""
    node = _node_of(topological_map, fault)
    spot = free_spot_near(node, building)
    if spot is None:
        return None
    moved = replace(node, x_m=spot[0], y_m=spot[1])
    nodes = tuple(moved if one.id == node.id else one for one in topological_map.nodes)
    by_id = {one.id: one for one in nodes}
    edges = []
    for edge in topological_map.edges:
        if node.id in (edge.source, edge.target) and edge.source != edge.target:
            before = _straight(topological_map, edge)
            after = edge_along(by_id[edge.source], by_id[edge.target], edge.behavior)
            if np.isclose(edge.yaw_rad, before.yaw_rad):
                edge = replace(edge, yaw_rad=after.yaw_rad)
            if np.isclose(edge.length_m, before.length_m):
                edge = replace(edge, length_m=after.length_m)
        edges.append(edge)
    return replace(topological_map, nodes=nodes, edges=tuple(edges))


Fix = Callable[[TopologicalMap, Fault, Building], TopologicalMap | None]

_FIXES: dict[Rule, Fix] = {
    Rule.FIND_DOOR: _fix_find_door,
    Rule.ENTER_AT_ROOM: _enter_at_room,
    Rule.EXIT_AT_DOOR: _exit_at_door,
    Rule.NO_SELF_LOOP: _remove_edge,
    Rule.ONE_EDGE_PER_PAIR: _remove_edge,
    Rule.LENGTH_FITS: _set_length,
    Rule.YAW_FITS: _set_yaw,
    Rule.IN_FREE_SPACE: _move_node,
}
