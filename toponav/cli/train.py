"""`toponav train`: networks from a recorded dataset."""

import json as json_module
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.presets import PresetName, get_preset
from toponav.training.config import Recipe, TrainingConfig, default_config

if TYPE_CHECKING:
    from toponav.training.loop import Report, TrainingResult
    from toponav.training.samples import TrainingData

__all__ = ["register"]


def register() -> dict[tuple[str, ...], Callable[..., int]]:
    """The commands of this module by their words."""
    return {
        ("train", "behaviors"): behaviors,
        ("train", "localization"): localization,
        ("train", "all"): everything,
        ("train", "release"): release,
    }


def behaviors(
    *,
    data: tuple[Path, ...],
    out: Path,
    preset: PresetName = "compact",
    behavior: Annotated[tuple[Behavior, ...], tyro.conf.EnumChoicesFromValues] = (),
    epochs: int | None = None,
    batch_size: int | None = None,
    learning_rate: float | None = None,
    seed: int = 0,
    threads: int = 1,
    max_minutes: float | None = None,
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
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
        epochs: Epochs a network; the preset's number when left out.
        batch_size: Samples a step; the preset's number when left out.
        learning_rate: Highest learning rate; the preset's when left out.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Train fewer epochs where they would take longer in all.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_behaviors

    config = default_config(preset, "behaviors").with_changes(
        epochs=epochs,
        batch_size=batch_size,
        learning_rate=learning_rate,
        seed=seed,
        threads=threads,
        max_minutes=max_minutes,
        precision=precision,
    )
    training_set = _open(data)
    with _shown(json) as report:
        results = train_behaviors(
            training_set,
            get_preset(preset),
            config,
            out,
            behaviors=behavior or tuple(Behavior),
            report=report,
        )
    return _print(results, out, json)


def localization(
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
    """Train the graph localization network.

    Killed or interrupted, the same command goes on after the last whole epoch.

    Example: toponav train localization --data runs/cache --out runs/weights --max-minutes 20

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from.
        preset: Sizes of the network.
        epochs: Epochs; the preset's number when left out.
        batch_size: Samples a step; the preset's number when left out.
        learning_rate: Highest learning rate; the preset's when left out.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Train fewer epochs where they would take longer.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_localization

    config = default_config(preset, "localization").with_changes(
        epochs=epochs,
        batch_size=batch_size,
        learning_rate=learning_rate,
        seed=seed,
        threads=threads,
        max_minutes=max_minutes,
        precision=precision,
    )
    training_set = _open(data)
    with _shown(json) as report:
        result = train_localization(training_set, get_preset(preset), config, out, report=report)
    return _print([result], out, json)


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
    json: bool = False,
) -> int:
    """Train the five behaviour networks, then localization: a folder that `--weights` takes.

    Example: toponav train all --data runs/cache --out runs/weights --max-minutes 40

    Args:
        data: Caches written by `toponav data prepare`; several are learned from as one.
        out: Folder for weights, metrics and the state to resume from.
        preset: Sizes of the networks.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Time in all: half for the behaviours, half for localization.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.training.recipes import train_behaviors, train_localization

    half = None if max_minutes is None else max_minutes / 2

    def config(recipe: Recipe) -> TrainingConfig:
        return default_config(preset, recipe).with_changes(
            seed=seed, threads=threads, max_minutes=half, precision=precision
        )

    training_set = _open(data)
    networks = get_preset(preset)
    with _shown(json) as report:
        results = train_behaviors(training_set, networks, config("behaviors"), out, report=report)
        results.append(
            train_localization(training_set, networks, config("localization"), out, report=report)
        )
    return _print(results, out, json)


def _open(directories: Sequence[Path]) -> "TrainingData":
    from toponav.data.training_set import TrainingSet

    for directory in directories:
        if not directory.is_dir():
            raise InputError(
                "there is no such folder",
                where=f"--data {directory}",
                remedy="record with `toponav collect graphnav`, then run `toponav data prepare`",
            )
    return TrainingSet.open(directories)


class _Bar(AbstractContextManager["Report"]):
    """A progress bar for each network."""

    def __init__(self) -> None:
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        self._progress = Progress(
            TextColumn("{task.description:<26}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("loss {task.fields[loss]:.3f}"),
            TimeRemainingColumn(),
        )
        self._tasks: dict[str, Any] = {}

    def __enter__(self) -> "Report":
        self._progress.start()
        return self._report

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def _report(self, name: str, step: int, total: int, metrics: Any) -> None:
        if name not in self._tasks:
            self._tasks[name] = self._progress.add_task(name, total=total, loss=0.0)
        self._progress.update(self._tasks[name], completed=step, total=total, **metrics)


def _shown(quiet: bool) -> "AbstractContextManager[Report | None]":
    return nullcontext() if quiet else _Bar()


def _print(results: "Sequence[TrainingResult]", out: Path, as_json: bool) -> int:
    from rich.console import Console
    from rich.table import Table

    if as_json:
        records = [asdict(result) | {"checkpoint": str(result.checkpoint)} for result in results]
        print(json_module.dumps(records, indent=1))
        return 0
    table = Table("network", "epochs", "best", "validation", "minutes", "format")
    for result in results:
        shown = ("val_loss", "accuracy", "true_crop_accuracy", "wrong_side")
        validation = "  ".join(
            f"{key} {result.metrics[key]:.3f}" for key in shown if key in result.metrics
        )
        table.add_row(
            result.name,
            str(result.epochs),
            str(result.best_epoch),
            validation,
            f"{result.seconds / 60:.1f}",
            result.precision,
        )
    console = Console()
    console.print(table)
    console.print(
        f"weights are in {out}; drive with them: toponav eval graphnav --weights {out}",
        soft_wrap=True,
    )
    return 0
