"""Convolutions over what the robot has seen and what the map says should be there."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn

from toponav.models.graphnav.metric.map_picture import MAP_CHANNELS
from toponav.models.graphnav.metric.presets import PictureConfig

__all__ = ["PictureEncoder"]


class PictureEncoder(nn.Module):
    """One feature vector from a local map and a map's picture in the same frame.

    Args:
        config: Layers.
        cells: Cells along a side.
    """

    def __init__(self, config: PictureConfig, cells: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        inputs, side = 2 + MAP_CHANNELS, cells
        for number, channels in enumerate(config.channels):
            kernel = 5 if number == 0 else 3
            layers.append(
                nn.Conv2d(inputs, channels, kernel, stride=2, padding=kernel // 2, bias=False)
            )
            layers += [nn.BatchNorm2d(channels), nn.ReLU(inplace=True)]
            inputs, side = channels, (side + 1) // 2
        self.convolutions = nn.Sequential(*layers)
        self.projection = nn.Sequential(
            nn.Linear(inputs * side * side, config.features),
            nn.ReLU(inplace=True),
            nn.Dropout(config.dropout),
        )

    def forward(
        self,
        local_map: UInt8[Tensor, "batch forward left"],
        map_picture: Float[Tensor, "batch channels forward left"],
    ) -> Float[Tensor, "batch features"]:
        """Features; the local map's bytes hold two bands of four bits."""
        dtype = map_picture.dtype
        low = ((local_map >> 4).to(dtype) - 7.5) / 7.5
        walls = ((local_map & 15).to(dtype) - 7.5) / 7.5
        inputs = torch.cat([low[:, None], walls[:, None], map_picture], dim=1)
        maps = self.convolutions(inputs.contiguous(memory_format=torch.channels_last))
        projected: Tensor = self.projection(maps.flatten(1))
        return projected
