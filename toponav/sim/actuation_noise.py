"""How far a real robot's motions and odometry are off: Gaussian mixtures measured on a LoCoBot."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError
from toponav.core.files import read_json_object
from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import FORWARD_M, TURN_RAD, Action

__all__ = [
    "INTENDED",
    "LOCOBOT_FILE",
    "GaussianMixture",
    "MotionNoise",
    "locobot_noise",
    "read_motion_noise",
]

LOCOBOT_FILE = Path(__file__).with_name("noise_models") / "locobot.json"
"""The numbers of Active Neural SLAM, with their source and licence."""

_ACTIONS = {"fwd": Action.FORWARD, "left": Action.LEFT, "right": Action.RIGHT}
_REMEDY = "give mixtures as in toponav/sim/noise_models/locobot.json: weights, means, covariances"

INTENDED: dict[Action, Pose2] = {
    Action.STOP: Pose2(0.0, 0.0, 0.0),
    Action.FORWARD: Pose2(FORWARD_M, 0.0, 0.0),
    Action.LEFT: Pose2(0.0, 0.0, TURN_RAD),
    Action.RIGHT: Pose2(0.0, 0.0, -TURN_RAD),
}
"""What each action is meant to do, in the robot's frame."""


@dataclass(frozen=True, eq=False)
class GaussianMixture:
    """A mixture of Gaussians over x, y and yaw: metres, metres, radians; left is positive.

    Attributes:
        weights: Probability of each component.
        means: Mean of each.
        covariances: Covariance of each.
    """

    weights: Float[np.ndarray, " parts"]
    means: Float[np.ndarray, "parts 3"]
    covariances: Float[np.ndarray, "parts 3 3"]

    @cached_property
    def _factors(self) -> Float[np.ndarray, "parts 3 3"]:
        values, vectors = np.linalg.eigh(self.covariances)
        factors: np.ndarray = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        return factors

    @cached_property
    def _bounds(self) -> Float[np.ndarray, " parts"]:
        bounds: np.ndarray = np.cumsum(self.weights) / np.sum(self.weights)
        return bounds

    @property
    def mean(self) -> Float[np.ndarray, "3"]:
        """Mean over the components."""
        mean: np.ndarray = self.weights @ self.means / self.weights.sum()
        return mean

    def sample(self, rng: np.random.Generator) -> Pose2:
        """A draw."""
        part = int(np.searchsorted(self._bounds, rng.random(), side="right"))
        part = min(part, len(self.weights) - 1)
        x_m, y_m, yaw_rad = self.means[part] + self._factors[part] @ rng.standard_normal(3)
        return Pose2(float(x_m), float(y_m), wrap_angle(float(yaw_rad)))


@dataclass(frozen=True, eq=False)
class MotionNoise:
    """What actions really do, and what the odometry says about it.

    Attributes:
        actuation: The motion that each action makes, as a whole.
        odometry: The reading minus the motion that was made, after each action.
    """

    actuation: Mapping[Action, GaussianMixture]
    odometry: Mapping[Action, GaussianMixture]

    def motion(self, action: Action, rng: np.random.Generator) -> Pose2:
        """The motion of an action that nothing blocks, in the robot's frame."""
        if action == Action.STOP:
            return INTENDED[action]
        return self.actuation[action].sample(rng)

    def reading(self, action: Action, motion: Pose2, rng: np.random.Generator) -> Pose2:
        """What the odometry says of a motion that was made."""
        if action == Action.STOP:
            return motion
        error = self.odometry[action].sample(rng)
        return Pose2(
            motion.x_m + error.x_m,
            motion.y_m + error.y_m,
            wrap_angle(motion.yaw_rad + error.yaw_rad),
        )


@cache
def locobot_noise() -> MotionNoise:
    """The noise of a LoCoBot, measured for Active Neural SLAM (Chaplot et al. 2020)."""
    return read_motion_noise(LOCOBOT_FILE)


def read_motion_noise(path: Path) -> MotionNoise:
    """Noise from a JSON file of six mixtures in [m, m, deg], x forward, y right, yaw clockwise.

    The turns' signs in the file show the frame: `left` has 348 degrees, which is -12. So y and
    yaw are turned over here, as the authors' program does when it moves its robot.

    Raises:
        InputError: When it holds anything else.
    """
    document = read_json_object(path, max_bytes=1 << 20)
    found = {
        kind: {
            action: _mixture(document, f"{kind}_noise_{name}", path)
            for name, action in _ACTIONS.items()
        }
        for kind in ("actuation", "sensor")
    }
    return MotionNoise(found["actuation"], found["sensor"])


def _mixture(document: Mapping[str, Any], key: str, path: Path) -> GaussianMixture:
    flip = np.array([1.0, -1.0, -1.0])
    unit = np.array([1.0, 1.0, np.pi / 180.0])
    try:
        given = document[key]
        weights = np.array(given["weights"], float)
        means = np.array(given["means"], float).reshape(len(weights), 3)
        covariances = np.array(given["covariances"], float).reshape(len(weights), 3, 3)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"a mixture is missing or misshapen ({type(error).__name__}: {error})",
            where=f"{path}, {key}",
            remedy=_REMEDY,
        ) from None
    means[:, 2] = (means[:, 2] + 180.0) % 360.0 - 180.0
    values = np.linalg.eigvalsh(covariances) if np.isfinite(covariances).all() else np.array([-1])
    sound = (
        np.isfinite(means).all()
        and (weights >= 0).all()
        and np.isclose(weights.sum(), 1.0, atol=1e-3)
        and np.allclose(covariances, covariances.swapaxes(1, 2))
        and (values >= -1e-9).all()
    )
    if not sound:
        raise InputError(
            "weights must add up to 1 and covariances be symmetric and not negative",
            where=f"{path}, {key}",
            remedy=_REMEDY,
        )
    scale = flip * unit
    return GaussianMixture(weights, means * scale, covariances * np.outer(scale, scale))
