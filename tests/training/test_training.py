import dataclasses
import json
import multiprocessing
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.training.synthetic import SyntheticSet
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.checkpoints import checkpoint_metadata, load_checkpoint
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.presets import (
    Convolution,
    EncoderConfig,
    ImageSpec,
    VelocityHeadConfig,
    get_preset,
)
from toponav.training.config import TrainingConfig, default_config
from toponav.training.loop import learning_rate_at
from toponav.training.recipes import train_behaviors, train_localization

COMPACT = get_preset("compact")


IMAGE = ImageSpec(16, 48, "equal_angles")


def _data(**changes):
    return SyntheticSet(rows=IMAGE.rows, cols=IMAGE.cols, **changes)


def _small(preset=COMPACT):
    """The compact preset with thinner networks and smaller images, so that tests are quick."""
    encoder = EncoderConfig(
        (Convolution(8, (5, 5), 4), Convolution(16, (3, 3))), padded=True, features=32
    )
    network = {"encoder": encoder, "image": IMAGE, "frame_offsets": (2, 0)}
    return dataclasses.replace(
        preset,
        image=IMAGE,
        behaviors=tuple(dataclasses.replace(config, **network) for config in preset.behaviors),
        localization=dataclasses.replace(preset.localization, **network, hidden=(32,), width=32),
    )


def _config(**changes) -> TrainingConfig:
    config = default_config("compact", "behaviors").with_changes(
        epochs=4, samples_per_epoch=128, batch_size=32, precision="float32"
    )
    return config.with_changes(**changes)


def _weights(path):
    return {name: value.clone() for name, value in load_checkpoint(path).state_dict().items()}


def _same(first, second):
    assert first.keys() == second.keys()
    return all(torch.equal(first[name], second[name]) for name in first)


@pytest.fixture(scope="module")
def data():
    return _data()


def test_localization_learns_which_edge_it_sees(data, tmp_path):
    config = _config(epochs=8, samples_per_epoch=512)
    result = train_localization(data, _small(), config, tmp_path)
    assert result.metrics["accuracy"] > 0.8
    assert result.metrics["true_crop_accuracy"] > 0.8
    assert {"no_plan_accuracy", "turn_left_accuracy", "val_loss"} <= result.metrics.keys()
    metadata = checkpoint_metadata(result.checkpoint)["metadata"]
    assert metadata["preset"] == "compact"
    assert metadata["validation_buildings"]
    assert metadata["metrics"]["accuracy"] == result.metrics["accuracy"]
    run = json.loads((tmp_path / "run_localization.json").read_text())
    assert run["config"]["epochs"] == 8
    lines = (tmp_path / "localization" / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(line)["epoch"] for line in lines] == list(range(1, 9))
    assert (tmp_path / "localization" / "metrics.csv").read_text().startswith("epoch,")
    assert (tmp_path / "localization" / "curve.png").read_bytes().startswith(b"\x89PNG")


def test_behaviors_learn_which_way_to_turn(tmp_path):
    data = _data(frames_an_edge=60)
    config = _config(epochs=8, samples_per_epoch=1024, learning_rate=5e-3)
    results = train_behaviors(
        data, _small(), config, tmp_path, behaviors=[Behavior.TURN_LEFT, Behavior.FIND_DOOR]
    )
    assert [result.name for result in results] == ["behavior_turn_left", "behavior_find_door"]
    for result in results:
        assert result.metrics["wrong_side"] < 0.25
        assert result.metrics["turn_error_rad_s"] < 0.45
        network = load_checkpoint(result.checkpoint)
        assert isinstance(network, BehaviorNetwork)


def test_recurrent_networks_learn_from_sequences(data, tmp_path):
    small = _small()
    recurrent = dataclasses.replace(
        small,
        behaviors=tuple(
            dataclasses.replace(
                config,
                frame_offsets=(0,),
                recurrent_layers=2,
                recurrent_size=16,
                head=VelocityHeadConfig("regression"),
            )
            for config in small.behaviors
        ),
    )
    config = _config(epochs=3, sequence_steps=5, batch_size=16)
    (result,) = train_behaviors(data, recurrent, config, tmp_path, behaviors=[Behavior.TURN_RIGHT])
    history = json.loads((tmp_path / result.name / "state.json").read_text())["history"]
    assert history[-1]["loss"] < history[0]["loss"]


def test_seed_repeats_exactly_and_another_does_not(data, tmp_path):
    train_localization(data, _small(), _config(epochs=2), tmp_path / "a")
    train_localization(data, _small(), _config(epochs=2), tmp_path / "b")
    train_localization(data, _small(), _config(epochs=2, seed=1), tmp_path / "c")
    first = _weights(tmp_path / "a" / "localization")
    assert _same(first, _weights(tmp_path / "b" / "localization"))
    assert not _same(first, _weights(tmp_path / "c" / "localization"))


class _KilledError(Exception):
    pass


def _dies_at(step):
    def report(name, now, total, metrics):
        if now == step:
            raise _KilledError

    return report


