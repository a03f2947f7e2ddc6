"""Sizes of GraphNav's networks: `paper` as published, `compact` for a pair of CPU cores.

A preset is only numbers. A checkpoint stores the configuration it was built from, so
changing a preset never changes what an old checkpoint means.
"""

import math
from dataclasses import dataclass, field
from typing import Literal

from toponav.core.camera import PinholeCamera
from toponav.core.episode import VelocityLimits
from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import Behavior

__all__ = [
    "BehaviorConfig",
    "Convolution",
    "EncoderConfig",
    "ImageSpec",
    "LocalizationConfig",
    "Preset",
    "PresetName",
    "VelocityHeadConfig",
    "get_preset",
    "profile_image",
]

PresetName = Literal["compact", "paper"]
_LARGEST = 8192


def _require(holds: bool, rule: str, where: str) -> None:
    if not holds:
        raise InputError(rule, where=where, remedy="start from get_preset('compact')")


@dataclass(frozen=True)
class ImageSpec:
    """What a network is shown of a depth frame; stored as one byte a pixel."""

    rows: int
    cols: int
    projection: Literal["equal_angles", "pinhole", "profile"]
    """`equal_angles`: columns uniform in azimuth, rows uniform in elevation. `pinhole`: as
    the camera gives it. `profile`: columns uniform in azimuth, rows are bands of heights
    (`toponav.models.graphnav.metric.profile`)."""
    hfov_rad: float = math.radians(150.0)
    """Horizontal field of view shown."""
    elevation_rad: float = math.radians(40.0)
    """Rows reach this far above and below the horizon (`equal_angles` only)."""
    min_depth_m: float = 0.0
    """Nearer depths read as this."""
    max_depth_m: float = 3.5
    """Farther depths read as this (section V-C)."""
    holes_read_as: Literal["far", "near"] = "far"
    """What a hole (depth 0) becomes. A simulated hole is a ray that met nothing: far."""

    def __post_init__(self) -> None:
        _require(
            1 <= self.rows <= _LARGEST and 1 <= self.cols <= _LARGEST,
            f"an image has 1..{_LARGEST} rows and columns, got {self.rows}x{self.cols}",
            "ImageSpec",
        )
        _require(
            0.0 < self.hfov_rad < math.pi and 0.0 < self.elevation_rad < math.pi / 2,
            f"fields of view are 0..180 degrees, got {self.hfov_rad}, {self.elevation_rad} rad",
            "ImageSpec",
        )
        _require(
            0.0 <= self.min_depth_m < self.max_depth_m < math.inf,
            f"0 <= min_depth_m < max_depth_m, got {self.min_depth_m}, {self.max_depth_m}",
            "ImageSpec",
        )
        _require(
            self.projection in ("equal_angles", "pinhole", "profile")
            and self.holes_read_as in ("far", "near"),
            f"unknown projection {self.projection!r} or holes_read_as {self.holes_read_as!r}",
            "ImageSpec",
        )

    @property
    def camera(self) -> PinholeCamera:
        """The pinhole camera whose image needs no resampling (`pinhole` only)."""
        return PinholeCamera(self.cols, self.rows, self.hfov_rad)


@dataclass(frozen=True)
class Convolution:
    """One convolution, then batch normalisation where wanted."""

    channels: int
    kernel: tuple[int, int]
    """Rows, columns."""
    stride: int = 2
    norm: bool = True

    def __post_init__(self) -> None:
        _require(
            1 <= self.channels <= _LARGEST
            and all(1 <= size <= 31 for size in self.kernel)
            and 1 <= self.stride <= 16,
            f"a convolution has 1..{_LARGEST} channels, kernels 1..31, stride 1..16, got {self}",
            "Convolution",
        )


@dataclass(frozen=True)
class EncoderConfig:
    """A convolutional encoder from a stack of frames to one feature vector."""

    convolutions: tuple[Convolution, ...]
    padded: bool = False
    """Whether convolutions pad by half their kernel. The paper's do not."""
    features: int = 0
    """Width of a final fully connected layer; 0 where the last convolution ends at 1x1 and is
    the feature itself."""
    dropout: float = 0.0

    def __post_init__(self) -> None:
        _require(
            1 <= len(self.convolutions) <= 32
            and 0 <= self.features <= _LARGEST
            and 0.0 <= self.dropout < 1.0,
            "an encoder has 1..32 convolutions, a feature width and a dropout below one",
            "EncoderConfig",
        )


