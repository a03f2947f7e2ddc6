"""`toponav train phasenet` and `toponav train behavrnn`: what GraphNav is compared with."""

from pathlib import Path
from typing import Literal

from toponav.cli._training import open_training_set, print_results, shown
from toponav.models.baselines.presets import get_baseline_preset
from toponav.models.graphnav.presets import PresetName
from toponav.training.config import default_config

__all__ = ["behavrnn", "phasenet"]


def phasenet(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    epochs: int | None = None,
    batch_size: int | None = None,
    learning_rate: float | None = None,
    seed: int = 0,
    threads: int = 1,
    max_minutes: float | None = None,
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
    json: bool = False,
) -> int:
    """Train PhaseNet, which predicts how much of the present behaviour is done.

    Killed or interrupted, the same command goes on after the last whole epoch.

    Example: toponav train phasenet --data runs/cache --out runs/weights --max-minutes 12

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from; best the one that holds
            the behaviour networks, which the agent drives with.
        preset: Sizes of the network.
        epochs: Epochs; the preset's number when left out.
        batch_size: Plan edges a step; the preset's number when left out.
        learning_rate: Highest learning rate; the preset's when left out.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Train fewer epochs where they would take longer.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_phasenet

    config = default_config(preset, "phasenet").with_changes(
        epochs=epochs,
        batch_size=batch_size,
        learning_rate=learning_rate,
        seed=seed,
        threads=threads,
        max_minutes=max_minutes,
        precision=precision,
    )
    training_set = open_training_set(data)
    with shown(json) as report:
        result = train_phasenet(
            training_set, get_baseline_preset(preset), config, out, report=report
        )
    return print_results([result], out, json)


def behavrnn(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    epochs: int | None = None,
    batch_size: int | None = None,
    learning_rate: float | None = None,
    seed: int = 0,
    threads: int = 1,
    max_minutes: float | None = None,
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
    json: bool = False,
) -> int:
    """Train BehavRNN, which names the behaviour to execute from the plan and the images.

    Killed or interrupted, the same command goes on after the last whole epoch.

    Example: toponav train behavrnn --data runs/cache --out runs/weights --max-minutes 12

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from; best the one that holds
            the behaviour networks, which the agent drives with.
        preset: Sizes of the network.
        epochs: Epochs; the preset's number when left out.
        batch_size: Drives a step; the preset's number when left out.
        learning_rate: Highest learning rate; the preset's when left out.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Train fewer epochs where they would take longer.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_behavrnn

    config = default_config(preset, "behavrnn").with_changes(
        epochs=epochs,
        batch_size=batch_size,
        learning_rate=learning_rate,
        seed=seed,
        threads=threads,
        max_minutes=max_minutes,
        precision=precision,
    )
    training_set = open_training_set(data)
    with shown(json) as report:
        result = train_behavrnn(
            training_set, get_baseline_preset(preset), config, out, report=report
        )
    return print_results([result], out, json)
