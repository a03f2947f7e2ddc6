"""Node sizes with which a robot that drives past a node is not taken to be at it."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from toponav.core.vocabulary import Behavior
from toponav.maps.spec import Edge, Node

__all__ = ["sizes_for_passing"]

_ALIGNED_RAD = 0.2 * math.pi
_SMALLEST = 0.6
_STEP_M = 0.1


def sizes_for_passing(nodes: Sequence[Node], edges: Sequence[Edge]) -> dict[str, float]:
    """A size below 1 for each node that is nearest to a robot on an edge between two others.

    The authors gave such nodes sizes of 0.7 to 0.9 by hand. Only corridors count: on them the
    robot's heading is known. The smallest size is 0.6.

    Args:
        nodes: All nodes of a map.
        edges: All edges of it.
    """
    order = {node.id: number for number, node in enumerate(nodes)}
    positions = np.array([(node.x_m, node.y_m) for node in nodes])
    yaws: list[list[float]] = [[] for _ in nodes]
    ahead: dict[str, set[str]] = {node.id: set() for node in nodes}
    behind: dict[str, set[str]] = {node.id: set() for node in nodes}
    for edge in edges:
        for end in (edge.source, edge.target):
            yaws[order[end]].append(edge.yaw_rad)
        if edge.behavior is Behavior.CORRIDOR_FOLLOW:
            ahead[edge.source].add(edge.target)
            behind[edge.target].add(edge.source)
    sizes = np.ones(len(nodes))
    straight = [edge for edge in edges if edge.behavior is Behavior.CORRIDOR_FOLLOW]
    aligned = [_aligned(yaws, edge.yaw_rad) for edge in straight]
    for _ in range(2):
        for edge, candidates in zip(straight, aligned, strict=True):
            ends = [order[edge.source], order[edge.target]]
            others = candidates.copy()
            others[ends] = False
            others[[order[name] for name in ahead[edge.target] | behind[edge.source]]] = False
            count = max(2, round(edge.length_m / _STEP_M))
            away = _distances_m(positions, positions[ends[0]], positions[ends[1]], count)
            nearest_end = (away[:, ends] / sizes[ends]).min(axis=1, keepdims=True)
            ratio = np.min(away / np.maximum(nearest_end, 1e-6), axis=0)
            shrink = others & (ratio < sizes)
            sizes[shrink] = np.maximum(np.floor(0.98 * ratio[shrink] * 20) / 20, _SMALLEST)
    return {node.id: float(size) for node, size in zip(nodes, sizes, strict=True) if size < 1.0}


def _aligned(yaws: list[list[float]], heading_rad: float) -> Bool[np.ndarray, " nodes"]:
    """Nodes with an edge that points about the way the robot does."""
    return np.array(
        [
            any(abs(math.remainder(yaw - heading_rad, math.tau)) < _ALIGNED_RAD for yaw in own)
            for own in yaws
        ]
    )


def _distances_m(
    positions: Float[np.ndarray, "nodes 2"],
    start: Float[np.ndarray, "2"],
    end: Float[np.ndarray, "2"],
    count: int,
) -> Float[np.ndarray, "samples nodes"]:
    """From points along a line to every node."""
    share = np.linspace(0.0, 1.0, count + 1)[:, None]
    points = start + share * (end - start)
    return np.asarray(np.linalg.norm(points[:, None, :] - positions[None, :, :], axis=2))
