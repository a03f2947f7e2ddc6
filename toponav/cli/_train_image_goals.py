"""`toponav train il`, `target_rl` and `metric_rl`: the learned baselines of image goals."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from toponav.cli._training import AS_PRESET, Schedule, print_results, shown
from toponav.core.errors import InputError
from toponav.models.baselines.image_goal_presets import (
    ImageGoalKind,
    ImageGoalPresetName,
    image_goal_preset,
)
from toponav.training.config import default_config

__all__ = ["il", "metric_rl", "target_rl"]

_KINDS = {"rgb": (False,), "rgbd": (True,), "both": (True, False)}


@dataclass(frozen=True)
class ReinforcementFlags:
    """What may be changed of how a preset is trained."""

    frames: int | None = None
    """Frames to learn from; the preset's number when left out. With a larger one, training that
    had ended goes on."""
    robots: int | None = None
    """Robots that are simulated at a time."""
    learning_rate: float | None = None
    """Learning rate; the preset's when left out."""
    curriculum_frames: int | None = None
    """Frames over which goals come to be as far as in the end."""
    validation_episodes: int | None = None
    """Episodes of homes-val of each difficulty that are run now and then."""
    seed: int = 0
    """Same seed, frames, precision and threads, same weights."""
    precision: Literal["float32", "bfloat16"] | None = None
    """Number format in which pictures are looked at: bfloat16 is quicker on some processors."""
    threads: int = 1
    """CPU threads of the policy's updates."""
    workers: int = 2
    """Processes that simulate; 0 simulates in this one. Results do not depend on it."""
    max_minutes: float | None = None
    """End after the last checkpoint that fits; the same command goes on from there."""


_Reinforcement = Annotated[ReinforcementFlags, tyro.conf.OmitArgPrefixes]
_AS_PRESET = ReinforcementFlags()


def il(
    *,
    data: tuple[Path, ...],
    out: Path,
    held_out: tuple[Path, ...] = (),
    preset: ImageGoalPresetName = "compact",
    modality: Literal["rgb", "rgbd", "both"] = "rgbd",
    eyes: str = "nts",
    validation_episodes: int = 0,
    schedule: Schedule = AS_PRESET,
    json: bool = False,
) -> int:
    """Train ResNet + GRU + IL: behavioural cloning of the shortest path's actions.

    Killed or interrupted, the same command goes on after the last whole epoch. For DAgger, collect
    again with `--learner`, and give all folders.

    Example: toponav train il --data runs/drives --held-out runs/drives-val --out runs/il

    Args:
        data: Folders that `toponav collect imitation` wrote; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from.
        held_out: The same of other homes, to choose the best epoch on.
        preset: Sizes of the network.
        modality: Colour, colour and depth, or one network for each.
        eyes: Weights of Neural Topological SLAM that compact networks see with.
        validation_episodes: Episodes of homes-val of each difficulty to run after each epoch.
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.training.image_goals.imitation_recipe import train_imitation

    kinds = _KINDS[modality]
    config = schedule.applied(default_config(preset, "il"), len(kinds))
    results = []
    with shown(json) as report:
        for depth in kinds:
            sizes = image_goal_preset("il", preset, depth=depth)
            results.append(
                train_imitation(
                    list(data),
                    list(held_out),
                    sizes,
                    preset,
                    config,
                    out,
                    closed_loop_episodes=validation_episodes,
                    eyes=eyes,
                    report=report,
                )
            )
    return print_results(results, out, json)


def target_rl(
    *,
    out: Path,
    preset: ImageGoalPresetName = "compact",
    modality: Literal["rgb", "rgbd", "both"] = "rgbd",
    homes_folder: Path | None = None,
    eyes: str = "nts",
    flags: _Reinforcement = _AS_PRESET,
    json: bool = False,
) -> int:
    """Train target-driven RL: a siamese network by proximal policy optimization.

    Killed or interrupted, the same command goes on from the last checkpoint. Needs the extra
    `rl`: pip install 'toponav[rl]'.

    Example: toponav train target_rl --out runs/target_rl --frames 1000000

    Args:
        out: Folder for weights, learning curve, TensorBoard's events and the state to resume from.
        preset: Sizes of the network, and the number of frames: a million, or the paper's 25.
        modality: Colour, colour and depth, or one network for each.
        homes_folder: Keep the homes here, so that another run need not make them again.
        eyes: Weights of Neural Topological SLAM that compact networks see with.
        flags: How long and how fast.
        json: Print results as JSON.
    """
    return _reinforce("target_rl", out, preset, modality, homes_folder, eyes, flags, json)


def metric_rl(
    *,
    out: Path,
    preset: ImageGoalPresetName = "compact",
    homes_folder: Path | None = None,
    eyes: str = "nts",
    flags: _Reinforcement = _AS_PRESET,
    json: bool = False,
) -> int:
    """Train metric map + RL: a recurrent policy that sees a map projected from depth.

    Killed or interrupted, the same command goes on from the last checkpoint. Needs the extra
    `rl`: pip install 'toponav[rl]'.

    Example: toponav train metric_rl --out runs/metric_rl --max-minutes 60

    Args:
        out: Folder for weights, learning curve, TensorBoard's events and the state to resume from.
        preset: Sizes of the network, and the number of frames: a million, or the paper's 25.
        homes_folder: Keep the homes here, so that another run need not make them again.
        eyes: Weights of Neural Topological SLAM that compact networks see with.
        flags: How long and how fast.
        json: Print results as JSON.
    """
    return _reinforce("metric_rl", out, preset, "rgbd", homes_folder, eyes, flags, json)


def _reinforce(
    kind: ImageGoalKind,
    out: Path,
    preset: ImageGoalPresetName,
    modality: str,
    homes_folder: Path | None,
    eyes: str,
    flags: ReinforcementFlags,
    json: bool,
) -> int:
    from toponav.training.image_goals.reinforcement_config import reinforcement_config

    kinds = _KINDS[modality]
    changes: dict[str, Any] = asdict(flags)
    if flags.max_minutes is not None:
        changes["max_minutes"] = flags.max_minutes / len(kinds)
    config = reinforcement_config(preset).with_changes(**changes)
    try:
        from toponav.training.image_goals.reinforcement import train_reinforcement
    except ImportError as error:
        raise InputError(
            f"the package {error.name} is not installed",
            where=f"toponav train {kind}",
            remedy="pip install 'toponav[rl]'",
        ) from None
    results = []
    with shown(json) as report:
        for depth in kinds:
            sizes = image_goal_preset(kind, preset, depth=depth)
            results.append(
                train_reinforcement(
                    sizes, preset, config, out, homes=homes_folder, eyes=eyes, report=report
                )
            )
    return print_results(results, out, json)
