"""The multi-task network: from two panoramas to connection, relative pose, exploration, score."""

from dataclasses import dataclass
from typing import ClassVar

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn
from torch.nn import functional

from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M
from toponav.models.nts.encoder import AroundEncoder, ResNet18Encoder
from toponav.models.nts.matching import Matcher
from toponav.models.nts.presets import NTSConfig

__all__ = ["NTSNetwork", "PairPrediction", "PlacePrediction"]


@dataclass(frozen=True, eq=False)
class PairPrediction:
    """What a source and a goal panorama say together.

    Attributes:
        connection: F_L, logit that both belong to one node.
        direction: F_R, logits of where the goal is, seen from the source.
        distance_m: F_R, how far.
        score: F_S, logits of how fast the goal is reached in each direction of the source.
    """

    connection: Float[Tensor, " pairs"]
    direction: Float[Tensor, "pairs directions"]
    distance_m: Float[Tensor, " pairs"]
    score: Float[Tensor, "pairs directions"]


@dataclass(frozen=True, eq=False)
class PlacePrediction:
    """What one panorama says alone.

    Attributes:
        explorable: F_G, logits that there is something to explore in each direction.
        obstacle_m: Ranges to what would stop the robot.
        sight_m: Ranges to what ends level sight.
    """

    explorable: Float[Tensor, "places directions"]
    obstacle_m: Float[Tensor, "places ranges"]
    sight_m: Float[Tensor, "places ranges"]


