"""Checks of topological maps: every fault at once, each with its place and its remedy."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from toponav.maps import paper_rules, sanity_rules
from toponav.maps.faults import Building, Fault, Rule, Severity
from toponav.maps.schema import map_schema_faults, read_json
from toponav.maps.spec import (
    Edge,
    MapFrame,
    Node,
    TopologicalMap,
    elements_of_document,
)

__all__ = [
    "CHECKS",
    "Building",
    "Fault",
    "Rule",
    "Severity",
    "check_file",
    "has_errors",
    "validate",
    "validate_document",
]

Check = Callable[[TopologicalMap, Building], Iterator[Fault]]

CHECKS: tuple[Check, ...] = (
    paper_rules.check_one_node_per_room,
    paper_rules.check_doors_have_nodes,
    paper_rules.check_find_door_joins_room_and_door,
    paper_rules.check_corridors_have_two_lanes,
    paper_rules.check_rooms_are_entered_at_their_node,
    paper_rules.check_rooms_are_left_from_their_doors,
    sanity_rules.check_edges,
    sanity_rules.check_geometry,
    sanity_rules.check_behaviors,
    sanity_rules.check_reachability,
    sanity_rules.check_places,
)
"""All checks, in the order in which their faults are reported."""


def validate(
    topological_map: TopologicalMap, building: Building | None = None
) -> tuple[Fault, ...]:
    """Every fault of a map: errors first, then by rule and element.

    Args:
        topological_map: Map to check.
        building: What is known of its building; without it places and rooms are not checked.

    Example:
        >>> faults = validate(load_map("office.topo.json"))
        >>> [fault.message for fault in faults if fault.severity is Severity.ERROR]
        []
    """
    building = building or Building()
    return _in_order(fault for check in CHECKS for fault in check(topological_map, building))


def validate_document(
    document: Any, building: Building | None = None
) -> tuple[TopologicalMap | None, tuple[Fault, ...]]:
    """The map that a JSON document holds and every fault of it.

    Repeated elements and edges without nodes are reported, left out, and the rest is checked
    too. The map is None when such faults keep the document from being one.
    """
    breaches = map_schema_faults(document)
    if breaches:
        return None, tuple(
            Fault(Rule.DOCUMENT, Severity.ERROR, place, None, rule, "follow the map's JSON Schema")
            for place, rule in breaches
        )
    nodes, edges = elements_of_document(document)
    structural = [*_repeated("node", nodes), *_repeated("edge", edges)]
    kept_nodes = tuple({node.id: node for node in reversed(nodes)}.values())
    unique_edges = {edge.id: edge for edge in reversed(edges)}.values()
    structural += _without_nodes(edges, {node.id: node for node in kept_nodes})
    ids = {node.id for node in kept_nodes}
    kept_edges = tuple(edge for edge in unique_edges if {edge.source, edge.target} <= ids)
    frame = MapFrame(document["frame"]["name"], document["frame"].get("plan"))
    topological_map = TopologicalMap(document["name"], frame, kept_nodes, kept_edges)
    faults = _in_order([*structural, *validate(topological_map, building)])
    return (None if structural else topological_map), faults


def check_file(
    path: str | Path, building: Building | None = None
) -> tuple[TopologicalMap | None, tuple[Fault, ...]]:
    """The map in a `*.topo.json` file, or None, and every fault of it.

    Raises:
        InputError: If the file cannot be read or is not JSON.
    """
    return validate_document(read_json(Path(path)), building)


def has_errors(faults: Sequence[Fault]) -> bool:
    """Whether any fault is more than a warning."""
    return any(fault.severity is Severity.ERROR for fault in faults)


def _repeated(what: str, elements: Sequence[Node | Edge]) -> Iterator[Fault]:
    first: dict[str, int] = {}
    for position, element in enumerate(elements):
        if element.id not in first:
            first[element.id] = position
            continue
        place_m = (element.x_m, element.y_m) if isinstance(element, Node) else None
        yield Fault(
            Rule.UNIQUE_ID,
            Severity.ERROR,
            f"{what} {element.id}",
            place_m,
            f"{what}s[{first[element.id]}] and {what}s[{position}] have the same id",
            "rename or remove one",
        )


def _without_nodes(edges: Sequence[Edge], nodes: dict[str, Node]) -> Iterator[Fault]:
    for edge in edges:
        for end, node_id, other in (
            ("source", edge.source, nodes.get(edge.target)),
            ("target", edge.target, nodes.get(edge.source)),
        ):
            if node_id not in nodes:
                yield Fault(
                    Rule.EDGE_HAS_NODES,
                    Severity.ERROR,
                    f"edge {edge.id}",
                    None if other is None else (other.x_m, other.y_m),
                    f"its {end} {node_id} is not a node of the map",
                    "add the node, correct the name, or remove the edge",
                    fixable=True,
                )


def _in_order(faults: Iterator[Fault] | Sequence[Fault]) -> tuple[Fault, ...]:
    rank = {rule: position for position, rule in enumerate(Rule)}
    return tuple(
        sorted(faults, key=lambda fault: (fault.severity, rank[fault.rule], fault.element))
    )