def test_interrupted_training_ends_as_if_it_had_not_been(data, tmp_path):
    small, config = _small(), _config()
    train_localization(data, small, config, tmp_path / "whole")
    for step in (2, 6, 11):
        with pytest.raises(_KilledError):
            train_localization(data, small, config, tmp_path / "cut", report=_dies_at(step))
    result = train_localization(data, small, config, tmp_path / "cut")
    assert result.epochs == 4
    whole = _weights(tmp_path / "whole" / "localization")
    assert _same(whole, _weights(tmp_path / "cut" / "localization"))
    histories = [
        json.loads((tmp_path / name / "localization" / "state.json").read_text())["history"]
        for name in ("whole", "cut")
    ]
    for history in histories:
        for record in history:
            del record["seconds"]
    assert histories[0] == histories[1]
    before = (tmp_path / "cut" / "localization.safetensors").stat().st_mtime_ns
    train_localization(data, small, config, tmp_path / "cut")
    assert (tmp_path / "cut" / "localization.safetensors").stat().st_mtime_ns == before


def _train_until_killed(out: str) -> None:
    def slow(name, now, total, metrics):
        time.sleep(0.05)

    train_behaviors(
        _data(),
        _small(),
        _config(),
        Path(out),
        behaviors=[Behavior.TURN_LEFT],
        report=slow,
    )


@pytest.mark.slow
def test_kill_9_loses_no_finished_epoch(data, tmp_path):
    process = multiprocessing.get_context("spawn").Process(
        target=_train_until_killed, args=(str(tmp_path / "cut"),)
    )
    process.start()
    state = tmp_path / "cut" / "behavior_turn_left" / "state.json"
    deadline = time.monotonic() + 120
    while not state.is_file() and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert state.is_file()
    arguments = {"behaviors": [Behavior.TURN_LEFT]}
    train_behaviors(data, _small(), _config(), tmp_path / "cut", **arguments)
    train_behaviors(data, _small(), _config(), tmp_path / "whole", **arguments)
    assert _same(
        _weights(tmp_path / "cut" / "behavior_turn_left"),
        _weights(tmp_path / "whole" / "behavior_turn_left"),
    )


def test_another_run_is_not_resumed(data, tmp_path):
    train_localization(data, _small(), _config(epochs=1), tmp_path)
    with pytest.raises(InputError, match="another configuration"):
        train_localization(data, _small(), _config(epochs=2), tmp_path)
    with pytest.raises(InputError, match="another configuration"):
        train_localization(_data(seed=5), _small(), _config(epochs=1), tmp_path)


@pytest.mark.parametrize("damage", ["cut", "missing", "json"])
def test_damaged_state_is_named(data, tmp_path, damage):
    train_localization(data, _small(), _config(epochs=1), tmp_path)
    folder = tmp_path / "localization"
    (state,) = folder.glob("state-*.safetensors")
    if damage == "cut":
        state.write_bytes(state.read_bytes()[:200])
    elif damage == "missing":
        state.unlink()
    else:
        (folder / "state.json").write_text("[]")
    with pytest.raises(InputError, match="delete the folder to start again"):
        train_localization(data, _small(), _config(epochs=1), tmp_path)


def test_time_limit_stops_cleanly_and_keeps_the_best(data, tmp_path):
    config = _config(epochs=500, max_minutes=0.03)
    began = time.monotonic()
    result = train_localization(data, _small(), config, tmp_path)
    assert time.monotonic() - began < 20
    assert 1 <= result.epochs < 500
    history = json.loads((tmp_path / "localization" / "state.json").read_text())["history"]
    best = max(history, key=lambda record: record["score"])
    assert result.best_epoch == best["epoch"]
    load_checkpoint(result.checkpoint)


def test_loss_that_is_not_finite_stops_training(data, tmp_path, monkeypatch):
    from toponav.training.localization_task import LocalizationTask

    monkeypatch.setattr(LocalizationTask, "loss", lambda *_: torch.tensor(float("nan")))
    with pytest.raises(InputError, match="loss has to be finite, got nan"):
        train_localization(data, _small(), _config(), tmp_path)


def test_cache_of_another_size_is_refused(tmp_path):
    wrong = SyntheticSet(trajectories=2, frames_an_edge=1, rows=24, cols=80)
    with pytest.raises(InputError, match="32x96 pixels, these frames have 24x80"):
        train_localization(wrong, COMPACT, _config(), tmp_path)


def test_missing_labels_are_refused(data, tmp_path):
    bare = _data(trajectories=3, frames_an_edge=2)
    bare.edge[:] = -1
    bare.behavior[:] = -1
    with pytest.raises(InputError, match="no frame for learning has an edge"):
        train_localization(bare, _small(), _config(), tmp_path)
    with pytest.raises(InputError, match="is tagged corridor_follow"):
        train_behaviors(bare, _small(), _config(), tmp_path)


def test_learning_rate_rises_then_falls_to_zero():
    config = _config(learning_rate=0.01, warm_up=0.1)
    rates = [learning_rate_at(share, config) for share in np.linspace(0, 1, 101)]
    assert rates[0] < 0.001
    assert np.argmax(rates) == 10
    assert rates[-1] == pytest.approx(0.0)
    assert (np.diff(rates[10:]) < 0).all()
    constant = _config(schedule="constant", learning_rate=1e-4)
    assert learning_rate_at(0.0, constant) == learning_rate_at(1.0, constant) == 1e-4


def test_paper_is_trained_as_published():
    config = default_config("paper", "localization")
    assert (config.learning_rate, config.batch_size) == (1e-4, 32)
    assert (config.weight_decay, config.ema, config.mirror) == (0.0, 0.0, False)


def test_bad_numbers_are_refused():
    with pytest.raises(InputError, match="--batch-size"):
        _config(batch_size=1)
