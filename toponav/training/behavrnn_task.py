"""Classification of the behaviour to execute along whole drives (section VII, "BehavRNN")."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Int64
from torch import Tensor
from torch.nn import functional as F

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.training.config import TrainingConfig
from toponav.training.samples import FrameStacks, Split, TrainingData, draw
from toponav.training.sequences import MIRRORED, gather_sequences, plan_numbers

__all__ = ["BehavRNNTask", "DriveBatch"]

_UNLABELLED = -1
_LATER_STARTS = 0.5


@dataclass(frozen=True)
class DriveBatch:
    """Drives from the beginning of their plan.

    Attributes:
        frames: Stacks of the steps that are there.
        is_there: `[steps, batch]`.
        plans: The behaviours of each plan, as positions in `list(Behavior)`.
        target: `[steps, batch]`: the behaviour to execute; -1 where it is not known.
    """

    frames: Tensor
    is_there: Tensor
    plans: list[Tensor]
    target: Tensor


class BehavRNNTask:
    """What the loop needs to train BehavRNN. A sample is a drive, or its mirror image.

    Gradients go back through a whole drive: cut short, they would teach the plan's reader only
    what comes first. So that beginnings are not all that is alike in every sample, half of
    them begin somewhere in the drive, with what is left of the plan.
    """

    name = BehavRNN.kind

    def __init__(
        self, model: BehavRNN, data: TrainingData, split: Split, config: TrainingConfig
    ) -> None:
        self.model = model
        self._config = config
        self._data = data
        self._stacks = FrameStacks(data, model.config.frame_offsets)
        self._behavior = np.asarray(data.behavior)
        self._position = np.asarray(data.plan_position)
        trajectory = np.asarray(data.trajectory)
        numbers, first = np.unique(trajectory, return_index=True)
        last = np.append(first[1:], len(trajectory)) - 1
        self._numbers, self._first = numbers.astype(np.int64), first.astype(np.int64)
        self._plans = [plan_numbers(data, int(number)) for number in numbers]
        self._last = np.array(
            [
                self._before_goal(*drive)
                for drive in zip(first.tolist(), last.tolist(), self._plans, strict=True)
            ],
            np.int64,
        )
        has_labels = np.maximum.reduceat(self._behavior, first) >= 0
        own = np.flatnonzero(split.train[first] & has_labels)
        self._pool = np.concatenate([own, own + len(first)]) if config.mirror else own
        self._val_pool = np.flatnonzero(split.val[first] & has_labels)
        if not len(self._pool):
            raise InputError(
                "no drive for learning has a behaviour",
                where="--data",
                remedy="run `toponav data annotate`, or collect more trajectories",
            )

    @property
    def samples(self) -> int:
        """How many different drives there are to learn from."""
        return len(self._pool)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[DriveBatch]:
        """`steps` batches in random order."""
        size, count = self._config.batch_size, len(self._first)
        drawn = draw(self._pool, steps * size, rng)
        for begin in range(0, len(drawn), size):
            chosen = drawn[begin : begin + size]
            drives = chosen % count
            length = self._last[drives] - self._first[drives] + 1
            # Beginnings are shifted by less than a stride, so that every frame comes to be seen.
            shift = rng.integers(0, np.minimum(self.model.config.stride, length))
            is_later = rng.random(len(drives)) < _LATER_STARTS
            shift = np.where(is_later, rng.integers(0, length), shift)
            yield self._batch(drives, self._first[drives] + shift, chosen >= count)

    def loss(self, model: torch.nn.Module, batch: DriveBatch) -> Tensor:
        """Mean cross-entropy over the steps whose behaviour is known."""
        logits = model(batch.frames, batch.is_there, batch.plans).flatten(0, 1)
        target = batch.target.flatten()
        total = F.cross_entropy(logits, target, ignore_index=_UNLABELLED, reduction="sum")
        return total / (target >= 0).sum().clamp(min=1)

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Accuracy along whole validation drives; `score` (minus the loss) is to be maximized."""
        if not len(self._val_pool):
            return {"score": 0.0}
        rng = np.random.default_rng(self._config.seed)
        order = rng.permutation(self._val_pool)
        loss, seen = 0.0, 0
        rights, truths = [], []
        for begin in range(0, len(order), self._config.batch_size):
            drives = order[begin : begin + self._config.batch_size]
            batch = self._batch(drives, self._first[drives], np.zeros(len(drives), bool))
            logits = model(batch.frames, batch.is_there, batch.plans)[batch.target >= 0]
            truth = batch.target[batch.target >= 0]
            loss += float(F.cross_entropy(logits, truth, reduction="sum"))
            rights.append((logits.argmax(-1) == truth).numpy())
            truths.append(truth.numpy())
            seen += len(truth)
            if seen * self.model.config.stride >= self._config.most_validation_samples:
                break
        right, truth_of = np.concatenate(rights), np.concatenate(truths)
        loss /= seen
        metrics = {"score": -loss, "val_loss": loss, "accuracy": float(right.mean())}
        for number, behavior in enumerate(Behavior):
            if (truth_of == number).any():
                metrics[f"{behavior}_accuracy"] = float(right[truth_of == number].mean())
        return metrics

    def _before_goal(self, first: int, last: int, plan: Int64[np.ndarray, " edges"]) -> int:
        """The last frame at which something of the plan is left to do."""
        position = self._position[first : last + 1]
        undone = int(np.searchsorted(position, len(plan), "left"))
        return first + max(undone - 1, 0)

    def _batch(
        self,
        drives: Int64[np.ndarray, " batch"],
        begin: Int64[np.ndarray, " batch"],
        mirrored: Bool[np.ndarray, " batch"],
    ) -> DriveBatch:
        seen = gather_sequences(
            self._stacks,
            begin,
            self._last[drives],
            mirrored,
            stride=self.model.config.stride,
            most_steps=self._config.sequence_steps,
        )
        plans = []
        for drive, frame, mirror in zip(drives.tolist(), begin.tolist(), mirrored, strict=True):
            plan = self._plans[drive]
            left = plan[np.clip(self._position[frame], 0, len(plan) - 1) :]
            plans.append(torch.from_numpy(MIRRORED[left] if mirror else left))
        target = self._behavior[seen.index].astype(np.int64)
        target = np.where(mirrored & (target >= 0), MIRRORED[target], target)
        target[~seen.is_there.numpy()] = _UNLABELLED
        return DriveBatch(seen.frames, seen.is_there, plans, torch.from_numpy(target))
