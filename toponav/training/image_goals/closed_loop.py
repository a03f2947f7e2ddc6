"""How often a policy finds its goal while it is trained: frozen episodes of homes-val."""

from pathlib import Path

import numpy as np

from toponav.core.imagenav import DIFFICULTIES, Difficulty, ImageNavAgent, ImageNavEpisode
from toponav.data.nts.episodes import load_episodes
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.navigation.baselines.image_goal_agent import ImageGoalAgent
from toponav.navigation.baselines.random_walk import RandomWalkAgent
from toponav.sim.imagenav_env import ImageNavEnv
from toponav.training.image_goals.homes import HomeShelf, camera_of, observation_of

__all__ = ["ClosedLoop"]


class ClosedLoop:
    """Runs a policy on the first frozen episodes of homes-val, as compact panoramas show them.

    Panoramas are rendered at the network's size, so a figure here comes close to, but is not, one
    of `toponav eval imagenav`, which gives agents whole panoramas.

    Args:
        config: The network's.
        episodes: How many of each difficulty; 0 measures nothing.
        levels: Which difficulties.
        max_steps: Length of an episode.
        homes: Where homes are kept between runs.
    """

    def __init__(
        self,
        config: ImageGoalConfig,
        episodes: int,
        levels: tuple[Difficulty, ...] = DIFFICULTIES,
        max_steps: int = 200,
        homes: Path | None = None,
    ) -> None:
        self._episodes: tuple[ImageNavEpisode, ...] = ()
        if episodes:
            self._episodes = tuple(
                one for level in levels for one in load_episodes("homes-val", level, episodes)
            )
        self._levels = levels if episodes else ()
        self._shelf = HomeShelf(
            "homes-val", camera=camera_of(config), folder=homes, max_steps=max_steps
        )

    def measure(self, network: ImageGoalNetwork) -> dict[str, int | float]:
        """Success and SPL, in all and by difficulty; the same random numbers each time."""
        was_training = network.training
        found = self._measure(ImageGoalAgent(network))
        network.train(was_training)
        return found

    def chance(self) -> dict[str, int | float]:
        """What the random walk comes to."""
        return self._measure(RandomWalkAgent())

    def _measure(self, agent: ImageGoalAgent | RandomWalkAgent) -> dict[str, int | float]:
        results: dict[str, list[tuple[float, float]]] = {level: [] for level in self._levels}
        for number, episode in enumerate(self._episodes):
            env = self._shelf.env(self._shelf.seeds.index(episode.scene_seed))
            agent.reseed(number)
            results[episode.difficulty].append(_run(env, agent, episode, number))
        if not self._episodes:
            return {}
        every = [one for some in results.values() for one in some]
        found: dict[str, int | float] = {
            "success": float(np.mean([success for success, _ in every])),
            "spl": float(np.mean([spl for _, spl in every])),
        }
        for level, some in results.items():
            found[f"success_{level}"] = float(np.mean([success for success, _ in some]))
        return found


def _run(
    env: ImageNavEnv, agent: ImageNavAgent, episode: ImageNavEpisode, seed: int
) -> tuple[float, float]:
    """Success and SPL of one episode."""
    seen, info = env.reset(seed=seed, options={"episode": episode})
    agent.reset(env.goal)
    over = False
    while not over:
        action = agent.act(observation_of(seen, info["step"]))
        seen, _, terminated, truncated, info = env.step(int(action))
        over = terminated or truncated
    success = float(info["success"])
    return success, success * episode.geodesic_m / max(info["path_m"], episode.geodesic_m)
