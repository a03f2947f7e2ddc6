"""Training of Neural Topological SLAM on panoramas of two rooms."""

import json
import multiprocessing
import os
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.sim.two_rooms import two_rooms
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageGoal, PanoramaObservation
from toponav.data.nts import panoramas
from toponav.data.nts.panoramas import PanoramaConfig, collect_panoramas, open_panoramas
from toponav.models.checkpoints import load_checkpoint
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.presets import ROOM_KINDS, NTSConfig, get_nts_preset
from toponav.navigation.nts.agent import NTSAgent
from toponav.training.config import TrainingConfig, default_config
from toponav.training.nts_recipe import PanoramaSamples, open_samples, train_nts
from toponav.training.nts_task import HomeSamples, NTSTask

SIZES = NTSConfig(depth=True, width=4, features=16, matches=2, hidden=16, dropout=0.0)
HOMES, PANORAMAS = 3, 24


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A collection in which two rooms stand in for every home."""
    out = tmp_path_factory.mktemp("nts")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(panoramas, "suite_scene", lambda generator, seed: two_rooms())
        collect_panoramas(
            out, PanoramaConfig(homes=HOMES, panoramas=PANORAMAS, height=32, width=128)
        )
    return out


@pytest.fixture(scope="module")
def samples(folder: Path) -> PanoramaSamples:
    return open_samples(folder, SIZES)


def _config(**changes: object) -> TrainingConfig:
    config = default_config("compact", "nts").with_changes(
        epochs=3, samples_per_epoch=64, batch_size=16, precision="float32", learning_rate=5e-3
    )
    return config.with_changes(**changes)


def _task(samples: PanoramaSamples, **changes: object) -> NTSTask:
    torch.manual_seed(0)
    return NTSTask(NTSNetwork(SIZES), samples.homes, _config(**changes))


def test_panoramas_are_made_small_once(folder: Path, samples: PanoramaSamples) -> None:
    made = {path: path.stat().st_mtime_ns for path in folder.glob("*/small-*.npy")}
    assert len(made) == 3 * HOMES
    again = open_samples(folder, SIZES)
    assert {path: path.stat().st_mtime_ns for path in folder.glob("*/small-*.npy")} == made
    for one, other in zip(samples.homes, again.homes, strict=True):
        assert all((vars(one)[name] == vars(other)[name]).all() for name in vars(one))


def test_kinds_are_those_of_the_rooms(folder: Path, samples: PanoramaSamples) -> None:
    home = samples.homes[0]
    x_m = open_panoramas(folder)[0].poses[:, 0]
    living, bed = ROOM_KINDS.index("living_room"), ROOM_KINDS.index("bedroom")
    wanted = np.where(x_m < 4.9, living, np.where(x_m > 5.1, bed, home.kind))
    assert (home.kind == wanted).all()
    assert (home.toward[:, ROOM_KINDS.index("kitchen")] == -1).all()


def test_a_room_of_a_kind_is_scored_as_its_best_goal(samples: PanoramaSamples) -> None:
    home = samples.homes[0]
    bed = ROOM_KINDS.index("bedroom")
    for source in range(len(home)):
        goals = (home.kind == bed) & ~home.same_node[source]
        if goals.any():
            wanted = home.score[source, goals].max(axis=0)
            assert (home.toward[source, bed] == wanted).all()


def test_mirrored_batches_keep_their_labels(samples: PanoramaSamples) -> None:
    rng = np.random.default_rng(0)
    task = _task(samples)
    plain = task._batch(samples.homes, np.random.default_rng(1), mirror=False)
    seen = set()
    for _ in range(40):
        batch = task._batch(samples.homes, rng, mirror=True)
        ahead = batch.images[:, 3, 15:17].float().mean(1).roll(2, 1).unflatten(1, (36, 4)).mean(2)
        sight = torch.exp(-batch.sight_m.unflatten(1, (36, 2))[..., 0] / 4.0) * 255
        seen.add(round(float((ahead - sight).abs().median())))
    assert max(seen) < 30
    assert plain.any_score.shape == (len(plain.any_source), 12)


def test_pairs_stay_within_a_home(samples: PanoramaSamples) -> None:
    batch = next(iter(_task(samples, batch_size=32).batches(np.random.default_rng(0), 1)))
    assert ((batch.source // 16) == (batch.goal // 16)).all()
    assert ((batch.any_source // 16) == (batch.any_goal // 16)).all()
    assert (batch.any_source != batch.any_goal).all()
    assert len(batch.any_source) == 2 * 16 * 15


def test_perfect_scores_cost_less_than_any_other(samples: PanoramaSamples) -> None:
    from toponav.training.nts_task import _score_loss

    truth = torch.tensor([[0.5, 0.2, 0.1, 0.0]])
    usable = torch.tensor([[1.0, 1.0, 1.0, 0.0]])
    same = torch.zeros(1)
    best = _score_loss(truth.logit(eps=1e-6), truth, usable, same)
    swapped = _score_loss(truth[:, [1, 0, 2, 3]].logit(eps=1e-6), truth, usable, same)
    even = _score_loss(torch.full((1, 4), 0.27).logit(), truth, usable, same)
    elsewhere = _score_loss(
        truth.logit(eps=1e-6) + torch.tensor([0, 0, 0, 9.0]), truth, usable, same
    )
    assert best < even < swapped
    assert elsewhere == best


def test_loss_falls_and_the_checkpoint_is_the_best_epoch(
    samples: PanoramaSamples, tmp_path: Path
) -> None:
    result = train_nts(samples, SIZES, "compact", _config(epochs=6), tmp_path)
    history = json.loads((tmp_path / "nts_rgbd" / "state.json").read_text())["history"]
    assert history[-1]["loss"] < history[0]["loss"] - 0.3
    assert result.metrics["val_loss"] == min(record["val_loss"] for record in history)
    assert isinstance(load_checkpoint(tmp_path / "nts_rgbd"), NTSNetwork)


def test_colour_network_sees_no_depth(samples: PanoramaSamples) -> None:
    torch.manual_seed(0)
    task = NTSTask(NTSNetwork(replace(SIZES, depth=False)), samples.homes, _config())
    batch = next(iter(task.batches(np.random.default_rng(0), 1)))
    assert batch.images.shape[1] == 3
    assert torch.isfinite(task.loss(task.model, batch))


def _train_until_killed(homes: tuple[HomeSamples, ...], out: str) -> None:
    def slow(name: str, now: int, total: int, metrics: object) -> None:
        time.sleep(0.05)

    data = PanoramaSamples(homes, "digest", ("a", "b", "c"))
    train_nts(data, SIZES, "compact", _config(), Path(out), report=slow)


@pytest.mark.slow
def test_kill_9_loses_no_finished_epoch(samples: PanoramaSamples, tmp_path: Path) -> None:
    process = multiprocessing.get_context("spawn").Process(
        target=_train_until_killed, args=(samples.homes, str(tmp_path / "cut"))
    )
    process.start()
    state = tmp_path / "cut" / "nts_rgbd" / "state.json"
    deadline = time.monotonic() + 120
    while not state.is_file() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert json.loads(state.read_text())["epoch"] < 3
    data = PanoramaSamples(samples.homes, "digest", ("a", "b", "c"))
    weights = []
    for name in ("cut", "whole"):
        train_nts(data, SIZES, "compact", _config(), tmp_path / name)
        weights.append(load_checkpoint(tmp_path / name / "nts_rgbd").state_dict())
    assert all(torch.equal(weights[0][name], weights[1][name]) for name in weights[0])


@pytest.mark.slow
@pytest.mark.parametrize("depth", [False, True])
def test_paper_preset_trains_and_drives(folder: Path, tmp_path: Path, *, depth: bool) -> None:
    sizes = get_nts_preset("paper", depth=depth)
    data = open_samples(folder, sizes)
    config = default_config("paper", "nts").with_changes(
        epochs=1, samples_per_epoch=8, batch_size=4, precision="float32", most_validation_samples=4
    )
    result = train_nts(data, sizes, "paper", config, tmp_path)
    assert np.isfinite(result.metrics["val_loss"])
    agent = NTSAgent.from_weights(tmp_path, depth=depth)
    rng = np.random.default_rng(0)
    rgb = rng.integers(0, 256, (128, 512, 3), dtype=np.uint8)
    depth_m = np.full((128, 512), 2.0, np.float32) if depth else None
    agent.reset(ImageGoal(rgb, depth_m))
    action = agent.act(PanoramaObservation(rgb, depth_m, Pose2(0.0, 0.0, 0.0), False, 0))
    assert action in set(Action)
