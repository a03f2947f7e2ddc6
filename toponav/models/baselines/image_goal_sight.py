"""Eyes of the compact policies: what Neural Topological SLAM's network sees, learned before."""

import torch
from jaxtyping import Float, Shaped
from torch import Tensor, nn
from torch.nn import functional

from toponav.core.imagenav import DIRECTIONS
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.models.nts.encoder import AroundEncoder
from toponav.models.nts.matching import Matcher

__all__ = ["SeenJoin", "Sight"]

_SCALE = 0.5
_NEAR, _MIXED = 12, 24


class Sight(nn.Module):
    """The encoder of panoramas and what compares two of them, as another network learned them.

    Policies are trained on what it says, and do not change it, as Zhu et al. (2017) trained theirs
    on features of a ResNet that knew ImageNet. So a frame is looked at once, however often it is
    learned from.

    Args:
        config: Sizes; `config.seen_size` numbers come out.
    """

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        self.channels, self.size = config.channels, config.seen_size
        self.encoder = AroundEncoder(config.vision)
        self.matcher = Matcher(config.vision)
        self.requires_grad_(False)
        self.train(False)

    def train(self, mode: bool = True) -> "Sight":
        """Stays in evaluation mode: statistics of batches do not change it either."""
        super().train(False)
        return self

    def encode(
        self, images: Shaped[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of panoramas, 0 to 255; those of a goal can be kept."""
        found: Tensor = self.encoder((images.float() - 110.0) / 64.0)
        return found

    def compare(
        self,
        seen: Float[Tensor, "batch features azimuths"],
        goal: Float[Tensor, "batch features azimuths"],
    ) -> Float[Tensor, "batch size"]:
        """All that a policy is told of what is seen and of its goal.

        Features of each direction, what their comparison says in each of twelve directions, and
        what is strongest and what is common in the goal.
        """
        matched = self.matcher(seen, goal)
        parts = [seen.flatten(1), matched.flatten(1), goal.amax(2), goal.mean(2)]
        return torch.cat(parts, dim=1).float()


class SeenJoin(nn.Module):
    """What a policy learns to make of `Sight.compare`, the same in every direction at first."""

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        self.features, self.azimuths = config.features, config.azimuths
        self.matched = config.matched_channels
        self.each = config.azimuths // DIRECTIONS
        self.near = nn.Conv1d(config.features, _NEAR, 3)
        self.mix = nn.Conv1d(_NEAR * self.each + self.matched, _MIXED, 3)
        self.size = _MIXED * DIRECTIONS + 2 * self.matched + 2 * config.features

    def forward(self, seen: Float[Tensor, "batch size"]) -> Float[Tensor, "batch joined"]:
        """One vector for each."""
        seen = seen.float() * _SCALE
        sizes = (self.features * self.azimuths, self.matched * DIRECTIONS, 2 * self.features)
        features, matched, goal = torch.split(seen, list(sizes), dim=1)
        near = _around(self.near, features.reshape(-1, self.features, self.azimuths))
        # Directions are multiples of their width: half of the first one lies to the right.
        grouped = near.roll(self.each // 2, 2)
        grouped = grouped.reshape(*near.shape[:2], DIRECTIONS, self.each)
        matched = matched.reshape(-1, self.matched, DIRECTIONS)
        both = torch.cat([grouped.transpose(2, 3).flatten(1, 2), matched], dim=1)
        mixed = _around(self.mix, both)
        return torch.cat([mixed.flatten(1), matched.amax(2), matched.mean(2), goal], dim=1)


def _around(layer: nn.Conv1d, x: Tensor) -> Tensor:
    """A convolution whose ends meet, and what is positive of it."""
    return functional.relu(layer(functional.pad(x, (1, 1), mode="circular")))
