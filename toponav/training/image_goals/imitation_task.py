"""Behavioural cloning of the shortest-path expert, through a recurrent policy."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.training.config import TrainingConfig
from toponav.training.image_goals.closed_loop import ClosedLoop
from toponav.training.image_goals.demonstrations import HomeDrives
from toponav.training.image_goals.seen_drives import mirrored_pictures, seen_in
from toponav.training.precision import Precision

__all__ = ["ImitationTask", "SequenceBatch"]

_CHANGE_WEIGHT = 2.5


@dataclass(frozen=True, eq=False)
class SequenceBatch:
    """Parts of drives, side by side.

    Attributes:
        sensed: By name, [steps, drives, ...]: `sensors`, and `seen` or `image`.
        goal: uint8[drives, channels, rows, cols]; None where `seen` says all of it.
        action: int64[steps, drives].
        weight: float32[steps, drives]; 0 where a drive has ended.
    """

    sensed: dict[str, Tensor]
    goal: Tensor | None
    action: Tensor
    weight: Tensor


class ImitationTask:
    """What the loop needs to clone the expert.

    A sample is a drive, or where it is longer than `sequence_steps` a part of it, which the
    memory enters empty. Steps at which the expert does something else than before count more
    (Wijmans et al. 2019, Embodied question answering in photorealistic environments): most of a
    drive is straight ahead, or turning on.

    Args:
        model: The network.
        homes: Drives to learn from.
        held_out: Drives of other homes, to validate on.
        config: How to train; a batch counts drives.
        closed_loop: What else to measure after every epoch.
        precision: Number format in which a network with eyes looks at pictures, once.
    """

    def __init__(
        self,
        model: ImageGoalNetwork,
        homes: Sequence[HomeDrives],
        held_out: Sequence[HomeDrives],
        config: TrainingConfig,
        closed_loop: ClosedLoop | None = None,
        precision: Precision = "float32",
    ) -> None:
        self.model = model
        self.name = model.config.name
        self._config, self._closed_loop = config, closed_loop
        self._seen: dict[tuple[int, bool], np.ndarray] = {}
        if model.sight is not None:
            for home in (*homes, *held_out):
                for mirrored in (False, True) if config.mirror else (False,):
                    seen = seen_in(home, model.sight, precision, mirrored=mirrored)
                    self._seen[id(home), mirrored] = seen
        self._homes, self._drives = list(homes), _drives_of(homes)
        self._val_homes, self._val_drives = list(held_out), _drives_of(held_out)

    @property
    def samples(self) -> int:
        """How many drives there are to learn from."""
        return len(self._drives)

    @property
    def frames(self) -> int:
        """How many frames they have."""
        return sum(len(home.action) for home in self._homes)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[SequenceBatch]:
        """`steps` batches in random order."""
        size, order = self._config.batch_size, np.zeros(0, np.int64)
        for _ in range(steps):
            while len(order) < size:
                order = np.concatenate([order, rng.permutation(len(self._drives))])
            chosen, order = order[:size], order[size:]
            mirror = self._config.mirror and rng.random() < 0.5
            yield self._batch(self._homes, self._drives[chosen], rng, mirror=mirror)

    def loss(self, model: nn.Module, batch: SequenceBatch) -> Tensor:
        """The weighted cross-entropy of the expert's actions."""
        logits = self._logits(model, batch)
        loss = functional.cross_entropy(
            logits.flatten(0, 1), batch.action.flatten(), reduction="none"
        )
        weight = batch.weight.flatten()
        return (loss * weight).sum() / weight.sum()

    @torch.inference_mode()
    def evaluate(self, model: nn.Module) -> dict[str, int | float]:
        """Agreement with the expert on homes held out; `score` is what to maximize."""
        rng = np.random.default_rng(self._config.seed)
        sums = np.zeros(4)
        drives = self._val_drives if len(self._val_drives) else self._drives
        homes = self._val_homes or self._homes
        drives = drives[: max(1, self._config.most_validation_samples // 64)]
        total, batches = 0.0, 0
        for first in range(0, len(drives), self._config.batch_size):
            chosen = drives[first : first + self._config.batch_size]
            batch = self._batch(homes, chosen, rng, mirror=False)
            total, batches = total + float(self.loss(model, batch)), batches + 1
            guess = self._logits(model, batch).argmax(-1)
            there = batch.weight > 0
            stops = there & (batch.action == int(Action.STOP))
            right = guess == batch.action
            sums += [float(x.sum()) for x in (right & there, there, right & stops, stops)]
        found: dict[str, int | float] = {
            "val_loss": total / batches,
            "accuracy": float(sums[0] / sums[1]),
            "stop_recall": float(sums[2] / max(sums[3], 1.0)),
        }
        if self._closed_loop is not None:
            assert isinstance(model, ImageGoalNetwork)
            found.update(self._closed_loop.measure(model))
        return {"score": -found["val_loss"], **found}

    def _logits(self, model: nn.Module, batch: SequenceBatch) -> Tensor:
        assert isinstance(model, ImageGoalNetwork)
        steps, drives = batch.action.shape
        sensed = {name: value.flatten(0, 1) for name, value in batch.sensed.items()}
        goal = None
        if batch.goal is not None:
            goal = model.trunk.encode(batch.goal).repeat(steps, 1, 1)
        hidden = model.trunk(sensed, goal).unflatten(0, (steps, drives))
        remembered, _ = model.remember(hidden, model.begin(drives))
        out: Tensor = model.actor(remembered).float()
        return out

    def _batch(
        self,
        homes: Sequence[HomeDrives],
        drives: np.ndarray,
        rng: np.random.Generator,
        *,
        mirror: bool,
    ) -> SequenceBatch:
        parts = [
            self._part(homes[home], first, end, rng, mirror)
            for home, first, end in drives.tolist()
        ]
        longest = max(len(part["action"]) for part in parts)
        joined = {
            name: torch.from_numpy(np.stack([_padded(part[name], longest) for part in parts], 1))
            for name in parts[0]
            if name != "goal"
        }
        goal = None
        if "goal" in parts[0]:
            goal = torch.from_numpy(np.stack([part["goal"] for part in parts]))
        action, weight = joined.pop("action"), joined.pop("weight")
        return SequenceBatch(joined, goal, action, weight)

    def _part(
        self, home: HomeDrives, first: int, end: int, rng: np.random.Generator, mirror: bool
    ) -> dict[str, np.ndarray]:
        most = self._config.sequence_steps
        before = int(rng.integers(max(1, end - first - most + 1)))
        rows = slice(first + before, min(first + before + most, end))
        action = home.action[rows].astype(np.int64)
        weight = np.ones(len(action), np.float32)
        weight[1:][action[1:] != action[:-1]] = _CHANGE_WEIGHT
        part = {"sensors": home.sensors[rows], "action": action, "weight": weight}
        if self.model.sight is not None:
            part["seen"] = self._seen[id(home), mirror][rows]
        else:
            channels = self.model.config.channels
            part["image"] = home.image[rows][:, :channels]
            part["goal"] = np.asarray(home.goal[home.episode[first]])[:channels]
        return _mirrored(part) if mirror else part


def _drives_of(homes: Sequence[HomeDrives]) -> np.ndarray:
    """Home, first frame and end of every drive; int64[drives, 3]."""
    rows = []
    for number, home in enumerate(homes):
        first = np.flatnonzero(np.diff(home.episode, prepend=-1))
        end = np.append(first[1:], len(home.episode))
        rows.append(np.stack([np.full(len(first), number), first, end], axis=1))
    return np.concatenate(rows) if rows else np.zeros((0, 3), np.int64)


def _padded(values: np.ndarray, length: int) -> np.ndarray:
    out = np.zeros((length, *values.shape[1:]), values.dtype)
    out[: len(values)] = values
    return out


def _mirrored(part: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Left and right swapped, but for what is `seen`, which was mirrored before it was seen."""
    swapped = np.arange(part["sensors"].shape[-1])
    swapped[[Action.LEFT, Action.RIGHT]] = Action.RIGHT, Action.LEFT
    out = part | {"sensors": part["sensors"][:, swapped], "action": swapped[part["action"]]}
    for name in ("image", "goal"):
        if name in part:
            out[name] = mirrored_pictures(part[name])
    return out
