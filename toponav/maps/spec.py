"""Topological maps: places, the behaviours that lead from one to the next, and their file."""

import functools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
from jaxtyping import Float64

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import write_atomically
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.elements import Edge, MapFrame, Node, broken_elements, edge_along
from toponav.maps.schema import FORMAT_VERSION, read_map_document

__all__ = [
    "Edge",
    "MapFrame",
    "Node",
    "TopologicalMap",
    "edge_along",
    "elements_of_document",
    "load_map",
    "map_from_document",
    "map_to_document",
    "save_map",
]


@dataclass(frozen=True)
class TopologicalMap:
    """A directed graph of places and behaviours (GraphNav, section IV).

    Nodes and edges are kept sorted by id, so that two maps with the same content are equal
    and give the same plans and tensors, whatever order they were drawn in.

    Args:
        name: Name of the building or floor.
        frame: Frame of the positions.
        nodes: Places with unique ids.
        edges: Behaviours with unique ids between existing nodes.

    Raises:
        InputError: If an id repeats, an edge leads from or to a node that is not there, or a
            number is not finite.

    Example:
        >>> nodes = (Node("office_1", NodeKind.ROOM, 0.0, 0.0, "office_1"),
        ...          Node("office_1_door", NodeKind.DOOR, 2.0, 0.0, "office_1"))
        >>> edges = (edge_along(nodes[0], nodes[1], Behavior.FIND_DOOR),)
        >>> TopologicalMap("tiny", MapFrame(), nodes, edges).out_edges("office_1")[0].id
        'office_1->office_1_door'
    """

    name: str
    frame: MapFrame
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", tuple(sorted(self.nodes, key=lambda node: node.id)))
        object.__setattr__(self, "edges", tuple(sorted(self.edges, key=lambda edge: edge.id)))
        faults = broken_elements(self.nodes, self.edges)
        if faults:
            raise InputError(
                "; ".join(faults[:5]) + (f"; and {len(faults) - 5} more" if faults[5:] else ""),
                where=f"map '{self.name}'",
                remedy="give each element its own id, and each edge two nodes of the map",
            )

    def __hash__(self) -> int:
        return self._content_hash

    @functools.cached_property
    def _content_hash(self) -> int:
        return hash((self.name, self.frame, self.nodes, self.edges))

    @functools.cached_property
    def node_index(self) -> Mapping[str, int]:
        """Position of each node in `nodes`, by id."""
        return {node.id: index for index, node in enumerate(self.nodes)}

    @functools.cached_property
    def edge_index(self) -> Mapping[str, int]:
        """Position of each edge in `edges`, by id."""
        return {edge.id: index for index, edge in enumerate(self.edges)}

    @functools.cached_property
    def positions_m(self) -> Float64[np.ndarray, "nodes 2"]:
        """Position of each node in the order of `nodes`, in metres."""
        positions = np.array([(node.x_m, node.y_m) for node in self.nodes], dtype=np.float64)
        return positions.reshape(-1, 2)

    @functools.cached_property
    def _out(self) -> Mapping[str, tuple[Edge, ...]]:
        return _grouped(self.nodes, self.edges, "source")

    @functools.cached_property
    def _in(self) -> Mapping[str, tuple[Edge, ...]]:
        return _grouped(self.nodes, self.edges, "target")

    @functools.cached_property
    def _between(self) -> Mapping[tuple[str, str], Edge]:
        return {(edge.source, edge.target): edge for edge in reversed(self.edges)}

    @functools.cached_property
    def _neighbors(self) -> Mapping[str, frozenset[str]]:
        return {
            node.id: frozenset(edge.target for edge in self._out[node.id])
            | frozenset(edge.source for edge in self._in[node.id])
            for node in self.nodes
        }

    def __contains__(self, node_id: object) -> bool:
        return node_id in self.node_index

    def node(self, node_id: str) -> Node:
        """The node of that id.

        Raises:
            InputError: If there is none; offers the nearest name.
        """
        index = self.node_index.get(node_id)
        if index is None:
            raise self._no_such("node", node_id, self.node_index)
        return self.nodes[index]

    def edge(self, edge_id: str) -> Edge:
        """The edge of that id.

        Raises:
            InputError: If there is none; offers the nearest name.
        """
        index = self.edge_index.get(edge_id)
        if index is None:
            raise self._no_such("edge", edge_id, self.edge_index)
        return self.edges[index]

    def out_edges(self, node_id: str) -> tuple[Edge, ...]:
        """Edges that leave the node, by id."""
        found = self._out.get(node_id)
        if found is None:
            raise self._no_such("node", node_id, self.node_index)
        return found

    def in_edges(self, node_id: str) -> tuple[Edge, ...]:
        """Edges that reach the node, by id."""
        found = self._in.get(node_id)
        if found is None:
            raise self._no_such("node", node_id, self.node_index)
        return found

    def neighbors(self, node_id: str) -> frozenset[str]:
        """Nodes joined to the node by an edge of either direction."""
        found = self._neighbors.get(node_id)
        if found is None:
            raise self._no_such("node", node_id, self.node_index)
        return found

    def edge_between(self, source: str, target: str) -> Edge | None:
        """The edge from one node to the other, or None; the first by id if several."""
        return self._between.get((source, target))

    @functools.cached_property
    def rooms(self) -> Mapping[str, tuple[Node, ...]]:
        """The nodes in each named room."""
        found: dict[str, list[Node]] = {}
        for node in self.nodes:
            if node.room is not None:
                found.setdefault(node.room, []).append(node)
        return {room: tuple(nodes) for room, nodes in sorted(found.items())}

    def to_networkx(self) -> "nx.DiGraph[str]":
        """A networkx graph: nodes by id with the attribute `node`, edges with `edge`, `length_m`.

        Of parallel edges the first by id is taken.
        """
        graph: nx.DiGraph[str] = nx.DiGraph(name=self.name)
        graph.add_nodes_from((node.id, {"node": node}) for node in self.nodes)
        for edge in self.edges:
            if not graph.has_edge(edge.source, edge.target):
                graph.add_edge(edge.source, edge.target, edge=edge, length_m=edge.length_m)
        return graph

    def _no_such(self, what: str, name: str, valid: Iterable[str]) -> InputError:
        return InputError(
            f"there is no {what} '{name}'",
            where=f"map '{self.name}'",
            remedy=did_you_mean(name, valid),
        )


