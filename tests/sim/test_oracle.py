import math
from pathlib import Path

import numpy as np
import pytest

from tests.maps.small_maps import NODES, office_floor
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2, angle_difference
from toponav.core.vocabulary import RoomKind
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import TopologicalMap
from toponav.sim.oracle import PlanTracker, TruthLocalizer
from toponav.worlds.scene import GridFrame, Room, Scene, scene_from_heights

NORTH, SOUTH, EAST, WEST = math.pi / 2, -math.pi / 2, 0.0, math.pi


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The building of the small map: a corridor, an office above it, a room at each end."""
    grid = GridFrame(0.05, (-4.0, -2.0), rows=120, cols=360)
    rooms = (
        Room("hallway_1", RoomKind.HALLWAY),
        Room("office_4", RoomKind.OFFICE),
        Room("office_41", RoomKind.OFFICE),
        Room("WC_1", RoomKind.WC),
    )
    index = np.full(grid.shape, -1, dtype=np.int16)
    for number, (x0, y0, x1, y1) in enumerate(
        (
            (-1.0, -1.0, 11.0, 1.0),
            (3.0, 1.0, 7.0, 4.0),
            (11.0, -2.0, 14.0, 2.0),
            (-4.0, -2.0, -1.0, 2.0),
        )
    ):
        low, high = grid.cell_of(x0 + 1e-6, y0 + 1e-6), grid.cell_of(x1 - 1e-6, y1 - 1e-6)
        index[low[0] : high[0] + 1, low[1] : high[1] + 1] = number
    return scene_from_heights("floor", grid, np.zeros(grid.shape), room_index=index, rooms=rooms)


@pytest.fixture(scope="module")
def truth(scene: Scene) -> TruthLocalizer:
    return TruthLocalizer(office_floor(), scene)


def _slow_node_at(topological_map: TopologicalMap, scene: Scene, pose: Pose2) -> str | None:
    """The rule as design.md words it."""
    room = scene.room_at(pose.x_m, pose.y_m)
    if room is None:
        return None
    best, best_distance = None, math.inf
    for node in topological_map.nodes:
        if scene.room(room).kind.is_enclosed and node.room != room:
            continue
        edges = topological_map.out_edges(node.id) + topological_map.in_edges(node.id)
        if not any(
            abs(angle_difference(edge.yaw_rad, pose.yaw_rad)) < math.radians(36.0)
            for edge in edges
        ):
            continue
        distance = math.hypot(node.x_m - pose.x_m, node.y_m - pose.y_m) / node.size
        if distance < best_distance:
            best, best_distance = node.id, distance
    return best


def _poses(scene: Scene, count: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    grid = scene.grid
    low = np.array([*grid.origin_m, -7.0])
    span = np.array([grid.cols * grid.resolution_m, grid.rows * grid.resolution_m, 14.0])
    return low + rng.random((count, 3)) * span


def _assert_same_as_slow(truth: TruthLocalizer, count: int) -> None:
    poses = _poses(truth.scene, count)
    fast = truth.nodes_at(poses[:, 0], poses[:, 1], poses[:, 2])
    known = 0
    for pose, index in zip(poses.tolist(), fast.tolist(), strict=True):
        slow = _slow_node_at(truth.map, truth.scene, Pose2(*pose))
        assert (truth.map.nodes[index].id if index >= 0 else None) == slow
        assert truth.node_at(Pose2(*pose)) == slow
        known += slow is not None
    assert known > count / 10


def test_the_fast_rule_is_the_slow_one(truth: TruthLocalizer) -> None:
    _assert_same_as_slow(truth, 200)


def test_the_fast_rule_is_the_slow_one_on_an_area(areas_dir: Path) -> None:
    from toponav.maps.formats.canvas import load_area_map
    from toponav.worlds.load.stanford import load_area

    area = areas_dir / "area_6.yaml"
    _assert_same_as_slow(TruthLocalizer(load_area_map(area), load_area(area)), 60)


def test_the_lane_is_that_of_the_heading(truth: TruthLocalizer) -> None:
    assert truth.node_at(Pose2(4.1, 0.05, EAST)) == "hallway_1-1r"
    assert truth.node_at(Pose2(4.1, -0.05, WEST)) == "hallway_1-1l"


def test_a_node_counts_up_to_36_degrees(truth: TruthLocalizer) -> None:
    assert truth.node_at(Pose2(0.0, -0.1, math.radians(35.0))) == "hallway_1-0r"
    assert truth.node_at(Pose2(0.0, -0.1, math.radians(37.0))) != "hallway_1-0r"


def test_only_nodes_of_the_room_of_exactly_that_name_count(truth: TruthLocalizer) -> None:
    # office_4 is a prefix of office_41; the nearest node of the other room never counts.
    assert truth.node_at(Pose2(5.0, 1.9, SOUTH)) == "office_4"
    assert truth.node_at(Pose2(6.9, 1.2, SOUTH)) == "office_4_door"
    assert truth.node_at(Pose2(11.1, 0.0, EAST)) == "office_41"
    assert truth.node_at(Pose2(11.1, 0.0, NORTH)) is None


def test_the_authors_take_the_rooms_node_for_any_heading(scene: Scene) -> None:
    lenient = TruthLocalizer(office_floor(), scene, any_heading_in_rooms=True)
    assert lenient.node_at(Pose2(11.1, 0.0, NORTH)) == "office_41"
    assert lenient.node_at(Pose2(2.0, 0.0, NORTH)) == TruthLocalizer(
        office_floor(), scene
    ).node_at(Pose2(2.0, 0.0, NORTH))


def test_size_scales_distance(scene: Scene) -> None:
    from dataclasses import replace

    from tests.maps.small_maps import plus

    between = Pose2(4.8, -0.1, EAST)
    assert TruthLocalizer(office_floor(), scene).node_at(between) == "hallway_1-1r"
    larger = plus(office_floor(), replace(NODES["hallway_1-2r"], size=1.8))
    assert TruthLocalizer(larger, scene).node_at(between) == "hallway_1-2r"


@pytest.mark.parametrize(
    "pose", [(1.0, 3.0, 0.0), (99.0, 0.0, 0.0), (math.nan, 0.0, 0.0), (0.0, -math.inf, 0.0),
             (0.0, 0.0, math.nan)],
)  # fmt: skip
def test_nowhere_is_no_node(truth: TruthLocalizer, pose) -> None:
    assert truth.node_at(Pose2(*pose)) is None


def test_a_scene_without_rooms_lets_every_node_count() -> None:
    grid = GridFrame(0.5, (-4.0, -2.0), rows=12, cols=36)
    plain = scene_from_heights("plain", grid, np.zeros(grid.shape))
    truth = TruthLocalizer(office_floor(), plain)
    assert truth.node_at(Pose2(12.0, 0.0, EAST)) == "office_41"
    assert truth.node_at(Pose2(99.0, 0.0, EAST)) is not None


def test_a_map_of_another_building_is_refused(scene: Scene) -> None:
    from dataclasses import replace

    nodes = tuple(replace(node, room=f"other_{node.room}") for node in office_floor().nodes)
    with pytest.raises(InputError, match="no node in any room of scene 'floor'"):
        TruthLocalizer(replace(office_floor(), nodes=nodes), scene)


def test_deviation_is_a_node_off_the_plan(truth: TruthLocalizer) -> None:
    plan = shortest_plan(truth.map, "office_4", "office_41")
    assert truth.on_plan(Pose2(6.0, -0.1, EAST), plan)
    assert not truth.on_plan(Pose2(6.0, 0.1, WEST), plan)
    assert truth.on_plan(Pose2(1.0, 3.0, 0.0), plan)
    assert truth.edge_for(Pose2(6.0, -0.1, EAST), plan) == "hallway_1-2r->hallway_1-3r"
    assert truth.edge_for(Pose2(6.0, 0.1, WEST), plan) is None
    assert truth.node_on_plan(Pose2(3.8, -0.1, EAST), plan) == "hallway_1-2r"
    positions = np.array([3.8]), np.array([-0.1]), np.array([EAST])
    (index,) = truth.nodes_at(*positions, plan=plan)
    assert truth.map.nodes[index].id == "hallway_1-2r"


def _names(truth: TruthLocalizer, poses) -> tuple[list[str | None], list[str | None]]:
    labels = truth.annotate(np.array(poses, dtype=np.float64).reshape(-1, 3))
    nodes = [truth.map.nodes[i].id if i >= 0 else None for i in labels.node_index]
    edges = [truth.map.edges[i].id if i >= 0 else None for i in labels.edge_index]
    return nodes, edges


def test_frames_at_a_node_have_the_edge_to_the_next_node(truth: TruthLocalizer) -> None:
    poses = [(5, 2.2, SOUTH), (5, 2.0, SOUTH), (5, 1.5, SOUTH), (6, -0.1, EAST), (9.9, -0.1, EAST)]
    nodes, edges = _names(truth, poses)
    assert nodes == ["office_4", "office_4", "office_4_door", "hallway_1-2r", "hallway_1-3r"]
    assert edges == [
        "office_4->office_4_door",
        "office_4->office_4_door",
        "office_4_door->hallway_1-2r",
        "hallway_1-2r->hallway_1-3r",
        None,
    ]


def test_frames_wait_for_a_node_that_an_edge_leads_to(truth: TruthLocalizer) -> None:
    poses = [
        (0, -0.1, EAST), (6, -0.1, EAST), (10, -0.1, EAST), (0.1, -0.1, EAST), (4, -0.1, EAST),
        (3.9, 0.1, WEST), (4, -0.1, EAST), (6, -0.1, EAST),
    ]  # fmt: skip
    nodes, edges = _names(truth, poses)
    first, second = "hallway_1-0r", "hallway_1-1r"
    assert nodes == [first, None, None, first, second, None, second, "hallway_1-2r"]
    step = "hallway_1-0r->hallway_1-1r"
    onward = "hallway_1-1r->hallway_1-2r"
    assert edges == [step, None, None, step, onward, None, onward, None]


def test_a_plan_keeps_other_nodes_from_interrupting_the_labels(truth: TruthLocalizer) -> None:
    plan = shortest_plan(truth.map, "office_4", "office_41")
    poses = np.array([(5.0, 1.5, SOUTH), (4.4, -0.1, EAST), (6.0, -0.1, EAST), (10.0, -0.1, EAST)])
    assert truth.annotate(poses).labelled_fraction == pytest.approx(0.5)
    assert truth.annotate(poses, plan=plan).labelled_fraction == pytest.approx(0.75)


def test_no_frames_have_no_labels(truth: TruthLocalizer) -> None:
    labels = truth.annotate(np.empty((0, 3)))
    assert labels.node_index.shape == (0,)
    assert labels.labelled_fraction == 0.0


def test_a_tracker_keeps_the_last_valid_edge(truth: TruthLocalizer) -> None:
    plan = shortest_plan(truth.map, "office_4", "office_41")
    tracker = PlanTracker(plan)
    assert tracker.edge == "office_4->office_4_door"
    assert tracker.update("office_4_door") == "office_4_door->hallway_1-2r"
    assert tracker.update("hallway_1-1l") == "office_4_door->hallway_1-2r"
    assert tracker.update("hallway_1-1l") == "office_4_door->hallway_1-2r"
    assert tracker.steps_off_plan == 2
    tracker.update(None)
    assert tracker.steps_off_plan == 2
    assert tracker.update("hallway_1-2r") == "hallway_1-2r->hallway_1-3r"
    assert tracker.steps_off_plan == 0
    assert tracker.completion == pytest.approx(0.6)
    assert not tracker.at_goal
    assert tracker.update("office_41") is None
    assert tracker.at_goal
    assert tracker.completion == 1.0
