import itertools
import math

import numpy as np
import pytest

from tests.data.small_office import make_map, make_plan, make_scene
from toponav.core.vocabulary import Behavior, RoomKind
from toponav.data.annotate import annotate_trajectory, detect_behaviors, plan_edges, rooms_at
from toponav.sim.oracle import TruthLocalizer

KINDS = [RoomKind.OFFICE, RoomKind.HALLWAY, RoomKind.HALLWAY, RoomKind.LOUNGE, RoomKind.STORAGE]
OFFICE, HALL, HALL_2, LOUNGE, STORAGE = range(5)
STEP_M = 0.1


def drive(*legs: tuple[float, float, int]) -> tuple[np.ndarray, np.ndarray]:
    """Poses and rooms along legs of (heading in degrees, length in metres, room)."""
    x = y = 0.0
    poses, rooms = [], []
    for heading_deg, length_m, room in legs:
        yaw = math.radians(heading_deg)
        for _ in range(round(length_m / STEP_M)):
            x, y = x + STEP_M * math.cos(yaw), y + STEP_M * math.sin(yaw)
            poses.append((x, y, math.remainder(yaw, 2 * math.pi)))
            rooms.append(room)
    return np.array(poses), np.array(rooms)


def runs(labels: np.ndarray) -> list[str | None]:
    """The labels without repetitions."""
    changes = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist()]
    names = list(Behavior)
    return [names[labels[at]] if labels[at] >= 0 else None for at in changes]


def test_a_drive_along_corridors_is_corridor_follow() -> None:
    pose, rooms = drive((0, 4, HALL), (0, 4, HALL_2))
    assert runs(detect_behaviors(pose, rooms, KINDS)) == [Behavior.CORRIDOR_FOLLOW]


@pytest.mark.parametrize(("turn", "behavior"), [(90, "turn_left"), (-90, "turn_right")])
def test_more_than_forty_degrees_within_two_metres_of_a_transition_is_a_turn(
    turn: float, behavior: str
) -> None:
    pose, rooms = drive((0, 5, HALL), (0, 1, HALL_2), (turn, 5, HALL_2))
    labels = detect_behaviors(pose, rooms, KINDS)
    assert runs(labels) == [Behavior.CORRIDOR_FOLLOW, Behavior(behavior), Behavior.CORRIDOR_FOLLOW]
    at = 50
    turning = labels == list(Behavior).index(Behavior(behavior))
    near = np.hypot(*(pose[:, :2] - pose[at, :2]).T) <= 2.0
    np.testing.assert_array_equal(turning, near)


def test_a_turn_before_the_transition_counts_too() -> None:
    pose, rooms = drive((170, 5, HALL), (-120, 1, HALL), (-120, 5, HALL_2))
    assert runs(detect_behaviors(pose, rooms, KINDS))[1] == Behavior.TURN_LEFT


def test_the_larger_of_both_turns_decides() -> None:
    pose, rooms = drive((0, 5, HALL), (50, 1, HALL), (-20, 5, HALL_2))
    assert runs(detect_behaviors(pose, rooms, KINDS))[1] == Behavior.TURN_RIGHT


def test_forty_degrees_are_no_turn_and_two_metres_away_is_too_far() -> None:
    pose, rooms = drive((0, 5, HALL), (39, 5, HALL_2))
    assert runs(detect_behaviors(pose, rooms, KINDS)) == [Behavior.CORRIDOR_FOLLOW]
    pose, rooms = drive((0, 5, HALL), (0, 2.5, HALL_2), (90, 5, HALL_2))
    assert runs(detect_behaviors(pose, rooms, KINDS)) == [Behavior.CORRIDOR_FOLLOW]


def test_entering_a_room_without_a_turn_is_straight() -> None:
    pose, rooms = drive((0, 5, HALL), (0, 3, STORAGE))
    labels = detect_behaviors(pose, rooms, KINDS)
    assert runs(labels) == [Behavior.CORRIDOR_FOLLOW, Behavior.STRAIGHT, None]


def test_find_door_lasts_until_the_first_step_into_a_hallway() -> None:
    pose, rooms = drive((0, 5, OFFICE), (90, 6, HALL), (90, 3, OFFICE), (90, 5, HALL))
    labels = detect_behaviors(pose, rooms, KINDS)
    find_door = labels == list(Behavior).index(Behavior.FIND_DOOR)
    np.testing.assert_array_equal(np.flatnonzero(find_door), np.arange(50))
    assert runs(labels)[1] == Behavior.TURN_LEFT


