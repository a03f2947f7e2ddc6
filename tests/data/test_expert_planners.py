import heapq
import math

import numpy as np
import pytest

from tests.data.expert_world import small_office
from toponav.core.geometry import Pose2
from toponav.data import path_kernels, planning_kernels, tracking_kernels
from toponav.data.global_planner import GlobalPlanner
from toponav.data.truth_table import TruthTable
from toponav.maps.plan import shortest_plan
from toponav.sim.oracle import TruthLocalizer

H = planning_kernels.HEADINGS


@pytest.fixture(scope="module")
def planner() -> GlobalPlanner:
    return GlobalPlanner(*small_office())


def test_table_says_what_the_truth_localizer_says(planner):
    scene, topological_map = small_office()
    clear = np.zeros((120, 130), dtype=bool)
    clear[8:112, 5:125] = True
    table = TruthTable.of(scene, topological_map, clear, 0.1)
    rows, cols = np.nonzero(clear)
    truth = TruthLocalizer(topological_map, scene)
    for heading in range(0, planning_kernels.BINS, 5):
        yaw = np.full(len(rows), heading * 2 * math.pi / planning_kernels.BINS)
        expected = truth.nodes_at((cols + 0.5) * 0.1, (rows + 0.5) * 0.1, yaw)
        found = table.node[table.row_of[rows, cols], heading]
        assert np.mean(found == expected) > 0.999  # ties between equally near nodes may differ


def slow_cost_to_go(cells, weight, off, goal, costs, units):
    """Dijkstra with a heap and the moves written out; the obvious way."""
    index = {tuple(cell): i for i, cell in enumerate(cells.tolist())}
    steps = [(1, 0), (2, 1), (1, 1), (1, 2)]
    moves = []
    for quarter in range(4):
        for dx, dy in steps:
            for _ in range(quarter):
                dx, dy = -dy, dx
            moves.append((dx, dy))
    off_cost, turn_cost, pivot_cost = costs
    value = {(i, k): 0 for i, k in zip(*np.nonzero(goal), strict=True)}
    queue = [(0, i, k) for i, k in value]
    while queue:
        cost, i, k = heapq.heappop(queue)
        if cost > value[i, k]:
            continue
        row, col = cells[i]
        before = []
        for turn in (-1, 0, 1):
            h = (k + turn) % H
            j = index.get((row - moves[h][1], col - moves[h][0]))
            if j is not None:
                rate = 0.5 * (weight[i] + weight[j])
                rate += off_cost * 0.5 * (off[j, h] + off[i, k])
                step = int(math.hypot(*moves[h]) * rate * units)
                before.append((j, h, step + (int(turn_cost * units) if turn else 0)))
            if turn:
                before.append((i, h, int(pivot_cost * units) + int(off_cost * off[i, h] * units)))
        for j, h, step in before:
            if cost + max(1, step) < value.get((j, h), math.inf):
                value[j, h] = cost + max(1, step)
                heapq.heappush(queue, (value[j, h], j, h))
    return value


def test_buckets_find_the_costs_that_a_heap_finds():
    random = np.random.default_rng(0)
    free = random.random((14, 17)) > 0.2
    cells = np.argwhere(free).astype(np.int32)
    cell_id = np.full(free.shape, -1, dtype=np.int32)
    cell_id[free] = np.arange(len(cells))
    weight = 1 + 3 * random.random(len(cells))
    off = (random.random((len(cells), H)) > 0.8).astype(np.float32)
    goal = np.zeros((len(cells), H), dtype=bool)
    goal[5, 3] = goal[5, 4] = True
    costs = (6.0, 0.4, 2.0)
    found = planning_kernels.cost_to_go(cell_id, cells, weight, off, goal, *costs, 20)
    expected = slow_cost_to_go(cells, weight, off, goal, costs, 20)
    for i in range(len(cells)):
        for k in range(H):
            assert found[i * H + k] == expected.get((i, k), 1 << 30)


def test_path_keeps_clear_of_walls_and_ends_at_the_goal(planner):
    plan = shortest_plan(planner.map, "office_1", "office_2")
    points, _ = planner.path(planner.cost_to_go(plan), Pose2(2.0, 8.5, -1.2))
    near = [
        path_kernels.sample_bilinear(planner.clearance_m, planner.resolution_m, x, y)
        for x, y in points
    ]
    assert min(near) > 0.25
    goal = planner.map.node("office_2")
    assert math.hypot(points[-1, 0] - goal.x_m, points[-1, 1] - goal.y_m) < 0.4
    assert np.allclose(np.hypot(*np.diff(points, axis=0).T), 0.05, atol=0.01)


def test_no_path_leads_through_a_wall(planner):
    plan = shortest_plan(planner.map, "office_1", "office_2")
    assert planner.path(planner.cost_to_go(plan), Pose2(6.0, 4.0, 0.0)) is None


def test_places_made_dearer_are_passed_elsewhere(planner):
    plan = shortest_plan(planner.map, "office_1", "office_2")
    start = Pose2(2.0, 8.5, -1.2)
    field = planner.cost_to_go(plan)
    before, _ = planner.path(field, start)
    middle = before[len(before) // 2]
    poses = np.array([[*middle, 0.0]])
    after, _ = planner.path(planner.avoiding(field, poses, 5.0), start)
    assert np.hypot(*(after - middle).T).min() > 0.08
    assert np.hypot(*(before - middle).T).min() < 0.01


def test_smoothing_shortens_a_staircase_and_keeps_its_ends():
    steps = np.repeat(np.arange(12), 2)[:-1] * 0.3
    stairs = np.stack([steps[1:], np.repeat(np.arange(12), 2)[:-2] * 0.3], axis=1) + 2.0
    points = path_kernels.resample(stairs, 0.1)
    open_floor = np.full((200, 200), 5.0, dtype=np.float32)
    smooth = path_kernels.smooth(points, open_floor, 0.05, 150, 0.45, 0.015, 0.15, 0.4, 0.2)
    length = [np.hypot(*np.diff(line, axis=0).T).sum() for line in (points, smooth)]
    assert length[1] < 0.8 * length[0]
    assert np.array_equal(smooth[[0, -1]], points[[0, -1]])


def test_speed_falls_in_time_for_a_bend():
    corner = np.concatenate(
        [np.stack([np.arange(40) * 0.05, np.zeros(40)], 1),
         np.stack([np.full(40, 1.95), np.arange(1, 41) * 0.05], 1)]
    ) + 3.0  # fmt: skip
    open_floor = np.full((200, 200), 5.0, dtype=np.float32)
    speed = tracking_kernels.speed_profile(corner, open_floor, 0.05, 0.5, 0.8, 0.2, 0.3, 0.4)
    assert speed[0] == 0.5
    assert speed[39] < 0.3
    assert np.all(np.diff(speed[:39] ** 2) >= -2 * 0.4 * 0.05 - 1e-9)
