"""BehavRNN: from the plan's behaviours and the images to the behaviour to execute now."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int64, UInt8
from torch import Tensor, nn

from toponav.core.vocabulary import Behavior
from toponav.models.baselines.presets import BehavRNNConfig
from toponav.models.baselines.sequence_encoder import encode_sequences, run_lstm
from toponav.models.graphnav.encoder import DepthEncoder

__all__ = ["BehavRNN", "DecoderState"]

DecoderState = tuple[Tensor, ...]
"""What the decoder carries from one decision to the next: opaque."""

_NUMBER = {behavior: number for number, behavior in enumerate(Behavior)}


class BehavRNN(nn.Module):
    """Sequence to sequence: an LSTM reads the plan, another starts in its state and decides.

    The decoder is shown an encoded image at each step and answers with logits over the five
    behaviours. The plan reaches it only as the state that it starts in, as in Sutskever et al.:
    where in the plan the robot is, it has to keep in mind by itself.

    Args:
        config: Sizes; its `image` and `frame_offsets` say what to show it.

    Reference:
        Chen et al. 2019, section VII, "BehavRNN"; Sutskever et al. 2014, arXiv:1409.3215.
    """

    kind = "behavrnn"

    def __init__(self, config: BehavRNNConfig) -> None:
        super().__init__()
        self.config = config
        size, layers = config.recurrent_size, config.recurrent_layers
        self.encoder = DepthEncoder(config.encoder, config.image, len(config.frame_offsets))
        self.behavior_embedding = nn.Embedding(len(Behavior), config.embedding)
        self.reader = nn.LSTM(config.embedding, size, layers)
        self.decoder = nn.LSTM(self.encoder.features, size, layers)
        self.output = nn.Linear(size, len(Behavior))

    def forward(
        self,
        frames: UInt8[Tensor, "valid frames rows cols"] | Float[Tensor, "valid frames rows cols"],
        is_there: Bool[Tensor, "steps batch"],
        plans: Sequence[Int64[Tensor, " _edges"]],
    ) -> Float[Tensor, "steps batch behaviors"]:
        """Logits over behaviours at each step of drives that begin with their plan.

        Args:
            frames: The stacks of the steps that are there, step by step.
            is_there: Which steps each drive has.
            plans: The behaviours of each plan in order, as positions in `list(Behavior)`.
        """
        features = encode_sequences(self.encoder, frames, is_there)
        outputs, _ = run_lstm(self.decoder, features, self.read(plans))
        logits: Tensor = self.output(outputs)
        return logits.float()

    def read(self, plans: Sequence[Int64[Tensor, " _edges"]]) -> DecoderState:
        """The state in which the decoder starts after each of these plans."""
        ordered = [plan.flip(0) if self.config.reads_backwards else plan for plan in plans]
        lengths = torch.tensor([len(plan) for plan in ordered])
        padded = nn.utils.rnn.pad_sequence(ordered)
        packed = nn.utils.rnn.pack_padded_sequence(
            self.behavior_embedding(padded), lengths, enforce_sorted=False
        )
        with torch.autocast("cpu", enabled=False):
            _, state = self.reader(packed)
        return tuple(state)

    @torch.inference_mode()
    def start(self, behaviors: Sequence[Behavior]) -> DecoderState:
        """The decoder's state at the beginning of a plan."""
        assert not self.training, "call eval() before driving"
        return self.read([torch.tensor([_NUMBER[behavior] for behavior in behaviors])])

    @torch.inference_mode()
    def act(
        self, frames: UInt8[np.ndarray, "frames rows cols"], state: DecoderState
    ) -> tuple[Float32[np.ndarray, " behaviors"], DecoderState]:
        """The probability of each behaviour after one more stack, and the next state."""
        assert not self.training, "call eval() before driving"
        features = self.encoder(torch.from_numpy(frames)[None])
        outputs, after = run_lstm(self.decoder, features[None], state)
        probabilities: np.ndarray = torch.softmax(self.output(outputs[0, 0]).float(), 0).numpy()
        return probabilities, after