class NTSNetwork(nn.Module):
    """One shared encoder and the heads of section 4.2.

    Features of a panorama are computed once and kept; pairs are compared by their features.

    Args:
        config: Sizes.

    Reference:
        Chaplot et al. 2020, figure 7.
    """

    kind: ClassVar[str] = "nts"

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        self.config = config
        is_around = config.encoder == "around"
        self.encoder = AroundEncoder(config) if is_around else ResNet18Encoder(config)
        self.heads: nn.Module = _AroundHeads(config) if is_around else _ConnectedHeads(config)

    def encode(
        self, images: UInt8[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of panoramas, as `network_input` makes them."""
        out: Tensor = self.encoder((images.float() - 110.0) / 64.0)
        return out

    def place(self, features: Float[Tensor, "places features azimuths"]) -> PlacePrediction:
        """What panoramas say alone."""
        explorable, ranges = self.heads.place(features)  # type: ignore[operator]
        metres = 10.0 * torch.sigmoid(ranges)
        return PlacePrediction(explorable, metres[:, 0], metres[:, 1])

    def pair(
        self,
        source: Float[Tensor, "pairs features azimuths"],
        goal: Float[Tensor, "pairs features azimuths"],
    ) -> PairPrediction:
        """What sources and goals say together."""
        found: PairPrediction = self.heads(source, goal)
        return found

    def forward(self, source: Tensor, goal: Tensor) -> tuple[PairPrediction, PlacePrediction]:
        """Both predictions from images."""
        features = self.encode(source)
        return self.pair(features, self.encode(goal)), self.place(features)


def _distance_m(raw: Tensor) -> Tensor:
    return 2.0 * NODE_RADIUS_M * torch.sigmoid(raw)


class _AroundHeads(nn.Module):
    """Fully connected layers, the same in every direction."""

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        self.each = config.azimuths // DIRECTIONS
        self.per_azimuth = config.ranges // config.azimuths
        features, hidden = config.features, config.hidden
        self.matcher = Matcher(config)
        self.connection = _layers(2 * self.matcher.channels, hidden, 1, config.dropout)
        self.distance = _layers(2 * self.matcher.channels, hidden, 1, config.dropout)
        self.direction = _wide_layers(self.matcher.channels, hidden, 1, 3, config.dropout)
        group = features * self.each
        self.explorable = _wide_layers(group, hidden, 1, 3, config.dropout)
        self.ranges = _wide_layers(features, hidden, 2 * self.per_azimuth, 1, 0.0)
        self.score = _wide_layers(
            group + self.matcher.channels + 2 * features, hidden, 1, 3, config.dropout
        )

    def place(self, features: Tensor) -> tuple[Tensor, Tensor]:
        ranges = self.ranges(features).unflatten(1, (2, self.per_azimuth))
        # Directions are multiples of their width: half of the first one lies to the right.
        ranges = ranges.transpose(2, 3).flatten(2).roll(-(self.per_azimuth // 2), 2)
        explorable = self.explorable(self._by_direction(features))[:, 0]
        return explorable, ranges

    def forward(self, source: Tensor, goal: Tensor) -> PairPrediction:
        matched = self.matcher(source, goal)
        pooled = torch.cat([matched.amax(2), matched.mean(2)], dim=1)
        wanted = torch.cat([goal.amax(2), goal.mean(2)], dim=1)
        ahead = self._by_direction(source)
        spread = wanted[:, :, None].expand(-1, -1, DIRECTIONS)
        return PairPrediction(
            self.connection(pooled)[:, 0],
            self.direction(matched)[:, 0],
            _distance_m(self.distance(pooled)[:, 0]),
            self.score(torch.cat([ahead, matched, spread], dim=1))[:, 0],
        )

    def _by_direction(self, features: Tensor) -> Tensor:
        """Features of the azimuths of each of the twelve directions, side by side."""
        rolled = features.roll(self.each // 2, 2)
        centred = rolled.reshape(*rolled.shape[:2], DIRECTIONS, self.each)
        return centred.transpose(2, 3).flatten(1, 2)


class _ConnectedHeads(nn.Module):
    """The paper's heads: fully connected layers over all features of both panoramas."""

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        self.ranges_per_kind = config.ranges
        one = config.features * config.azimuths
        hidden, dropout = config.hidden, config.dropout
        self.connection = _layers(2 * one, hidden, 1, dropout)
        self.intra = _layers(2 * one, hidden, DIRECTIONS + 1, dropout)
        self.explorable = _layers(one, hidden, DIRECTIONS, dropout)
        self.score = _layers(2 * one, hidden, DIRECTIONS, dropout)
        self.ranges = _layers(one, hidden, 2 * config.ranges, 0.0)

    def place(self, features: Tensor) -> tuple[Tensor, Tensor]:
        flat = features.flatten(1)
        return self.explorable(flat), self.ranges(flat).unflatten(1, (2, self.ranges_per_kind))

    def forward(self, source: Tensor, goal: Tensor) -> PairPrediction:
        both = torch.cat([source.flatten(1), goal.flatten(1)], dim=1)
        intra = self.intra(both)
        return PairPrediction(
            self.connection(both)[:, 0],
            intra[:, :DIRECTIONS],
            _distance_m(intra[:, DIRECTIONS]),
            self.score(both),
        )


def _layers(inputs: int, hidden: int, outputs: int, dropout: float) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, hidden),
        nn.ReLU(inplace=True),
        nn.Dropout(dropout),
        nn.Linear(hidden, outputs),
    )


class _WrappedConv1d(nn.Module):
    def __init__(self, inputs: int, outputs: int, kernel: int) -> None:
        super().__init__()
        self.pad = kernel // 2
        self.conv = nn.Conv1d(inputs, outputs, kernel)

    def forward(self, x: Tensor) -> Tensor:
        if self.pad:
            x = functional.pad(x, (self.pad, self.pad), mode="circular")
        out: Tensor = self.conv(x)
        return out


def _wide_layers(
    inputs: int, hidden: int, outputs: int, kernel: int, dropout: float
) -> nn.Sequential:
    """Layers that see the neighbouring directions too."""
    return nn.Sequential(
        _WrappedConv1d(inputs, hidden, kernel),
        nn.ReLU(inplace=True),
        nn.Dropout(dropout),
        _WrappedConv1d(hidden, outputs, 1),
    )
