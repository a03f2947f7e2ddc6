"""An agent that acts as a learned policy says: imitation or reinforcement learning."""

from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from toponav.core.imagenav import Action, ImageGoal, ImageNavBelief, PanoramaObservation
from toponav.models.baselines.image_goal import ImageGoalNetwork, Memory
from toponav.models.nts.encoder import folded
from toponav.navigation.baselines.senses import Senses

__all__ = ["ImageGoalAgent"]


class ImageGoalAgent:
    """Acts by chance as often as the policy says, or as it likes best.

    Args:
        network: The policy.
        seed: Seed of its choices.
        sampled: Whether actions are drawn from the policy; else the likeliest is taken. A policy
            that always takes the likeliest turns to and fro for ever where two are as good.
    """

    def __init__(self, network: ImageGoalNetwork, seed: int = 0, *, sampled: bool = True) -> None:
        self._network: ImageGoalNetwork = folded(network)  # type: ignore[assignment]
        self._senses = Senses(network.config)
        self._sampled = sampled
        self._memory: Memory = network.begin()
        self._goal: Tensor | None = None
        self._last: Action | None = None
        self.reseed(seed)

    def reseed(self, seed: int) -> None:
        """Starts its random numbers afresh."""
        self._rng = np.random.default_rng(seed)

    @torch.inference_mode()
    def reset(self, goal: ImageGoal) -> None:
        """Begins an episode."""
        picture = self._senses.reset(goal)
        self._goal = self._network.encode(torch.from_numpy(picture)[None])
        self._memory = self._network.begin()
        self._last = None

    @torch.inference_mode()
    def act(self, observation: PanoramaObservation) -> Action:
        """The next action."""
        sensed = self._senses.observe(observation, self._last)
        batch: Mapping[str, Tensor] = {
            name: torch.from_numpy(value)[None] for name, value in sensed.items() if name != "goal"
        }
        logits, self._memory = self._network(batch, self._memory, self._goal)
        chance = torch.softmax(logits[0].double(), dim=0).numpy()
        if self._sampled:
            choice = int(np.searchsorted(np.cumsum(chance), self._rng.random() * chance.sum()))
        else:
            choice = int(chance.argmax())
        self._last = Action(min(choice, len(Action) - 1))
        return self._last

    def did(self, action: Action) -> None:
        """Tells it that another action was taken than it said, as while it is being taught."""
        self._last = action

    def belief(self) -> ImageNavBelief:
        """Only what it does: all else is in its weights."""
        is_stop = self._last == Action.STOP
        return ImageNavBelief(
            mode="stop" if is_stop else "act",
            stopped_because="the policy said so" if is_stop else "",
        )