def load_map(path: str | Path) -> TopologicalMap:
    """The topological map in a `*.topo.json` file.

    Raises:
        InputError: If the file cannot be read, is not JSON, breaks the schema, repeats an id
            or has an edge without its nodes; names the file and the element.
    """
    path = Path(path)
    document = read_map_document(path)
    try:
        return map_from_document(document)
    except InputError as error:
        raise InputError(error.rule, where=str(path), remedy=error.remedy) from None


def save_map(topological_map: TopologicalMap, path: str | Path) -> Path:
    """The path of the file, written at once or not at all; the same map gives the same bytes.

    Raises:
        InputError: If the folder cannot be written to.
    """
    text = _format_document(map_to_document(topological_map))
    return write_atomically(path, text)


def map_from_document(document: Mapping[str, Any]) -> TopologicalMap:
    """The map that a document with a checked schema describes.

    Raises:
        InputError: If an id repeats or an edge lacks a node.
    """
    nodes, edges = elements_of_document(document)
    frame = MapFrame(document["frame"]["name"], document["frame"].get("plan"))
    return TopologicalMap(document["name"], frame, tuple(nodes), tuple(edges))


def elements_of_document(document: Mapping[str, Any]) -> tuple[list[Node], list[Edge]]:
    """Nodes and edges of a document with a checked schema, repeated and dangling ones too."""
    nodes = [
        Node(
            id=raw["id"],
            kind=NodeKind(raw["kind"]),
            x_m=float(raw["x"]),
            y_m=float(raw["y"]),
            room=raw.get("room"),
            size=float(raw.get("size", 1.0)),
        )
        for raw in document["nodes"]
    ]
    by_id = {node.id: node for node in nodes}
    edges = [_edge_of(raw, by_id) for raw in document["edges"]]
    return nodes, edges


def map_to_document(topological_map: TopologicalMap) -> dict[str, Any]:
    """The JSON document of a map, keys in the order of the schema, elements sorted by id."""
    # Adding zero turns -0.0 into 0.0: equal maps give equal documents.
    return {
        "version": FORMAT_VERSION,
        "name": topological_map.name,
        "frame": {"name": topological_map.frame.name, "plan": topological_map.frame.plan},
        "nodes": [
            {
                "id": node.id,
                "kind": node.kind.value,
                "x": node.x_m + 0.0,
                "y": node.y_m + 0.0,
                "room": node.room,
                "size": node.size,
            }
            for node in topological_map.nodes
        ],
        "edges": [
            {
                "id": edge.id,
                "source": edge.source,
                "target": edge.target,
                "behavior": edge.behavior.value,
                "yaw": edge.yaw_rad + 0.0,
                "length": edge.length_m + 0.0,
            }
            for edge in topological_map.edges
        ],
    }


def _edge_of(raw: Mapping[str, Any], nodes: Mapping[str, Node]) -> Edge:
    source, target = nodes.get(raw["source"]), nodes.get(raw["target"])
    yaw_rad, length_m = raw.get("yaw"), raw.get("length")
    if source is not None and target is not None:
        straight = edge_along(source, target, Behavior(raw["behavior"]))
        yaw_rad = straight.yaw_rad if yaw_rad is None else yaw_rad
        length_m = straight.length_m if length_m is None else length_m
    return Edge(
        id=raw["id"],
        source=raw["source"],
        target=raw["target"],
        behavior=Behavior(raw["behavior"]),
        yaw_rad=float(yaw_rad or 0.0),
        length_m=float(length_m or 0.0),
    )


def _format_document(document: Mapping[str, Any]) -> str:
    """One element a line, so that a version control system shows what changed."""
    lines = ["{"]
    for key in ("version", "name", "frame"):
        lines.append(f'  "{key}": {_compact(document[key])},')
    for key, ending in (("nodes", ","), ("edges", "")):
        elements = ",\n".join(f"    {_compact(element)}" for element in document[key])
        lines.append(
            f'  "{key}": [\n{elements}\n  ]{ending}' if elements else f'  "{key}": []{ending}'
        )
    return "\n".join([*lines, "}"]) + "\n"


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _grouped(
    nodes: tuple[Node, ...], edges: tuple[Edge, ...], end: str
) -> dict[str, tuple[Edge, ...]]:
    found: dict[str, list[Edge]] = {node.id: [] for node in nodes}
    for edge in edges:
        found[getattr(edge, end)].append(edge)
    return {node_id: tuple(grouped) for node_id, grouped in found.items()}
