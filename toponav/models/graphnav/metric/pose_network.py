"""How far off the robot takes itself to be: what it has seen, laid over the map."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn

from toponav.models.graphnav.metric.pictures import PictureEncoder
from toponav.models.graphnav.metric.presets import PoseConfig

__all__ = ["FAR_M", "NEAR_M", "PoseNetwork"]

NEAR_M, FAR_M = 1.0, 1.6
"""A belief is near the truth within the one, and elsewhere beyond the other."""
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
        self.output = nn.Linear(config.picture.features, 7 if config.judges else 6)

    def forward(
        self,
        local_map: UInt8[Tensor, "batch forward left"],
        map_picture: Float[Tensor, "batch channels forward left"],
    ) -> tuple[Float[Tensor, "batch 3"], Float[Tensor, "batch 3"]]:
        """Mean and logarithm of the standard deviation of the true pose in the believed one.

        Metres forward, metres left, radians to the left.
        """
        mean, log_std, _ = self.judged(local_map, map_picture)
        return mean, log_std

    def judged(
        self,
        local_map: UInt8[Tensor, "batch forward left"],
        map_picture: Float[Tensor, "batch channels forward left"],
    ) -> tuple[Float[Tensor, "batch 3"], Float[Tensor, "batch 3"], Float[Tensor, " batch"] | None]:
        """What `forward` says, and the log-odds that the true pose is near the believed one.

        Near is within `NEAR_M`: where the belief is that wrong, what is there and what should
        be there have nothing to do with each other, and the offset means nothing. None where
        the network has not learned to judge.
        """
        out = self.output(self.encoder(local_map, map_picture)).float()
        log_odds = out[:, 6] if self.config.judges else None
        return out[:, :3], out[:, 3:6].clamp(*_LOG_STD), log_odds

    @staticmethod
    def loss(
        mean: Float[Tensor, "batch 3"],
        log_std: Float[Tensor, "batch 3"],
        truth: Float[Tensor, "batch 3"],
    ) -> Float[Tensor, " batch"]:
        """Negative log-likelihood of a normal distribution, without its constant."""
        away = (truth - mean) * torch.exp(-log_std)
        return (0.5 * away.square() + log_std).sum(-1)
