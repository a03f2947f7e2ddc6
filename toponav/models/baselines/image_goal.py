"""Policies from two panoramas to an action: shared eyes, a memory, four logits."""

from collections.abc import Mapping
from typing import ClassVar

import torch
from jaxtyping import Float, Shaped
from torch import Tensor, nn
from torch.nn import functional

from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal_presets import (
    MAP_CELLS,
    MAP_CHANNELS,
    SENSORS,
    ImageGoalConfig,
)
from toponav.models.baselines.image_goal_sight import SeenJoin, Sight
from toponav.models.nts.encoder import ResNet18Encoder

__all__ = ["ImageGoalNetwork", "ImageGoalTrunk", "Memory"]

Memory = tuple[Tensor, ...]
"""State of the memory between steps: one tensor (GRU), two (LSTM) or none."""


class _EndToEnd(nn.Module):
    """The paper's: features of both panoramas, side by side."""

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        self.size = 2 * config.features * (config.cols // 32)

    def forward(self, seen: Tensor, goal: Tensor) -> Tensor:
        return torch.cat([seen.flatten(1), goal.flatten(1)], dim=1)


class _MapEncoder(nn.Sequential):
    """What the maps around the robot say."""

    size: ClassVar[int] = 64

    def __init__(self) -> None:
        cells = MAP_CELLS // 8
        super().__init__(
            nn.Conv2d(MAP_CHANNELS, 16, 4, 2, 1),
            nn.ReLU(),
            nn.Conv2d(16, 32, 4, 2, 1),
            nn.ReLU(),
            nn.Conv2d(32, 16, 4, 2, 1),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(16 * cells * cells, self.size),
            nn.ReLU(),
        )


class ImageGoalTrunk(nn.Module):
    """From what is sensed in one step to one vector; what reinforcement learning trains too.

    Args:
        config: Sizes.
    """

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder: nn.Module | None = None
        self.join: nn.Module
        if config.has_sight:
            self.join = SeenJoin(config)
        else:
            self.encoder = ResNet18Encoder(config.vision)
            self.join = _EndToEnd(config)
        self.map = _MapEncoder() if config.metric_map else None
        inputs = int(self.join.size) + SENSORS
        self.out = nn.Linear(
            inputs + (self.map.size if self.map is not None else 0), config.hidden
        )

    def encode(
        self, images: Shaped[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of panoramas, 0 to 255, where the trunk learns to see."""
        assert self.encoder is not None
        found: Tensor = self.encoder((images.float() - 110.0) / 64.0)
        return found

    def forward(
        self, sensed: Mapping[str, Tensor], goal: Tensor | None = None
    ) -> Float[Tensor, "batch hidden"]:
        """One vector a step.

        Args:
            sensed: `sensors`, `map` where used, and `seen`, as `Sight.compare` says it; or where
                the trunk learns to see `image`, and `goal` unless its features are given.
            goal: Features of the goals.
        """
        parts = [self._seen(sensed, goal), sensed["sensors"].float()]
        if self.map is not None:
            parts.append(self.map(sensed["map"].float() / 255.0))
        return functional.relu(self.out(torch.cat(parts, dim=1)))

    def _seen(self, sensed: Mapping[str, Tensor], goal: Tensor | None) -> Tensor:
        found: Tensor
        if self.encoder is None:
            found = self.join(sensed["seen"])
        elif goal is None:
            both = self.encode(torch.cat([sensed["image"], sensed["goal"]]))
            found = self.join(*both.chunk(2))
        else:
            found = self.join(self.encode(sensed["image"]), goal)
        return found


class ImageGoalNetwork(nn.Module):
    """A policy that acts towards a picture.

    Args:
        config: Sizes.

    Reference:
        Chaplot et al. 2020, section 5.1; Zhu et al. 2017, Target-driven visual navigation;
        Chen, Gupta, Gupta 2019, Learning exploration policies for navigation.
    """

    kind: ClassVar[str] = "image_goal"

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        self.config = config
        self.sight = Sight(config) if config.has_sight else None
        self.trunk = ImageGoalTrunk(config)
        size = config.memory_size if config.memory != "none" else config.hidden
        self.memory: nn.Module | None = None
        if config.memory == "gru":
            self.memory = nn.GRU(config.hidden, size)
        elif config.memory == "lstm":
            self.memory = nn.LSTM(config.hidden, size)
        self.actor = nn.Linear(size, len(Action))

    def begin(self, batch: int = 1) -> Memory:
        """The memory at the start of an episode."""
        count = {"gru": 1, "lstm": 2, "none": 0}[self.config.memory]
        return tuple(torch.zeros(1, batch, self.config.memory_size) for _ in range(count))

    def encode(
        self, images: Shaped[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of panoramas, 0 to 255; those of a goal can be kept."""
        found: Tensor = (self.trunk if self.sight is None else self.sight).encode(images)
        return found

    def remember(
        self, hidden: Float[Tensor, "steps batch hidden"], memory: Memory
    ) -> tuple[Float[Tensor, "steps batch size"], Memory]:
        """What the memory says after each step, and its state after the last."""
        if self.memory is None:
            return hidden, memory
        if len(memory) == 1:
            out, state = self.memory(hidden, memory[0])
            return out, (state,)
        out, (state, cell) = self.memory(hidden, memory)
        return out, (state, cell)

    def forward(
        self, sensed: Mapping[str, Tensor], memory: Memory, goal: Tensor | None = None
    ) -> tuple[Float[Tensor, "batch actions"], Memory]:
        """Logits of the actions after one step of several robots, and the memory."""
        if self.sight is not None and "seen" not in sensed:
            goal = self.sight.encode(sensed["goal"]) if goal is None else goal
            seen = self.sight.compare(self.sight.encode(sensed["image"]), goal)
            sensed = {**sensed, "seen": seen}
        hidden = self.trunk(sensed, goal)
        remembered, memory = self.remember(hidden[None], memory)
        return self.actor(remembered[0]), memory
