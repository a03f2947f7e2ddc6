"""The least that an agent can do: wander, and stop somewhere."""

import numpy as np

from toponav.core.imagenav import Action, ImageGoal, ImageNavBelief, PanoramaObservation

__all__ = ["RandomWalkAgent"]

_ACTIONS = (Action.FORWARD, Action.LEFT, Action.RIGHT)
_CHANCES = (0.6, 0.2, 0.2)


class RandomWalkAgent:
    """Drives forward or turns at random, and stops with a small chance a step.

    Args:
        seed: Seed of its choices.
        stop_chance: Chance of stopping at each step.
    """

    def __init__(self, seed: int = 0, stop_chance: float = 0.01) -> None:
        self._stop_chance = stop_chance
        self.reseed(seed)

    def reseed(self, seed: int) -> None:
        """Starts its random numbers afresh."""
        self._rng = np.random.default_rng(seed)

    def reset(self, goal: ImageGoal) -> None:
        """Begins an episode; the goal does not matter."""

    def act(self, observation: PanoramaObservation) -> Action:
        """Any action."""
        if self._rng.random() < self._stop_chance:
            return Action.STOP
        return _ACTIONS[self._rng.choice(len(_ACTIONS), p=_CHANCES)]

    def belief(self) -> ImageNavBelief:
        """Nothing."""
        return ImageNavBelief(mode="wander")
