"""`toponav train phasenet` and `toponav train behavrnn`: what GraphNav is compared with."""

from pathlib import Path

from toponav.cli._training import AS_PRESET, Schedule, open_training_set, print_results, shown
from toponav.models.baselines.presets import get_baseline_preset
from toponav.models.graphnav.presets import PresetName
from toponav.training.config import default_config

__all__ = ["behavrnn", "phasenet"]


def phasenet(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    schedule: Schedule = AS_PRESET,
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
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_phasenet

    config = schedule.applied(default_config(preset, "phasenet"))
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
    schedule: Schedule = AS_PRESET,
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
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_behavrnn

    config = schedule.applied(default_config(preset, "behavrnn"))
    training_set = open_training_set(data)
    with shown(json) as report:
        result = train_behavrnn(
            training_set, get_baseline_preset(preset), config, out, report=report
        )
    return print_results([result], out, json)
