"""What a training recipe has to say; the loop does the rest."""

from collections.abc import Iterator
from typing import Any, Protocol, runtime_checkable

import numpy as np
from torch import Tensor, nn

from toponav.models.checkpoints import Network

__all__ = ["Task"]


@runtime_checkable
class Task(Protocol):
    """One network, its samples, its loss and its validation."""

    @property
    def name(self) -> str:
        """Name of the checkpoint, without suffix."""

    @property
    def model(self) -> Network:
        """The network to train."""

    @property
    def samples(self) -> int:
        """How many different samples there are to learn from."""

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[Any]:
        """This many batches in an order that `rng` alone decides."""

    def loss(self, model: nn.Module, batch: Any) -> Tensor:
        """What to minimize."""

    def evaluate(self, model: nn.Module) -> dict[str, int | float]:
        """Validation metrics; `score` is what to maximize."""
