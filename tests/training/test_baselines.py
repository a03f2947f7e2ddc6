import dataclasses
import json

import numpy as np
import pytest
import torch

from tests.training.synthetic import ORDER, SyntheticSet
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.presets import get_baseline_preset
from toponav.models.checkpoints import checkpoint_metadata, load_behavrnn, load_phasenet
from toponav.models.graphnav.presets import Convolution, EncoderConfig, ImageSpec
from toponav.training.behavrnn_task import BehavRNNTask
from toponav.training.config import default_config
from toponav.training.phasenet_task import PhaseNetTask
from toponav.training.recipes import train_behavrnn, train_phasenet
from toponav.training.samples import FrameStacks, split_frames
from toponav.training.sequences import gather_sequences, segments

IMAGE = ImageSpec(16, 48, "equal_angles")
LEFT, RIGHT = ORDER.index(Behavior.TURN_LEFT), ORDER.index(Behavior.TURN_RIGHT)


def _small():
    """The compact baselines, thinner and with smaller images, so that tests are quick."""
    encoder = EncoderConfig(
        (Convolution(8, (5, 5), 4), Convolution(16, (3, 3))), padded=True, features=32
    )
    network = {"image": IMAGE, "encoder": encoder, "frame_offsets": (2, 0), "recurrent_size": 32}
    compact = get_baseline_preset("compact")
    return dataclasses.replace(
        compact,
        image=IMAGE,
        phasenet=dataclasses.replace(compact.phasenet, **network, finished_at=0.92),
        behavrnn=dataclasses.replace(compact.behavrnn, **network, stride=2),
    )


def _config(recipe, **changes):
    config = default_config("compact", recipe).with_changes(
        epochs=3, samples_per_epoch=64, batch_size=16, precision="float32", learning_rate=5e-3
    )
    return config.with_changes(**changes)


