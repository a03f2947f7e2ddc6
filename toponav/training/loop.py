"""One readable training loop for every network: optimize, average, validate, save, resume."""

import copy
import hashlib
import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

import toponav
from toponav.core.errors import InputError
from toponav.models.checkpoints import save_checkpoint
from toponav.training.config import TrainingConfig
from toponav.training.curves import draw_curves, write_metrics
from toponav.training.precision import Precision, autocast, quicker_precision
from toponav.training.state import Progress, restore_state, save_state
from toponav.training.task import Task

__all__ = ["Report", "TrainingResult", "learning_rate_at", "train"]

Report = Callable[[str, int, int, Mapping[str, int | float]], None]
"""Called after each step: network, step, steps in all, latest metrics."""


@dataclass(frozen=True)
class TrainingResult:
    """What training one network came to."""

    name: str
    checkpoint: Path
    metrics: dict[str, int | float]
    """Of the epoch that was kept."""
    epochs: int
    best_epoch: int
    seconds: float
    precision: str


def train(
    task: Task,
    config: TrainingConfig,
    out: Path,
    *,
    data_hash: str = "",
    metadata: Mapping[str, Any] | None = None,
    report: Report | None = None,
) -> TrainingResult:
    """Train one network and keep the best epoch's weights as `out/<name>.safetensors`.

    Validation, the metrics and the resumable state are written after every epoch, under
    `out/<name>/`. Run again with the same arguments, it goes on after the last whole epoch
    and ends with the same weights as an uninterrupted run; a finished run is left alone.

    Args:
        task: Network, samples, loss.
        config: How to train.
        out: Folder for the weights.
        data_hash: Identifies the data; part of what must agree to resume.
        metadata: Stored in the checkpoint.
        report: Told about progress.

    Raises:
        InputError: The folder holds another run, or the loss is no longer finite.
    """
    torch.set_num_threads(config.threads)
    return _Training(task, config, out, data_hash, dict(metadata or {}), report).run()


def learning_rate_at(progress: float, config: TrainingConfig) -> float:
    """The learning rate when this share of training is done."""
    if config.schedule == "constant":
        return config.learning_rate
    if progress < config.warm_up:
        return config.learning_rate * (0.05 + 0.95 * progress / config.warm_up)
    share = (progress - config.warm_up) / (1.0 - config.warm_up)
    return config.learning_rate * 0.5 * (1.0 + math.cos(math.pi * min(share, 1.0)))


