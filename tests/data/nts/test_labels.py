"""Labels of panoramas in two rooms whose answers are known by hand."""

import math

import numpy as np
import pytest

from tests.sim.two_rooms import two_rooms
from toponav.core.geometry import Pose2
from toponav.core.imagenav import NODE_RADIUS_M, bin_of_direction
from toponav.data.nts.ground import Ground
from toponav.data.nts.labels import HomeLabels, exits_of, home_labels, score_of
from toponav.worlds.scene import scene_from_heights

# In the first room: before the doorway, in a corner; in the second: behind the doorway, aside.
POSES = np.array(
    [
        [3.0, 3.0, 0.0],
        [1.0, 1.0, math.pi / 2],
        [5.8, 3.0, math.pi],
        [8.0, 5.0, 0.0],
    ]
)


@pytest.fixture(scope="module")
def ground() -> Ground:
    return Ground.of(two_rooms())


@pytest.fixture(scope="module")
def labels(ground: Ground) -> HomeLabels:
    return home_labels(ground, POSES)


def test_what_is_seen_within_three_metres_is_of_the_same_node(labels: HomeLabels) -> None:
    wanted = np.eye(4, dtype=bool)
    wanted[0, 1] = wanted[1, 0] = True  # 2.83 m, the same room
    wanted[0, 2] = wanted[2, 0] = True  # 2.8 m, through the doorway
    wanted[2, 3] = wanted[3, 2] = True  # 2.97 m, the same room
    assert (labels.same_node == wanted).all()


def test_a_wall_ends_a_node_even_when_near(ground: Ground) -> None:
    beside = np.array([[4.6, 1.0, 0.0], [5.4, 1.0, 0.0]])
    found = home_labels(ground, beside)
    assert not found.same_node[0, 1]
    assert found.distance_m[0, 1] == pytest.approx(0.8)
    assert found.geodesic_m[0, 1] > 3.0


def test_bearings_count_from_the_source_s_heading(labels: HomeLabels) -> None:
    assert labels.bearing_rad[0, 2] == pytest.approx(0.0)
    assert labels.bearing_rad[2, 0] == pytest.approx(0.0)
    assert labels.bearing_rad[1, 0] == pytest.approx(-math.pi / 4)
    assert (labels.distance_m == labels.distance_m.T).all()


def test_the_doorway_is_explorable_and_the_walls_are_not(ground: Ground) -> None:
    near_door = exits_of(ground, Pose2(4.0, 3.0, 0.0))
    bins = set(near_door.bins.tolist())
    assert 0 in bins
    # Left and right of it the room goes on beyond 3 m only behind, to the west.
    assert 2 not in bins
    assert 10 not in bins
    turned = exits_of(ground, Pose2(4.0, 3.0, math.pi / 2))
    assert {(one + 3) % 12 for one in turned.bins.tolist()} == bins


def test_a_node_is_what_is_seen_within_its_radius(ground: Ground) -> None:
    pose = Pose2(3.0, 3.0, 0.7)
    node = exits_of(ground, pose).node
    centers = ground.centers_of(np.argwhere(node).astype(np.int32))
    distance_m = np.hypot(centers[:, 0] - pose.x_m, centers[:, 1] - pose.y_m)
    assert distance_m.max() <= NODE_RADIUS_M
    assert not node[~ground.free].any()


def test_the_shadow_of_a_pillar_is_not_explorable() -> None:
    scene = two_rooms()
    heights_m = scene.heights_m.copy()
    heights_m[25:35, 49:51] = 2.7
    heights_m[:, 51:] = 2.7  # The doorway is shut: one room of 28 m2 is left.
    heights_m[29:31, 20:22] = 2.7
    shut = scene_from_heights("pillar", scene.grid, heights_m)
    ground = Ground.of(shut)
    # Within 6 m all of the room but the pillar's shadow is seen; within 3 m half of it is.
    near = exits_of(ground, Pose2(4.4, 3.0, 0.0))
    hidden = exits_of(ground, Pose2(4.4, 3.0, 0.0), radius_m=6.0)
    assert len(near.cells) > 0
    assert len(hidden.cells) == 0


def test_the_best_direction_leads_along_the_shortest_path(labels: HomeLabels) -> None:
    # From before the doorway to the far room: the doorway's way is the shortest path itself.
    ways_m = labels.via_m[0, 3]
    assert int(np.argmin(ways_m)) == bin_of_direction(0.0)
    assert ways_m.min() == pytest.approx(labels.geodesic_m[0, 3], abs=0.02)
    # Another way out leads back through the node, so it is longer.
    others = np.delete(ways_m[np.isfinite(ways_m)], 0)
    assert (others >= ways_m.min()).all()


def test_no_way_leads_where_nothing_is_explorable(labels: HomeLabels) -> None:
    assert (np.isfinite(labels.via_m) == labels.explorable[:, None, :]).all()
    assert (score_of(labels.via_m)[~np.isfinite(labels.via_m)] == 0).all()


def test_no_way_is_shorter_than_the_shortest_path(labels: HomeLabels) -> None:
    assert (labels.via_m >= labels.geodesic_m[:, :, None] - 0.02).all()


def test_the_score_falls_with_the_way() -> None:
    scores = score_of(np.array([0.0, 2.0, 5.0, 20.0]))
    assert (np.diff(scores) < 0).all()
    assert scores[0] == 1.0


def test_turning_the_source_turns_its_labels(ground: Ground) -> None:
    turned = POSES.copy()
    turned[:, 2] += math.pi / 2
    before, after = home_labels(ground, POSES), home_labels(ground, turned)
    assert (np.roll(before.explorable, -3, axis=1) == after.explorable).all()
    assert (np.roll(before.via_m, -3, axis=2) == after.via_m).all()
    assert (before.same_node == after.same_node).all()
