"""Beliefs over poses: dead reckoning moves them, the pose network corrects them."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64, Int64

from toponav.core.errors import InputError

__all__ = ["PoseFilter", "PoseFilterConfig"]


@dataclass(frozen=True)
class PoseFilterConfig:
    """How a belief spreads as the robot moves, and how far a correction is trusted."""

    start_std_m: float = 2.5
    """At the start: the robot is somewhere in the room of its node."""
    start_std_rad: float = math.radians(12.0)
    """At the start: it faces along the first edge, give or take 20 degrees."""
    step_std_m: float = 0.008
    """Spread of a control step at rest."""
    step_std_rad: float = 0.006
    """Turn of a control step at rest."""
    slip: float = 0.04
    """Spread in proportion to the distance driven and the angle turned."""
    news_m: float = 0.8
    """After driving this far, what the robot sees is news; before, in proportion less."""
    news_rad: float = 0.8
    """The same for turning."""
    least_news: float = 0.02
    """A frame counts at least this share of one that is all news."""
    doubt: float = 2.0
    """Factor on what the network takes its errors to be: buildings differ from those it knows."""
    surprise: float = 3.0
    """Squared distance, in standard deviations, from which on a correction is a surprise."""
    surprise_share: float = 0.3
    """Share of a surprising correction's square by which the belief spreads."""
    most_m: float = 1.5
    """No correction moves a belief farther than this."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(
                    f"{name} must be positive, got {value}",
                    where="PoseFilterConfig",
                    remedy="leave it at its default",
                )


class PoseFilter:
    """Kalman filters over (x, y, yaw) in the map's frame, one for each of several robots.

    Attributes:
        pose: The most likely poses.
        covariance: Their spread.

    Args:
        start: Poses to begin at: nodes, facing along edges.
        config: The filters' noise.
    """

    def __init__(
        self, start: Float[np.ndarray, "robots 3"], config: PoseFilterConfig | None = None
    ) -> None:
        self.config = config or PoseFilterConfig()
        spread = [self.config.start_std_m**2] * 2 + [self.config.start_std_rad**2]
        self.pose: Float64[np.ndarray, "robots 3"] = np.array(start, dtype=np.float64)
        self.covariance: Float64[np.ndarray, "robots 3 3"] = np.tile(
            np.diag(spread), (len(start), 1, 1)
        )
        self._news = np.ones(len(start))

    def predict(self, step: Float[np.ndarray, "robots 3"]) -> None:
        """Move by dead-reckoned steps: metres forward and left, radians turned."""
        config = self.config
        turn = _rotations(self.pose[:, 2] + 0.5 * step[:, 2])
        moved = np.einsum("rij,rj->ri", turn[:, :2, :2], step[:, :2])
        self.pose[:, :2] += moved
        self.pose[:, 2] += step[:, 2]
        jacobian = np.tile(np.eye(3), (len(step), 1, 1))
        jacobian[:, 0, 2], jacobian[:, 1, 2] = -moved[:, 1], moved[:, 0]
        self._news += np.abs(step[:, 0]) / config.news_m + np.abs(step[:, 2]) / config.news_rad
        noise = np.stack(
            [
                config.step_std_m + config.slip * np.abs(step[:, 0]),
                np.full(len(step), config.step_std_m),
                config.step_std_rad + config.slip * np.abs(step[:, 2]),
            ],
            axis=1,
        )
        self.covariance = _around(jacobian, self.covariance) + _spread(turn, noise)

    def correct_some(
        self,
        robots: Int64[np.ndarray, " chosen"],
        mean: Float[np.ndarray, "chosen 3"],
        std: Float[np.ndarray, "chosen 3"],
    ) -> None:
        """`correct` for these robots alone; what the others see later is the more news."""
        some = PoseFilter(self.pose[robots], self.config)
        some.covariance, some._news = self.covariance[robots], self._news[robots]
        some.correct(mean, std)
        self.pose[robots], self.covariance[robots] = some.pose, some.covariance
        self._news[robots] = some._news

    def correct(
        self, mean: Float[np.ndarray, "robots 3"], std: Float[np.ndarray, "robots 3"]
    ) -> None:
        """Take in where the pose network sees the true poses from the believed ones.

        What is seen from one place again and again repeats its errors: a correction's variance
        is divided by how much of it is news.

        Args:
            mean: Metres forward, metres left, radians to the left.
            std: Their standard deviations.
        """
        config = self.config
        seen = np.array(mean, dtype=np.float64)
        size = np.hypot(seen[:, 0], seen[:, 1])
        seen[:, :2] *= np.minimum(1.0, config.most_m / np.maximum(size, 1e-9))[:, None]
        turn = _rotations(self.pose[:, 2])
        news = self.news
        self._news[:] = 0.0
        doubted = np.asarray(std, np.float64) * config.doubt
        self._take_surprise(np.einsum("rij,rj->ri", turn, seen), _spread(turn, doubted))
        noise = _spread(turn, doubted / np.sqrt(news)[:, None])
        gain = self.covariance @ np.linalg.inv(self.covariance + noise)
        self.pose += np.einsum("rij,rj->ri", gain @ turn, seen)
        self.covariance = _around(np.eye(3) - gain, self.covariance) + _around(gain, noise)

    def _take_surprise(
        self, seen: Float64[np.ndarray, "robots 3"], noise: Float64[np.ndarray, "robots 3 3"]
    ) -> None:
        """Spread beliefs whose corrections are larger than both of them allow for.

        A belief that is sure and wrong would otherwise stay so, whatever the network says.
        """
        config = self.config
        inverse = np.linalg.inv(self.covariance + noise)
        distance = np.einsum("ri,rij,rj->r", seen, inverse, seen)
        excess = np.maximum(0.0, 1.0 - config.surprise / np.maximum(distance, 1e-9))
        outer = seen[:, :, None] * seen[:, None, :]
        self.covariance = self.covariance + (config.surprise_share * excess)[:, None, None] * outer

    def keep(self, count: int) -> None:
        """Go on with the first robots alone."""
        self.choose(np.arange(count))

    def choose(self, robots: Int64[np.ndarray, " chosen"]) -> None:
        """Go on with these robots alone."""
        self.pose, self.covariance = self.pose[robots], self.covariance[robots]
        self._news = self._news[robots]

    @property
    def news(self) -> Float64[np.ndarray, " robots"]:
        """How much of the next correction is news, 1 for all of it."""
        share: np.ndarray = np.clip(self._news, self.config.least_news, 1.0)
        return share

    def take(
        self, mean: Float[np.ndarray, "robots 3"], std: Float[np.ndarray, "robots 3"]
    ) -> None:
        """Take corrections whole, as a robot without a filter does."""
        turn = _rotations(self.pose[:, 2])
        self.pose += np.einsum("rij,rj->ri", turn, np.asarray(mean, np.float64))
        self.covariance = _spread(turn, np.asarray(std, np.float64))

    @property
    def std_in_robot(self) -> Float64[np.ndarray, "robots 3"]:
        """Standard deviations forward, to the left, and of the heading."""
        turned = _around(_rotations(-self.pose[:, 2]), self.covariance)
        return np.asarray(np.sqrt(np.diagonal(turned, axis1=1, axis2=2)))


def _rotations(yaw_rad: Float64[np.ndarray, " robots"]) -> Float64[np.ndarray, "robots 3 3"]:
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    out = np.zeros((len(yaw_rad), 3, 3))
    out[:, 0, 0], out[:, 0, 1], out[:, 1, 0], out[:, 1, 1], out[:, 2, 2] = c, -s, s, c, 1.0
    return out


def _around(
    matrix: Float64[np.ndarray, "#robots 3 3"], middle: Float64[np.ndarray, "robots 3 3"]
) -> Float64[np.ndarray, "robots 3 3"]:
    product: np.ndarray = matrix @ middle @ matrix.transpose(0, 2, 1)
    return product


def _spread(
    turn: Float64[np.ndarray, "robots 3 3"], std: Float64[np.ndarray, "robots 3"]
) -> Float64[np.ndarray, "robots 3 3"]:
    """The covariance of independent errors along axes that are turned."""
    return _around(turn, std[:, :, None] ** 2 * np.eye(3))