@dataclass(frozen=True)
class VelocityHeadConfig:
    """How features become a velocity."""

    kind: Literal["regression", "bins"]
    """`regression`: two numbers, mean squared error (the paper). `bins`: the turn rate is a
    distribution over bins, and the robot takes its mode: where left and right are both right,
    the mean of the two is wrong."""
    bounded: bool = False
    """Whether a tanh bounds a regressed velocity to the limits."""
    bins: int = 25
    mode_half_width: int = 2
    """A mode gathers this many bins on either side."""
    inertia: float = 0.5
    """A mode near the last turn rate counts for up to this fraction more, so that the robot
    does not waver between two equal sides."""

    def __post_init__(self) -> None:
        _require(
            self.kind in ("regression", "bins")
            and 3 <= self.bins <= 1001
            and 0 <= self.mode_half_width < self.bins // 2
            and 0.0 <= self.inertia <= 100.0,
            f"a velocity head is 'regression' or 'bins' with 3..1001 bins, got {self}",
            "VelocityHeadConfig",
        )


@dataclass(frozen=True)
class BehaviorConfig:
    """One behaviour network."""

    behavior: Behavior
    image: ImageSpec
    frame_offsets: tuple[int, ...]
    """Frames that it sees, as steps before now at 5 Hz: oldest first, 0 last."""
    encoder: EncoderConfig
    head: VelocityHeadConfig
    recurrent_layers: int = 0
    recurrent_size: int = 512
    limits: VelocityLimits = field(default_factory=VelocityLimits)

    def __post_init__(self) -> None:
        _check_offsets(self.frame_offsets)
        _require(
            0 <= self.recurrent_layers <= 8 and 1 <= self.recurrent_size <= _LARGEST,
            "recurrent_layers is 0..8",
            "BehaviorConfig",
        )


@dataclass(frozen=True)
class LocalizationConfig:
    """The graph localization network."""

    image: ImageSpec
    frame_offsets: tuple[int, ...]
    """Frames that it sees, as steps before now at 5 Hz: oldest first, 0 last."""
    encoder: EncoderConfig
    node_kinds: Literal[3, 4]
    """3: room, hallway, open space, where a door node counts as a room, as in the authors'
    code (a door's name begins with its room's). 4: doors have a kind of their own."""
    embedding: int
    """Width of the node and edge embeddings."""
    edge_features: bool
    """Whether edges carry geometry, plan and last location beside their behaviour."""
    hidden: tuple[int, ...]
    """Hidden widths of the update functions."""
    width: int
    """Width of the features between blocks."""
    norm: Literal["batch", "layer"]
    blocks: int = 2
    ahead: int = 3
    """The crop keeps nodes this many edges ahead of its centre."""
    behind: int = 2
    """The crop keeps nodes this many edges behind its centre."""
    motion_features: bool = False
    """Whether edges also carry what the robot has commanded since it came to the last edge."""

    def __post_init__(self) -> None:
        _check_offsets(self.frame_offsets)
        widths = (self.embedding, self.width, *self.hidden)
        _require(
            self.edge_features or not self.motion_features,
            "motion_features need edge_features",
            "LocalizationConfig",
        )
        _require(
            all(1 <= width <= _LARGEST for width in widths)
            and 1 <= len(self.hidden) <= 16
            and 1 <= self.blocks <= 16
            and self.node_kinds in (3, 4)
            and self.norm in ("batch", "layer")
            and 1 <= self.ahead <= 20
            and 0 <= self.behind <= 20,
            f"widths are 1..{_LARGEST}, blocks 1..16, node_kinds 3 or 4, norm batch or layer",
            "LocalizationConfig",
        )


def _check_offsets(offsets: tuple[int, ...]) -> None:
    ordered = list(offsets) == sorted(set(offsets), reverse=True)
    _require(
        bool(offsets) and offsets[-1] == 0 and ordered and offsets[0] < 1000,
        f"frame_offsets count down to 0, got {offsets}",
        "frame_offsets",
    )


