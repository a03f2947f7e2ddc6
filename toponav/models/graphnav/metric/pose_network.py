"""How far off the robot takes itself to be: what it has seen, laid over the map."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn

from toponav.models.graphnav.metric.pictures import PictureEncoder
from toponav.models.graphnav.metric.presets import PoseConfig

__all__ = ["PoseNetwork"]

_LOG_STD = (-4.0, 1.5)


class PoseNetwork(nn.Module):
    """The true pose seen from the believed one, and how sure that is.

    The local map is what is there; the picture of the topological map, drawn around the
    believed pose, is what should be there. Where the belief is right the two agree: doors lie
    in openings, lanes in corridors. The network says how to move the belief until they do.

    Args:
        config: Sizes.
    """

    kind = "pose"

    def __init__(self, config: PoseConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = PictureEncoder(config.picture, config.local_map.view_cells)
        self.output = nn.Linear(config.picture.features, 6)

    def forward(
        self,
        local_map: UInt8[Tensor, "batch forward left"],
        map_picture: Float[Tensor, "batch channels forward left"],
    ) -> tuple[Float[Tensor, "batch 3"], Float[Tensor, "batch 3"]]:
        """Mean and logarithm of the standard deviation of the true pose in the believed one.

        Metres forward, metres left, radians to the left.
        """
        out = self.output(self.encoder(local_map, map_picture)).float()
        return out[:, :3], out[:, 3:].clamp(*_LOG_STD)

    @staticmethod
    def loss(
        mean: Float[Tensor, "batch 3"],
        log_std: Float[Tensor, "batch 3"],
        truth: Float[Tensor, "batch 3"],
    ) -> Float[Tensor, " batch"]:
        """Negative log-likelihood of a normal distribution, without its constant."""
        away = (truth - mean) * torch.exp(-log_std)
        return (0.5 * away.square() + log_std).sum(-1)
