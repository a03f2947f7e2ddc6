"""The last word before the wheels: no command drives the robot into what it has seen."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float, UInt8

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.models.graphnav.metric.profile import bin_azimuths_rad
from toponav.models.graphnav.metric.profile_kernels import FARTHEST, NOTHING
from toponav.models.graphnav.presets import ImageSpec
from toponav.navigation.graphnav import avoidance_kernels as kernels

__all__ = ["AvoidanceConfig", "CollisionAvoidance"]

_SHARES: Final = np.array([1.0, 0.75, 0.5, 0.3, 0.15, 0.0])
_TURNS: Final = np.array([0.0, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5, 0.8, -0.8])
_STANDING_M_S: Final = 0.04
_TURN_AWAY_RAD_S: Final = 0.7


@dataclass(frozen=True)
class AvoidanceConfig:
    """How far a robot stays from what it has seen."""

    radius_m: float = 0.177
    """Of the robot's body."""
    margin_m: float = 0.02
    """To keep beside it."""
    horizon_s: float = 0.7
    """How far ahead an arc is checked."""
    memory: int = 15
    """Frames whose obstacles are remembered: what is beside the robot is out of its sight."""
    reach_m: float = 1.2
    """Obstacles farther away than this are not remembered."""
    patience: int = 8
    """Steps that a robot stands blocked before it turns away."""
    slowing: float = 1.0
    """How dear it is to lose all speed."""
    turning: float = 0.8
    """How dear it is to turn by a radian a second more or less."""

    def __post_init__(self) -> None:
        if not all(0.0 < value < 1000.0 for value in vars(self).values()):
            raise InputError(
                f"every setting must be positive, got {self}",
                where="AvoidanceConfig",
                remedy="leave it at its default",
            )


class CollisionAvoidance:
    """Remembers obstacles around the robot and bends or slows commands that lead into them.

    A robot that stands may always turn: it is round.

    Args:
        image: What a profile covers.
        config: Distances.
    """

    def __init__(self, image: ImageSpec, config: AvoidanceConfig | None = None) -> None:
        self.config = config or AvoidanceConfig()
        self._scale = image.max_depth_m / FARTHEST
        self._tangent = np.tan(bin_azimuths_rad(image).astype(np.float64))
        self._frames: list[np.ndarray] = []
        self._blocked, self._turn_side = 0, 0.0

    def clear(self) -> None:
        """Forget everything: an episode begins."""
        self._frames.clear()
        self._blocked, self._turn_side = 0, 0.0

    def advance(self, step: Float[np.ndarray, " 3"]) -> None:
        """The robot moved by this: metres forward and left, radians turned."""
        for points in self._frames:
            kernels.carry(points, step)

    def insert(self, profile: UInt8[np.ndarray, "bands bins"]) -> None:
        """Take in what the robot sees here: the profile's lower row."""
        seen = profile[0] != NOTHING
        forward = profile[0][seen] * self._scale
        points = np.stack([forward, forward * self._tangent[seen]], axis=1)
        near = points[(points**2).sum(axis=1) < self.config.reach_m**2]
        self._frames = [*self._frames[1 - self.config.memory :], near]

    @property
    def obstacles(self) -> Float[np.ndarray, "points 2"]:
        """What is remembered: metres forward and left of the robot."""
        return np.concatenate(self._frames) if self._frames else np.empty((0, 2))

    def checked(
        self, command: Velocity, drift_m: float = 0.0, *, may_turn_away: bool = True
    ) -> Velocity:
        """The nearest command that keeps clear.

        Args:
            command: What the robot would do.
            drift_m: How far it rolls on by the command before, whatever it does.
            may_turn_away: Whether a robot that has been blocked for a while turns to one side.
        """
        if command.linear_m_s <= 0.0 or not self._frames:
            return command
        config = self.config
        linear, angular = kernels.safest(
            np.concatenate(self._frames),
            command.linear_m_s,
            command.angular_rad_s,
            drift_m,
            config.radius_m,
            config.margin_m,
            config.horizon_s,
            _SHARES,
            _TURNS,
            config.slowing,
            config.turning,
        )
        clear = Velocity(float(linear), float(angular))
        return self._unblocked(clear) if may_turn_away else clear

    def _unblocked(self, command: Velocity) -> Velocity:
        """Turn on to one side where the way has been blocked for a while.

        A network that would drive on, now to one side of an obstacle and now to the other, would
        stand before it for ever.
        """
        config = self.config
        if command.linear_m_s > _STANDING_M_S:
            self._blocked, self._turn_side = 0, 0.0
            return command
        self._blocked += 1
        if self._blocked < config.patience:
            return command
        if self._turn_side == 0.0:
            self._turn_side = 1.0 if self._is_left_open() else -1.0
        return Velocity(0.0, self._turn_side * _TURN_AWAY_RAD_S)

    def _is_left_open(self) -> bool:
        """Whether more of what lies near is to the right."""
        points = np.concatenate(self._frames)
        return bool((points[:, 1] > 0.0).sum() <= (points[:, 1] < 0.0).sum())
