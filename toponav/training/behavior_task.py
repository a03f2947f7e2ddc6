"""Behavioural cloning of one behaviour (section V-D)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float32, Int64
from torch import Tensor

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.training.config import TrainingConfig
from toponav.training.samples import FrameStacks, Split, TrainingData, draw, first_frames

__all__ = ["BehaviorBatch", "BehaviorTask"]

_MIRROR = {
    Behavior.TURN_LEFT: Behavior.TURN_RIGHT,
    Behavior.TURN_RIGHT: Behavior.TURN_LEFT,
}
_TURNING_RAD_S = 0.3


@dataclass(frozen=True)
class BehaviorBatch:
    """Stacks and the expert's commands; recurrent batches have steps in front.

    Attributes:
        frames: `[batch, frames, rows, cols]` or `[steps, batch, 1, rows, cols]`, bytes.
        command: m/s and rad/s.
        weight: 0 where a sequence has already ended.
    """

    frames: Tensor
    command: Tensor
    weight: Tensor


class BehaviorTask:
    """What the loop needs to train one behaviour's network.

    Mirrored samples negate the turn rate; mirrored right turns teach the left turn's network,
    and the reverse.
    """

    def __init__(
        self, model: BehaviorNetwork, data: TrainingData, split: Split, config: TrainingConfig
    ) -> None:
        self.model = model
        self.name = f"behavior_{model.config.behavior}"
        self._config = config
        self._command = np.asarray(data.command)
        self._stacks = FrameStacks(data, model.config.frame_offsets)
        self._segment_last = _segment_ends(data)
        behavior = np.asarray(data.behavior)
        order = list(Behavior)
        mine = behavior == order.index(model.config.behavior)
        other = _MIRROR.get(model.config.behavior, model.config.behavior)
        mirrored = behavior == order.index(other)
        own_pool = np.flatnonzero(mine & split.train)
        mirror_pool = np.flatnonzero(mirrored & split.train) if config.mirror else own_pool[:0]
        # A frame and its mirror image are two samples: index and whether to mirror.
        self._pool = np.concatenate([own_pool, mirror_pool + len(behavior)])
        self._frames = len(behavior)
        self._val_pool = np.flatnonzero(mine & split.val)
        if not len(self._pool):
            raise InputError(
                f"no frame for learning is tagged {model.config.behavior}",
                where="--data",
                remedy="collect more trajectories, or train the other behaviours one by one",
            )

    @property
    def samples(self) -> int:
        """How many different samples there are to learn from."""
        return len(self._pool)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[BehaviorBatch]:
        """`steps` batches in random order."""
        size = self._config.batch_size
        drawn = draw(self._pool, steps * size, rng)
        for first in range(0, len(drawn), size):
            chosen = drawn[first : first + size]
            yield self._batch(chosen % self._frames, chosen >= self._frames)

    def loss(self, model: torch.nn.Module, batch: BehaviorBatch) -> Tensor:
        """Mean over the samples of the batch."""
        assert isinstance(model, BehaviorNetwork)
        outputs = model.raw_sequence if model.is_recurrent else model.raw
        each = model.head.loss(outputs(batch.frames), batch.command)
        return (each * batch.weight).sum() / batch.weight.sum()

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Loss and errors on the validation frames; `score` is what to maximize."""
        assert isinstance(model, BehaviorNetwork)
        if not len(self._val_pool):
            return {"score": 0.0}
        rng = np.random.default_rng(self._config.seed)
        chosen = draw(self._val_pool, len(self._val_pool), rng)
        chosen = np.sort(chosen[: self._config.most_validation_samples])
        losses, wrong, total, speed_error, turn_error = 0.0, 0, 0, 0.0, 0.0
        weights = 0.0
        turning = 0
        size = self._config.batch_size
        for first in range(0, len(chosen), size):
            index = chosen[first : first + size]
            batch = self._batch(index, np.zeros(len(index), bool))
            raw = (model.raw_sequence if model.is_recurrent else model.raw)(batch.frames)
            each = model.head.loss(raw, batch.command)
            losses += float((each * batch.weight).sum())
            weights += float(batch.weight.sum())
            velocity = model.head.velocity(raw.flatten(0, -2))
            command = batch.command.flatten(0, -2)
            keep = batch.weight.flatten() > 0
            error = (velocity - command).abs()[keep]
            speed_error += float(error[:, 0].sum())
            turn_error += float(error[:, 1].sum())
            total += len(error)
            turns = keep & (command[:, 1].abs() > _TURNING_RAD_S)
            turning += int(turns.sum())
            wrong += int((velocity[turns, 1] * command[turns, 1] <= 0).sum())
        return {
            "score": -losses / weights,
            "val_loss": losses / weights,
            "speed_error_m_s": speed_error / total,
            "turn_error_rad_s": turn_error / total,
            "wrong_side": wrong / max(turning, 1),
        }

    def _batch(
        self, index: Int64[np.ndarray, " batch"], mirrored: Bool[np.ndarray, " batch"]
    ) -> BehaviorBatch:
        if self.model.is_recurrent:
            return self._sequences(index, mirrored)
        command = self._commands(index, mirrored)
        return BehaviorBatch(
            torch.from_numpy(self._stacks.gather(index, mirrored)),
            torch.from_numpy(command),
            torch.ones(len(index)),
        )

    def _sequences(
        self, index: Int64[np.ndarray, " batch"], mirrored: Bool[np.ndarray, " batch"]
    ) -> BehaviorBatch:
        """Steps from each frame on; those past the end of its behaviour weigh nothing."""
        last = self._segment_last[index]
        frames, command, weight = [], [], []
        for step in range(self._config.sequence_steps):
            here = np.minimum(index + step, last)
            frames.append(torch.from_numpy(self._stacks.gather(here, mirrored)))
            command.append(torch.from_numpy(self._commands(here, mirrored)))
            weight.append(torch.from_numpy((index + step <= last).astype(np.float32)))
        return BehaviorBatch(torch.stack(frames), torch.stack(command), torch.stack(weight))

    def _commands(
        self, index: Int64[np.ndarray, " batch"], mirrored: Bool[np.ndarray, " batch"]
    ) -> Float32[np.ndarray, "batch 2"]:
        command: np.ndarray = self._command[index].astype(np.float32)
        command[mirrored, 1] *= -1.0
        return command


def _segment_ends(data: TrainingData) -> Int64[np.ndarray, " frames"]:
    """The last frame of each frame's run of one behaviour within one trajectory."""
    label = np.asarray(data.trajectory).astype(np.int64) * 16 + np.asarray(data.behavior)
    return np.asarray(len(label) - 1 - first_frames(label[::-1])[::-1])
