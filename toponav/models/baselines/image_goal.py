"""Policies from two panoramas to an action: one shared encoder, a memory, four logits."""

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
from toponav.models.nts.encoder import ResNet18Encoder

__all__ = ["ImageGoalNetwork", "ImageGoalTrunk", "Memory"]

Memory = tuple[Tensor, ...]
"""State of the memory between steps: one tensor (GRU), two (LSTM) or none."""


class _Around(nn.Module):
    """A convolution whose last axis wraps."""

    def __init__(
        self, inputs: int, outputs: int, kernel: tuple[int, int], stride: tuple[int, int] = (1, 1)
    ) -> None:
        super().__init__()
        self.pad = (
            (kernel[1] - stride[1]) // 2,
            kernel[1] - stride[1] - (kernel[1] - stride[1]) // 2,
        )
        self.pad_rows = (kernel[0] - stride[0]) // 2
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, (self.pad_rows, 0))

    def forward(self, x: Tensor) -> Tensor:
        left, right = self.pad
        if left or right:
            x = torch.cat([x[..., x.shape[-1] - left :], x, x[..., :right]], dim=-1)
        return functional.relu(self.conv(x))


class _AroundEncoder(nn.Module):
    """A few features for each direction; without batch statistics, which reinforcement upsets."""

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        width = config.width
        self.layers = nn.Sequential(
            _Around(config.channels, width, (4, 4), (4, 4)),
            _Around(width, width, (3, 3)),
            _Around(width, 2 * width, (4, 3), (2, 1)),
        )
        self.columns = nn.Conv1d(2 * width * (config.rows // 8), config.features, 1)

    def forward(
        self, x: Float[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of each direction."""
        return functional.relu(self.columns(self.layers(x).flatten(1, 2)))


class _AroundJoin(nn.Module):
    """Compares two panoramas in all ways that one may be turned against the other.

    Entry (i, s) says how much direction i of what is seen resembles direction i + s of the goal.
    """

    def __init__(self, config: ImageGoalConfig) -> None:
        super().__init__()
        ways, azimuths = config.matches, config.cols // 4
        self.ways = ways
        self.project = nn.Conv1d(config.features, config.features, 1)
        self.first = nn.Conv2d(ways, 2 * ways, 3)
        self.second = nn.Conv2d(2 * ways, 4 * ways, 3)
        self.mix = nn.Conv1d(config.features + 4 * ways, config.features, 3)
        index = torch.arange(azimuths)
        shifted = (index[:, None] + index[None, :]) % azimuths
        self.register_buffer("shifted", shifted, persistent=False)
        self.size = config.features * azimuths + 2 * config.features

    def forward(
        self,
        seen: Float[Tensor, "batch features azimuths"],
        goal: Float[Tensor, "batch features azimuths"],
    ) -> Float[Tensor, "batch joined"]:
        """What both say together."""
        alike = torch.einsum("nkfi,nkfj->nkij", self._described(seen), self._described(goal))
        index = self.shifted.expand(len(alike), self.ways, -1, -1)  # type: ignore[operator]
        x = functional.pad(torch.gather(alike, 3, index), (1, 1, 1, 1), mode="circular")
        x = functional.max_pool2d(functional.relu(self.first(x)), (1, 2))
        x = functional.pad(x, (1, 1, 1, 1), mode="circular")
        x = functional.relu(self.second(x)).amax(3)
        x = functional.pad(torch.cat([seen, x], dim=1), (1, 1), mode="circular")
        x = functional.relu(self.mix(x))
        return torch.cat([x.flatten(1), goal.amax(2), goal.mean(2)], dim=1)

    def _described(self, features: Tensor) -> Tensor:
        vectors = self.project(features).unflatten(1, (self.ways, -1))
        return functional.normalize(vectors, dim=2) * 2.0


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
        small = config.encoder == "around"
        self.encoder: nn.Module = (
            _AroundEncoder(config) if small else ResNet18Encoder(config.vision)
        )
        self.join: nn.Module = _AroundJoin(config) if small else _EndToEnd(config)
        self.map = _MapEncoder() if config.metric_map else None
        inputs = int(self.join.size) + SENSORS
        self.out = nn.Linear(
            inputs + (self.map.size if self.map is not None else 0), config.hidden
        )

    def encode(
        self, images: Shaped[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of panoramas, 0 to 255; those of a goal can be kept."""
        found: Tensor = self.encoder((images.float() - 110.0) / 64.0)
        return found

    def forward(
        self, sensed: Mapping[str, Tensor], goal: Tensor | None = None
    ) -> Float[Tensor, "batch hidden"]:
        """One vector a step.

        Args:
            sensed: `image`, `sensors`, `goal` unless its features are given, `map` where used.
            goal: Features of the goals.
        """
        if goal is None:
            both = self.encode(torch.cat([sensed["image"], sensed["goal"]]))
            seen, goal = both.chunk(2)
        else:
            seen = self.encode(sensed["image"])
        parts = [self.join(seen, goal), sensed["sensors"].float()]
        if self.map is not None:
            parts.append(self.map(sensed["map"].float() / 255.0))
        return functional.relu(self.out(torch.cat(parts, dim=1)))


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
        hidden = self.trunk(sensed, goal)
        remembered, memory = self.remember(hidden[None], memory)
        return self.actor(remembered[0]), memory
