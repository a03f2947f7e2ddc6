"""Topological maps: places, the behaviours that lead from one to the next, and their file."""

import functools
import json
import math
import os
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
from jaxtyping import Float64

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.schema import FORMAT_VERSION, read_map_document

__all__ = [
    "Edge",
    "MapFrame",
    "Node",
    "TopologicalMap",
    "edge_along",
    "load_map",
    "map_from_document",
    "map_to_document",
    "save_map",
]


@dataclass(frozen=True)
class MapFrame:
    """The frame that positions are given in: metres, y up, as in ROS `map_server`."""

    name: str = "map"
    """Name of the frame, as a transform tree has it."""
    plan: str | None = None
    """Floor plan in this frame: a `map_server` yaml, relative to the map's file."""


@dataclass(frozen=True)
class Node:
    """A place. A door node looks out of its room; corridor nodes come in two directions."""

    id: str
    """Unique name."""
    kind: NodeKind
    """What it stands for."""
    x_m: float
    """Position along x in the map's frame."""
    y_m: float
    """Position along y in the map's frame."""
    room: str | None = None
    """The room that it lies in, or None where rooms are not named."""
    size: float = 1.0
    """Distances to this node are divided by it when the nearest node is sought."""

    def distance_to(self, other: "Node") -> float:
        """Straight distance between the two, in metres."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)


@dataclass(frozen=True)
class Edge:
    """A behaviour that takes the robot from one node to another."""

    id: str
    """Unique name; `edge_along` makes it `source->target`."""
    source: str
    """Node that it leaves."""
    target: str
    """Node that it reaches."""
    behavior: Behavior
    """What the robot does on it."""
    yaw_rad: float
    """The robot's heading along it, counter-clockwise from x."""
    length_m: float
    """Metres to drive."""


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
        faults = _broken_elements(self.nodes, self.edges)
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


def edge_along(
    source: Node,
    target: Node,
    behavior: Behavior,
    *,
    edge_id: str | None = None,
    length_m: float | None = None,
) -> Edge:
    """An edge whose yaw points from source to target, as the authors compute it.

    Args:
        source: Node that it leaves.
        target: Node that it reaches.
        behavior: What the robot does on it.
        edge_id: Its id; `source->target` when not given.
        length_m: Metres to drive; the straight distance when not given.
    """
    return Edge(
        id=edge_id or f"{source.id}->{target.id}",
        source=source.id,
        target=target.id,
        behavior=behavior,
        yaw_rad=math.atan2(target.y_m - source.y_m, target.x_m - source.x_m),
        length_m=source.distance_to(target) if length_m is None else length_m,
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
    path = Path(path)
    text = _format_document(map_to_document(topological_map))
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(descriptor, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise InputError(
            f"cannot be written: {error.strerror or error}",
            where=str(path),
            remedy="name a file in a folder that you may write to",
        ) from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
    return path


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
    return {
        "version": FORMAT_VERSION,
        "name": topological_map.name,
        "frame": {"name": topological_map.frame.name, "plan": topological_map.frame.plan},
        "nodes": [
            {
                "id": node.id,
                "kind": node.kind.value,
                "x": node.x_m,
                "y": node.y_m,
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
                "yaw": edge.yaw_rad,
                "length": edge.length_m,
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
        lines.append(f'  "{key}": [\n{elements}\n  ]{ending}' if elements else f'  "{key}": []{ending}')
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


def _broken_elements(nodes: tuple[Node, ...], edges: tuple[Edge, ...]) -> list[str]:
    """What keeps nodes and edges from being a graph at all."""
    faults = []
    for what, elements in (("node", nodes), ("edge", edges)):
        for first, second in zip(elements, elements[1:], strict=False):
            if first.id == second.id:
                faults.append(f"{what} '{first.id}' comes twice")
    ids = {node.id for node in nodes}
    for node in nodes:
        if not (math.isfinite(node.x_m) and math.isfinite(node.y_m)):
            faults.append(f"node '{node.id}' must have a finite position")
        if not (math.isfinite(node.size) and node.size > 0):
            faults.append(f"node '{node.id}' must have a positive size, got {node.size}")
    for edge in edges:
        for end, node_id in (("source", edge.source), ("target", edge.target)):
            if node_id not in ids:
                faults.append(f"edge '{edge.id}' has no {end} '{node_id}'")
        if not (math.isfinite(edge.yaw_rad) and 0 <= edge.length_m < math.inf):
            faults.append(f"edge '{edge.id}' must have a finite yaw and a length >= 0")
    return faults
