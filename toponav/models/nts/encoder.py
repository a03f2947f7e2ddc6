"""Encoders of panoramas: a few features for each direction around the robot."""

import copy

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional
from torch.nn.utils.fusion import fuse_conv_bn_eval

from toponav.models.nts.presets import NTSConfig

__all__ = ["AroundEncoder", "ResNet18Encoder", "WrappedConv", "folded"]


class WrappedConv(nn.Module):
    """A convolution whose columns wrap at the seam, with batch normalisation."""

    def __init__(
        self, inputs: int, outputs: int, kernel: tuple[int, int], stride: tuple[int, int] = (1, 1)
    ) -> None:
        super().__init__()
        # Even kernels with stride two keep the middle of what is pooled where it is.
        self.pad_rows = (kernel[0] - 1) // 2
        self.pad_cols = (kernel[1] - 1) // 2
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, bias=False)
        self.norm: nn.Module = nn.BatchNorm2d(outputs)

    def forward(self, x: Tensor) -> Tensor:
        """The convolved picture, without an activation."""
        cols = self.pad_cols
        x = torch.cat([x[..., x.shape[-1] - cols :], x, x[..., :cols]], dim=-1)
        if self.pad_rows:
            x = functional.pad(x, (0, 0, self.pad_rows, self.pad_rows))
        out: Tensor = self.norm(self.conv(x))
        return out


def folded(network: nn.Module) -> nn.Module:
    """A copy for inference whose normalisations are part of the convolutions before them."""
    answer = copy.deepcopy(network).eval()
    for module in answer.modules():
        if isinstance(module, WrappedConv) and isinstance(module.norm, nn.BatchNorm2d):
            module.conv = fuse_conv_bn_eval(module.conv, module.norm)
            module.norm = nn.Identity()
    return answer


class _Residual(nn.Module):
    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = WrappedConv(channels, channels, (3, 3))
        self.second = WrappedConv(channels, channels, (3, 3))

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(x + self.second(functional.relu(self.first(x))))


class AroundEncoder(nn.Module):
    """A small residual network that treats all directions alike."""

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        width = config.width
        self.trunk = nn.Sequential(
            WrappedConv(config.channels, width, (4, 4), (2, 2)),
            nn.ReLU(inplace=True),
            WrappedConv(width, width, (3, 3)),
            nn.ReLU(inplace=True),
            WrappedConv(width, 2 * width, (4, 4), (2, 2)),
            nn.ReLU(inplace=True),
            _Residual(2 * width),
            WrappedConv(2 * width, 2 * width, (4, 3), (2, 1)),
            nn.ReLU(inplace=True),
            _Residual(2 * width),
        )
        self.columns = WrappedConv(2 * width * (config.rows // 8), config.features, (1, 1))
        self.context = nn.ModuleList(
            [WrappedConv(config.features, config.features, (1, 5)) for _ in range(2)]
        )

    def forward(
        self, x: Float[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of each direction, from forward to the left."""
        x = self.trunk(x)
        x = functional.relu(self.columns(x.flatten(1, 2)[:, :, None]))
        for layer in self.context:
            x = functional.relu(x + layer(x))
        return x[:, :, 0]


class _Block(nn.Module):
    """Two 3x3 convolutions and a way around them (He et al. 2016)."""

    def __init__(self, inputs: int, outputs: int, stride: int) -> None:
        super().__init__()
        self.first = nn.Sequential(
            nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs)
        )
        self.second = nn.Sequential(
            nn.Conv2d(outputs, outputs, 3, 1, 1, bias=False), nn.BatchNorm2d(outputs)
        )
        self.around: nn.Module = nn.Identity()
        if stride != 1 or inputs != outputs:
            self.around = nn.Sequential(
                nn.Conv2d(inputs, outputs, 1, stride, bias=False), nn.BatchNorm2d(outputs)
            )

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(self.around(x) + self.second(functional.relu(self.first(x))))


class ResNet18Encoder(nn.Module):
    """ResNet-18 without its classifier; the columns of its last map are the directions.

    Reference:
        He et al. 2016, Deep residual learning for image recognition, table 1.
    """

    def __init__(self, config: NTSConfig) -> None:
        super().__init__()
        stages: list[nn.Module] = []
        inputs = 64
        for number, outputs in enumerate((64, 128, 256, 512)):
            stages += [
                _Block(inputs, outputs, 1 if number == 0 else 2),
                _Block(outputs, outputs, 1),
            ]
            inputs = outputs
        self.stem = nn.Sequential(
            nn.Conv2d(config.channels, 64, 7, 2, 3, bias=False),
            nn.BatchNorm2d(64),
            nn.ReLU(inplace=True),
            nn.MaxPool2d(3, 2, 1),
        )
        self.stages = nn.Sequential(*stages)
        self.columns = nn.Conv1d(512, config.features, 1)

    def forward(
        self, x: Float[Tensor, "batch channels rows cols"]
    ) -> Float[Tensor, "batch features azimuths"]:
        """Features of each direction, from forward to the left."""
        return functional.relu(self.columns(self.stages(self.stem(x)).mean(dim=2)))
