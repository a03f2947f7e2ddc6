"""Robots whose pictures are looked at once, before the policy that learns is told of them."""

from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.vec_env import VecEnvWrapper
from torch import Tensor

from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.models.baselines.image_goal_sight import Sight
from toponav.models.nts.encoder import folded
from toponav.training.image_goals.robot_processes import RobotProcesses
from toponav.training.precision import Precision, autocast

__all__ = ["SeeingRobots"]

_PICTURES = ("image", "goal")


class SeeingRobots(VecEnvWrapper):
    """Says `seen` in place of `image` and `goal`. All robots are looked through at once, so what
    is seen does not depend on the number of processes.

    Args:
        robots: What to look at.
        config: The network's.
        sight: Its eyes.
        precision: Number format of looking.
    """

    def __init__(
        self,
        robots: RobotProcesses,
        config: ImageGoalConfig,
        sight: Sight,
        precision: Precision = "float32",
    ) -> None:
        spaces = dict(robots.observation_space.spaces)  # type: ignore[attr-defined]
        for name in _PICTURES:
            del spaces[name]
        spaces["seen"] = gymnasium.spaces.Box(-np.inf, np.inf, (config.seen_size,), np.float32)
        super().__init__(robots, observation_space=gymnasium.spaces.Dict(spaces))
        self._sight: Any = folded(sight)
        self._precision = precision
        self._goals = torch.zeros(self.num_envs, config.features, config.azimuths)

    def reset(self) -> dict[str, np.ndarray]:
        """What all robots sense at the start of a segment."""
        sensed = self.venv.reset()
        assert isinstance(sensed, dict)
        with torch.inference_mode(), autocast(self._precision):
            self._goals[:] = self._sight.encode(torch.from_numpy(sensed["goal"]))
            seen = self._sight.encode(torch.from_numpy(sensed["image"]))
            return self._told(sensed, self._sight.compare(seen, self._goals))

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """What came of the actions."""
        sensed, rewards, over, infos = self.venv.step_wait()
        assert isinstance(sensed, dict)
        ended = np.flatnonzero(over)
        late = [k for k in ended.tolist() if "terminal_observation" in infos[k]]
        pictures = [sensed["image"], sensed["goal"][ended]]
        pictures += [infos[k]["terminal_observation"]["image"][None] for k in late]
        with torch.inference_mode(), autocast(self._precision):
            features = self._sight.encode(torch.from_numpy(np.concatenate(pictures)))
            seen, goals, last = features.split((len(over), len(ended), len(late)))
            if late:
                # Time ran out on the way to the goal before: it is looked for a last time.
                found = self._sight.compare(last, self._goals[late].to(last.dtype))
                for k, one in zip(late, found, strict=True):
                    alone = infos[k]["terminal_observation"]
                    infos[k]["terminal_observation"] = self._told(alone, one)
            self._goals[ended] = goals.float()
            told = self._told(sensed, self._sight.compare(seen, self._goals.to(seen.dtype)))
        return told, rewards, over, infos

    @staticmethod
    def _told(sensed: dict[str, np.ndarray], seen: Tensor) -> dict[str, np.ndarray]:
        rest = {name: value for name, value in sensed.items() if name not in _PICTURES}
        return rest | {"seen": seen.float().numpy()}
