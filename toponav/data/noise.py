"""The noise that is added to commands while driving, so that data shows recoveries."""

from dataclasses import dataclass

import numpy as np

from toponav.core.episode import Velocity
from toponav.core.errors import InputError

__all__ = ["NoiseConfig", "VelocityNoise"]


@dataclass(frozen=True)
class NoiseConfig:
    """A slow random walk on the commands (GraphNav, equations 2 and 3)."""

    noise_scale: float = 1.0
    """Factor on the paper's noise. Its formula settles at 0.03 m/s and 0.16 rad/s (one
    standard deviation); 0 drives as the expert says."""
    noise_linear_m_s: float = 0.2
    """Standard deviation of n_p."""
    noise_angular_rad_s: float = 1.0
    """Standard deviation of n_theta."""
    noise_memory: float = 0.95
    """How much of the noise is left at the next step."""

    def __post_init__(self) -> None:
        checks = {
            "noise_scale": 0.0 <= self.noise_scale <= 100.0,
            "noise_linear_m_s": 0.0 <= self.noise_linear_m_s <= 10.0,
            "noise_angular_rad_s": 0.0 <= self.noise_angular_rad_s <= 100.0,
            "noise_memory": 0.0 <= self.noise_memory < 1.0,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where=f"--{name.replace('_', '-')}",
                    remedy="the paper's values are 1, 0.2, 1 and 0.95",
                )


class VelocityNoise:
    """z <- 0.95 z + 0.05 n, n ~ N(0, (0.2, 1)); the robot is told the command plus z.

    Args:
        config: Amplitudes and memory.
        scale: A further factor, for drives with less noise.
    """

    def __init__(self, config: NoiseConfig, scale: float = 1.0) -> None:
        factor = (1.0 - config.noise_memory) * config.noise_scale * scale
        self._memory = config.noise_memory
        self._deviation = (
            factor * config.noise_linear_m_s,
            factor * config.noise_angular_rad_s,
        )
        self._state = (0.0, 0.0)

    def apply(self, command: Velocity, random: np.random.Generator) -> Velocity:
        """The command that the robot gets; advances the noise by one step."""
        linear, angular = random.standard_normal(2).tolist()
        self._state = (
            self._memory * self._state[0] + self._deviation[0] * linear,
            self._memory * self._state[1] + self._deviation[1] * angular,
        )
        return Velocity(
            command.linear_m_s + self._state[0], command.angular_rad_s + self._state[1]
        )
