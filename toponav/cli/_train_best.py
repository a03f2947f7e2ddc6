"""`toponav train best`: the pose and the steering network of preset `best`."""

from pathlib import Path

from toponav.cli._training import AS_PRESET, Schedule, print_results, shown
from toponav.core.errors import InputError
from toponav.training.config import default_config

__all__ = ["best", "judge"]


def best(
    *,
    data: tuple[Path, ...],
    out: Path,
    pose: Path | None = None,
    schedule: Schedule = AS_PRESET,
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
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.models.checkpoints import checkpoint_metadata, load_checkpoint, save_checkpoint
    from toponav.models.graphnav.metric.presets import best_preset
    from toponav.training.metric_recipe import open_metric_data, train_pose, train_steering

    _check(data)
    config = schedule.applied(default_config("best", "pose"))
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


def judge(
    *,
    data: tuple[Path, ...],
    start: Path,
    out: Path,
    drives: int = 500,
    schedule: Schedule = AS_PRESET,
    json: bool = False,
) -> int:
    """Teach preset `best`'s pose network to tell where the robot is not.

    Robots are searched for along the first seconds of recorded drives, from all over the room,
    with the network as it is; then it learns which of those hypotheses were near the truth.
    Offices with partitions are what it has most to learn from (`toponav scene generate office
    --partitions 0.65`).

    Example: toponav train judge --data runs/cache-best runs/cache-partitions
    --start runs/best --out runs/judge

    Args:
        data: Caches written by `toponav data prepare --preset best`.
        start: Folder of `toponav train best` with the pose network to go on from; its steering
            network is copied beside the new one.
        out: Folder for the network, metrics, hypotheses and the state to resume from.
        drives: Along how many drives of each cache robots are searched for.
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.models.graphnav.metric.presets import best_preset
    from toponav.training.metric_recipe import open_metric_data, train_judge

    _check(data)
    if drives < 1:
        raise InputError(
            f"drives must be 1 or more, got {drives}", where="--drives", remedy="leave it out"
        )
    config = schedule.applied(default_config("best", "judge"))
    preset = best_preset()
    sets = open_metric_data(data, preset)
    with shown(json) as report:
        result = train_judge(sets, preset, config, start, out, drives=drives, report=report)
    return print_results([result], out, json)


def _check(data: tuple[Path, ...]) -> None:
    for directory in data:
        if not directory.is_dir():
            raise InputError(
                "there is no such folder",
                where=f"--data {directory}",
                remedy="record with `toponav collect graphnav`, then run "
                "`toponav data prepare --preset best`",
            )
