"""No command leads the robot to a node off its plan where another keeps it at the plan's."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.kept_way import ALIGNMENT_RAD, node_headings
from toponav.models.graphnav.metric.map_picture import MapArrays
from toponav.navigation.graphnav import plan_keeping_kernels as kernels

__all__ = ["PlanKeeping", "PlanKeepingConfig"]

_PERIOD_S: Final = 0.2
_TURNS_RAD_S: Final = np.array([0.0, 0.2, -0.2, 0.45, -0.45, 0.75, -0.75, 1.1, -1.1])
_REACH_M: Final = 5.0


@dataclass(frozen=True)
class PlanKeepingConfig:
    """How far ahead, and how much nearer the plan's nodes should be than others."""

    horizon_s: float = 2.0
    """How far ahead manoeuvres go."""
    margin_m: float = 0.1
    """How much nearer the plan's nodes should be."""
    dearness: float = 12.0
    """Of a step that comes short of the margin by a metre."""
    least_speed_m_s: float = 0.1
    """A slower robot is left alone: it turns at a corner, or round."""
    most_std_m: float = 0.5
    """A robot that knows less well where it is is left alone."""

    def __post_init__(self) -> None:
        if not all(0.0 < value < 1000.0 for value in vars(self).values()):
            raise InputError(
                f"every setting must be positive, got {self}",
                where="PlanKeepingConfig",
                remedy="leave it at its default",
            )


class PlanKeeping:
    """Bends commands so that the plan's nodes stay the nearest that are aligned with the robot.

    That is what being on the plan means (GraphNav, appendix B-D), and the map alone says where
    it is in danger: at doors beside a corridor, and where open spaces have large nodes.

    Args:
        task: Map and plan.
        arrays: The same as arrays.
        between_m: Metres of the plan between which it applies: not in the first and the last
            room, where only the room's own nodes count.
        config: How far ahead it looks.
    """

    def __init__(
        self,
        task: NavigationTask,
        arrays: MapArrays,
        between_m: tuple[float, float],
        config: PlanKeepingConfig | None = None,
    ) -> None:
        self.config = config or PlanKeepingConfig()
        self._between_m = between_m
        self._arrays = arrays
        self._way, self._arc = arrays.way()
        self._size = np.array([node.size for node in task.map.nodes])
        self._headings = node_headings(task.map)

    def checked(
        self,
        command: Velocity,
        last_turn_rad_s: float,
        pose: Float[np.ndarray, " 3"],
        std: Float[np.ndarray, " 3"],
        progress_m: float,
    ) -> Velocity:
        """The command, or one that turns otherwise.

        Args:
            command: What the robot would do.
            last_turn_rad_s: What it was last told to do.
            pose: The believed x, y, yaw.
            std: Of the belief: metres forward and left, radians.
            progress_m: Metres of the plan behind it.
        """
        config = self.config
        if (
            command.linear_m_s < config.least_speed_m_s
            or not self._between_m[0] < progress_m < self._between_m[1]
            or max(std[0], std[1]) > config.most_std_m
            or len(self._way) < 2
        ):
            return command
        away = np.abs(self._arrays.node_xy - pose[:2])
        turn_rad_s = kernels.kept_turn(
            np.asarray(pose, dtype=np.float64),
            command.linear_m_s,
            command.angular_rad_s,
            last_turn_rad_s,
            _TURNS_RAD_S,
            max(2, round(config.horizon_s / _PERIOD_S)),
            _PERIOD_S,
            config.margin_m,
            config.dearness,
            self._way,
            self._arc,
            progress_m,
            np.flatnonzero((away < _REACH_M).all(axis=1)),
            self._arrays.node_xy,
            self._size,
            self._arrays.on_plan,
            *self._headings,
            math.cos(ALIGNMENT_RAD),
        )
        return Velocity(command.linear_m_s, turn_rad_s)
