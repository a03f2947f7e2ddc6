import heapq
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.free_space import FreeSpace, indoors
from toponav.worlds.grid_kernels import distance_to_solid, geodesic_cells
from toponav.worlds.scene import GridFrame, Room, scene_from_heights

masks = arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9)))


def scene_of(solid, cell_m=0.1, **rooms):
    grid = GridFrame(cell_m, (0.0, 0.0), *solid.shape)
    return scene_from_heights("s", grid, solid * 2.5, ceiling_m=2.5, **rooms)


def two_rooms():
    """Two rooms of 2 x 2 m, a doorway of 0.8 m in the wall between them, and white outside."""
    solid = np.zeros((60, 80), bool)
    solid[19:42, 19:63] = True
    solid[20:41, 20:40] = solid[20:41, 42:62] = False
    solid[27:35, 40:42] = False
    room_index = np.full(solid.shape, -1)
    room_index[20:41, 20:40], room_index[20:41, 42:62] = 0, 1
    rooms = [Room("office_1", RoomKind.OFFICE), Room("hallway_1", RoomKind.HALLWAY)]
    return scene_of(solid, room_index=room_index, rooms=rooms)


@given(masks)
@settings(max_examples=40, deadline=None)
def test_clearance_is_the_exact_distance_to_the_nearest_square(solid):
    padded = np.pad(solid, 1, constant_values=True)
    squares = np.argwhere(padded) - 1
    found = distance_to_solid(solid)
    for row in range(solid.shape[0]):
        for col in range(solid.shape[1]):
            gaps = np.maximum(np.abs(squares - (row, col)) - 0.5, 0)
            expected = 0 if solid[row, col] else np.hypot(*gaps.T).min()
            assert found[row, col] == pytest.approx(expected, abs=1e-5)


def heap_dijkstra(free, weight, goal):
    cost = np.full(free.shape, np.inf)
    if not free[goal]:
        return cost
    cost[goal] = 0
    queue = [(0.0, goal)]
    while queue:
        here, (row, col) = heapq.heappop(queue)
        if here > cost[row, col]:
            continue
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                r, c = row + dr, col + dc
                if not (0 <= r < free.shape[0] and 0 <= c < free.shape[1] and free[r, c]):
                    continue
                if dr and dc and not (free[row, c] and free[r, col]):
                    continue
                step = np.hypot(dr, dc) * (weight[row, col] + weight[r, c]) / 2
                if here + step < cost[r, c] - 1e-12:
                    cost[r, c] = here + step
                    heapq.heappush(queue, (cost[r, c], (r, c)))
    return cost


@given(masks, st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=40, deadline=None)
def test_geodesic_field_equals_dijkstra_with_a_heap(free, seed, weighted):
    rng = np.random.default_rng(seed)
    goal = tuple(int(rng.integers(n)) for n in free.shape)
    weight = rng.uniform(1, 9, free.shape) if weighted else np.ones(free.shape)
    weight = weight.astype(np.float32)
    given_weight = weight if weighted else np.ones((1, 1), np.float32)
    goals = np.array([goal], np.int32)
    found = geodesic_cells(free, given_weight, float(weight.max()), goals)
    np.testing.assert_allclose(found, heap_dijkstra(free, weight, goal), rtol=1e-5)


def test_free_space_is_indoors_and_joins_rooms_through_the_door():
    space = FreeSpace.of(two_rooms(), radius_m=0.2)
    assert space.is_free(2.5, 3.0)
    assert space.is_free(4.1, 3.1), "the doorway is no room's and still free"
    assert not space.is_free(0.5, 0.5), "white outside the building is not free"
    assert not space.is_free(-3.0, 99.0)
    assert space.component.max() == 1
    narrow = FreeSpace.of(two_rooms(), radius_m=0.45)
    assert narrow.component.max() == 2


def test_scene_without_rooms_is_free_everywhere():
    space = FreeSpace.of(scene_of(np.zeros((10, 10), bool)), radius_m=0.2)
    assert space.free.sum() == 6 * 6


def test_free_pieces_outside_all_rooms_do_not_count():
    room_index = np.full((30, 30), -1)
    room_index[2:28, 2:10] = room_index[2:28, 14:28] = 0
    solid = np.zeros((30, 30), bool)
    solid[:, [10, 13]] = True
    scene = scene_of(solid, room_index=room_index, rooms=[Room("wc_1", RoomKind.WC)])
    assert indoors(scene.room_index, 0.1)[15, 11]
    assert not FreeSpace.of(scene, 0.05).free[:, 11:13].any()


def test_geodesic_goes_around_the_wall_and_path_follows_it():
    scene = two_rooms()
    space = FreeSpace.of(scene, 0.2)
    start, goal = (2.35, 2.35), (5.85, 2.35)
    field_m = space.geodesic_m(goal)
    path = space.path_m(field_m, start)
    length_m = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert field_m[scene.grid.cell_of(*start)] == pytest.approx(length_m, rel=1e-4)
    assert length_m > np.hypot(3.5, 0.0)
    assert all(space.is_free(*point) for point in path)
    assert np.isinf(field_m[0, 0])
    assert path[-1] == pytest.approx(goal)


def test_weights_keep_the_path_off_costly_cells():
    scene = scene_of(np.zeros((41, 41), bool))
    space = FreeSpace.of(scene, 0.1)
    weight = np.ones(scene.grid.shape, np.float32)
    weight[18:23, 5:36] = 50.0
    path = space.path_m(space.geodesic_m((3.85, 2.05), weight), (0.25, 2.05))
    rows = ((path[:, 1]) / 0.1).astype(int)
    cols = ((path[:, 0]) / 0.1).astype(int)
    assert weight[rows, cols].max() == 1


def test_goals_off_the_floor_move_to_it_or_say_why_not():
    space = FreeSpace.of(two_rooms(), 0.2)
    assert space.free[space.nearest_free(2.05, 2.05)]
    with pytest.raises(InputError, match="no free floor within 1 m"):
        space.geodesic_m((0.0, 0.0))
    with pytest.raises(InputError, match="weights must lie in"):
        space.geodesic_m((2.5, 3.0), np.zeros(space.grid.shape, np.float32))
    with pytest.raises(InputError, match="radius_m"):
        FreeSpace.of(two_rooms(), float("nan"))


def test_unreachable_goal_is_named():
    space = FreeSpace.of(two_rooms(), 0.45)
    with pytest.raises(InputError, match="cannot be reached"):
        space.path_m(space.geodesic_m((5.2, 3.0)), (3.0, 3.0))


def test_field_of_a_large_grid_takes_milliseconds():
    space = FreeSpace.of(scene_of(np.zeros((600, 600), bool), 0.05), 0.2)
    space.geodesic_m((1.0, 1.0))
    best_s = np.inf
    for _ in range(3):
        start = time.perf_counter()
        space.geodesic_m((1.0, 1.0))
        best_s = min(best_s, time.perf_counter() - start)
    assert best_s < 0.25  # 15 ms on an idle core; tests share theirs.