@pytest.fixture(scope="module")
def data():
    """Drives whose images show the behaviour (a bright band) and its progress (a column)."""
    made = SyntheticSet(rows=IMAGE.rows, cols=IMAGE.cols, trajectories=12, frames_an_edge=6)
    for frame, image in enumerate(made.frames):
        image[: IMAGE.rows // 8] = 0
        column = int(frame % 6 / 6 * IMAGE.cols)
        image[: IMAGE.rows // 8, column : column + 8] = 255
    return made


def test_segments_are_the_plans_edges_in_one_piece(data):
    found = segments(data)
    assert len(found.first) == 12 * 7
    assert (found.last - found.first == 5).all()
    np.testing.assert_array_equal(found.behavior, data.behavior[found.first])
    at_goal = SyntheticSet(rows=4, cols=9, trajectories=2, frames_an_edge=3)
    at_goal.plan_position = np.where(at_goal.plan_position == 6, 7, at_goal.plan_position)
    assert len(segments(at_goal).first) == 2 * 6


def test_sequences_hold_each_frame_once_and_end_where_they_end(data):
    stacks = FrameStacks(data, (2, 0))
    first, last = np.array([0, 50]), np.array([6, 53])
    seen = gather_sequences(stacks, first, last, np.array([False, True]), stride=3, most_steps=9)
    np.testing.assert_array_equal(seen.is_there.numpy(), [[1, 1], [1, 1], [1, 0]])
    np.testing.assert_array_equal(seen.index[:, 0], [0, 3, 6])
    assert len(seen.frames) == 5
    np.testing.assert_array_equal(seen.frames[0, 1].numpy(), data.frames[0])
    np.testing.assert_array_equal(seen.frames[3, 1].numpy(), data.frames[53][:, ::-1])
    cut = gather_sequences(stacks, first, last, np.zeros(2, bool), most_steps=2)
    assert cut.is_there.shape == (2, 2)


def test_phase_rises_evenly_to_one_and_mirrors_turn_the_other_way(data):
    small = _small()
    task = PhaseNetTask(PhaseNet(small.phasenet), data, split_frames(data), _config("phasenet"))
    turning = np.flatnonzero(segments(data).behavior == LEFT)[:2]
    batch = task._batch(turning, np.array([False, True]))
    np.testing.assert_allclose(batch.phase[:, 0], np.arange(1, 7) / 6, rtol=1e-6)
    assert batch.behavior.tolist() == [LEFT, RIGHT]
    np.testing.assert_array_equal(
        batch.frames[1, 1].numpy(), data.frames[segments(data).first[turning[1]]][:, ::-1]
    )


def test_mirrored_drives_have_mirrored_plans_and_targets(data):
    config = _config("behavrnn", batch_size=4)
    small = _small()
    task = BehavRNNTask(BehavRNN(small.behavrnn), data, split_frames(data), config)
    drives, mirrored = np.array([0, 0]), np.array([False, True])
    batch = task._batch(drives, task._first[drives], mirrored)
    plain, mirror = (plan.tolist() for plan in batch.plans)
    swap = {LEFT: RIGHT, RIGHT: LEFT}
    assert mirror == [swap.get(kind, kind) for kind in plain]
    target = batch.target.numpy()
    assert target[:, 1].tolist() == [swap.get(kind, kind) for kind in target[:, 0].tolist()]
    assert target[:, 0].tolist() == data.behavior[: 7 * 6 : 2].tolist()


def test_a_drive_begun_later_has_what_is_left_of_the_plan(data):
    small = _small()
    task = BehavRNNTask(BehavRNN(small.behavrnn), data, split_frames(data), _config("behavrnn"))
    batch = task._batch(np.array([1]), np.array([7 * 6 + 20]), np.array([False]))
    assert batch.plans[0].tolist() == data.behavior[42 + 18 : 84 : 6].tolist()
    assert len(batch.target) == 11


def test_phasenet_learns_when_a_behavior_is_done(data, tmp_path):
    config = _config("phasenet", epochs=6, samples_per_epoch=192)
    result = train_phasenet(data, _small(), config, tmp_path)
    assert result.metrics["phase_error"] < 0.12
    assert result.metrics["replay_accuracy"] > 0.75
    assert load_phasenet(tmp_path).config == _small().phasenet
    assert checkpoint_metadata(result.checkpoint)["metadata"]["validation_buildings"]
    assert json.loads((tmp_path / "run_phasenet.json").read_text())["config"]["epochs"] == 6


def test_behavrnn_learns_what_to_execute(data, tmp_path):
    config = _config("behavrnn", epochs=8, samples_per_epoch=128, batch_size=8)
    result = train_behavrnn(data, _small(), config, tmp_path)
    assert result.metrics["accuracy"] > 0.8
    assert {"val_loss", "turn_left_accuracy"} <= result.metrics.keys()
    assert load_behavrnn(tmp_path).config == _small().behavrnn


@pytest.mark.parametrize("train", [train_phasenet, train_behavrnn])
def test_seed_repeats_exactly(data, tmp_path, train):
    recipe = train.__name__.removeprefix("train_")
    for name in ("a", "b"):
        train(data, _small(), _config(recipe, epochs=1, samples_per_epoch=32), tmp_path / name)
    first, second = ((tmp_path / name / f"{recipe}.safetensors").read_bytes() for name in "ab")
    assert first == second


def test_unlabelled_data_is_refused(tmp_path):
    bare = SyntheticSet(rows=IMAGE.rows, cols=IMAGE.cols, trajectories=3, frames_an_edge=2)
    bare.behavior[:] = -1
    bare.plan_position[:] = 99
    with pytest.raises(InputError, match="on an edge of its plan"):
        train_phasenet(bare, _small(), _config("phasenet"), tmp_path)
    with pytest.raises(InputError, match="no drive for learning has a behaviour"):
        train_behavrnn(bare, _small(), _config("behavrnn"), tmp_path)


def test_unlabelled_steps_cost_nothing(data):
    small = _small()
    model = BehavRNN(small.behavrnn).eval()
    task = BehavRNNTask(model, data, split_frames(data), _config("behavrnn"))
    batch = task._batch(np.array([0, 1]), task._first[:2], np.zeros(2, bool))
    target = batch.target.clone()
    target[3:] = -1
    with torch.no_grad():
        some = task.loss(model, dataclasses.replace(batch, target=target))
        logits = model(batch.frames, batch.is_there, batch.plans)[:3]
        expected = torch.nn.functional.cross_entropy(logits.flatten(0, 1), target[:3].flatten())
        nothing = task.loss(model, dataclasses.replace(batch, target=torch.full_like(target, -1)))
    torch.testing.assert_close(some, expected)
    assert nothing == 0.0
