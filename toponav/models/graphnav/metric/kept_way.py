"""The line along which a robot that follows a plan stays nearest to the plan's own nodes.

A robot is at the nearest node that is aligned with it (GraphNav, appendix B-D), and people draw
the nodes of doors close beside those of a corridor: driving straight from node to node may lead
past a door that is nearer than the nodes ahead and behind, which counts as having left the plan.
The map says where that would happen, so the line is bent away from it.
"""

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64

from toponav.core.vocabulary import NodeKind
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.models.graphnav.metric import way_kernels as kernels

__all__ = ["ALIGNMENT_RAD", "KeptWay", "kept_way", "node_headings"]

ALIGNMENT_RAD: Final = 0.2 * math.pi
"""A node counts when one of its edges is within this of the robot's heading (36 degrees)."""
_SPACING_M: Final = 0.2
_MARGIN_M: Final = 0.35
_OFFSETS_M: Final = np.arange(-16, 17) * 0.05
_REACH_M: Final = 5.0
_CORNER_RAD: Final = math.radians(25.0)


@dataclass(frozen=True)
class KeptWay:
    """A polyline that moves with the map's nodes.

    Point i lies `share[i]` of the way from node `ends[i, 0]` to node `ends[i, 1]`, moved by
    `shift_m[i]`.

    Attributes:
        ends: Indices of nodes.
        share: From 0 to 1.
        shift_m: In the map's frame.
        edge: The plan's edge that begins at or holds the point; the last point has the last edge.
        stop: Which point is each of the plan's nodes.
    """

    ends: Int64[np.ndarray, "points 2"]
    share: Float64[np.ndarray, " points"]
    shift_m: Float64[np.ndarray, "points 2"]
    edge: Int64[np.ndarray, " points"]
    stop: Int64[np.ndarray, " stops"]


def kept_way(topological_map: TopologicalMap, plan: Plan, *, bent: bool = True) -> KeptWay:
    """The plan's nodes joined by lines, bent away from nodes that are not in the plan.

    Inside rooms and at corners the line is left as it is: there the map does not say where the
    walls are, or which way the robot looks.
    """
    index = topological_map.node_index
    path = np.array([index[node] for node in plan.nodes], dtype=np.int64)
    stops = len(path)
    node_xy = np.array([[node.x_m, node.y_m] for node in topological_map.nodes], dtype=float)
    if stops < 2 or not bent:
        return KeptWay(
            np.stack([path, path], axis=1),
            np.zeros(stops),
            np.zeros((stops, 2)),
            np.minimum(np.arange(stops), max(stops - 2, 0)),
            np.arange(stops),
        )
    ends, share, edge, stop = _sampled(node_xy, path)
    points = node_xy[ends[:, 0]] + share[:, None] * (node_xy[ends[:, 1]] - node_xy[ends[:, 0]])
    along = node_xy[path[1:]] - node_xy[path[:-1]]
    yaws = np.arctan2(along[:, 1], along[:, 0])
    before = np.concatenate([yaws[:1], yaws[edge[:-1]]])
    offsets = kernels.bend(
        points,
        before,
        _is_free(topological_map, plan, yaws, share, edge, stop),
        np.concatenate([[1.0], np.maximum(np.linalg.norm(np.diff(points, axis=0), axis=1), 1e-3)]),
        _OFFSETS_M,
        _MARGIN_M,
        _REACH_M,
        node_xy,
        np.array([node.size for node in topological_map.nodes]),
        np.array([node.id in plan for node in topological_map.nodes]),
        *node_headings(topological_map),
        math.cos(ALIGNMENT_RAD),
    )
    shift = offsets[:, None] * np.stack([-np.sin(before), np.cos(before)], axis=1)
    return _without_idle_points(KeptWay(ends, share, shift, edge, stop))


def _sampled(
    node_xy: Float64[np.ndarray, "nodes 2"], path: Int64[np.ndarray, " stops"]
) -> tuple[
    Int64[np.ndarray, "points 2"],
    Float64[np.ndarray, " points"],
    Int64[np.ndarray, " points"],
    Int64[np.ndarray, " stops"],
]:
    """Points along each edge, a fifth of a metre apart at most: ends, share, edge; the stops."""
    ends: list[tuple[int, int]] = []
    share: list[float] = []
    edge: list[int] = []
    stop: list[int] = []
    for number, (a, b) in enumerate(itertools.pairwise(path)):
        pieces = max(1, math.ceil(float(np.linalg.norm(node_xy[b] - node_xy[a])) / _SPACING_M))
        stop.append(len(ends))
        for piece in range(pieces):
            ends.append((a, b))
            share.append(piece / pieces)
            edge.append(number)
    stop.append(len(ends))
    ends.append((path[-1], path[-1]))
    share.append(0.0)
    edge.append(len(path) - 2)
    return (
        np.array(ends, dtype=np.int64),
        np.array(share),
        np.array(edge, dtype=np.int64),
        np.array(stop, dtype=np.int64),
    )


def _is_free(
    topological_map: TopologicalMap,
    plan: Plan,
    yaws: Float64[np.ndarray, " edges"],
    share: Float64[np.ndarray, " points"],
    edge: Int64[np.ndarray, " points"],
    stop: Int64[np.ndarray, " stops"],
) -> Bool[np.ndarray, " points"]:
    """Where the line may be bent."""
    nodes = [topological_map.node(node) for node in plan.nodes]
    free = np.ones(len(share), dtype=bool)
    for number in range(len(nodes) - 1):
        on_edge = edge == number
        if nodes[number].kind is NodeKind.ROOM:
            free[on_edge] = False
        if nodes[number].kind is NodeKind.DOOR:
            free[on_edge & (share < 0.5)] = False
        if nodes[number + 1].kind is NodeKind.ROOM:
            free[on_edge & (share > 0.5)] = False
    turn = np.abs(np.angle(np.exp(1j * np.diff(yaws))))
    free[stop[1:-1][turn > _CORNER_RAD]] = False
    free[stop[[0, -1]]] = False
    return free


def node_headings(
    topological_map: TopologicalMap,
) -> tuple[Int64[np.ndarray, " bounds"], Float64[np.ndarray, "headings 2"]]:
    """The headings of the edges at each node, and where each node's begin."""
    first, yaws = [0], []
    for node in topological_map.nodes:
        yaws += [edge.yaw_rad for edge in topological_map.out_edges(node.id)]
        yaws += [edge.yaw_rad for edge in topological_map.in_edges(node.id)]
        first.append(len(yaws))
    yaw = np.array(yaws, dtype=float)
    return np.array(first, dtype=np.int64), np.stack([np.cos(yaw), np.sin(yaw)], axis=1)


def _without_idle_points(way: KeptWay) -> KeptWay:
    """The way without the points between two nodes that a straight line passes anyway."""
    moved = np.abs(way.shift_m).max(axis=1) > 0.0
    near = moved.copy()
    near[1:] |= moved[:-1]
    near[:-1] |= moved[1:]
    near[way.stop] = True
    kept = np.cumsum(near) - 1
    return KeptWay(
        way.ends[near], way.share[near], way.shift_m[near], way.edge[near], kept[way.stop]
    )
