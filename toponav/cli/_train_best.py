"""`toponav train best`: the pose and the steering network of preset `best`."""

from pathlib import Path
from typing import Literal

from toponav.cli._training import print_results, shown
from toponav.core.errors import InputError
from toponav.training.config import default_config

__all__ = ["best"]


def best(
    *,
    data: tuple[Path, ...],
    out: Path,
    pose: Path | None = None,
    epochs: int | None = None,
    batch_size: int | None = None,
    learning_rate: float | None = None,
    seed: int = 0,
    threads: int = 1,
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
    json: bool = False,
) -> int:
    """Train preset `best`: where the robot is in metres, and how it drives from there.

    First the pose network; then what robots with it would have believed along the recorded
    drives is replayed; then the steering network learns to drive from those beliefs. Killed or
    interrupted, the same command goes on after the last whole epoch.

    Example: toponav train best --data runs/cache-best --out runs/best --threads 2

    Args:
        data: Caches written by `toponav data prepare --preset best`; the folders also take the
            local maps, 8 kB a frame. Several are learned from as one.
        out: Folder for weights, metrics, beliefs and the state to resume from.
        pose: Take the pose network of this folder in place of training one.
        epochs: Epochs of each network; the preset's number when left out.
        batch_size: Samples a step; the preset's number when left out.
        learning_rate: Highest learning rate; the preset's when left out.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.models.checkpoints import checkpoint_metadata, load_checkpoint, save_checkpoint
    from toponav.models.graphnav.metric.presets import best_preset
    from toponav.training.metric_recipe import open_metric_data, train_pose, train_steering

    for directory in data:
        if not directory.is_dir():
            raise InputError(
                "there is no such folder",
                where=f"--data {directory}",
                remedy="record with `toponav collect graphnav`, then run "
                "`toponav data prepare --preset best`",
            )
    config = default_config("best", "pose").with_changes(
        epochs=epochs,
        batch_size=batch_size,
        learning_rate=learning_rate,
        seed=seed,
        threads=threads,
        precision=precision,
    )
    preset = best_preset()
    sets = open_metric_data(data, preset)
    results = []
    with shown(json) as report:
        if pose is None:
            results.append(train_pose(sets, preset, config, out, report=report))
        else:
            network = load_checkpoint(pose / "pose")
            metadata = checkpoint_metadata(pose / "pose")["metadata"]
            out.mkdir(parents=True, exist_ok=True)
            save_checkpoint(network, out / "pose", metadata)
        results.append(train_steering(sets, preset, config, out, report=report))
    return print_results(results, out, json)
