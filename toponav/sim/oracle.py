"""Privileged truth: which node of the map the robot really is at, and whether it is on its plan.

Agents never see this; annotation, evaluation and agents that use the truth on purpose do.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import NodeKind
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.sim import oracle_kernels as kernels
from toponav.worlds.scene import Scene

__all__ = ["NodeAnnotation", "PlanTracker", "TruthLocalizer"]

ALIGNMENT_RAD = 0.2 * math.pi
"""A node counts when one of its edges is within this of the robot's yaw (36 degrees)."""

_ANY_NODE = np.empty(0, dtype=np.bool_)


@dataclass(frozen=True)
class NodeAnnotation:
    """What each frame of a drive is labelled with (GraphNav, appendix B-D).

    Attributes:
        node_index: Index into the map's nodes, -1 where there is no label.
        edge_index: Index into the map's edges, -1 where there is no label.
    """

    node_index: Int64[np.ndarray, " frames"]
    edge_index: Int64[np.ndarray, " frames"]

    @property
    def labelled_fraction(self) -> float:
        """The fraction of frames that have an edge."""
        return float((self.edge_index >= 0).mean()) if self.edge_index.size else 0.0


class TruthLocalizer:
    """The protocol's truth: the node that a pose belongs to.

    It is the nearest node, by distance over node size, of which an incoming or outgoing edge is
    within 36 degrees of the robot's yaw. Inside a room (an office, a WC, ... but no hallway,
    open space, lounge or lobby) only nodes of the room of exactly that name count. Where the
    scene has no room there is no node, as in the authors' program; in a scene without any named
    rooms all nodes count everywhere.

    Args:
        topological_map: Map to localize on.
        scene: Building that the map is of; gives the rooms.
        any_heading_in_rooms: Whether the robot is at the room's node when it is inside a room
            and no node is aligned, as the authors' program does during evaluation. Off, such a
            pose has no node.

    Example:
        >>> truth = TruthLocalizer(map_from_layout(scene), scene)
        >>> truth.node_at(pose)
        'office_1'
    """

    def __init__(
        self,
        topological_map: TopologicalMap,
        scene: Scene,
        *,
        any_heading_in_rooms: bool = False,
    ) -> None:
        self.map = topological_map
        self.scene = scene
        self._ids = tuple(node.id for node in topological_map.nodes)
        self._arrays = _localizer_arrays(topological_map, scene, any_heading_in_rooms)
        self._successors = _successor_arrays(topological_map)
        self._masks: dict[Plan, np.ndarray] = {}

    def node_at(self, pose: Pose2) -> str | None:
        """The id of the node that the robot is at, or None."""
        index = kernels.nearest_node(
            self._arrays, _ANY_NODE, float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)
        )
        return None if index < 0 else self._ids[index]

    def nodes_at(
        self,
        x_m: Float[np.ndarray, " poses"],
        y_m: Float[np.ndarray, " poses"],
        yaw_rad: Float[np.ndarray, " poses"],
        *,
        plan: Plan | None = None,
    ) -> Int64[np.ndarray, " poses"]:
        """The index into the map's nodes of the node at each pose, -1 where there is none.

        Args:
            x_m: Positions in the map's frame, in metres.
            y_m: Positions in the map's frame, in metres.
            yaw_rad: Headings in the map's frame, in radians.
            plan: Consider the nodes of this plan only; all nodes when None.
        """
        result: np.ndarray = kernels.nearest_nodes(
            self._arrays, self._mask(plan), *_as_float64(x_m, y_m, yaw_rad)
        )
        return result

    def node_on_plan(self, pose: Pose2, plan: Plan) -> str | None:
        """The id of the plan's node that the robot is at when no other nodes count, or None."""
        index = kernels.nearest_node(
            self._arrays, self._mask(plan), float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)
        )
        return None if index < 0 else self._ids[index]

    def on_plan(self, pose: Pose2, plan: Plan) -> bool:
        """Whether the robot has not deviated: it is at a node of the plan or at none."""
        node = self.node_at(pose)
        return node is None or node in plan

    def edge_for(self, pose: Pose2, plan: Plan) -> str | None:
        """The edge that the plan takes from where the robot is; None off it and at the goal."""
        node = self.node_at(pose)
        return None if node is None else plan.edge_from(node)

    def annotate(
        self, poses: Float[np.ndarray, "frames 3"], *, plan: Plan | None = None
    ) -> NodeAnnotation:
        """The node and the edge of each frame of one drive.

        The node of a frame is the node at its pose if that is the node of the last labelled frame
        or a direct successor of it; otherwise the frame has none. Frames at node A until a frame
        at node B have the edge from A to B; those at the last node have none.

        Args:
            poses: x, y in metres and yaw in radians, in order of time.
            plan: Consider the nodes of this plan only. The paper considers all, and loses the
                frames after a drive passes close to a node that it does not stop at.

        Reference:
            GraphNav, appendix B-D.
        """
        candidates = self.nodes_at(poses[:, 0], poses[:, 1], poses[:, 2], plan=plan)
        nodes, edges = kernels.track_nodes(candidates, *self._successors)
        return NodeAnnotation(nodes, edges)

    def _mask(self, plan: Plan | None) -> np.ndarray:
        if plan is None:
            return _ANY_NODE
        mask = self._masks.get(plan)
        if mask is None:
            if len(self._masks) >= 256:
                self._masks.clear()
            mask = self._masks[plan] = np.zeros(len(self._ids), dtype=np.bool_)
            for node in plan.nodes:
                self.map.node(node)
                mask[self.map.node_index[node]] = True
        return mask


