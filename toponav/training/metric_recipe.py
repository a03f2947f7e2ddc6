"""Recipe of preset `best`: the pose network, beliefs replayed with it, the steering network."""

import hashlib
import io
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from toponav.core.arrays import read_npz
from toponav.core.errors import InputError
from toponav.core.files import write_atomically
from toponav.models.checkpoints import load_checkpoint
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.models.graphnav.metric.presets import BestPreset
from toponav.models.graphnav.metric.steering import SteeringNetwork
from toponav.training.belief_replay import ReplayedBeliefs, replay_beliefs
from toponav.training.config import TrainingConfig
from toponav.training.loop import Report, TrainingResult, train
from toponav.training.metric_data import MetricData
from toponav.training.place_samples import PlaceSamples, replay_hypotheses
from toponav.training.pose_task import PoseTask
from toponav.training.recipes import data_digest, run_metadata, write_run
from toponav.training.samples import check_image, split_frames
from toponav.training.steering_task import SteeringTask

__all__ = ["open_metric_data", "train_judge", "train_pose", "train_steering"]


def open_metric_data(directories: Sequence[Path], preset: BestPreset) -> list[MetricData]:
    """The caches with their local maps; makes those that are not there yet.

    Raises:
        InputError: A folder is no finished cache, or one of another preset.
    """
    sets = []
    for directory in directories:
        one = MetricData(directory, preset.pose.local_map, preset.pose.odometry)
        check_image(one.data, preset.image, preset.name)
        sets.append(one)
    return sets


