"""Lines of sight and paths at any angle, against slow references and geometry."""

import math

import numpy as np
import pytest

from tests.sim.two_rooms import two_rooms
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.shortest_path import any_angle_length_m
from toponav.worlds.sight_kernels import cells_in_sight, is_clear


def sampled_is_clear(blocked: np.ndarray, start: np.ndarray, end: np.ndarray) -> bool:
    """Whether a thousand points of the segment lie in open cells."""
    points = start + np.linspace(0, 1, 1000)[:, None] * (end - start)
    rows, cols = np.floor(points).astype(int).T
    return not blocked[rows, cols].any()


def test_sight_agrees_with_points_along_the_segment() -> None:
    rng = np.random.default_rng(0)
    blocked = rng.random((20, 30)) < 0.08
    disagreements = 0
    for _ in range(500):
        start, end = rng.uniform(0, [20, 30], (2, 2))
        # A sample can step over the corner that a segment just cuts, never the other way.
        clear = bool(is_clear(blocked, *start, *end))
        sampled = sampled_is_clear(blocked, start, end)
        assert sampled or not clear
        disagreements += clear != sampled
    assert disagreements < 5


def test_sight_is_mutual() -> None:
    rng = np.random.default_rng(1)
    blocked = rng.random((20, 30)) < 0.1
    for _ in range(300):
        start, end = rng.uniform(0, [20, 30], (2, 2))
        assert is_clear(blocked, *start, *end) == is_clear(blocked, *end, *start)


def test_a_corner_between_two_blocked_cells_lets_nothing_through() -> None:
    blocked = np.zeros((4, 4), bool)
    blocked[1, 2] = blocked[2, 1] = True
    assert not is_clear(blocked, 1.5, 1.5, 2.5, 2.5)


def test_outside_the_grid_nothing_is_seen() -> None:
    blocked = np.zeros((4, 4), bool)
    assert not is_clear(blocked, 2.0, 2.0, 2.0, 6.0)
    assert not cells_in_sight(blocked, -1.0, 2.0, 3.0).any()


def test_a_wall_hides_what_lies_behind() -> None:
    blocked = np.zeros((11, 11), bool)
    blocked[3:8, 5] = True
    seen = cells_in_sight(blocked, 5.5, 2.5, 20.0)
    assert seen[5, 4]
    assert not seen[5, 5]
    assert not seen[5, 8]
    assert seen[0, 6]


@pytest.fixture(scope="module")
def space() -> FreeSpace:
    return FreeSpace.of(two_rooms(), 0.18)


def length_m(space: FreeSpace, start: tuple[float, float], goal: tuple[float, float]) -> float:
    return any_angle_length_m(space, space.geodesic_m(goal), start, goal)


def test_a_free_line_is_the_shortest_path(space: FreeSpace) -> None:
    assert length_m(space, (1.0, 1.0), (4.0, 2.3)) == pytest.approx(math.hypot(3.0, 1.3))


def test_a_path_through_the_doorway_is_pulled_tight(space: FreeSpace) -> None:
    start, goal = (4.0, 1.0), (6.0, 1.0)
    # By hand: tangents to circles of the robot's radius about the doorway's corners.
    away_m, radius_m = math.dist(start, (4.9, 2.5)), 0.18
    turn_rad = math.atan2(1.5, 0.9) + math.asin(radius_m / away_m)
    true_m = 2 * (math.sqrt(away_m**2 - radius_m**2) + radius_m * turn_rad) + 0.2
    found = length_m(space, start, goal)
    assert true_m < found < true_m + 0.35
    steps = float(space.geodesic_m(goal)[space.grid.cell_of(*start)])
    assert found < steps


def test_where_no_path_leads_the_length_is_infinite() -> None:
    scene = two_rooms()
    heights_m = scene.heights_m.copy()
    heights_m[25:35, 49:51] = 2.7
    from toponav.worlds.scene import scene_from_heights

    closed = FreeSpace.of(scene_from_heights("closed", scene.grid, heights_m), 0.18)
    assert math.isinf(length_m(closed, (2.0, 3.0), (8.0, 3.0)))
