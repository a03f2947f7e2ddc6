"""Behaviour networks: depth frames in, velocity out."""

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn

from toponav.core.episode import Velocity
from toponav.models.graphnav.encoder import DepthEncoder
from toponav.models.graphnav.presets import BehaviorConfig
from toponav.models.graphnav.velocity_head import VelocityHead

__all__ = ["BehaviorNetwork", "BehaviorState"]

BehaviorState = tuple[Tensor, ...]
"""What a network carries from one step to the next: opaque, reset (None) at a switch."""


class BehaviorNetwork(nn.Module):
    """One behaviour's policy, either reactive on a stack of frames or recurrent on one frame.

    Preset `paper`: table IV for corridor_follow and find_door, where the last convolution is
    the velocity; the encoder of table II, a two-layer LSTM of 512 and a fully connected layer
    (figure 7) for the others. Reactive outputs pass the tanh that the authors' code has,
    scaled to the robot's limits. (Their code feeds the LSTM the sixth convolution; the paper,
    followed here, all seven.)

    Args:
        config: Sizes; its `image` and `frame_offsets` say what to show it.

    Reference:
        Chen et al. 2019, section V-D, figure 7, tables II and IV.
    """

    kind = "behavior"

    def __init__(self, config: BehaviorConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = DepthEncoder(config.encoder, config.image, len(config.frame_offsets))
        self.memory: nn.LSTM | None = None
        width = self.encoder.features
        if config.recurrent_layers:
            self.memory = nn.LSTM(width, config.recurrent_size, config.recurrent_layers)
            width = config.recurrent_size
        self.head = VelocityHead(config.head, config.limits)
        self.output: nn.Module = nn.Identity()
        if config.encoder.features or self.memory is not None or width != self.head.inputs:
            self.output = nn.Linear(width, self.head.inputs)

    @property
    def is_recurrent(self) -> bool:
        """Whether it learns from sequences rather than single stacks."""
        return self.memory is not None

    def forward(
        self,
        frames: UInt8[Tensor, "batch frames rows cols"] | Float[Tensor, "batch frames rows cols"],
        state: BehaviorState | None = None,
    ) -> tuple[Float[Tensor, "batch 2"], BehaviorState]:
        """Velocities (m/s, rad/s) and the state for the next step; None starts afresh."""
        features = self.encoder(frames)
        if self.memory is not None:
            steps, memory = self.memory(features[None], state)
            velocity = self.head.velocity(self.output(steps[0]))
            return velocity, tuple(memory)
        velocity = self.head.velocity(self.output(features), state[0] if state else None)
        return velocity, (velocity[:, 1],)

    def raw(
        self,
        frames: UInt8[Tensor, "batch frames rows cols"] | Float[Tensor, "batch frames rows cols"],
    ) -> Float[Tensor, "batch outputs"]:
        """What the head turns into a velocity, for the loss of a reactive network."""
        assert self.memory is None, "use raw_sequence"
        outputs: Tensor = self.output(self.encoder(frames))
        return outputs

    def raw_sequence(
        self,
        frames: UInt8[Tensor, "steps batch frames rows cols"]
        | Float[Tensor, "steps batch frames rows cols"],
    ) -> Float[Tensor, "steps batch outputs"]:
        """What the head turns into velocities at each step, from a fresh state."""
        assert self.memory is not None, "use raw"
        steps, batch = frames.shape[:2]
        features = self.encoder(frames.flatten(0, 1)).unflatten(0, (steps, batch))
        outputs: Tensor = self.output(self.memory(features)[0])
        return outputs

    @torch.inference_mode()
    def act(
        self,
        frames: UInt8[np.ndarray, "frames rows cols"],
        state: BehaviorState | None = None,
    ) -> tuple[Velocity, BehaviorState]:
        """The command for one stack of frames, within the limits it was trained for."""
        assert not self.training, "call eval() before driving"
        velocity, state = self(torch.from_numpy(frames)[None], state)
        command = Velocity(float(velocity[0, 0]), float(velocity[0, 1]))
        return self.config.limits.clip(command), state
