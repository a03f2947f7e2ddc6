"""What topological maps are made of: nodes, edges, and the frame that they lie in."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from toponav.core.vocabulary import Behavior, NodeKind

__all__ = ["Edge", "MapFrame", "Node", "broken_elements", "edge_along"]


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


def broken_elements(nodes: tuple[Node, ...], edges: tuple[Edge, ...]) -> list[str]:
    """What keeps nodes and edges, each sorted by id, from being a graph at all."""
    faults = []
    sorted_elements: tuple[tuple[str, Sequence[Node | Edge]], ...] = (
        ("node", nodes),
        ("edge", edges),
    )
    for what, elements in sorted_elements:
        for first, second in itertools.pairwise(elements):
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
