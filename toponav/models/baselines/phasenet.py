"""PhaseNet: how much of the present behaviour is done?"""

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64, UInt8
from torch import Tensor, nn

from toponav.core.vocabulary import Behavior
from toponav.models.baselines.presets import PhaseNetConfig
from toponav.models.baselines.sequence_encoder import encode_sequences, run_lstm
from toponav.models.graphnav.encoder import DepthEncoder

__all__ = ["PhaseNet", "PhaseState"]

PhaseState = tuple[Tensor, ...]
"""What the LSTM carries from one step to the next: opaque, reset (None) at a switch."""

_NUMBER = {behavior: number for number, behavior in enumerate(Behavior)}


class PhaseNet(nn.Module):
    """An LSTM over images that predicts the phase, the share of a behaviour's time gone by.

    Each step of the LSTM sees the encoded image and which behaviour is being executed. A
    sigmoid keeps the phase in [0, 1]; the paper leaves open both it and whether the network is
    told the behaviour.

    Args:
        config: Sizes; its `image` and `frame_offsets` say what to show it.

    Reference:
        Chen et al. 2019, section VII, "PhaseNet"; Yu et al. 2018, arXiv:1810.11043.
    """

    kind = "phasenet"

    def __init__(self, config: PhaseNetConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = DepthEncoder(config.encoder, config.image, len(config.frame_offsets))
        self.behavior_embedding = nn.Embedding(len(Behavior), config.embedding)
        self.memory = nn.LSTM(
            self.encoder.features + config.embedding,
            config.recurrent_size,
            config.recurrent_layers,
        )
        self.output = nn.Linear(config.recurrent_size, 1)

    def forward(
        self,
        frames: UInt8[Tensor, "valid frames rows cols"] | Float[Tensor, "valid frames rows cols"],
        is_there: Bool[Tensor, "steps batch"],
        behavior: Int64[Tensor, " batch"],
    ) -> Float[Tensor, "steps batch"]:
        """The phase at each step of sequences that begin with their behaviour.

        Args:
            frames: The stacks of the steps that are there, step by step.
            is_there: Which steps each sequence has.
            behavior: What each sequence executes, as a position in `list(Behavior)`.
        """
        features = encode_sequences(self.encoder, frames, is_there)
        told = self.behavior_embedding(behavior).expand(len(features), -1, -1)
        outputs, _ = run_lstm(self.memory, torch.cat([features, told], -1), None)
        return self._phase(outputs)

    def step(
        self,
        features: Float[Tensor, "batch features"],
        behavior: Int64[Tensor, " batch"],
        state: PhaseState | None = None,
    ) -> tuple[Float[Tensor, " batch"], PhaseState]:
        """The phase after one more encoded image, and the state for the next."""
        inputs = torch.cat([features, self.behavior_embedding(behavior)], -1)
        outputs, after = run_lstm(self.memory, inputs[None], state)
        return self._phase(outputs)[0], after

    @torch.inference_mode()
    def act(
        self,
        frames: UInt8[np.ndarray, "frames rows cols"],
        behavior: Behavior,
        state: PhaseState | None = None,
    ) -> tuple[float, PhaseState]:
        """The phase of a behaviour after one more stack; a state of None begins it."""
        assert not self.training, "call eval() before driving"
        features = self.encoder(torch.from_numpy(frames)[None])
        phase, after = self.step(features, torch.tensor([_NUMBER[behavior]]), state)
        return float(phase[0]), after

    def _phase(self, outputs: Float[Tensor, "*batch width"]) -> Float[Tensor, "*batch"]:
        return torch.sigmoid(self.output(outputs)[..., 0].float())
