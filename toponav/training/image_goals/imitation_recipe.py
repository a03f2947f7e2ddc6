"""From folders of demonstrations to the weights of the ResNet + GRU + IL baseline."""

import hashlib
from dataclasses import asdict
from pathlib import Path

import torch

from toponav.core.errors import InputError
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.models.baselines.image_goal_weights import digest_of_weights, open_eyes
from toponav.training.config import TrainingConfig
from toponav.training.image_goals.closed_loop import ClosedLoop
from toponav.training.image_goals.demonstrations import (
    HomeDrives,
    digest_of,
    open_demonstrations,
)
from toponav.training.image_goals.imitation_task import ImitationTask
from toponav.training.loop import Report, TrainingResult, train
from toponav.training.precision import Precision
from toponav.training.recipes import run_metadata, write_run

__all__ = ["train_imitation"]


def train_imitation(
    data: list[Path],
    held_out: list[Path],
    sizes: ImageGoalConfig,
    preset: str,
    config: TrainingConfig,
    out: Path,
    *,
    closed_loop_episodes: int = 0,
    eyes: str | Path = "nts",
    report: Report | None = None,
) -> TrainingResult:
    """Train one policy to do as the expert does.

    Args:
        data: What `toponav collect imitation` wrote; rounds of DAgger beside it.
        held_out: The same of other homes, to validate on.
        sizes: The network.
        preset: Name of its sizes.
        config: How to train.
        out: Folder for the weights.
        closed_loop_episodes: Episodes of homes-val of each difficulty to run after every epoch.
        eyes: Weights of Neural Topological SLAM that a compact policy sees with.
        report: Told about progress.

    Raises:
        InputError: The folder holds another run, or there are no demonstrations.
    """
    torch.manual_seed(config.seed)
    closed_loop = ClosedLoop(sizes, closed_loop_episodes) if closed_loop_episodes else None
    homes = open_demonstrations(data)
    others = open_demonstrations(held_out) if held_out else []
    for home in (*homes, *others):
        _check(home, sizes)
    network = open_eyes(ImageGoalNetwork(sizes), eyes)
    # Looking is done once; for training itself the loop times both formats.
    looking: Precision = "float32" if config.precision == "float32" else "bfloat16"
    task = ImitationTask(network, homes, others, config, closed_loop, looking)
    digest = digest_of([*data, *held_out])
    if network.sight is not None:
        digest = hashlib.sha256(
            f"{digest} {digest_of_weights(network.sight)}".encode()
        ).hexdigest()
    metadata = run_metadata(preset, digest, tuple(home.name for home in others))
    metadata |= {"frames": task.frames, "drives": task.samples, "network": asdict(sizes)}
    write_run(out, task.name, config, metadata)
    return train(task, config, out, data_hash=digest, metadata=metadata, report=report)


def _check(home: HomeDrives, sizes: ImageGoalConfig) -> None:
    channels, rows, cols = home.image.shape[1:]
    if channels < sizes.channels or (rows, cols) != (sizes.rows, sizes.cols):
        raise InputError(
            f"the drives show {channels} channels of {rows}x{cols} pixels, and {sizes.name} sees "
            f"{sizes.channels} of {sizes.rows}x{sizes.cols}",
            where=f"--data {home.name}",
            remedy="collect with the --modality and --preset of the network to train",
        )
