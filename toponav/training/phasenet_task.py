"""Regression of a behaviour's progress (section VII, "PhaseNet")."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from toponav.core.errors import InputError
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.sequence_encoder import encode_sequences
from toponav.training.config import TrainingConfig
from toponav.training.samples import FrameStacks, Split, TrainingData, draw
from toponav.training.sequences import (
    MIRRORED,
    FrameSequences,
    gather_sequences,
    plan_numbers,
    segments,
)

__all__ = ["PhaseBatch", "PhaseNetTask"]


@dataclass(frozen=True)
class PhaseBatch:
    """Sequences that each begin and end with one behaviour.

    Attributes:
        frames: Stacks of the steps that are there.
        is_there: `[steps, batch]`.
        behavior: What is executed in each, as a position in `list(Behavior)`.
        phase: `[steps, batch]`: the share of the behaviour's frames seen so far.
    """

    frames: Tensor
    is_there: Tensor
    behavior: Tensor
    phase: Tensor


class PhaseNetTask:
    """What the loop needs to train PhaseNet. A sample is one edge of a plan as it was driven.

    The phase rises evenly from the first frame to 1 at the last. Mirrored samples turn the
    other way.
    """

    name = PhaseNet.kind

    def __init__(
        self, model: PhaseNet, data: TrainingData, split: Split, config: TrainingConfig
    ) -> None:
        self.model = model
        self._config = config
        self._data = data
        self._stacks = FrameStacks(data, model.config.frame_offsets)
        self._behavior = np.asarray(data.behavior)
        self._trajectory = np.asarray(data.trajectory)
        self._segments = segments(data)
        is_train = split.train[self._segments.first]
        own = np.flatnonzero(is_train)
        count = len(self._segments.first)
        # A segment and its mirror image are two samples: number and whether to mirror.
        self._pool = np.concatenate([own, own + count]) if config.mirror else own
        self._val_pool = np.flatnonzero(split.val[self._segments.first])
        self._val_drives = np.unique(self._trajectory[split.val]).astype(np.int64)
        if not len(self._pool):
            raise InputError(
                "no frame for learning is on an edge of its plan",
                where="--data",
                remedy="run `toponav data annotate`, or collect more trajectories",
            )

    @property
    def samples(self) -> int:
        """How many different sequences there are to learn from."""
        return len(self._pool)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[PhaseBatch]:
        """`steps` batches in random order."""
        size, count = self._config.batch_size, len(self._segments.first)
        drawn = draw(self._pool, steps * size, rng)
        for begin in range(0, len(drawn), size):
            chosen = drawn[begin : begin + size]
            yield self._batch(chosen % count, chosen >= count)

    def loss(self, model: torch.nn.Module, batch: PhaseBatch) -> Tensor:
        """Mean squared error of the phase over all steps."""
        error: Tensor = model(batch.frames, batch.is_there, batch.behavior) - batch.phase
        return (error[batch.is_there] ** 2).mean()

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Errors on validation frames; `score` (minus the loss) is what to maximize.

        `replay_accuracy` is how often the behaviour is right when whole drives of the expert
        are watched and the network alone decides when to go on in the plan.
        """
        assert isinstance(model, PhaseNet)
        if not len(self._val_pool):
            return {"score": 0.0}
        rng = np.random.default_rng(self._config.seed)
        squared = absolute = 0.0
        steps, size = 0, self._config.batch_size
        order = rng.permutation(self._val_pool)
        for begin in range(0, len(order), size):
            index = order[begin : begin + size]
            batch = self._batch(index, np.zeros(len(index), bool))
            error = model(batch.frames, batch.is_there, batch.behavior) - batch.phase
            there = error[batch.is_there]
            squared += float((there**2).sum())
            absolute += float(there.abs().sum())
            steps += len(there)
            if steps >= self._config.most_validation_samples:
                break
        return {
            "score": -squared / steps,
            "val_loss": squared / steps,
            "phase_error": absolute / steps,
            "replay_accuracy": self.replay_accuracy(model, model.config.finished_at),
        }

    @torch.inference_mode()
    def replay_accuracy(self, model: PhaseNet, finished_at: float) -> float:
        """The share of validation frames at which the plan's behaviour would be executed.

        Args:
            model: In evaluation mode.
            finished_at: The phase at which a behaviour is done.
        """
        right = labelled = 0
        frames = 0
        for begin in range(0, len(self._val_drives), self._config.batch_size):
            drives = self._val_drives[begin : begin + self._config.batch_size]
            chosen, truth = self._replay(model, drives, finished_at)
            right += int((chosen == truth)[truth >= 0].sum())
            labelled += int((truth >= 0).sum())
            frames += int((truth > -2).sum())
            if frames >= self._config.most_validation_samples:
                break
        return right / max(labelled, 1)

    def _replay(
        self, model: PhaseNet, drives: Int64[np.ndarray, " batch"], finished_at: float
    ) -> tuple[Int64[np.ndarray, "steps batch"], Int64[np.ndarray, "steps batch"]]:
        """The behaviour chosen at each step, and the true one: -1 unlabelled, -2 padding."""
        seen = self._drives(drives)
        features = encode_sequences(model.encoder, seen.frames, seen.is_there)
        plans = [plan_numbers(self._data, int(drive)) for drive in drives]
        last = np.array([len(plan) for plan in plans]) - 1
        table = np.stack([np.pad(plan, (0, last.max() + 1 - len(plan))) for plan in plans])
        position = np.zeros(len(drives), np.int64)
        rows = np.arange(len(drives))
        state: tuple[Tensor, ...] | None = None
        chosen = np.empty(seen.index.shape, np.int64)
        for step in range(len(features)):
            executed = torch.from_numpy(table[rows, position])
            phase, state = model.step(features[step], executed, state)
            done = (phase.numpy() >= finished_at) & (position < last)
            position += done
            state = tuple(part * torch.from_numpy(~done)[:, None] for part in state)
            chosen[step] = table[rows, position]
        truth = np.where(seen.is_there.numpy(), self._behavior[seen.index].astype(np.int64), -2)
        return chosen, truth

    def _drives(self, drives: Int64[np.ndarray, " batch"]) -> FrameSequences:
        first = np.searchsorted(self._trajectory, drives, "left")
        last = np.searchsorted(self._trajectory, drives, "right") - 1
        plain = np.zeros(len(drives), bool)
        return gather_sequences(self._stacks, first, last, plain, most_steps=1 << 20)

    def _batch(
        self, index: Int64[np.ndarray, " batch"], mirrored: Bool[np.ndarray, " batch"]
    ) -> PhaseBatch:
        first, last = self._segments.first[index], self._segments.last[index]
        behavior = self._segments.behavior[index]
        seen = gather_sequences(
            self._stacks, first, last, mirrored, most_steps=self._config.sequence_steps
        )
        phase = (seen.index - first + 1) / (last - first + 1)
        return PhaseBatch(
            seen.frames,
            seen.is_there,
            torch.from_numpy(np.where(mirrored, MIRRORED[behavior], behavior)),
            torch.from_numpy(phase.astype(np.float32)),
        )