@dataclass(frozen=True)
class Preset:
    """A localization network and five behaviour networks that see the same image."""

    name: str
    image: ImageSpec
    behaviors: tuple[BehaviorConfig, ...]
    localization: LocalizationConfig

    def behavior(self, behavior: Behavior) -> BehaviorConfig:
        """The configuration of one behaviour's network."""
        return next(config for config in self.behaviors if config.behavior is behavior)

    @property
    def history(self) -> int:
        """Frames an agent has to remember, the present one included."""
        stacks = [self.localization.frame_offsets, *(b.frame_offsets for b in self.behaviors)]
        return 1 + max(offsets[0] for offsets in stacks)


def get_preset(name: str) -> Preset:
    """The preset of this name: `compact` or `paper`.

    Raises:
        InputError: There is no such preset.
    """
    builders = {"compact": _compact, "paper": _paper}
    if name not in builders:
        raise InputError(
            f"there is no preset {name!r}", where="--preset", remedy=did_you_mean(name, builders)
        )
    return builders[name]()


def profile_image() -> ImageSpec:
    """What the networks of preset `best` are shown of a depth frame."""
    return ImageSpec(2, 128, "profile")


def _paper_convolutions(outputs: int) -> tuple[Convolution, ...]:
    # Tables II and IV. The paper writes kernels as columns x rows, like its 320 x 240 images:
    # 320 columns end at 3 and 240 rows at 2, so the last kernel, "3 x 2", is 2 rows by 3.
    return (
        Convolution(32, (5, 5)),
        Convolution(64, (5, 5)),
        Convolution(128, (3, 3)),
        Convolution(256, (3, 3)),
        Convolution(512, (3, 3)),
        Convolution(512, (3, 3)),
        Convolution(outputs, (2, 3), stride=1, norm=False),
    )


def _paper() -> Preset:
    # 0.8 m and holes read as near are the authors' code; the paper gives only the 3.5 m.
    image = ImageSpec(240, 320, "pinhole", min_depth_m=0.8, holes_read_as="near")
    stack = tuple(range(19, -1, -1))

    def behavior(name: Behavior) -> BehaviorConfig:
        reactive = name in (Behavior.CORRIDOR_FOLLOW, Behavior.FIND_DOOR)
        return BehaviorConfig(
            behavior=name,
            image=image,
            frame_offsets=stack if reactive else (0,),
            encoder=EncoderConfig(_paper_convolutions(2 if reactive else 512)),
            head=VelocityHeadConfig("regression", bounded=reactive),
            recurrent_layers=0 if reactive else 2,
        )

    return Preset(
        name="paper",
        image=image,
        behaviors=tuple(behavior(name) for name in Behavior),
        localization=LocalizationConfig(
            image=image,
            frame_offsets=stack,
            encoder=EncoderConfig(_paper_convolutions(512)),
            node_kinds=3,
            embedding=512,
            edge_features=False,
            hidden=(256, 256, 256),
            width=256,
            norm="batch",
        ),
    )


def _compact_encoder(features: int, dropout: float) -> EncoderConfig:
    # A stem of stride 2 with one more layer took a fifth (localization) to two thirds
    # (behaviours) longer. After as many samples it localized no better on held-out buildings
    # and found doors slightly better, in one run of one seed that was not kept.
    return EncoderConfig(
        (
            Convolution(32, (5, 5), stride=4),
            Convolution(64, (3, 3)),
            Convolution(128, (3, 3)),
        ),
        padded=True,
        features=features,
        dropout=dropout,
    )


def _compact() -> Preset:
    image = ImageSpec(32, 96, "equal_angles")
    return Preset(
        name="compact",
        image=image,
        behaviors=tuple(
            BehaviorConfig(
                behavior=name,
                image=image,
                frame_offsets=(10, 5, 2, 0),
                encoder=_compact_encoder(192, dropout=0.1),
                head=VelocityHeadConfig("bins"),
            )
            for name in Behavior
        ),
        localization=LocalizationConfig(
            image=image,
            frame_offsets=(19, 14, 10, 6, 3, 0),
            encoder=_compact_encoder(256, dropout=0.2),
            node_kinds=4,
            embedding=32,
            edge_features=True,
            motion_features=True,
            hidden=(128,),
            width=128,
            norm="layer",
        ),
    )
