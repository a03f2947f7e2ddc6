"""Which frames to learn from: stacks over time, validation buildings, mirror images."""

from dataclasses import asdict, dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float32, Int8, Int32, Int64, Shaped, UInt8

from toponav.core.errors import InputError
from toponav.data.splits import split_buildings
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.models.graphnav.presets import ImageSpec

__all__ = ["FrameStacks", "TrainingData", "check_image", "split_frames"]


@runtime_checkable
class TrainingData(Protocol):
    """What a training set offers; `toponav.data.training_set.TrainingSet` is one.

    Frames of a trajectory are contiguous and in time order.
    """

    @property
    def frames(self) -> UInt8[np.ndarray, "frames rows cols"]:
        """What the networks see, one byte a pixel."""

    @property
    def command(self) -> Float32[np.ndarray, "frames 2"]:
        """The expert's command: m/s, rad/s."""

    @property
    def executed(self) -> Float32[np.ndarray, "frames 2"]:
        """The command that the robot was given: m/s, rad/s."""

    @property
    def behavior(self) -> Int8[np.ndarray, " frames"]:
        """Index in `Behavior`, or -1."""

    @property
    def edge(self) -> Int32[np.ndarray, " frames"]:
        """Index of the edge in its map, or -1."""

    @property
    def plan_position(self) -> Int32[np.ndarray, " frames"]:
        """How many nodes of the plan the robot had come; never goes back."""

    @property
    def trajectory(self) -> Int32[np.ndarray, " frames"]:
        """Number of the trajectory."""

    def map_of(self, trajectory: int) -> TopologicalMap:
        """The map that the trajectory was driven on."""

    def plan_of(self, trajectory: int) -> Plan:
        """The plan that the trajectory followed."""

    def building_of(self, trajectory: int) -> str:
        """The building that the trajectory was driven in."""


@dataclass(frozen=True)
class Split:
    """Frames to learn from and frames to validate on, of different buildings.

    Attributes:
        train: Whether each frame is for learning.
        val: Whether each frame is for validation.
        val_buildings: Buildings held out; empty if there is but one, and trajectories were.
    """

    train: Bool[np.ndarray, " frames"]
    val: Bool[np.ndarray, " frames"]
    val_buildings: tuple[str, ...]


def split_frames(data: TrainingData) -> Split:
    """Learning and validation frames, divided by whole buildings.

    A set of a single building is divided by trajectories, every tenth for validation.

    Raises:
        InputError: There are fewer than two trajectories.
    """
    trajectory = np.asarray(data.trajectory)
    numbers = np.unique(trajectory)
    if len(numbers) < 2:
        raise InputError(
            f"training needs two trajectories or more, got {len(numbers)}",
            where="--data",
            remedy="collect more with `toponav collect graphnav`",
        )
    building = {int(number): data.building_of(int(number)) for number in numbers}
    held_out = split_buildings(building.values(), "val")
    if held_out and len(held_out) < len(set(building.values())):
        of_val = [number for number in numbers if building[int(number)] in held_out]
    else:
        held_out = frozenset()
        of_val = list(numbers[:: max(2, min(10, len(numbers)))])
    val = np.isin(trajectory, of_val)
    return Split(~val, val, tuple(sorted(held_out)))


def check_image(data: TrainingData, image: ImageSpec, preset: str) -> None:
    """Refuse a cache of another image than the preset's.

    Raises:
        InputError: The size differs, or the way that depth became bytes.
    """
    prepared = getattr(data, "image", {})
    for name, value in asdict(image).items():
        if name in prepared and prepared[name] != value:
            raise InputError(
                f"preset {preset} learns from {name} {value}, these frames have {prepared[name]}",
                where="--data",
                remedy=f"prepare the training cache for preset {preset}",
            )
    size = tuple(data.frames.shape[1:])
    if size != (image.rows, image.cols):
        raise InputError(
            f"preset {preset} learns from {image.rows}x{image.cols} pixels, "
            f"these frames have {size[0]}x{size[1]}",
            where="--data",
            remedy=f"prepare the training cache for preset {preset}",
        )


class FrameStacks:
    """Gathers stacks of past frames; before a trajectory's start its first frame repeats.

    Args:
        data: Where the frames are.
        offsets: Steps before now, oldest first.
    """

    def __init__(self, data: TrainingData, offsets: tuple[int, ...]) -> None:
        # A plain array over the same mapped file: a memmap's own indexing is slower.
        self._frames = np.asarray(data.frames)
        self._offsets = np.asarray(offsets, np.int64)
        self._first = first_frames(np.asarray(data.trajectory))

    def gather(
        self,
        index: Int64[np.ndarray, " batch"],
        mirrored: Bool[np.ndarray, " batch"],
    ) -> UInt8[np.ndarray, "batch stack rows cols"]:
        """The stack that ends at each frame, mirrored left to right where asked."""
        rows = np.maximum(index[:, None] - self._offsets, self._first[index][:, None])
        stacks: np.ndarray = self._frames[rows]
        flip = np.flatnonzero(mirrored)
        stacks[flip] = stacks[flip][..., ::-1]
        return stacks


def first_frames(trajectory: Shaped[np.ndarray, " frames"]) -> Int64[np.ndarray, " frames"]:
    """The index of the first frame of each frame's trajectory (or segment)."""
    index = np.arange(len(trajectory))
    begins = np.concatenate([[True], trajectory[1:] != trajectory[:-1]])
    return np.asarray(np.maximum.accumulate(np.where(begins, index, 0)))


def draw(
    pool: Int64[np.ndarray, " frames"], count: int, rng: np.random.Generator
) -> Int64[np.ndarray, " count"]:
    """`count` of the pool in random order, none twice before all came once."""
    assert len(pool)
    rounds = [rng.permutation(pool) for _ in range(-(-count // len(pool)))]
    return np.concatenate(rounds)[:count]
