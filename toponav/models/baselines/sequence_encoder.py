"""Depth stacks of sequences of unequal length to features, without encoding the padding."""

import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from toponav.models.graphnav.encoder import DepthEncoder

__all__ = ["encode_sequences", "run_lstm"]


def encode_sequences(
    encoder: DepthEncoder,
    frames: UInt8[Tensor, "valid frames rows cols"] | Float[Tensor, "valid frames rows cols"],
    is_there: Bool[Tensor, "steps batch"],
) -> Float[Tensor, "steps batch features"]:
    """Features of each step of each sequence; zero where a sequence has already ended.

    Args:
        encoder: Makes a feature of one stack.
        frames: The stacks that are there, step by step, as `is_there` is read row by row.
        is_there: Which steps each sequence has.
    """
    features: Tensor = encoder(frames).float()
    padded = features.new_zeros((*is_there.shape, encoder.features))
    return padded.masked_scatter(is_there[..., None], features)


def run_lstm(
    lstm: torch.nn.LSTM,
    inputs: Float[Tensor, "steps batch features"],
    state: tuple[Tensor, ...] | None,
) -> tuple[Float[Tensor, "steps batch width"], tuple[Tensor, ...]]:
    """Outputs at each step and the last state, in float32 whatever the encoder runs in."""
    with torch.autocast("cpu", enabled=False):
        outputs, after = lstm(inputs, state)
    return outputs, tuple(after)
