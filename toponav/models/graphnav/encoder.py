"""The convolutional encoder of GraphNav: a stack of depth frames to one feature vector."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn

from toponav.core.errors import InputError
from toponav.models.graphnav.presets import Convolution, EncoderConfig, ImageSpec

__all__ = ["DepthEncoder", "encoder_output_shape"]


def encoder_output_shape(config: EncoderConfig, image: ImageSpec) -> tuple[int, int, int]:
    """Channels, rows and columns after the last convolution.

    Raises:
        InputError: A convolution's kernel is larger than what reaches it.
    """
    rows, cols = image.rows, image.cols
    for number, convolution in enumerate(config.convolutions, start=1):
        pad_rows, pad_cols = _padding(config, convolution)
        rows = (rows + 2 * pad_rows - convolution.kernel[0]) // convolution.stride + 1
        cols = (cols + 2 * pad_cols - convolution.kernel[1]) // convolution.stride + 1
        if rows < 1 or cols < 1:
            raise InputError(
                f"convolution {number}'s kernel {convolution.kernel} is larger than its input",
                where="EncoderConfig",
                remedy=f"use fewer convolutions for {image.rows}x{image.cols} pixels",
            )
    return config.convolutions[-1].channels, rows, cols


def _padding(config: EncoderConfig, convolution: Convolution) -> tuple[int, int]:
    if not config.padded:
        return 0, 0
    return convolution.kernel[0] // 2, convolution.kernel[1] // 2


class DepthEncoder(nn.Module):
    """Strided convolutions with batch normalisation and ReLU (tables II and IV).

    With `features == 0` the last convolution has to end at 1x1 and its output is returned as
    it is, without an activation.

    Args:
        config: Layers.
        image: Size of a frame.
        frames: Frames in a stack: the input channels.

    Reference:
        Chen et al. 2019, tables II and IV.
    """

    def __init__(self, config: EncoderConfig, image: ImageSpec, frames: int) -> None:
        super().__init__()
        self.frames = frames
        channels, rows, cols = encoder_output_shape(config, image)
        layers: list[nn.Module] = []
        last = len(config.convolutions) - 1
        inputs = frames
        for number, convolution in enumerate(config.convolutions):
            layers.append(
                nn.Conv2d(
                    inputs,
                    convolution.channels,
                    convolution.kernel,
                    convolution.stride,
                    _padding(config, convolution),
                    bias=not convolution.norm,
                )
            )
            if convolution.norm:
                layers.append(nn.BatchNorm2d(convolution.channels))
            if number < last or config.features:
                layers.append(nn.ReLU(inplace=True))
            inputs = convolution.channels
        self.convolutions = nn.Sequential(*layers)
        self.projection: nn.Module = nn.Identity()
        self.features = config.features or channels
        if config.features:
            self.projection = nn.Sequential(
                nn.Linear(channels * rows * cols, config.features),
                nn.ReLU(inplace=True),
                nn.Dropout(config.dropout),
            )
        elif (rows, cols) != (1, 1):
            raise InputError(
                f"without a feature layer the convolutions have to end at 1x1, got {rows}x{cols}",
                where="EncoderConfig",
                remedy="set features, or match the image size to the convolutions",
            )

    @property
    def _dtype(self) -> torch.dtype:
        return next(self.parameters()).dtype

    def forward(
        self,
        frames: UInt8[Tensor, "batch frames rows cols"] | Float[Tensor, "batch frames rows cols"],
    ) -> Float[Tensor, "batch features"]:
        """Features of each stack. Bytes are scaled to [0, 1]; floats have to be there already."""
        frames = frames.contiguous(memory_format=torch.channels_last)
        if frames.dtype == torch.uint8:
            # Bytes are moved to channels-last first, and go straight to the format in use.
            is_mixed = torch.is_autocast_enabled("cpu")
            dtype = torch.get_autocast_dtype("cpu") if is_mixed else self._dtype
            frames = frames.to(dtype).mul_(1.0 / 255.0)
        maps = self.convolutions(frames)
        projected: Tensor = self.projection(maps.flatten(1))
        return projected
