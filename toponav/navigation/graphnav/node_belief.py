"""From a belief over poses to a belief over the map's nodes and edges."""

import math
from typing import Final

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64

from toponav.core.episode import Belief
from toponav.core.vocabulary import NodeKind
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.kept_way import ALIGNMENT_RAD
from toponav.models.graphnav.metric.map_picture import MapArrays

__all__ = ["NodeBelief", "doorsteps_m", "first_door"]

_DOORSTEP_M: Final = 0.3
_POINTS: Final = 32


class NodeBelief:
    """Which node a robot is at, by the rule that the map's nodes were made for.

    A node counts when one of its edges is within 36 degrees of the robot's heading; of those
    the nearest is taken, distances being divided by the nodes' sizes. Between a room's node
    and its door at the ends of the plan, only that room's nodes count: the map says where
    rooms are left and entered, though not where their walls are.

    Args:
        task: Map and plan.
    """

    def __init__(self, task: NavigationTask) -> None:
        self._task = task
        nodes = task.map.nodes
        self._xy = np.array([[node.x_m, node.y_m] for node in nodes], dtype=float)
        self._size = np.array([node.size for node in nodes])
        self._ids = [node.id for node in nodes]
        self._rooms = np.array([node.room or "" for node in nodes])
        index = task.map.node_index
        ends, yaws = [], []
        for edge in task.map.edges:
            ends += [index[edge.source], index[edge.target]]
            yaws += [edge.yaw_rad, edge.yaw_rad]
        self._ends = np.array(ends, dtype=np.int64)
        self._yaws = np.array(yaws)
        self._points = np.random.default_rng(0).normal(size=(_POINTS, 3))
        self._points[0] = 0.0
        self._leaves_m, self._enters_m = doorsteps_m(task)
        self._last_edge = task.plan.edges[0] if task.plan.edges else None

    def belief(
        self,
        pose: Float[np.ndarray, " 3"],
        progress_m: float,
        std_in_robot: Float[np.ndarray, " 3"],
    ) -> Belief:
        """The likeliest node, the edge to take there, and how likely each edge is.

        Args:
            pose: The believed x, y, yaw.
            progress_m: Metres of the plan behind the robot.
            std_in_robot: Of the belief: metres forward and left, radians.
        """
        votes = self._nodes_at(self._spread(pose, std_in_robot), self._allowed(progress_m))
        votes = votes[votes >= 0]
        if not len(votes):
            edge = self._last_edge
            node = None if edge is None else self._task.map.edge(edge).source
            return self._made(node, edge, {})
        counts = np.bincount(votes, minlength=len(self._ids))
        node = self._ids[int(counts.argmax())]
        probability: dict[str, float] = {}
        for number in np.flatnonzero(counts).tolist():
            likely = self._edge_at(self._ids[number])
            if likely is not None:
                share = float(counts[number]) / len(votes)
                probability[likely] = probability.get(likely, 0.0) + share
        return self._made(node, self._edge_at(node), probability)

    def _made(self, node: str | None, edge: str | None, probability: dict[str, float]) -> Belief:
        if node is not None and self._task.plan.edge_from(node) is not None:
            self._last_edge = self._task.plan.edge_from(node)
        behavior = (
            None if self._last_edge is None else self._task.map.edge(self._last_edge).behavior
        )
        return Belief(node, edge, behavior, probability)

    def _edge_at(self, node: str) -> str | None:
        """The plan's edge where it has one, else the node's first."""
        planned = self._task.plan.edge_from(node)
        if planned is not None:
            return planned
        exits = self._task.map.out_edges(node)
        return exits[0].id if exits else None

    def _spread(
        self, pose: Float[np.ndarray, " 3"], std: Float[np.ndarray, " 3"]
    ) -> Float64[np.ndarray, "points 3"]:
        offset = self._points * np.minimum(std, [1.0, 1.0, 0.5])
        c, s = math.cos(pose[2]), math.sin(pose[2])
        out = np.empty_like(offset)
        out[:, 0] = pose[0] + offset[:, 0] * c - offset[:, 1] * s
        out[:, 1] = pose[1] + offset[:, 0] * s + offset[:, 1] * c
        out[:, 2] = pose[2] + offset[:, 2]
        return np.asarray(out)

    def _allowed(self, progress_m: float) -> Bool[np.ndarray, " nodes"] | None:
        plan = self._task.plan
        if progress_m < self._leaves_m:
            return np.asarray(self._rooms == (self._task.map.node(plan.nodes[0]).room or ""))
        if progress_m > self._enters_m:
            return np.asarray(self._rooms == (self._task.map.node(plan.nodes[-1]).room or ""))
        return None

    def _nodes_at(
        self,
        poses: Float64[np.ndarray, "points 3"],
        allowed: Bool[np.ndarray, " nodes"] | None,
    ) -> Int64[np.ndarray, " points"]:
        turn = np.abs(np.angle(np.exp(1j * (self._yaws[None] - poses[:, 2:]))))
        aligned = np.zeros((len(poses), len(self._ids)), dtype=bool)
        for point, near in enumerate(turn < ALIGNMENT_RAD):
            aligned[point, self._ends[near]] = True
        if allowed is not None:
            aligned &= allowed
        away = np.linalg.norm(self._xy[None] - poses[:, None, :2], axis=-1) / self._size
        away[~aligned] = np.inf
        nearest = away.argmin(axis=1)
        found = np.isfinite(away[np.arange(len(poses)), nearest])
        return np.asarray(np.where(found, nearest, -1))


def doorsteps_m(task: NavigationTask) -> tuple[float, float]:
    """Metres of the plan at which it has left its first room, and enters its last."""
    plan, topological_map = task.plan, task.map
    arrays = MapArrays.of(topological_map, plan)
    door, door_m = first_door(arrays, task)
    leaves_m, enters_m = -math.inf, math.inf
    if door is not None:
        leaves_m = door_m + _DOORSTEP_M
    if topological_map.node(plan.nodes[-1]).kind is NodeKind.ROOM and len(plan.nodes) > 1:
        enters_m = float(arrays.stops_m()[-1]) - _DOORSTEP_M
    return leaves_m, enters_m


def first_door(
    arrays: MapArrays, task: NavigationTask
) -> tuple[Float64[np.ndarray, " 2"] | None, float]:
    """The door by which the plan leaves its first room, and the metres up to it."""
    nodes = [task.map.node(node) for node in task.plan.nodes[:2]]
    if len(nodes) < 2 or nodes[1].kind is not NodeKind.DOOR or nodes[1].room != nodes[0].room:
        return None, 0.0
    return np.array([nodes[1].x_m, nodes[1].y_m]), float(arrays.stops_m()[1])
