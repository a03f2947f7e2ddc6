"""Sizes of the networks of preset `best`."""

from dataclasses import dataclass, field

from toponav.core.episode import VelocityLimits
from toponav.core.errors import InputError
from toponav.models.graphnav.metric.local_map import LocalMapConfig
from toponav.models.graphnav.metric.odometry import CommandOdometry
from toponav.models.graphnav.presets import ImageSpec, VelocityHeadConfig, profile_image

__all__ = ["BestPreset", "PictureConfig", "PoseConfig", "SteeringConfig", "best_preset"]


@dataclass(frozen=True)
class PictureConfig:
    """The convolutions over the local map and the map's picture."""

    channels: tuple[int, ...] = (32, 64, 96, 128)
    """Of each convolution; each halves the sides."""
    features: int = 256
    """Width of the fully connected layer after them."""
    dropout: float = 0.1

    def __post_init__(self) -> None:
        if not (
            1 <= len(self.channels) <= 6
            and all(1 <= width <= 4096 for width in self.channels)
            and 1 <= self.features <= 4096
            and 0.0 <= self.dropout < 1.0
        ):
            raise InputError(
                f"1..6 convolutions of 1..4096 channels, got {self}",
                where="PictureConfig",
                remedy="start from best_preset()",
            )


@dataclass(frozen=True)
class PoseConfig:
    """The network that says how far off a believed pose is."""

    image: ImageSpec = field(default_factory=profile_image)
    local_map: LocalMapConfig = field(default_factory=LocalMapConfig)
    odometry: CommandOdometry = field(default_factory=CommandOdometry)
    picture: PictureConfig = field(default_factory=PictureConfig)
    judges: bool = False
    """Whether it also says if the true pose is near the believed one at all."""


@dataclass(frozen=True)
class SteeringConfig:
    """The network that drives, one trunk for all behaviours."""

    image: ImageSpec = field(default_factory=profile_image)
    local_map: LocalMapConfig = field(default_factory=LocalMapConfig)
    odometry: CommandOdometry = field(default_factory=CommandOdometry)
    picture: PictureConfig = field(default_factory=PictureConfig)
    profile_features: int = 64
    """Width of what is read from the present profile."""
    hidden: int = 256
    """Width of the layer that brings all together."""
    head: VelocityHeadConfig = field(default_factory=lambda: VelocityHeadConfig("bins"))
    limits: VelocityLimits = field(default_factory=VelocityLimits)

    def __post_init__(self) -> None:
        if not (1 <= self.profile_features <= 4096 and 1 <= self.hidden <= 4096):
            raise InputError(
                "widths are 1..4096", where="SteeringConfig", remedy="start from best_preset()"
            )


@dataclass(frozen=True)
class BestPreset:
    """A pose network and a steering network that see the same profile."""

    name: str
    image: ImageSpec
    pose: PoseConfig
    steering: SteeringConfig


def best_preset() -> BestPreset:
    """What measures best: a belief over poses, and one network that drives along the plan."""
    return BestPreset("best", profile_image(), PoseConfig(), SteeringConfig())