def train_pose(
    sets: Sequence[MetricData],
    preset: BestPreset,
    config: TrainingConfig,
    out: Path,
    *,
    report: Report | None = None,
) -> TrainingResult:
    """Train the pose network; `out/pose.safetensors`.

    Raises:
        InputError: The data has no building to validate on, or the folder holds another run.
    """
    metadata, digest = _described(sets, preset)
    write_run(out, "pose", config, metadata)
    torch.manual_seed(config.seed)
    task = PoseTask(PoseNetwork(preset.pose), sets, config)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def train_judge(
    sets: Sequence[MetricData],
    preset: BestPreset,
    config: TrainingConfig,
    start: Path,
    out: Path,
    *,
    drives: int = 500,
    report: Report | None = None,
) -> TrainingResult:
    """Teach a trained pose network to judge hypotheses as well; `out/pose.safetensors`.

    The steering network of `start`, where there is one, is copied beside it.

    Args:
        sets: Recorded drives.
        preset: Sizes.
        config: How to train.
        start: Folder with the network to go on from, which also leads the search for robots.
        out: Folder for the network and its state.
        drives: How many drives of each set robots are searched for along.
        report: Told how far it is.

    Raises:
        InputError: There is no pose network, or the folder holds another run.
    """
    path = start / "pose.safetensors"
    before = _pose_network(path)
    metadata, digest = _described(sets, preset)
    metadata["from_sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    write_run(out, "pose", config, metadata)
    torch.set_num_threads(config.threads)
    places = []
    for number, one in enumerate(sets):

        def told(done: int, count: int, number: int = number) -> None:
            if report is not None:
                report(f"searches {number + 1} of {len(sets)}", done, count, {})

        key = f"{metadata['from_sha256']} {data_digest(one.data)} {drives} {config.seed}"
        path_of = out / f"places_{number}.npz"
        places.append(_places(one, before, path_of, key, drives, config.seed, told))
    torch.manual_seed(config.seed)
    for path in start.glob("steering.*"):
        if path.is_file() and not (out / path.name).exists():
            shutil.copyfile(path, out / path.name)
    task = PoseTask(_able_to_judge(before, preset), sets, config, places)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def train_steering(
    sets: Sequence[MetricData],
    preset: BestPreset,
    config: TrainingConfig,
    out: Path,
    *,
    report: Report | None = None,
) -> TrainingResult:
    """Replay what robots with `out/pose.safetensors` believed, and train the steering network.

    Raises:
        InputError: There is no pose network, or the folder holds another run.
    """
    metadata, digest = _described(sets, preset)
    pose_path = out / "pose.safetensors"
    network = _pose_network(pose_path)
    pose_sha256 = hashlib.sha256(pose_path.read_bytes()).hexdigest()
    metadata["pose_sha256"] = pose_sha256
    write_run(out, "steering", config, metadata)
    torch.set_num_threads(config.threads)
    beliefs = []
    for number, one in enumerate(sets):

        def told(done: int, drives: int, number: int = number) -> None:
            if report is not None:
                report(f"beliefs {number + 1} of {len(sets)}", done, drives, {})

        beliefs.append(_beliefs(one, network, out / f"beliefs_{number}.npz", pose_sha256, told))
    torch.manual_seed(config.seed)
    task = SteeringTask(SteeringNetwork(preset.steering), sets, beliefs, config)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def _pose_network(path: Path) -> PoseNetwork:
    network = load_checkpoint(path)
    if not isinstance(network, PoseNetwork):
        raise InputError(
            f"this is a network for {network.kind}, not for poses",
            where=str(path),
            remedy="give a folder that `toponav train best` wrote",
        )
    return network


def _able_to_judge(network: PoseNetwork, preset: BestPreset) -> PoseNetwork:
    """The same network with an output more."""
    able = PoseNetwork(replace(preset.pose, judges=True))
    weights = able.state_dict()
    for name, value in network.state_dict().items():
        if name.startswith("output."):
            weights[name][: len(value)] = value
        else:
            weights[name] = value
    able.load_state_dict(weights)
    return able


def _places(
    one: MetricData,
    network: PoseNetwork,
    path: Path,
    key: str,
    drives: int,
    seed: int,
    report: Any,
) -> PlaceSamples:
    """Read what an earlier run with the same network and data stored, or search."""

    def search() -> PlaceSamples:
        rng = np.random.default_rng(seed)
        chosen = np.sort(rng.permutation(one.data.trajectories)[:drives])
        return replay_hypotheses(one, network, rng, trajectories=chosen, on_progress=report)

    _store_once(path, key, search)
    wanted = {"row": ("<i8", (None,)), "pose": ("<f4", (None, 3)), "bounds_m": ("<f4", (None, 2))}
    return PlaceSamples(**read_npz(path, wanted, remedy=f"delete {path}"))


def _store_once(path: Path, key: str, make: Callable[[], PlaceSamples | ReplayedBeliefs]) -> None:
    """Make and store arrays, unless they are there, made with the same key."""
    stamp = path.with_suffix(".key")
    if path.is_file() and stamp.is_file() and stamp.read_text() == key:
        return
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **vars(make()))
    write_atomically(path, buffer.getvalue())
    write_atomically(stamp, key.encode())


def _described(sets: Sequence[MetricData], preset: BestPreset) -> tuple[dict[str, Any], str]:
    digests = [data_digest(one.data) for one in sets]
    digest = hashlib.sha256(" ".join(digests).encode()).hexdigest()
    buildings = sorted({name for one in sets for name in split_frames(one.data).val_buildings})
    return run_metadata(preset.name, digest, tuple(buildings)), digest


def _beliefs(
    one: MetricData, network: PoseNetwork, path: Path, pose_sha256: str, report: Any
) -> ReplayedBeliefs:
    """Read what an earlier run with the same network and data stored, or replay it."""
    key = hashlib.sha256((pose_sha256 + data_digest(one.data)).encode()).hexdigest()
    _store_once(path, key, lambda: replay_beliefs(one, network, on_progress=report))
    rows = len(one)
    wanted = {
        "pose": ("<f4", (rows, 3)),
        "std": ("<f4", (rows, 3)),
        "progress_m": ("<f4", (rows,)),
    }
    return ReplayedBeliefs(**read_npz(path, wanted, remedy=f"delete {path}"))
