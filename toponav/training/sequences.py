"""Sequences of frames of unequal length, in a batch without padding frames."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from toponav.core.vocabulary import Behavior
from toponav.maps.plan import Plan
from toponav.training.samples import FrameStacks, TrainingData, first_frames

__all__ = [
    "MIRRORED",
    "FrameSequences",
    "Segments",
    "gather_sequences",
    "plan_numbers",
    "segments",
]

_ORDER = list(Behavior)
_OPPOSITE = {
    Behavior.TURN_LEFT: Behavior.TURN_RIGHT,
    Behavior.TURN_RIGHT: Behavior.TURN_LEFT,
}
MIRRORED: Int64[np.ndarray, " behaviors"] = np.array(
    [_ORDER.index(_OPPOSITE.get(behavior, behavior)) for behavior in _ORDER]
)
"""What each behaviour is in a mirror, by position in `list(Behavior)`."""


@dataclass(frozen=True)
class FrameSequences:
    """Frames of some sequences.

    Attributes:
        frames: `[valid, stack, rows, cols]`, bytes: the stacks that are there, step by step.
        is_there: `[steps, batch]`: which steps each sequence has.
        index: `[steps, batch]`: the frame of each step; past a sequence's end its last.
    """

    frames: Tensor
    is_there: Tensor
    index: Int64[np.ndarray, "steps batch"]


def gather_sequences(
    stacks: FrameStacks,
    first: Int64[np.ndarray, " batch"],
    last: Int64[np.ndarray, " batch"],
    mirrored: Bool[np.ndarray, " batch"],
    *,
    stride: int = 1,
    most_steps: int,
) -> FrameSequences:
    """The frames from `first` to `last` at every `stride`, no more than `most_steps` of them."""
    counts = np.minimum((last - first) // stride + 1, most_steps)
    step = np.arange(counts.max())[:, None]
    is_there = step < counts
    index = first + np.minimum(step, counts - 1) * stride
    flip = np.broadcast_to(mirrored, is_there.shape)[is_there]
    frames = stacks.gather(index[is_there], flip)
    return FrameSequences(torch.from_numpy(frames), torch.from_numpy(is_there), index)


@dataclass(frozen=True)
class Segments:
    """Runs of frames in which one edge of the plan was being driven.

    Attributes:
        first: First frame of each.
        last: Last frame of each.
        behavior: The behaviour of the plan's edge, as a position in `list(Behavior)`.
    """

    first: Int64[np.ndarray, " segments"]
    last: Int64[np.ndarray, " segments"]
    behavior: Int64[np.ndarray, " segments"]


def segments(data: TrainingData) -> Segments:
    """Every plan edge of every trajectory, from reaching its source to reaching its target.

    A robot between two nodes may be closest now to one, now to the other; how far it has come
    in its plan never goes back, so a segment is in one piece. What follows the goal is left
    out.
    """
    trajectory = np.asarray(data.trajectory)
    position = np.asarray(data.plan_position)
    label = trajectory.astype(np.int64) << 32 | (position.astype(np.int64) & 0xFFFFFFFF)
    first = np.unique(first_frames(label))
    last = np.append(first[1:], len(label)) - 1
    behavior = np.full(len(first), -1, np.int64)
    plans: dict[int, list[int]] = {}
    for number, frame in enumerate(first.tolist()):
        own = int(trajectory[frame])
        if own not in plans:
            plans[own] = plan_numbers(data, own).tolist()
        place = int(position[frame])
        if 0 <= place < len(plans[own]):
            behavior[number] = plans[own][place]
    kept = behavior >= 0
    return Segments(first[kept], last[kept], behavior[kept])


def plan_numbers(data: TrainingData, trajectory: int) -> Int64[np.ndarray, " edges"]:
    """The behaviours of a trajectory's plan, as positions in `list(Behavior)`."""
    plan: Plan = data.plan_of(trajectory)
    behaviors = plan.behaviors(data.map_of(trajectory))
    return np.array([_ORDER.index(behavior) for behavior in behaviors], np.int64)
