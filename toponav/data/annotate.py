"""Labels for recorded frames: room, node, edge and behaviour (GraphNav, appendix B).

Two answers are given to "which behaviour is this?". `behavior` is the paper's heuristic,
which sees only the path and the rooms. `edge_behavior` is what a robot that knows its true
node and its plan executes there: the states in which a behaviour network will really run.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from jaxtyping import Bool, Float, Int

from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior, RoomKind
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap

__all__ = [
    "Annotations",
    "NodeLocalizer",
    "annotate_trajectory",
    "constrained_nodes",
    "detect_behaviors",
    "labelled_edges",
    "plan_positions",
]

TURN_RAD: Final = math.radians(40.0)
REACH_M: Final = 2.0
MAX_SKIP: Final = 3
"""Plan nodes that one step may advance: as far as the crop looks ahead."""

_CORRIDORS = frozenset({RoomKind.HALLWAY, RoomKind.LOBBY, RoomKind.OPEN_SPACE, RoomKind.LOUNGE})
_HALLWAYS = frozenset({RoomKind.HALLWAY, RoomKind.LOBBY})
_CODE: Final = {behavior: code for code, behavior in enumerate(Behavior)}


class NodeLocalizer(Protocol):
    """Anything that says which node a pose belongs to (`toponav.sim.oracle.TruthLocalizer`)."""

    def node_at(self, pose: Pose2) -> str | None:
        """The node's id, or None where no node fits the pose."""


@dataclass(frozen=True)
class Annotations:
    """One row a frame; codes are positions in `list(Behavior)`, -1 where there is no label.

    Attributes:
        room: Name of the room, or None where there is none.
        node: Node by the paper's rule, which allows moves between neighbours only.
        edge: Edge by the paper's rule: from this node to the next that the robot reached.
        behavior: Behaviour by the paper's heuristic.
        true_node: Nearest fitting node, whatever came before.
        plan_position: How far along the plan the robot has come: the position of a node.
        plan_edge: The plan's edge there, or None at the goal.
        edge_behavior: Behaviour of that edge, -1 at the goal.
        off_plan: Whether the true node is known and not in the plan.
    """

    room: list[str | None]
    node: list[str | None]
    edge: list[str | None]
    behavior: Int[np.ndarray, " frames"]
    true_node: list[str | None]
    plan_position: Int[np.ndarray, " frames"]
    plan_edge: list[str | None]
    edge_behavior: Int[np.ndarray, " frames"]
    off_plan: Bool[np.ndarray, " frames"]

    def __len__(self) -> int:
        return len(self.room)


def annotate_trajectory(
    pose: Float[np.ndarray, "frames 3"],
    plan: Plan,
    topological_map: TopologicalMap,
    localizer: NodeLocalizer,
    room_at: Callable[[float, float], str | None],
    kind_of: Callable[[str], RoomKind],
) -> Annotations:
    """The labels of each frame of a trajectory; a pure function of its arguments.

    Args:
        pose: True x, y (metres) and yaw (radians), in time order.
        plan: The plan that the robot was following.
        topological_map: Map that the plan is in.
        localizer: Says which node a pose belongs to.
        room_at: Name of the room at a point (`Scene.room_at`).
        kind_of: Kind of the room of that name.
    """
    rooms = [room_at(float(x), float(y)) for x, y, _ in pose]
    true_nodes = [localizer.node_at(Pose2(*map(float, row))) for row in pose]
    nodes = constrained_nodes(true_nodes, topological_map, plan.nodes[0])
    positions = plan_positions(true_nodes, plan)
    plan_edges = [plan.edges[p] if p < len(plan.edges) else None for p in positions.tolist()]
    codes = [
        -1 if edge is None else _CODE[topological_map.edge(edge).behavior] for edge in plan_edges
    ]
    kinds = {room: kind_of(room) for room in set(rooms) - {None} if room is not None}
    return Annotations(
        room=rooms,
        node=nodes,
        edge=labelled_edges(nodes, topological_map),
        behavior=detect_behaviors(pose, rooms, kinds.__getitem__),
        true_node=true_nodes,
        plan_position=positions,
        plan_edge=plan_edges,
        edge_behavior=np.array(codes, np.int8),
        off_plan=np.array([n is not None and n not in plan for n in true_nodes], bool),
    )


def constrained_nodes(
    candidates: Sequence[str | None], topological_map: TopologicalMap, start: str
) -> list[str | None]:
    """The node of each frame where only moves between neighbours are believed.

    A candidate counts if it is the last believed node or joined to it by an edge; other
    frames stay unlabelled until such a candidate comes (appendix B-D).

    Args:
        candidates: Nearest fitting node of each frame, or None.
        topological_map: Map that the nodes are in.
        start: Node that the robot is known to start at.
    """
    nodes: list[str | None] = []
    last = start
    for candidate in candidates:
        if candidate is not None and (
            candidate == last or candidate in topological_map.neighbors(last)
        ):
            last = candidate
            nodes.append(candidate)
        else:
            nodes.append(None)
    return nodes


