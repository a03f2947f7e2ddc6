"""Recipes: behaviour networks, graph localization and the baselines, from a training set."""

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch

import toponav
from toponav.core.vocabulary import Behavior
from toponav.data.dataset import environment
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.presets import BaselinePreset
from toponav.models.checkpoints import write_atomically
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import Preset
from toponav.training.behavior_task import BehaviorTask
from toponav.training.behavrnn_task import BehavRNNTask
from toponav.training.config import TrainingConfig
from toponav.training.localization_task import LocalizationTask
from toponav.training.loop import Report, TrainingResult, train
from toponav.training.phasenet_task import PhaseNetTask
from toponav.training.samples import TrainingData, check_image, split_frames

__all__ = [
    "data_digest",
    "run_metadata",
    "train_behaviors",
    "train_behavrnn",
    "train_localization",
    "train_phasenet",
    "write_run",
]


def train_behaviors(
    data: TrainingData,
    preset: Preset,
    config: TrainingConfig,
    out: Path,
    *,
    behaviors: Sequence[Behavior] = tuple(Behavior),
    report: Report | None = None,
) -> list[TrainingResult]:
    """Train one network for each behaviour, one after the other.

    With `max_minutes`, each network gets its share of the time that is left.

    Args:
        data: Frames tagged with behaviours and the expert's commands.
        preset: Networks to train.
        config: How to train each.
        out: Folder for `behavior_<name>.safetensors`.
        behaviors: Which ones.
        report: Told about progress.

    Raises:
        InputError: The data does not fit the preset, lacks a behaviour, or the folder holds
            another run.
    """
    check_image(data, preset.image, preset.name)
    split = split_frames(data)
    digest = data_digest(data)
    metadata = run_metadata(preset.name, digest, split.val_buildings)
    write_run(out, "behaviors", config, metadata)
    began = time.monotonic()
    results = []
    for number, behavior in enumerate(behaviors):
        own = config
        if config.max_minutes is not None:
            left = config.max_minutes - (time.monotonic() - began) / 60
            share = max(left / (len(behaviors) - number), 0.01)
            own = config.with_changes(max_minutes=share)
        torch.manual_seed(config.seed)
        model = BehaviorNetwork(preset.behavior(behavior))
        task = BehaviorTask(model, data, split, own)
        results.append(train(task, own, out, data_hash=digest, metadata=metadata, report=report))
    return results


def train_localization(
    data: TrainingData,
    preset: Preset,
    config: TrainingConfig,
    out: Path,
    *,
    report: Report | None = None,
) -> TrainingResult:
    """Train the graph localization network.

    Args:
        data: Frames labelled with edges, and the maps and plans they were driven with.
        preset: Network to train.
        config: How to train.
        out: Folder for `localization.safetensors`.
        report: Told about progress.

    Raises:
        InputError: The data does not fit the preset, has no edges, or the folder holds another
            run.
    """
    check_image(data, preset.image, preset.name)
    split = split_frames(data)
    digest = data_digest(data)
    metadata = run_metadata(preset.name, digest, split.val_buildings)
    write_run(out, "localization", config, metadata)
    torch.manual_seed(config.seed)
    model = LocalizationNetwork(preset.localization)
    task = LocalizationTask(model, data, split, config)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def train_phasenet(
    data: TrainingData,
    preset: BaselinePreset,
    config: TrainingConfig,
    out: Path,
    *,
    report: Report | None = None,
) -> TrainingResult:
    """Train PhaseNet on the progress of each plan edge that was driven.

    Args:
        data: Frames with how far in its plan the robot was.
        preset: Network to train.
        config: How to train.
        out: Folder for `phasenet.safetensors`.
        report: Told about progress.

    Raises:
        InputError: The data does not fit the preset, or the folder holds another run.
    """
    check_image(data, preset.image, preset.name)
    split = split_frames(data)
    digest = data_digest(data)
    metadata = run_metadata(preset.name, digest, split.val_buildings)
    write_run(out, "phasenet", config, metadata)
    torch.manual_seed(config.seed)
    task = PhaseNetTask(PhaseNet(preset.phasenet), data, split, config)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def train_behavrnn(
    data: TrainingData,
    preset: BaselinePreset,
    config: TrainingConfig,
    out: Path,
    *,
    report: Report | None = None,
) -> TrainingResult:
    """Train BehavRNN on whole drives and the behaviours that their plans ask for.

    Args:
        data: Frames tagged with behaviours, and the plans they were driven with.
        preset: Network to train.
        config: How to train.
        out: Folder for `behavrnn.safetensors`.
        report: Told about progress.

    Raises:
        InputError: The data does not fit the preset, has no behaviours, or the folder holds
            another run.
    """
    check_image(data, preset.image, preset.name)
    split = split_frames(data)
    digest = data_digest(data)
    metadata = run_metadata(preset.name, digest, split.val_buildings)
    write_run(out, "behavrnn", config, metadata)
    torch.manual_seed(config.seed)
    task = BehavRNNTask(BehavRNN(preset.behavrnn), data, split, config)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def data_digest(data: TrainingData) -> str:
    """A digest of the labels and of some frames: enough to tell two training sets apart."""
    digest = hashlib.sha256()
    for array in (data.command, data.behavior, data.edge, data.trajectory):
        digest.update(np.ascontiguousarray(array).tobytes())
    frames = np.asarray(data.frames)
    some = np.linspace(0, len(frames) - 1, min(64, len(frames))).astype(np.int64)
    digest.update(repr(frames.shape).encode())
    digest.update(np.ascontiguousarray(frames[some]).tobytes())
    return digest.hexdigest()


def run_metadata(preset: str, digest: str, val_buildings: tuple[str, ...]) -> dict[str, Any]:
    """What a checkpoint remembers of its training beside its configuration."""
    return {
        "preset": preset,
        "data_sha256": digest,
        "environment": environment(),
        "validation_buildings": list(val_buildings),
    }


def write_run(out: Path, recipe: str, config: TrainingConfig, metadata: dict[str, Any]) -> None:
    """Write `run_<recipe>.json`: the resolved configuration, the data and the versions."""
    document = {
        "recipe": recipe,
        "config": asdict(config),
        "versions": {"toponav": toponav.__version__, "torch": torch.__version__},
        **metadata,
    }
    out.mkdir(parents=True, exist_ok=True)
    write_atomically(out / f"run_{recipe}.json", json.dumps(document, indent=1).encode())
