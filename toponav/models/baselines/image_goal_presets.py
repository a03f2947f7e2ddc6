"""Sizes of the networks that learn to act towards a picture, end to end."""

from dataclasses import dataclass
from typing import Literal

from toponav.core.errors import InputError, did_you_mean
from toponav.core.imagenav import DIRECTIONS
from toponav.models.nts.presets import NTSConfig, get_nts_preset

__all__ = [
    "MAP_CELLS",
    "MAP_CHANNELS",
    "SENSORS",
    "ImageGoalConfig",
    "ImageGoalKind",
    "ImageGoalPresetName",
    "image_goal_preset",
]

ImageGoalKind = Literal["il", "target_rl", "metric_rl"]
"""The learned baselines: ResNet + GRU + IL, target-driven RL, metric spatial map + RL."""

ImageGoalPresetName = Literal["compact", "paper"]

SENSORS = 5
"""What is felt beside the pictures: the last action, one of four, and whether it was blocked."""
MAP_CELLS = 32
"""Side of the maps around the robot, in cells."""
MAP_CHANNELS = 4
"""Obstacles and free floor, near (0.2 m a cell) and far (0.6 m)."""


@dataclass(frozen=True)
class ImageGoalConfig:
    """One policy from panoramas to actions."""

    policy: ImageGoalKind = "il"
    """Which baseline it is."""
    rows: int = 32
    """Rows of the panorama that the network sees."""
    cols: int = 144
    """Columns of it."""
    depth: bool = True
    """Whether it sees depth besides colour."""
    encoder: Literal["around", "resnet18"] = "around"
    """`around`: that of `nts_rgb` and `nts_rgbd`, and what compares panoramas there in all ways
    that one may be turned; learned before and left as they are. `resnet18`: the paper's, on
    panoramas as the camera gives them, whose features are joined end to end; learned with the
    policy."""
    width: int = 32
    """Channels of the first layers of `around`."""
    features: int = 64
    """Features of each direction."""
    matches: int = 4
    """Ways in which directions of two panoramas are compared (`around`)."""
    hidden: int = 128
    """Width of the layer that joins all that is seen and felt."""
    memory: Literal["gru", "lstm", "none"] = "gru"
    """What the robot remembers with."""
    memory_size: int = 128
    """Width of the memory."""
    metric_map: bool = False
    """Whether it sees a map around the robot, projected from depth along the odometry."""

    def __post_init__(self) -> None:
        small = self.encoder == "around"
        checks = {
            "rows": 32 <= self.rows <= 1024 and self.rows % 16 == 0,
            "cols": 32 <= self.cols <= 4096 and self.cols % (4 * DIRECTIONS if small else 32) == 0,
            "width": 1 <= self.width <= 1024,
            "features": 1 <= self.features <= 4096 and self.features % self.matches == 0,
            "matches": 1 <= self.matches <= 256,
            "hidden": 1 <= self.hidden <= 8192,
            "memory_size": 1 <= self.memory_size <= 8192,
            "metric_map": self.depth or not self.metric_map,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} does not fit the others, got {getattr(self, name)}",
                    where="ImageGoalConfig",
                    remedy="start from image_goal_preset('il', 'compact', depth=True)",
                )

    @property
    def name(self) -> str:
        """Name of its weights and of its agent, such as `il_rgbd` or `metric_map_rl_rgbd`."""
        base = "metric_map_rl" if self.policy == "metric_rl" else self.policy
        return f"{base}_{'rgbd' if self.depth else 'rgb'}"

    @property
    def channels(self) -> int:
        """Channels of the panorama that the network sees."""
        return 4 if self.depth else 3

    @property
    def is_cylinder(self) -> bool:
        """Whether panoramas are laid on a cylinder before the network sees them."""
        return self.encoder == "around"

    @property
    def has_sight(self) -> bool:
        """Whether the network sees with eyes that were learned before."""
        return self.encoder == "around"

    @property
    def azimuths(self) -> int:
        """Directions that have features."""
        return self.vision.azimuths

    @property
    def matched_channels(self) -> int:
        """What a comparison of panoramas says in each of twelve directions (`around`)."""
        return 8 * self.matches

    @property
    def seen_size(self) -> int:
        """How much `Sight.compare` says."""
        return self.features * (self.azimuths + 2) + self.matched_channels * DIRECTIONS

    @property
    def vision(self) -> NTSConfig:
        """The same sizes as Neural Topological SLAM's encoders and projections take them."""
        return NTSConfig(
            rows=self.rows,
            cols=self.cols,
            depth=self.depth,
            encoder=self.encoder,
            width=self.width,
            features=self.features,
            matches=self.matches,
        )


def image_goal_preset(
    policy: ImageGoalKind, name: ImageGoalPresetName, *, depth: bool
) -> ImageGoalConfig:
    """The sizes that a name stands for.

    Args:
        policy: Which baseline.
        name: `compact`, for processors, or `paper`: ResNet-18 on 128x512 panoramas.
        depth: Whether the network sees depth besides colour; a metric map needs it.

    Raises:
        InputError: There is no such baseline or preset, or a metric map without depth.
    """
    memories: dict[str, Literal["gru", "lstm", "none"]] = {
        "il": "gru",
        "target_rl": "none",
        "metric_rl": "lstm",
    }
    if policy not in memories:
        raise InputError(
            f"there is no learned baseline {policy!r}",
            where="image_goal_preset",
            remedy=did_you_mean(str(policy), memories),
        )
    if policy == "metric_rl" and not depth:
        raise InputError(
            "a metric map is projected from depth",
            where="--modality",
            remedy="train metric_rl with rgbd",
        )
    is_metric = policy == "metric_rl"
    if name == "compact":
        eyes = get_nts_preset("compact", depth=depth)
        return ImageGoalConfig(
            policy,
            rows=eyes.rows,
            cols=eyes.cols,
            depth=depth,
            width=eyes.width,
            features=eyes.features,
            matches=eyes.matches,
            memory=memories[policy],
            metric_map=is_metric,
        )
    if name == "paper":
        return ImageGoalConfig(
            policy,
            rows=128,
            cols=512,
            depth=depth,
            encoder="resnet18",
            features=64,
            hidden=512,
            memory=memories[policy],
            memory_size=512,
            metric_map=is_metric,
        )
    raise InputError(
        f"there is no preset {name!r}", where="--preset", remedy="give compact or paper"
    )
