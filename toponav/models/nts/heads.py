"""Heads of the network: connection, relative pose, exploration, score, and what else it learns."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M
from toponav.models.nts.matching import Matcher
from toponav.models.nts.presets import ROOM_KINDS, NTSConfig

__all__ = ["AroundHeads", "ConnectedHeads", "PairPrediction", "PlacePrediction"]


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
        kind: Logits of the kind of room that it was taken in, as `ROOM_KINDS`.
        toward: Logits of how fast a room of each kind is reached in each direction.
    """

    explorable: Float[Tensor, "places directions"]
    obstacle_m: Float[Tensor, "places ranges"]
    sight_m: Float[Tensor, "places ranges"]
    kind: Float[Tensor, "places kinds"]
    toward: Float[Tensor, "places kinds directions"]


def _distance_m(raw: Tensor) -> Tensor:
    return 2.0 * NODE_RADIUS_M * torch.sigmoid(raw)


def _ranges_m(raw: Tensor) -> tuple[Tensor, Tensor]:
    metres = 10.0 * torch.sigmoid(raw)
    return metres[:, 0], metres[:, 1]


class AroundHeads(nn.Module):
    """Fully connected layers, the same in every direction."""

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        self.each = config.azimuths // DIRECTIONS
        self.per_azimuth = config.ranges // config.azimuths
        features, hidden, dropout = config.features, config.hidden, config.dropout
        self.matcher = Matcher(config)
        self.connection = _layers(2 * self.matcher.channels, hidden, 1, dropout)
        self.distance = _layers(2 * self.matcher.channels, hidden, 1, dropout)
        self.direction = _wide_layers(self.matcher.channels, hidden, 1, 3, dropout)
        group = features * self.each
        self.explorable = _wide_layers(group, hidden, 1, 3, dropout)
        self.ranges = _wide_layers(features, hidden, 2 * self.per_azimuth, 1, 0.0)
        self.kind = _layers(2 * features, hidden, len(ROOM_KINDS), dropout)
        self.outlook = nn.Sequential(
            _WrappedConv1d(group + 2 * features, hidden, 3),
            nn.ReLU(inplace=True),
            nn.Dropout(dropout),
            _WrappedConv1d(hidden, hidden, 3),
        )
        self.toward = nn.Sequential(nn.ReLU(), nn.Conv1d(hidden, len(ROOM_KINDS), 1))
        self.wanted = _layers(2 * features, hidden, 2 * hidden, dropout)
        self.trust = nn.Parameter(torch.tensor(0.3))
        self.score = nn.Sequential(
            nn.ReLU(inplace=True), nn.Dropout(dropout), _score_end(hidden, hidden)
        )
        self.seen = _wide_layers(self.matcher.channels + hidden, hidden, 1, 3, dropout)

    def place(self, features: Tensor) -> PlacePrediction:
        """What panoramas say alone."""
        ranges = self.ranges(features).unflatten(1, (2, self.per_azimuth))
        # Directions are multiples of their width: half of the first one lies to the right.
        ranges = ranges.transpose(2, 3).flatten(2).roll(-(self.per_azimuth // 2), 2)
        explorable = self.explorable(self._by_direction(features))[:, 0]
        kind = self.kind(_pooled(features))
        toward = self.toward(self._outlook(features))
        return PlacePrediction(explorable, *_ranges_m(ranges), kind, toward)

    def scores(self, features: Tensor, source: Tensor, goal: Tensor) -> Tensor:
        """F_S without comparing pictures direction by direction: cheap, for many pairs."""
        return self._scores(features, features, source, goal)[0]

    def _scores(
        self, sources: Tensor, goals: Tensor, source: Tensor, goal: Tensor
    ) -> tuple[Tensor, Tensor]:
        outlook = self._outlook(sources)
        pooled = _pooled(goals)
        gain, shift = self.wanted(pooled).chunk(2, dim=1)
        kind = torch.softmax(self.kind(pooled), dim=1)
        kinds = torch.einsum("pk,pkd->pd", kind[goal], self.toward(outlook)[source])
        met = outlook[source] * (1.0 + gain)[goal][:, :, None] + shift[goal][:, :, None]
        return self.score(met)[:, 0] + self.trust * kinds, met

    def forward(self, source: Tensor, goal: Tensor) -> PairPrediction:
        """What sources and goals say together."""
        matched = self.matcher(source, goal)
        pooled = torch.cat([matched.amax(2), matched.mean(2)], dim=1)
        each = torch.arange(len(source))
        score, met = self._scores(source, goal, each, each)
        seen = self.seen(torch.cat([matched, functional.relu(met)], dim=1))[:, 0]
        return PairPrediction(
            self.connection(pooled)[:, 0],
            self.direction(matched)[:, 0],
            _distance_m(self.distance(pooled)[:, 0]),
            score + seen,
        )

    def _outlook(self, features: Tensor) -> Tensor:
        """What lies in each of the twelve directions, before its last ReLU."""
        pooled = _pooled(features)[:, :, None].expand(-1, -1, DIRECTIONS)
        found: Tensor = self.outlook(torch.cat([self._by_direction(features), pooled], dim=1))
        return found

    def _by_direction(self, features: Tensor) -> Tensor:
        """Features of the azimuths of each of the twelve directions, side by side."""
        rolled = features.roll(self.each // 2, 2)
        centred = rolled.reshape(*rolled.shape[:2], DIRECTIONS, self.each)
        return centred.transpose(2, 3).flatten(1, 2)


class ConnectedHeads(nn.Module):
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
        self.kind = _layers(one, hidden, len(ROOM_KINDS), dropout)
        self.toward = _layers(one, hidden, len(ROOM_KINDS) * DIRECTIONS, dropout)

    def place(self, features: Tensor) -> PlacePrediction:
        """What panoramas say alone."""
        flat = features.flatten(1)
        ranges = self.ranges(flat).unflatten(1, (2, self.ranges_per_kind))
        toward = self.toward(flat).unflatten(1, (len(ROOM_KINDS), DIRECTIONS))
        return PlacePrediction(self.explorable(flat), *_ranges_m(ranges), self.kind(flat), toward)

    def scores(self, features: Tensor, source: Tensor, goal: Tensor) -> Tensor:
        """F_S of pairs among panoramas."""
        flat = features.flatten(1)
        found: Tensor = self.score(torch.cat([flat[source], flat[goal]], dim=1))
        return found

    def forward(self, source: Tensor, goal: Tensor) -> PairPrediction:
        """What sources and goals say together."""
        both = torch.cat([source.flatten(1), goal.flatten(1)], dim=1)
        intra = self.intra(both)
        return PairPrediction(
            self.connection(both)[:, 0],
            intra[:, :DIRECTIONS],
            _distance_m(intra[:, DIRECTIONS]),
            self.score(both),
        )


def _pooled(features: Tensor) -> Tensor:
    return torch.cat([features.amax(2), features.mean(2)], dim=1)


def _score_end(inputs: int, hidden: int) -> nn.Sequential:
    half = max(1, hidden // 2)
    return nn.Sequential(nn.Conv1d(inputs, half, 1), nn.ReLU(inplace=True), nn.Conv1d(half, 1, 1))


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
