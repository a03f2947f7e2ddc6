"""Comparing two panoramas direction by direction, whatever way each is turned."""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from toponav.core.imagenav import DIRECTIONS
from toponav.models.nts.encoder import WrappedConv
from toponav.models.nts.presets import NTSConfig

__all__ = ["Matcher"]


class Matcher(nn.Module):
    """Which directions of two panoramas look alike, and how that bends around the robot.

    Entry (i, s) of the compared pair says how much direction i of the source resembles
    direction i + s of the goal. A turned camera moves all matches to another s; a moved camera
    bends their line, straight towards and away from where it moved. The result turns with the
    source and does not change when the goal turns.
    """

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        self.ways = config.matches
        self.azimuths = config.azimuths
        self.channels = 4 * config.matches * 2
        self.project = nn.Conv1d(config.features, config.features, 1)
        ways = config.matches
        self.first = WrappedConv(ways, 2 * ways, (3, 3))
        self.second = WrappedConv(2 * ways, 4 * ways, (3, 3))
        self.third = WrappedConv(4 * ways, 6 * ways, (3, 3))
        self.fourth = WrappedConv(6 * ways, self.channels, (5, 3))
        index = torch.arange(config.azimuths)
        shifted = (index[:, None] + index[None, :]) % config.azimuths
        self.register_buffer("shifted", shifted, persistent=False)

    def forward(
        self,
        source: Float[Tensor, "pairs features azimuths"],
        goal: Float[Tensor, "pairs features azimuths"],
    ) -> Float[Tensor, "pairs channels directions"]:
        """What the comparison says in each direction of the source."""
        one = self._described(source)
        other = self._described(goal)
        alike = torch.einsum("pkfi,pkfj->pkij", one, other)
        index = self.shifted.expand(len(alike), self.ways, -1, -1)  # type: ignore[operator]
        x = torch.gather(alike, 3, index)
        x = functional.max_pool2d(_wrapped_both(self.first, x), (1, 2))
        x = functional.max_pool2d(_wrapped_both(self.second, x), (1, 2))
        each = self.azimuths // DIRECTIONS
        x = _wrapped_both(self.third, x.roll(each // 2, 2))
        x = functional.avg_pool2d(x, (each, 1))
        x = _wrapped_both(self.fourth, x)
        return x.amax(3)

    def _described(self, features: Tensor) -> Tensor:
        vectors = self.project(features).unflatten(1, (self.ways, -1))
        return functional.normalize(vectors, dim=2) * 3.0


def _wrapped_both(layer: WrappedConv, x: Tensor) -> Tensor:
    """The layer's output with rows that wrap as its columns do, after ReLU."""
    pad = layer.pad_rows
    wrapped = torch.cat([x[:, :, x.shape[2] - pad :], x, x[:, :, :pad]], dim=2)
    out = functional.relu(layer(wrapped))
    return out[:, :, pad : out.shape[2] - pad]