def test_leaving_a_room_into_a_lounge_is_not_find_door() -> None:
    pose, rooms = drive((0, 4, OFFICE), (0, 4, LOUNGE))
    assert Behavior.FIND_DOOR not in runs(detect_behaviors(pose, rooms, KINDS))


def test_frames_in_a_third_room_are_not_tagged_by_a_transition() -> None:
    pose, rooms = drive((0, 4, HALL), (0, 1, STORAGE), (90, 4, OFFICE))
    labels = detect_behaviors(pose, rooms, KINDS)
    before_second = labels[40:50]
    assert (before_second == list(Behavior).index(Behavior.TURN_LEFT)).all()
    assert labels[0] == list(Behavior).index(Behavior.CORRIDOR_FOLLOW)


def test_frames_outside_all_rooms_count_to_the_room_before() -> None:
    pose, rooms = drive((0, 3, HALL), (0, 0.5, -1), (0, 4, HALL_2))
    assert runs(detect_behaviors(pose, rooms, KINDS)) == [Behavior.CORRIDOR_FOLLOW]
    assert (detect_behaviors(pose, np.full(len(pose), -1), KINDS) == -1).all()


def test_the_executed_edge_stays_where_the_robot_is_astray() -> None:
    nodes = np.array([-1, 3, 9, 9, 4, -1, 3, 5])
    progress, executed = plan_edges(nodes, np.array([3, 4, 5]))
    assert executed.tolist() == [0, 0, 0, 0, 1, 1, 0, 2]
    assert progress.tolist() == [0, 0, 0, 0, 1, 1, 1, 2]


def office_drive() -> np.ndarray:
    """From office_1 to office_2 by right-angled legs."""
    corners = [(2.0, 3.7), (2.0, 1.0), (6.0, 1.0), (6.0, 3.7)]
    rows = []
    for (x0, y0), (x1, y1) in itertools.pairwise(corners):
        steps = round(math.dist((x0, y0), (x1, y1)) / STEP_M)
        for t in np.arange(steps) / steps:
            yaw = math.atan2(y1 - y0, x1 - x0)
            rows.append((x0 + t * (x1 - x0), y0 + t * (y1 - y0), yaw))
    return np.array([*rows, (6.0, 3.7, math.pi / 2)])


def test_a_whole_drive_gets_the_plans_behaviours_in_order() -> None:
    scene, topological_map, plan = make_scene(), make_map(), make_plan()
    truth = TruthLocalizer(topological_map, scene)
    labels = annotate_trajectory(office_drive(), plan, scene, truth)
    assert runs(labels.edge_behavior) == [
        Behavior.FIND_DOOR,
        Behavior.TURN_LEFT,
        Behavior.CORRIDOR_FOLLOW,
        Behavior.TURN_LEFT,
        None,
    ]
    names = [topological_map.edges[edge].id for edge in np.unique(labels.plan_edge) if edge >= 0]
    assert sorted(names) == sorted(plan.edges)
    assert topological_map.nodes[labels.true_node[-1]].id == "office_2"
    assert labels.plan_position[-1] == len(plan.nodes) - 1
    assert not labels.off_plan.any()
    assert [scene.rooms[room].name for room in labels.room[[0, 40, -1]]] == [
        "office_1",
        "hallway_1",
        "office_2",
    ]
    # The paper's rule agrees wherever it labels.
    labelled = labels.edge >= 0
    assert labelled.mean() > 0.5
    np.testing.assert_array_equal(labels.edge[labelled], labels.plan_edge[labelled])


def test_rooms_are_those_of_the_scene_and_none_outside() -> None:
    scene = make_scene()
    pose = np.array([(2.0, 3.0, 0.0), (2.0, 1.0, 0.0), (-50.0, 0.0, 0.0), (0.25, 3.0, 0.0)])
    expected = [scene.room_at(x, y) for x, y, _ in pose]
    found = [scene.rooms[room].name if room >= 0 else None for room in rooms_at(pose, scene)]
    assert found == expected == ["office_1", "hallway_1", None, None]
