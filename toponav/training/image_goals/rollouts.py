"""Many robots in many homes, a step of all at a time: what reinforcement learning learns from."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal_presets import (
    MAP_CELLS,
    MAP_CHANNELS,
    SENSORS,
    ImageGoalConfig,
)
from toponav.navigation.baselines.senses import Senses
from toponav.sim.imagenav_env import ImageNavEnv
from toponav.training.image_goals.homes import HomeShelf, Route, camera_of, observation_of

__all__ = ["Robots", "RolloutSettings", "input_spaces"]


@dataclass(frozen=True)
class RolloutSettings:
    """What episodes of training are drawn from."""

    suite: str = "homes-train"
    """Homes to run in."""
    homes: int = 68
    """How many of them, from the first."""
    near_m: float = 1.0
    """Shortest paths are at least so long."""
    max_steps: int = 200
    """Length of an episode; the papers' is 500."""
    noise: bool = True
    """Whether motions and odometry are as bad as a LoCoBot's."""
    folder: Path | None = None
    """Where homes are kept between runs."""

    def shelf(self, config: ImageGoalConfig) -> HomeShelf:
        """The homes, seen as a network sees them."""
        return HomeShelf(
            self.suite,
            self.homes,
            camera_of(config),
            folder=self.folder,
            max_steps=self.max_steps,
            noise=self.noise,
        )


def input_spaces(config: ImageGoalConfig) -> dict[str, gymnasium.spaces.Box]:
    """What a network is given in a step, by name."""
    picture = gymnasium.spaces.Box(0, 255, (config.channels, config.rows, config.cols), np.uint8)
    spaces: dict[str, gymnasium.spaces.Box] = {
        "image": picture,
        "goal": picture,
        "sensors": gymnasium.spaces.Box(0.0, 1.0, (SENSORS,), np.float32),
    }
    if config.metric_map:
        shape = (MAP_CHANNELS, MAP_CELLS, MAP_CELLS)
        spaces["map"] = gymnasium.spaces.Box(0, 255, shape, np.uint8)
    return spaces


class Robots:
    """Some robots, numbered, each in a home of its own choice.

    What robot k meets depends on (seed, segment, k) and on what it does, and on nothing else, so
    it does not matter which process runs which robots.

    Args:
        config: The network's.
        settings: What episodes are drawn from.
        numbers: Of these robots among all.
        seed: Seed of the episodes.
        shelf: Other buildings than the settings say.
    """

    def __init__(
        self,
        config: ImageGoalConfig,
        settings: RolloutSettings,
        numbers: range,
        seed: int,
        shelf: HomeShelf | None = None,
    ) -> None:
        self._numbers, self._seed = numbers, seed
        shelf = shelf or settings.shelf(config)
        self._robots = [_Robot(shelf, Senses(config), settings) for _ in numbers]

    def reset(self, segment: int, far_m: float) -> list[dict[str, np.ndarray]]:
        """Begins new episodes with random numbers of their own; what every robot senses.

        Args:
            segment: Part of the training that begins.
            far_m: Shortest paths are shorter than this from now on.
        """
        return [
            robot.begin(np.random.default_rng([self._seed, segment, number]), far_m)
            for number, robot in zip(self._numbers, self._robots, strict=True)
        ]

    def step(self, actions: np.ndarray) -> list["Sensed"]:
        """What came of an action of each robot; a robot whose episode is over begins another."""
        return [
            robot.step(Action(int(action)))
            for robot, action in zip(self._robots, actions, strict=True)
        ]


@dataclass(frozen=True, eq=False)
class Sensed:
    """What came of one robot's action.

    Attributes:
        inputs: What it senses now; of the next episode where one is over.
        reward: The paper's dense reward.
        is_over: Whether the episode is over.
        info: Where it is over: `episode` (return, length), `is_success`, `spl`, and
            `terminal_observation` where time ran out.
    """

    inputs: dict[str, np.ndarray]
    reward: float
    is_over: bool
    info: dict[str, Any]


class _Robot:
    """One robot, from episode to episode."""

    def __init__(self, shelf: HomeShelf, senses: Senses, settings: RolloutSettings) -> None:
        self._shelf, self._senses, self._settings = shelf, senses, settings
        self._rng = np.random.default_rng(0)
        self._far_m = 10.0
        self._route: Route | None = None
        self._env: ImageNavEnv | None = None
        self._gained, self._steps = 0.0, 0

    def begin(self, rng: np.random.Generator, far_m: float) -> dict[str, np.ndarray]:
        self._rng, self._far_m = rng, far_m
        return self._next()

    def step(self, action: Action) -> Sensed:
        assert self._route is not None, "begin comes first"
        assert self._env is not None
        seen, reward, terminated, truncated, info = self._env.step(int(action))
        self._gained += reward
        self._steps += 1
        inputs = self._senses.observe(observation_of(seen, info["step"]), action)
        if not (terminated or truncated):
            return Sensed(inputs, reward, False, {})
        shortest_m = self._route.geodesic_m
        told: dict[str, Any] = {
            "episode": {"r": self._gained, "l": self._steps, "t": 0.0},
            "is_success": bool(info["success"]),
            "spl": info["success"] * shortest_m / max(info["path_m"], shortest_m),
            "TimeLimit.truncated": truncated,
        }
        if truncated:
            told["terminal_observation"] = inputs
        return Sensed(self._next(), reward, True, told)

    def _next(self) -> dict[str, np.ndarray]:
        home = int(self._rng.integers(len(self._shelf)))
        self._route = self._shelf.route(home, self._settings.near_m, self._far_m, self._rng)
        # Robots share homes, but not their state.
        env = self._env = self._shelf.env(home).twin()
        options = {"start": self._route.start, "goal": self._route.goal}
        seen, info = env.reset(seed=int(self._rng.integers(2**31)), options=options)
        self._senses.reset(env.goal)
        self._gained, self._steps = 0.0, 0
        return self._senses.observe(observation_of(seen, info["step"]), None)
