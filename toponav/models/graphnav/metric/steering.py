"""The network that drives: local map, map and plan around the believed pose to a velocity."""

import numpy as np
import torch
from jaxtyping import Float, Float32, UInt8
from torch import Tensor, nn

from toponav.core.episode import VelocityLimits
from toponav.models.graphnav.metric.map_picture import PLAN_FEATURES
from toponav.models.graphnav.metric.pictures import PictureEncoder
from toponav.models.graphnav.metric.presets import SteeringConfig
from toponav.models.graphnav.velocity_head import VelocityHead

__all__ = ["STEERING_FEATURES", "SteeringNetwork", "steering_features"]

STEERING_FEATURES = PLAN_FEATURES + 5
"""The plan's numbers, the last command, and the belief's three standard deviations."""


class SteeringNetwork(nn.Module):
    """One trunk for all behaviours, told which one is due and where the plan leads.

    Args:
        config: Sizes.
    """

    kind = "steering"

    def __init__(self, config: SteeringConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = PictureEncoder(config.picture, config.local_map.view_cells)
        self.profile = nn.Sequential(
            nn.Conv1d(config.image.rows, 24, 7, stride=2, padding=3),
            nn.ReLU(inplace=True),
            nn.Conv1d(24, 32, 5, stride=4, padding=2),
            nn.ReLU(inplace=True),
            nn.Flatten(),
            nn.Linear(32 * _after(_after(config.image.cols, 2), 4), config.profile_features),
            nn.ReLU(inplace=True),
        )
        width = config.picture.features + config.profile_features + STEERING_FEATURES
        self.head = VelocityHead(config.head, config.limits)
        self.output = nn.Sequential(
            nn.Linear(width, config.hidden),
            nn.ReLU(inplace=True),
            nn.Dropout(config.picture.dropout),
            nn.Linear(config.hidden, self.head.inputs),
        )

    def forward(
        self,
        local_map: UInt8[Tensor, "batch forward left"],
        map_picture: Float[Tensor, "batch channels forward left"],
        profile: UInt8[Tensor, "batch bands bins"],
        features: Float[Tensor, "batch features"],
    ) -> Float[Tensor, "batch outputs"]:
        """What the head turns into a velocity."""
        seen = self.profile(1.0 - profile.to(features.dtype) / 255.0)
        pictured = self.encoder(local_map, map_picture)
        outputs: Tensor = self.output(torch.cat([pictured, seen, features], dim=1))
        return outputs


def steering_features(
    plan: Float32[np.ndarray, "batch plan"],
    last_command: Float[np.ndarray, "batch 2"],
    std: Float[np.ndarray, "batch 3"],
    limits: VelocityLimits,
) -> Float32[np.ndarray, "batch features"]:
    """The numbers that the network is told beside its pictures.

    Args:
        plan: What the plan looks like (`MapArrays.plan_features`).
        last_command: m/s and rad/s.
        std: Of the belief: metres forward and left, radians.
        limits: What commands are measured by.
    """
    shares = last_command / np.array([limits.linear_m_s, limits.angular_rad_s])
    spread = np.minimum(std, 2.0) * np.array([1.0, 1.0, 4.0])
    features: np.ndarray = np.concatenate([plan, shares, spread], axis=1).astype(np.float32)
    return features


def _after(size: int, stride: int) -> int:
    return (size - 1) // stride + 1
