"""How a behaviour network's outputs become a velocity, and what they are punished for."""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from toponav.core.episode import VelocityLimits
from toponav.models.graphnav.presets import VelocityHeadConfig

__all__ = ["VelocityHead"]

_SPEED_WEIGHT = 4.0
_INERTIA_WIDTH_RAD_S = 0.4


class VelocityHead(nn.Module):
    """Outputs to velocities and back: no parameters of its own.

    Output 0 is the speed as a share of its limit. With `regression`, output 1 is the turn rate
    as a share of its limit. With `bins`, the others are logits over turn rates spread evenly
    from the right limit to the left one; a command between two bins is shared by both.
    """

    _rates: Tensor

    def __init__(self, config: VelocityHeadConfig, limits: VelocityLimits) -> None:
        super().__init__()
        self.config = config
        self.limits = limits
        self.inputs = 2 if config.kind == "regression" else 1 + config.bins
        rates = torch.linspace(-limits.angular_rad_s, limits.angular_rad_s, config.bins)
        self.register_buffer("_rates", rates, persistent=False)

    def loss(
        self, outputs: Float[Tensor, "*batch outputs"], command: Float[Tensor, "*batch 2"]
    ) -> Float[Tensor, "*batch"]:
        """What each sample costs: squared error, or cross-entropy for the turn rate's bins."""
        outputs = outputs.float()
        speed = command[..., 0] / self.limits.linear_m_s
        turn = command[..., 1] / self.limits.angular_rad_s
        if self.config.kind == "regression":
            shares = self._shares(outputs)
            return ((shares - torch.stack([speed, turn], -1)) ** 2).mean(-1)
        target = self._soft_bins(turn)
        cross_entropy = -(target * F.log_softmax(outputs[..., 1:], -1)).sum(-1)
        return cross_entropy + _SPEED_WEIGHT * (outputs[..., 0] - speed) ** 2

    def velocity(
        self,
        outputs: Float[Tensor, "batch outputs"],
        last_turn_rad_s: Float[Tensor, " batch"] | None = None,
    ) -> Float[Tensor, "batch 2"]:
        """Velocities in m/s and rad/s. A mode near the last turn rate is favoured a little."""
        outputs = outputs.float()
        if self.config.kind == "regression":
            limits = outputs.new_tensor([self.limits.linear_m_s, self.limits.angular_rad_s])
            return self._shares(outputs) * limits
        speed = outputs[:, 0].clamp(-0.4, 1.0) * self.limits.linear_m_s
        return torch.stack([speed, self._mode(outputs[:, 1:], last_turn_rad_s)], dim=1)

    def _shares(self, outputs: Float[Tensor, "*batch 2"]) -> Float[Tensor, "*batch 2"]:
        return torch.tanh(outputs) if self.config.bounded else outputs

    def _soft_bins(self, turn: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch bins"]:
        place = (turn.clamp(-1.0, 1.0) + 1.0) * 0.5 * (self.config.bins - 1)
        bins = torch.arange(self.config.bins, dtype=place.dtype)
        return (1.0 - (place[..., None] - bins).abs()).clamp_(min=0.0)

    def _mode(
        self, logits: Float[Tensor, "batch bins"], last_rad_s: Float[Tensor, " batch"] | None
    ) -> Float[Tensor, " batch"]:
        probability = torch.softmax(logits, dim=1)
        half = self.config.mode_half_width
        padded = F.pad(probability, (half, half))
        mass = padded.unfold(1, 2 * half + 1, 1).sum(-1)
        if last_rad_s is not None and self.config.inertia:
            away = (self._rates - last_rad_s[:, None]) / _INERTIA_WIDTH_RAD_S
            mass = mass * (1.0 + self.config.inertia * torch.exp(-(away**2)))
        best = mass.argmax(dim=1, keepdim=True)
        window = torch.arange(-half, half + 1)
        near = padded.gather(1, best + half + window)
        places = (best + window).clamp(0, self.config.bins - 1)
        return (near * self._rates[places]).sum(1) / near.sum(1).clamp(min=1e-9)