def labelled_edges(
    nodes: Sequence[str | None], topological_map: TopologicalMap
) -> list[str | None]:
    """The edge of each frame: from its node to the node that the robot reached next.

    Frames at the last node, and those before a move against the edges' direction, have none.
    """
    edges: list[str | None] = [None] * len(nodes)
    upcoming: str | None = None  # the next node that differs from `current`
    current: str | None = None
    for frame in range(len(nodes) - 1, -1, -1):
        node = nodes[frame]
        if node is None:
            continue
        if current is not None and node != current:
            upcoming = current
        current = node
        if upcoming is not None:
            edge = topological_map.edge_between(node, upcoming)
            edges[frame] = None if edge is None else edge.id
    return edges


def plan_positions(nodes: Sequence[str | None], plan: Plan) -> Int[np.ndarray, " frames"]:
    """How far along the plan the robot is at each frame; never goes back.

    A node behind, off the plan or more than three nodes ahead leaves the position as it is:
    the rule by which a localized robot keeps executing its last valid edge.
    """
    positions = np.zeros(len(nodes), np.int32)
    current = 0
    for frame, node in enumerate(nodes):
        position = None if node is None else plan.position(node)
        if position is not None and current < position <= current + MAX_SKIP:
            current = position
        positions[frame] = current
    return positions


def detect_behaviors(
    pose: Float[np.ndarray, "frames 3"],
    rooms: Sequence[str | None],
    kind_of: Callable[[str], RoomKind],
) -> Int[np.ndarray, " frames"]:
    """The behaviour of each frame by the paper's heuristic, as a code or -1.

    Turns and straights come first, from the transitions between rooms; then find door, from
    the first frame to the first transition from a room into a hallway, over what was there;
    corridor follow takes what is left in hallways, open spaces and lounges.

    Args:
        pose: True x, y (metres) and yaw (radians), in time order.
        rooms: Name of the room of each frame; frames without one count to the last room.
        kind_of: Kind of the room of that name.

    Reference:
        GraphNav, appendix B-C. The paper does not say which of two overlapping transitions
        wins; here the later one does.
    """
    labels = np.full(len(rooms), -1, np.int8)
    filled = _without_gaps(rooms)
    yaw = np.unwrap(pose[:, 2])
    transitions = [t for t in range(1, len(filled)) if filled[t] != filled[t - 1]]
    for at in transitions:
        before, after = filled[at - 1], filled[at]
        if before is None or after is None:
            continue
        within = _within_reach(pose, at)
        behavior = _behavior_at(yaw, at, within, kind_of(after))
        for frame in range(within.start, within.stop):
            if filled[frame] in (before, after):
                labels[frame] = _CODE[behavior]
    for at in transitions:
        before, after = filled[at - 1], filled[at]
        if before is None or after is None:
            continue
        if kind_of(before).is_enclosed and kind_of(after) in _HALLWAYS:
            labels[:at] = _CODE[Behavior.FIND_DOOR]
            break
    for frame, room in enumerate(filled):
        if labels[frame] < 0 and room is not None and kind_of(room) in _CORRIDORS:
            labels[frame] = _CODE[Behavior.CORRIDOR_FOLLOW]
    return labels


def _without_gaps(rooms: Sequence[str | None]) -> list[str | None]:
    filled: list[str | None] = []
    last: str | None = next((room for room in rooms if room is not None), None)
    for room in rooms:
        last = room if room is not None else last
        filled.append(last)
    return filled


def _within_reach(pose: Float[np.ndarray, "frames 3"], at: int) -> slice:
    """The frames around `at` during which the robot stays within two metres of where it is."""
    far = np.hypot(pose[:, 0] - pose[at, 0], pose[:, 1] - pose[at, 1]) > REACH_M
    before, after = np.flatnonzero(far[:at]), np.flatnonzero(far[at:])
    start = int(before[-1]) + 1 if len(before) else 0
    stop = at + int(after[0]) if len(after) else len(pose)
    return slice(start, stop)


def _behavior_at(
    yaw_rad: Float[np.ndarray, " frames"], at: int, within: slice, entered: RoomKind
) -> Behavior:
    forward = yaw_rad[at : within.stop] - yaw_rad[at]
    backward = yaw_rad[at] - yaw_rad[within.start : at]
    turns = np.concatenate([forward, backward])
    turn = float(turns[np.abs(turns).argmax()])
    if abs(turn) > TURN_RAD:
        return Behavior.TURN_LEFT if turn > 0 else Behavior.TURN_RIGHT
    return Behavior.STRAIGHT if entered.is_enclosed else Behavior.CORRIDOR_FOLLOW