class _Training:
    """State of one run."""

    def __init__(
        self,
        task: Task,
        config: TrainingConfig,
        out: Path,
        data_hash: str,
        metadata: dict[str, Any],
        report: Report | None,
    ) -> None:
        self.task, self.config, self.out, self.metadata = task, config, out, metadata
        self.report = report
        self.directory = out / task.name
        self.directory.mkdir(parents=True, exist_ok=True)
        per_epoch = min(config.samples_per_epoch, task.samples * config.most_repeats)
        self.steps = max(1, per_epoch // config.batch_size)
        self.model: nn.Module = task.model
        self.shadow = copy.deepcopy(self.model) if config.ema else self.model
        self.optimizer = torch.optim.AdamW(
            self.model.parameters(),
            lr=config.learning_rate,
            weight_decay=config.weight_decay,
            fused=True,
        )
        self.fingerprint = self._fingerprint(data_hash)
        self.progress = self._start_or_resume()
        self.began = time.monotonic() - self.progress.elapsed_s
        self._plan_by_time()

    def run(self) -> TrainingResult:
        """Train until the planned epochs are done or time is up."""
        progress = self.progress
        while progress.epoch < progress.planned_epochs:
            began = time.monotonic()
            loss, is_whole = self._epoch()
            if not is_whole and progress.epoch:
                # Time is up: the epochs before stand; this one is left for another run.
                break
            progress.epoch += 1
            self._finish_epoch(loss, time.monotonic() - began)
            if not is_whole:
                break
        if progress.history:
            draw_curves(self.directory, progress.history, self.task.name)
        best = progress.history[progress.best_epoch - 1]
        return TrainingResult(
            name=self.task.name,
            checkpoint=self.out / f"{self.task.name}.safetensors",
            metrics=best,
            epochs=progress.epoch,
            best_epoch=progress.best_epoch,
            seconds=progress.elapsed_s,
            precision=progress.precision,
        )

    def _epoch(self) -> tuple[float, bool]:
        """The mean loss, and whether the epoch ran to its end."""
        progress = self.progress
        rng = np.random.default_rng([self.config.seed, progress.epoch])
        torch.manual_seed(int(rng.integers(2**31)))
        self.model.train()
        losses = []
        for batch in self.task.batches(rng, self.steps):
            loss = self._step(batch)
            losses.append(loss)
            progress.step += 1
            if self.report is not None:
                total = progress.planned_epochs * self.steps
                self.report(self.task.name, progress.step, total, {"loss": loss})
            if self._is_out_of_time(slack=1.1):
                return float(np.mean(losses)), len(losses) == self.steps
        return float(np.mean(losses)), True

    def _step(self, batch: object) -> float:
        config, progress = self.config, self.progress
        rate = learning_rate_at(progress.schedule, config)
        self.optimizer.param_groups[0]["lr"] = rate
        precision: Precision = "bfloat16" if progress.precision == "bfloat16" else "float32"
        with autocast(precision):
            loss = self.task.loss(self.model, batch)
        value = loss.item()
        if not math.isfinite(value):
            raise InputError(
                f"the loss has to be finite, got {value} at step {progress.step}",
                where=self.task.name,
                remedy="lower --learning-rate, or check the data with `toponav data verify`",
            )
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.model.parameters(), config.largest_gradient)
        self.optimizer.step()
        self._average()
        left = self.steps * progress.planned_epochs - progress.step
        progress.schedule += (1.0 - progress.schedule) / max(left, 1)
        return value

    @torch.no_grad()
    def _average(self) -> None:
        if self.shadow is self.model:
            return
        # Early on, the average would mostly hold the random start: let it forget sooner.
        decay = min(self.config.ema, (1 + self.progress.step) / (10 + self.progress.step))
        torch._foreach_lerp_(_floats(self.shadow), _floats(self.model), 1.0 - decay)

    def _finish_epoch(self, loss: float, seconds: float) -> None:
        progress = self.progress
        self.shadow.eval()
        metrics = {
            "epoch": progress.epoch,
            "step": progress.step,
            "loss": loss,
            "learning_rate": learning_rate_at(progress.schedule, self.config),
            **self.task.evaluate(self.shadow),
            "seconds": round(seconds, 3),
        }
        progress.history.append(metrics)
        if progress.best_score is None or metrics["score"] > progress.best_score:
            progress.best_score = metrics["score"]
            progress.best_epoch = progress.epoch
            self._keep(metrics)
        progress.elapsed_s = time.monotonic() - self.began
        self._plan_by_time()
        write_metrics(self.directory, progress.history)
        save_state(self.directory, progress, self.model, self.shadow, self.optimizer)

    def _keep(self, metrics: Mapping[str, int | float]) -> None:
        model: Any = self.shadow
        about = {
            "toponav": toponav.__version__,
            "training": asdict(self.config) | {"precision": self.progress.precision},
            "metrics": {key: value for key, value in metrics.items() if key != "seconds"},
            **self.metadata,
        }
        save_checkpoint(model, self.out / f"{self.task.name}.safetensors", about)

    def _start_or_resume(self) -> Progress:
        restored = restore_state(
            self.directory, self.fingerprint, self.model, self.shadow, self.optimizer
        )
        if restored is not None:
            return restored
        precision: str = self.config.precision
        if precision == "auto":
            rng = np.random.default_rng(self.config.seed)
            batch = next(iter(self.task.batches(rng, 1)))
            precision, _ = quicker_precision(self.task, batch)
        return Progress(self.fingerprint, precision, self.config.epochs)

    def _fingerprint(self, data_hash: str) -> str:
        """Digest of all that decides the result but the clock."""
        config = asdict(self.config)
        del config["max_minutes"]
        document = {
            "config": config,
            "network": asdict(self.task.model.config),
            "samples": self.task.samples,
            "data": data_hash,
            "toponav": toponav.__version__,
            "torch": torch.__version__,
        }
        text = json.dumps(document, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def _is_out_of_time(self, slack: float) -> bool:
        minutes = self.config.max_minutes
        return minutes is not None and time.monotonic() - self.began > minutes * 60 * slack

    def _plan_by_time(self) -> None:
        """Plan as many epochs as fit; the schedule then reaches its end with the last."""
        progress = self.progress
        is_done = progress.epoch >= progress.planned_epochs
        if self.config.max_minutes is None or is_done or not progress.epoch:
            return
        left_s = self.config.max_minutes * 60 - progress.elapsed_s
        fitting = int(left_s / (progress.elapsed_s / progress.epoch))
        progress.planned_epochs = min(self.config.epochs, progress.epoch + max(fitting, 0))


def _floats(model: nn.Module) -> list[Tensor]:
    """Weights and running statistics, the same objects as in the model."""
    return [value for value in model.state_dict().values() if value.is_floating_point()]
