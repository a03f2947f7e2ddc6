"""What the training commands share: opening caches, showing progress, printing results."""

import json as json_module
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.training.config import TrainingConfig
    from toponav.training.loop import Report, TrainingResult
    from toponav.training.samples import TrainingData

__all__ = ["AS_PRESET", "Schedule", "ScheduleFlags", "open_training_set", "print_results", "shown"]


@dataclass(frozen=True)
class ScheduleFlags:
    """What may be changed of how a preset is trained."""

    epochs: int | None = None
    """Epochs a network; the preset's number when left out."""
    batch_size: int | None = None
    """Samples a step; the preset's number when left out."""
    learning_rate: float | None = None
    """Highest learning rate; the preset's when left out."""
    seed: int = 0
    """Same seed, data and threads, same weights."""
    threads: int = 1
    """CPU threads to use."""
    max_minutes: float | None = None
    """Train fewer epochs where they would take longer in all."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """Number format; `auto` times both."""

    def applied(self, config: "TrainingConfig", networks: int = 1) -> "TrainingConfig":
        """A preset's configuration with these changes, for one of several networks."""
        minutes = None if self.max_minutes is None else self.max_minutes / networks
        return config.with_changes(**{**asdict(self), "max_minutes": minutes})


Schedule = Annotated[ScheduleFlags, tyro.conf.OmitArgPrefixes]
"""The same flags of every training command."""

AS_PRESET = ScheduleFlags()
"""No changes."""


def open_training_set(directories: Sequence[Path]) -> "TrainingData":
    """The caches as one training set.

    Raises:
        InputError: A folder is not there, or is no cache.
    """
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


def shown(quiet: bool) -> "AbstractContextManager[Report | None]":
    """Progress bars while training, or nothing where a program reads the output."""
    return nullcontext() if quiet else _Bar()


def print_results(results: "Sequence[TrainingResult]", out: Path, as_json: bool) -> int:
    """Print what training came to; exit status 0."""
    from rich.console import Console
    from rich.table import Table

    if as_json:
        records = [asdict(result) | {"checkpoint": str(result.checkpoint)} for result in results]
        print(json_module.dumps(records, indent=1))
        return 0
    table = Table("network", "epochs", "best", "validation", "minutes", "format")
    for result in results:
        names = ("val_loss", "accuracy", "true_crop_accuracy", "wrong_side", "replay_accuracy")
        validation = "  ".join(
            f"{key} {result.metrics[key]:.3f}" for key in names if key in result.metrics
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
