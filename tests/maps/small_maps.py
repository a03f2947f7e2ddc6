"""A tiny office floor without faults, and ways to break it."""

from dataclasses import replace
from typing import Any

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, edge_along

CF, FD = Behavior.CORRIDOR_FOLLOW, Behavior.FIND_DOOR
TL, TR, S = Behavior.TURN_LEFT, Behavior.TURN_RIGHT, Behavior.STRAIGHT

NODES = {
    node.id: node
    for node in (
        *(Node(f"hallway_1-{i}r", NodeKind.HALLWAY, x, -0.1, "hallway_1")
          for i, x in enumerate((0.0, 4.0, 6.0, 10.0))),
        *(Node(f"hallway_1-{i}l", NodeKind.HALLWAY, x, 0.1, "hallway_1")
          for i, x in enumerate((0.0, 4.0, 6.0, 10.0))),
        Node("office_4", NodeKind.ROOM, 5.0, 2.0, "office_4"),
        Node("office_4_door", NodeKind.DOOR, 5.0, 1.5, "office_4"),
        Node("office_41", NodeKind.ROOM, 12.0, 0.0, "office_41"),
        Node("office_41_door", NodeKind.DOOR, 11.5, 0.0, "office_41"),
        Node("WC_1", NodeKind.ROOM, -2.0, 0.0, "WC_1"),
        Node("WC_1_door", NodeKind.DOOR, -1.5, 0.0, "WC_1"),
    )
}  # fmt: skip
_WALKS: tuple[tuple[str, str, Behavior], ...] = (
    ("hallway_1-0r", "hallway_1-1r", CF),
    ("hallway_1-1r", "hallway_1-2r", CF),
    ("hallway_1-2r", "hallway_1-3r", CF),
    ("hallway_1-3l", "hallway_1-2l", CF),
    ("hallway_1-2l", "hallway_1-1l", CF),
    ("hallway_1-1l", "hallway_1-0l", CF),
    ("hallway_1-1r", "office_4", TL),
    ("hallway_1-2l", "office_4", TR),
    ("office_4", "office_4_door", FD),
    ("office_4_door", "hallway_1-2r", TL),
    ("office_4_door", "hallway_1-1l", TR),
    ("hallway_1-3r", "office_41", S),
    ("office_41", "office_41_door", FD),
    ("office_41_door", "hallway_1-3l", CF),
    ("hallway_1-0l", "WC_1", S),
    ("WC_1", "WC_1_door", FD),
    ("WC_1_door", "hallway_1-0r", CF),
)


def edge(source: str, target: str, behavior: Behavior, **changes: Any) -> Edge:
    """An edge between two nodes of the floor."""
    return replace(edge_along(NODES[source], NODES[target], behavior), **changes)


def office_floor() -> TopologicalMap:
    """A corridor along x with an office to its north and a room at each end."""
    edges = tuple(edge(*walk) for walk in _WALKS)
    return TopologicalMap("floor", MapFrame(), tuple(NODES.values()), edges)


def without(topological_map: TopologicalMap, *ids: str) -> TopologicalMap:
    """The map without some nodes (and their edges) or edges."""
    return replace(
        topological_map,
        nodes=tuple(node for node in topological_map.nodes if node.id not in ids),
        edges=tuple(
            edge
            for edge in topological_map.edges
            if not {edge.id, edge.source, edge.target} & set(ids)
        ),
    )


def plus(topological_map: TopologicalMap, *elements: Node | Edge) -> TopologicalMap:
    """The map with more nodes or edges; those of the same id are replaced."""
    ids = {element.id for element in elements}
    nodes = [node for node in topological_map.nodes if node.id not in ids]
    edges = [edge for edge in topological_map.edges if edge.id not in ids]
    for element in elements:
        (nodes if isinstance(element, Node) else edges).append(element)  # type: ignore[arg-type]
    return replace(topological_map, nodes=tuple(nodes), edges=tuple(edges))
