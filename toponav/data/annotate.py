"""Labels for recorded frames: room, node, edge and behaviour (GraphNav, appendix B).

Two answers are given to "which behaviour is this?". `behavior` is the paper's heuristic,
which sees only the path and the rooms. `edge_behavior` is what a robot that knows its true
node and its plan executes there: the states in which a behaviour network will really run.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float, Int

from toponav.core.vocabulary import Behavior, RoomKind
from toponav.maps.plan import Plan
from toponav.sim.oracle import TruthLocalizer
from toponav.worlds.scene import Scene

__all__ = ["Annotations", "annotate_trajectory", "detect_behaviors", "plan_edges", "rooms_at"]

TURN_RAD: Final = math.radians(40.0)
REACH_M: Final = 2.0

_CORRIDORS = frozenset({RoomKind.HALLWAY, RoomKind.LOBBY, RoomKind.OPEN_SPACE, RoomKind.LOUNGE})
_HALLWAYS = frozenset({RoomKind.HALLWAY, RoomKind.LOBBY})
_CODE: Final = {behavior: code for code, behavior in enumerate(Behavior)}


@dataclass(frozen=True)
class Annotations:
    """The labels of one trajectory, -1 where there is none.

    Attributes:
        room: Index into the scene's rooms.
        node: Index into the map's nodes, by the paper's rule: only moves along edges count.
        edge: Index into the map's edges, by the paper's rule: from this node to the next.
        behavior: Position in `list(Behavior)`, by the paper's heuristic.
        true_node: Index of the nearest fitting node, whatever came before.
        plan_position: How many nodes of the plan the robot has come; never goes back.
        plan_edge: Index of the edge that a robot which knows its true node is executing.
        edge_behavior: Behaviour of that edge; none at the goal.
        off_plan: Whether the true node is known and not in the plan.
    """

    room: Int[np.ndarray, " frames"]
    node: Int[np.ndarray, " frames"]
    edge: Int[np.ndarray, " frames"]
    behavior: Int[np.ndarray, " frames"]
    true_node: Int[np.ndarray, " frames"]
    plan_position: Int[np.ndarray, " frames"]
    plan_edge: Int[np.ndarray, " frames"]
    edge_behavior: Int[np.ndarray, " frames"]
    off_plan: Bool[np.ndarray, " frames"]

    def __len__(self) -> int:
        return len(self.room)


def annotate_trajectory(
    pose: Float[np.ndarray, "frames 3"], plan: Plan, scene: Scene, localizer: TruthLocalizer
) -> Annotations:
    """The labels of each frame of a trajectory; a pure function of its arguments.

    Args:
        pose: True x, y (metres) and yaw (radians), in time order.
        plan: The plan that the robot was following, in the localizer's map.
        scene: The building, which gives the rooms.
        localizer: Says which node a pose belongs to.

    Raises:
        InputError: The plan is not in the map.
    """
    topological_map = localizer.map
    rooms = rooms_at(pose, scene)
    tracked = localizer.annotate(pose)
    true_nodes = localizer.nodes_at(pose[:, 0], pose[:, 1], pose[:, 2])
    for node in plan.nodes:
        topological_map.node(node)
    on_plan = np.array([topological_map.node_index[node] for node in plan.nodes])
    positions, edges = plan_edges(true_nodes, on_plan)
    edge_codes = np.array(
        [topological_map.edge_index[edge] for edge in plan.edges] + [-1], np.int64
    )
    behavior_codes = np.array([_CODE[edge.behavior] for edge in topological_map.edges] + [-1])
    plan_edge = edge_codes[edges]
    return Annotations(
        room=rooms,
        node=tracked.node_index,
        edge=tracked.edge_index,
        behavior=detect_behaviors(pose, rooms, [room.kind for room in scene.rooms]),
        true_node=true_nodes,
        plan_position=positions,
        plan_edge=plan_edge,
        edge_behavior=behavior_codes[plan_edge],
        off_plan=(true_nodes >= 0) & ~np.isin(true_nodes, on_plan),
    )


def rooms_at(pose: Float[np.ndarray, "frames 3"], scene: Scene) -> Int[np.ndarray, " frames"]:
    """Index of the room that each pose is in, -1 outside all rooms."""
    grid = scene.grid
    cells = np.floor((pose[:, :2] - np.array(grid.origin_m)) / grid.resolution_m).astype(int)
    inside = ((cells >= 0) & (cells < (grid.cols, grid.rows))).all(axis=1)
    rooms = np.full(len(pose), -1, np.int64)
    rooms[inside] = scene.room_index[cells[inside, 1], cells[inside, 0]]
    return rooms


def plan_edges(
    nodes: Int[np.ndarray, " frames"], plan_nodes: Int[np.ndarray, " plan_nodes"]
) -> tuple[Int[np.ndarray, " frames"], Int[np.ndarray, " frames"]]:
    """Progress along the plan, and the position of the plan's edge that is executed.

    A robot that knows its true node executes the plan's edge out of it; where there is no
    node, or one off the plan, it goes on with its last valid edge (GraphNav, section V).
    Progress is the furthest position so far.

    Args:
        nodes: Index of the true node of each frame, or -1.
        plan_nodes: Indices of the plan's nodes; the robot starts at the first.
    """
    position_of = {int(node): position for position, node in enumerate(plan_nodes)}
    executed = np.zeros(len(nodes), np.int64)
    current = 0
    for frame, node in enumerate(nodes.tolist()):
        current = position_of.get(node, current)
        executed[frame] = current
    return np.maximum.accumulate(executed), executed


def detect_behaviors(
    pose: Float[np.ndarray, "frames 3"],
    rooms: Int[np.ndarray, " frames"],
    kinds: Sequence[RoomKind],
) -> Int[np.ndarray, " frames"]:
    """The behaviour of each frame by the paper's heuristic, as a code or -1.

    Turns and straights come first, from the transitions between rooms; then find door, from
    the first frame to the first transition from a room into a hallway, over what was there;
    corridor follow takes what is left in hallways, open spaces and lounges.

    Args:
        pose: True x, y (metres) and yaw (radians), in time order.
        rooms: Room of each frame; frames without one (-1) count to the last room.
        kinds: Kind of each room.

    Reference:
        GraphNav, appendix B-C. The paper does not say which of two overlapping transitions
        wins; here the later one does.
    """
    labels = np.full(len(rooms), -1, np.int8)
    if not (rooms >= 0).any():
        return labels
    filled = _without_gaps(rooms)
    yaw_rad = np.unwrap(pose[:, 2])
    enclosed = np.array([kind.is_enclosed for kind in kinds])
    transitions = (np.flatnonzero(np.diff(filled)) + 1).tolist()
    for at in transitions:
        start, stop = _within_reach(pose, at)
        behavior = _behavior_at(yaw_rad[start:stop], at - start, enclosed[filled[at]])
        tagged = np.isin(filled[start:stop], filled[at - 1 : at + 1])
        labels[start:stop][tagged] = _CODE[behavior]
    hallway = np.array([kind in _HALLWAYS for kind in kinds])
    for at in transitions:
        if enclosed[filled[at - 1]] and hallway[filled[at]]:
            labels[:at] = _CODE[Behavior.FIND_DOOR]
            break
    corridor = np.array([kind in _CORRIDORS for kind in kinds])
    labels[(labels < 0) & corridor[filled]] = _CODE[Behavior.CORRIDOR_FOLLOW]
    return labels


def _without_gaps(rooms: Int[np.ndarray, " frames"]) -> Int[np.ndarray, " frames"]:
    """Each -1 replaced by the last room before it, or by the first room of all."""
    known = np.flatnonzero(rooms >= 0)
    last = np.searchsorted(known, np.arange(len(rooms)), side="right") - 1
    return rooms[known[np.maximum(last, 0)]]


def _within_reach(pose: Float[np.ndarray, "frames 3"], at: int) -> tuple[int, int]:
    """The frames around `at` during which the robot stays within two metres of where it is."""
    far = np.hypot(pose[:, 0] - pose[at, 0], pose[:, 1] - pose[at, 1]) > REACH_M
    before, after = np.flatnonzero(far[:at]), np.flatnonzero(far[at:])
    start = int(before[-1]) + 1 if len(before) else 0
    return start, at + int(after[0]) if len(after) else len(pose)


def _behavior_at(
    yaw_rad: Float[np.ndarray, " frames"], at: int, entered_a_room: bool | np.bool_
) -> Behavior:
    """The behaviour of a transition, from the unwrapped headings within reach of it."""
    turns = np.concatenate([yaw_rad[at:] - yaw_rad[at], yaw_rad[at] - yaw_rad[:at]])
    turn = float(turns[np.abs(turns).argmax()])
    if abs(turn) > TURN_RAD:
        return Behavior.TURN_LEFT if turn > 0 else Behavior.TURN_RIGHT
    return Behavior.STRAIGHT if entered_a_room else Behavior.CORRIDOR_FOLLOW
