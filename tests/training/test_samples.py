import numpy as np
import pytest
import torch

from tests.training.synthetic import ORDER, SyntheticSet
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.maps.subgraph import crop
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import get_preset
from toponav.training.behavior_task import BehaviorTask
from toponav.training.config import default_config
from toponav.training.localization_task import LocalizationTask, draw_previous_edge
from toponav.training.samples import FrameStacks, draw, split_frames

COMPACT, PAPER = get_preset("compact"), get_preset("paper")
CONFIG = default_config("compact", "localization").with_changes(batch_size=32)


@pytest.fixture(scope="module")
def data():
    return SyntheticSet()


def test_buildings_are_on_one_side_only(data):
    split = split_frames(data)
    assert (split.train ^ split.val).all()
    for building in range(3):
        of_building = np.isin(data.trajectory, np.flatnonzero(np.arange(6) % 3 == building))
        assert len(set(split.val[of_building])) == 1
    assert 0 < split.val.sum() < split.train.sum()


def test_one_building_is_divided_by_trajectories():
    split = split_frames(SyntheticSet(trajectories=4, buildings=1, frames_an_edge=2))
    assert split.val_buildings == ()
    assert 0 < split.val.sum() < len(split.val)
    with pytest.raises(InputError, match="two trajectories"):
        split_frames(SyntheticSet(trajectories=1, frames_an_edge=2))


def test_stacks_repeat_a_trajectorys_first_frame(data):
    stacks = FrameStacks(data, (5, 1, 0))
    start = int(np.flatnonzero(data.trajectory == 1)[0])
    index = np.array([start, start + 2, start + 9])
    gathered = stacks.gather(index, np.array([False, False, True]))
    expected = [[start] * 3, [start, start + 1, start + 2], [start + 4, start + 8, start + 9]]
    for stack, rows in zip(gathered[:2], expected[:2], strict=True):
        np.testing.assert_array_equal(stack, data.frames[rows])
    np.testing.assert_array_equal(gathered[2], data.frames[expected[2]][..., ::-1])


def test_draw_repeats_nothing_before_all_came_once():
    pool = np.arange(10, 17)
    drawn = draw(pool, 12, np.random.default_rng(0))
    assert set(drawn[:7]) == set(pool)
    assert len(drawn) == 12


def test_turns_learn_from_mirrored_opposite_turns(data):
    model = BehaviorNetwork(COMPACT.behavior(Behavior.TURN_LEFT))
    split = split_frames(data)
    task = BehaviorTask(model, data, split, CONFIG)
    left, right = (ORDER.index(b) for b in (Behavior.TURN_LEFT, Behavior.TURN_RIGHT))
    counts = [(split.train & (data.behavior == kind)).sum() for kind in (left, right)]
    assert task.samples == sum(counts)
    rng = np.random.default_rng(0)
    seen = torch.cat([batch.command for batch in task.batches(rng, task.samples // 32)])
    expected = set(np.float32(data.command[split.train & (data.behavior == left), 1]))
    expected |= set(-np.float32(data.command[split.train & (data.behavior == right), 1]))
    assert set(seen[:, 1].numpy()) <= expected


def test_mirrored_images_go_with_negated_turns(data):
    model = BehaviorNetwork(COMPACT.behavior(Behavior.STRAIGHT))
    task = BehaviorTask(model, data, split_frames(data), CONFIG)
    (batch,) = task.batches(np.random.default_rng(0), 1)
    now = batch.frames[:, -1, :4].numpy().astype(float)
    column = (now == 255).mean(1).argmax(1) + 3.5
    turn = (column - 47.5) / 43.5
    assert np.abs(turn - batch.command[:, 1].numpy()).max() < 0.1


def test_sequences_weigh_nothing_past_the_behaviors_end(data):
    model = BehaviorNetwork(PAPER.behavior(Behavior.TURN_LEFT))
    task = BehaviorTask(model, data, split_frames(data), CONFIG.with_changes(sequence_steps=20))
    kind = ORDER.index(Behavior.TURN_LEFT)
    start = int(np.flatnonzero(data.behavior == kind)[0])
    batch = task._batch(np.array([start, start + 10]), np.array([False, True]))
    assert batch.frames.shape[:3] == (20, 2, 1)
    assert batch.weight.sum(0).tolist() == [12.0, 2.0]
    np.testing.assert_allclose(batch.command[1, 0].numpy(), data.command[start + 1])


def test_every_crop_holds_its_true_edge(data):
    model = LocalizationNetwork(COMPACT.localization)
    task = LocalizationTask(model, data, split_frames(data), CONFIG)
    for batch in task.batches(np.random.default_rng(0), 4):
        counts = torch.bincount(batch.graphs.edge_batch)
        assert (batch.target < counts).all()
        first = torch.cumsum(counts, 0) - counts
        kinds = batch.graphs.edge_kind[first + batch.target].numpy()
        now = batch.frames[:, -1].numpy()
        shown = (now[:, 4:24] == 255).reshape(32, 5, -1).mean(-1).argmax(1)
        mirror = {2: 3, 3: 2}
        unmirrored = [mirror.get(k, k) if i < 16 else k for i, k in enumerate(kinds)]
        assert list(shown) == unmirrored


def test_last_location_is_mostly_right_and_always_near(data):
    rng = np.random.default_rng(0)
    topological_map, plan = data.map_of(0), data.plan_of(0)
    truth = topological_map.edge(plan.edges[3])
    drawn = [
        draw_previous_edge(topological_map, truth, plan, COMPACT.localization, rng)
        for _ in range(400)
    ]
    for edge in drawn:
        nodes = crop(topological_map, edge.source).nodes
        assert truth.source in nodes
        assert truth.target in nodes
    share = np.mean([edge is truth for edge in drawn])
    assert 0.3 < share < 0.5
    before = np.mean([edge.id == plan.edges[2] for edge in drawn])
    assert 0.2 < before < 0.4
    assert len({edge.id for edge in drawn}) > 6