class PlanTracker:
    """Where on its plan a robot is, from the true node of each step.

    Args:
        plan: The plan that the robot follows; it stands at the first node.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.last_node = plan.nodes[0]
        """The last node of the plan that the robot was at."""
        self.steps_off_plan = 0
        """Steps in a row that the robot was at a node off the plan."""
        self._furthest = 0

    def update(self, node: str | None) -> str | None:
        """The edge to follow now, given the true node; a step without node changes nothing.

        Off the plan it stays the edge of the last valid node (GraphNav, section V).
        """
        if node is not None:
            position = self.plan.position(node)
            if position is None:
                self.steps_off_plan += 1
            else:
                self.steps_off_plan = 0
                self.last_node = node
                self._furthest = max(self._furthest, position)
        return self.edge

    @property
    def edge(self) -> str | None:
        """The edge to follow now; None at the goal."""
        return self.plan.edge_from(self.last_node)

    @property
    def at_goal(self) -> bool:
        """Whether the last node on the plan was its goal."""
        return self.last_node == self.plan.nodes[-1]

    @property
    def completion(self) -> float:
        """The fraction of the plan's nodes that the robot got to, the start included."""
        return (self._furthest + 1) / len(self.plan.nodes)


def _localizer_arrays(
    topological_map: TopologicalMap, scene: Scene, any_heading_in_rooms: bool
) -> kernels.LocalizerArrays:
    number_of_room = {room.name: number for number, room in enumerate(scene.rooms)}
    if topological_map.nodes and scene.rooms and not number_of_room.keys() & topological_map.rooms:
        raise InputError(
            f"the map has no node in any room of scene '{scene.name}'",
            where=f"map '{topological_map.name}'",
            remedy="load the map that belongs to this building",
        )
    room_node = np.full(max(len(scene.rooms), 1), kernels.NO_NODE, dtype=np.int64)
    if any_heading_in_rooms:
        for index, node in enumerate(topological_map.nodes):
            if node.kind is NodeKind.ROOM and node.room in number_of_room:
                room_node[number_of_room[node.room]] = index
    first_heading, headings = [0], []
    for node in topological_map.nodes:
        headings += [edge.yaw_rad for edge in topological_map.out_edges(node.id)]
        headings += [edge.yaw_rad for edge in topological_map.in_edges(node.id)]
        first_heading.append(len(headings))
    yaw_rad = np.array(headings, dtype=np.float64)
    positions = topological_map.positions_m
    return kernels.LocalizerArrays(
        node_x_m=np.ascontiguousarray(positions[:, 0]),
        node_y_m=np.ascontiguousarray(positions[:, 1]),
        inverse_size_squared=np.array([node.size**-2 for node in topological_map.nodes], float),
        first_heading=np.array(first_heading, dtype=np.int64),
        heading_cos=np.cos(yaw_rad),
        heading_sin=np.sin(yaw_rad),
        node_room=np.array(
            [number_of_room.get(node.room or "", -1) for node in topological_map.nodes], np.int64
        ),
        room_node=room_node,
        room_is_enclosed=np.array([room.kind.is_enclosed for room in scene.rooms], np.bool_),
        room_index=np.ascontiguousarray(scene.room_index),
        origin_x_m=float(scene.grid.origin_m[0]),
        origin_y_m=float(scene.grid.origin_m[1]),
        resolution_m=float(scene.grid.resolution_m),
        has_rooms=bool(scene.rooms),
        aligned_cos=math.cos(ALIGNMENT_RAD),
    )


def _successor_arrays(topological_map: TopologicalMap) -> tuple[np.ndarray, ...]:
    """Where each node's outgoing edges start, their targets and their indices."""
    first, targets, edges = [0], [], []
    for node in topological_map.nodes:
        for edge in topological_map.out_edges(node.id):
            targets.append(topological_map.node_index[edge.target])
            edges.append(topological_map.edge_index[edge.id])
        first.append(len(targets))
    return tuple(np.array(values, dtype=np.int64) for values in (first, targets, edges))


def _as_float64(*arrays: Sequence[float] | np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(np.ascontiguousarray(array, dtype=np.float64) for array in arrays)
