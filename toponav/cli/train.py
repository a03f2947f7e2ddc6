"""`toponav train`: networks from a recorded dataset."""

import json as json_module
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import tyro

from toponav.cli._train_baselines import behavrnn, phasenet
from toponav.cli._train_best import best, judge
from toponav.cli._train_image_goals import il, metric_rl, target_rl
from toponav.cli._train_nts import nts
from toponav.cli._training import AS_PRESET, Schedule, open_training_set, print_results, shown
from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.presets import PresetName, get_preset
from toponav.training.config import Recipe, TrainingConfig, default_config

__all__ = ["register"]


def register() -> dict[tuple[str, ...], Callable[..., int]]:
    """The commands of this module by their words."""
    return {
        ("train", "behaviors"): behaviors,
        ("train", "localization"): localization,
        ("train", "phasenet"): phasenet,
        ("train", "behavrnn"): behavrnn,
        ("train", "best"): best,
        ("train", "judge"): judge,
        ("train", "nts"): nts,
        ("train", "il"): il,
        ("train", "target_rl"): target_rl,
        ("train", "metric_rl"): metric_rl,
        ("train", "all"): everything,
        ("train", "release"): release,
    }


def behaviors(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    behavior: Annotated[tuple[Behavior, ...], tyro.conf.EnumChoicesFromValues] = (),
    schedule: Schedule = AS_PRESET,
    json: bool = False,
) -> int:
    """Train the behaviour networks: all five, or those named.

    Killed or interrupted, the same command goes on after the last whole epoch.

    Example: toponav train behaviors --data runs/cache --out runs/weights --threads 2

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from.
        preset: Sizes of the networks.
        behavior: Behaviours to train; all when left out.
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_behaviors

    config = schedule.applied(default_config(preset, "behaviors"))
    training_set = open_training_set(data)
    with shown(json) as report:
        results = train_behaviors(
            training_set,
            get_preset(preset),
            config,
            out,
            behaviors=behavior or tuple(Behavior),
            report=report,
        )
    return print_results(results, out, json)


def localization(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    schedule: Schedule = AS_PRESET,
    json: bool = False,
) -> int:
    """Train the graph localization network.

    Killed or interrupted, the same command goes on after the last whole epoch.

    Example: toponav train localization --data runs/cache --out runs/weights --max-minutes 20

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from.
        preset: Sizes of the network.
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_localization

    config = schedule.applied(default_config(preset, "localization"))
    training_set = open_training_set(data)
    with shown(json) as report:
        result = train_localization(training_set, get_preset(preset), config, out, report=report)
    return print_results([result], out, json)


def release(run: Path, /, *, out: Path, json: bool = False) -> int:
    """Store the networks of a run in half precision, as they ship.

    Example: toponav train release runs/weights --out runs/released

    Args:
        run: Folder that `toponav train` wrote.
        out: Folder of the released weights; `--weights` takes it.
        json: Print sizes as JSON.
    """
    from toponav.training.release import release_weights

    released = release_weights(run, out)
    if json:
        print(json_module.dumps(released))
    else:
        print(f"{released['bytes'] / 1e6:.1f} MB in {out}")
    return 0


def everything(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    seed: int = 0,
    threads: int = 1,
    max_minutes: float | None = None,
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
    baselines: bool = True,
    json: bool = False,
) -> int:
    """Train the behaviour networks, localization and the baselines: what `--weights` takes.

    Example: toponav train all --data runs/cache --out runs/weights --max-minutes 40

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from.
        preset: Sizes of the networks.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Time in all: three tenths for the behaviours and for localization each,
            two for each baseline; half and half without baselines.
        precision: Number format; `auto` times both.
        baselines: Whether to train PhaseNet and BehavRNN too, which GraphNav does not need.
        json: Print results as JSON.
    """
    from toponav.models.baselines.presets import get_baseline_preset
    from toponav.training import recipes

    def config(recipe: Recipe, share: float) -> TrainingConfig:
        minutes = None if max_minutes is None else max_minutes * share
        return default_config(preset, recipe).with_changes(
            seed=seed, threads=threads, max_minutes=minutes, precision=precision
        )

    training_set = open_training_set(data)
    networks, others = get_preset(preset), get_baseline_preset(preset)
    share = 0.3 if baselines else 0.5
    with shown(json) as report:
        results = recipes.train_behaviors(
            training_set, networks, config("behaviors", share), out, report=report
        )
        own = config("localization", share)
        results.append(recipes.train_localization(training_set, networks, own, out, report=report))
        if baselines:
            own = config("phasenet", 0.2)
            results.append(recipes.train_phasenet(training_set, others, own, out, report=report))
            own = config("behavrnn", 0.2)
            results.append(recipes.train_behavrnn(training_set, others, own, out, report=report))
    return print_results(results, out, json)
