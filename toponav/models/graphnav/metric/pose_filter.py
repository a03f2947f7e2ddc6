"""A belief over poses: dead reckoning moves it, the pose network corrects it."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError

__all__ = ["PoseFilter", "PoseFilterConfig"]


@dataclass(frozen=True)
class PoseFilterConfig:
    """How the belief spreads as the robot moves, and how far a correction is trusted."""

    start_std_m: float = 1.8
    """At the start: the robot is somewhere in the room of its node."""
    start_std_rad: float = math.radians(12.0)
    """At the start: it faces along the first edge, give or take 20 degrees."""
    step_std_m: float = 0.008
    """Spread of a control step at rest."""
    step_std_rad: float = 0.006
    """Turn of a control step at rest."""
    slip: float = 0.04
    """Spread in proportion to the distance driven and the angle turned."""
    inflation: float = 8.0
    """Consecutive corrections repeat each other's errors: their variance counts this often."""
    most_m: float = 1.5
    """No correction moves the belief farther than this."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(
                    f"{name} must be positive, got {value}",
                    where="PoseFilterConfig",
                    remedy="leave it at its default",
                )


class PoseFilter:
    """A Kalman filter over (x, y, yaw) in the map's frame.

    Args:
        config: Its noise.
    """

    def __init__(self, config: PoseFilterConfig | None = None) -> None:
        self.config = config or PoseFilterConfig()
        self.pose = np.zeros(3)
        self.covariance = np.eye(3)

    def reset(self, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Begin at a node, facing along an edge."""
        config = self.config
        self.pose = np.array([x_m, y_m, yaw_rad])
        self.covariance = np.diag(
            [config.start_std_m**2, config.start_std_m**2, config.start_std_rad**2]
        )

    def predict(self, step: Float[np.ndarray, " 3"]) -> None:
        """Move by a dead-reckoned step: metres forward and left, radians turned."""
        config = self.config
        middle = self.pose[2] + 0.5 * step[2]
        c, s = math.cos(middle), math.sin(middle)
        dx, dy = step[0] * c - step[1] * s, step[0] * s + step[1] * c
        self.pose = self.pose + np.array([dx, dy, step[2]])
        jacobian = np.eye(3)
        jacobian[0, 2], jacobian[1, 2] = -dy, dx
        driven, turned = abs(float(step[0])), abs(float(step[2]))
        along = (config.step_std_m + config.slip * driven) ** 2
        across = config.step_std_m**2
        noise = np.diag([0.0, 0.0, (config.step_std_rad + config.slip * turned) ** 2])
        turn = np.array([[c, -s], [s, c]])
        noise[:2, :2] = turn @ np.diag([along, across]) @ turn.T
        self.covariance = jacobian @ self.covariance @ jacobian.T + noise

    def correct(self, mean: Float[np.ndarray, " 3"], std: Float[np.ndarray, " 3"]) -> None:
        """Take in where the pose network sees the true pose from the believed one.

        Args:
            mean: Metres forward, metres left, radians to the left.
            std: Their standard deviations.
        """
        config = self.config
        size = math.hypot(float(mean[0]), float(mean[1]))
        shrink = min(1.0, config.most_m / max(size, 1e-9))
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        innovation = turn @ (np.asarray(mean, dtype=np.float64) * [shrink, shrink, 1.0])
        noise = turn @ np.diag(np.asarray(std, dtype=np.float64) ** 2 * config.inflation) @ turn.T
        gain = self.covariance @ np.linalg.inv(self.covariance + noise)
        self.pose = self.pose + gain @ innovation
        left = np.eye(3) - gain
        self.covariance = left @ self.covariance @ left.T + gain @ noise @ gain.T

    @property
    def std_in_robot(self) -> Float[np.ndarray, " 3"]:
        """Standard deviations forward, to the left, and of the heading."""
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        turn = np.array([[c, s], [-s, c]])
        spread = turn @ self.covariance[:2, :2] @ turn.T
        return np.sqrt(np.array([spread[0, 0], spread[1, 1], self.covariance[2, 2]]))
