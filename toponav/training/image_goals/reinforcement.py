"""Proximal policy optimization of image-goal policies, with stable-baselines3."""

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, configure
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv
from torch import Tensor

import toponav
from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal import ImageGoalNetwork, ImageGoalTrunk
from toponav.models.baselines.image_goal_presets import ImageGoalConfig
from toponav.models.baselines.image_goal_sight import Sight
from toponav.models.baselines.image_goal_weights import digest_of_weights, open_eyes
from toponav.models.checkpoints import save_checkpoint
from toponav.training.curves import write_metrics
from toponav.training.image_goals.closed_loop import ClosedLoop
from toponav.training.image_goals.homes import HomeShelf
from toponav.training.image_goals.reinforcement_config import ReinforcementConfig
from toponav.training.image_goals.robot_processes import RobotProcesses
from toponav.training.image_goals.rollouts import RolloutSettings
from toponav.training.image_goals.seeing_robots import SeeingRobots
from toponav.training.loop import Report, TrainingResult
from toponav.training.recipes import run_metadata
from toponav.training.state import Progress, restore_state, save_state

__all__ = ["TrunkExtractor", "network_of", "train_reinforcement"]


class TrunkExtractor(BaseFeaturesExtractor):
    """Our trunk where stable-baselines3 wants its features from.

    Args:
        observation_space: What is sensed.
        config: The network's.
    """

    def __init__(self, observation_space: gymnasium.Space[Any], config: ImageGoalConfig) -> None:
        super().__init__(observation_space, config.hidden)
        self.trunk = ImageGoalTrunk(config)

    def forward(self, observations: Mapping[str, Tensor]) -> Tensor:
        """One vector a step."""
        out: Tensor = self.trunk(observations)
        return out


def train_reinforcement(
    sizes: ImageGoalConfig,
    preset: str,
    config: ReinforcementConfig,
    out: Path,
    *,
    homes: Path | None = None,
    eyes: str | Path = "nts",
    report: Report | None = None,
    shelf: HomeShelf | None = None,
) -> TrainingResult:
    """Train a policy until it has seen so many frames, or time is up; run again, it goes on.

    After every segment the policy is stored as `out/<name>.safetensors`, beside the state to
    resume from and the learning curve (`out/<name>/metrics.jsonl`), and TensorBoard's events in
    `out/<name>/tensorboard` where TensorBoard is installed.

    Args:
        sizes: The network.
        preset: Name of its sizes.
        config: How to train.
        out: Folder for the weights.
        homes: Where homes are kept between runs.
        eyes: Weights of Neural Topological SLAM that a compact policy sees with.
        report: Told about progress.
        shelf: Other buildings than homes-train; simulated in this process.

    Raises:
        InputError: The folder holds another run.
    """
    torch.set_num_threads(config.threads)
    drawn = RolloutSettings(
        homes=config.homes, near_m=config.near_m, max_steps=config.max_steps, folder=homes
    )
    workers = config.workers if shelf is None else 0
    sight = open_eyes(ImageGoalNetwork(sizes), eyes).sight
    robots = RobotProcesses(
        sizes, drawn, config.robots, workers, config.seed, config.reward_scale, shelf
    )
    try:
        return _Run(sizes, preset, config, drawn, robots, sight, out, report).run()
    finally:
        robots.close()


def network_of(
    model: PPO | RecurrentPPO, config: ImageGoalConfig, sight: Sight | None = None
) -> ImageGoalNetwork:
    """The policy and its eyes, without what only training needs."""
    policy: Any = model.policy
    network = ImageGoalNetwork(config)
    if network.sight is not None and sight is not None:
        network.sight.load_state_dict(sight.state_dict())
    network.trunk.load_state_dict(policy.features_extractor.trunk.state_dict())
    if network.memory is not None:
        network.memory.load_state_dict(policy.lstm_actor.state_dict())
    network.actor.load_state_dict(policy.action_net.state_dict())
    return network.eval()


def _learned(model: PPO | RecurrentPPO) -> torch.nn.ModuleDict:
    """What is learned, each part once: the policy knows its trunk by three names."""
    policy: Any = model.policy
    parts = {
        "trunk": policy.features_extractor,
        "actor": policy.action_net,
        "critic": policy.value_net,
    }
    if isinstance(model, RecurrentPPO):
        parts["memory"] = policy.lstm_actor
        parts["critic_in"] = policy.critic
    return torch.nn.ModuleDict(parts)


class _Run:
    """State of one run."""

    def __init__(
        self,
        sizes: ImageGoalConfig,
        preset: str,
        config: ReinforcementConfig,
        settings: RolloutSettings,
        robots: RobotProcesses,
        sight: Sight | None,
        out: Path,
        report: Report | None,
    ) -> None:
        self.sizes, self.preset, self.config = sizes, preset, config
        self.robots, self.sight, self.out, self.report = robots, sight, out, report
        self.directory = out / sizes.name
        self.directory.mkdir(parents=True, exist_ok=True)
        seeing = robots if sight is None else SeeingRobots(robots, sizes, sight, config.precision)
        self.model = _model(sizes, config, seeing)
        self.model.set_logger(_logger(self.directory))
        fingerprint = _fingerprint(sizes, config, settings, sight)
        self.learned = _learned(self.model)
        self.optimizer = self.model.policy.optimizer
        found = restore_state(
            self.directory, fingerprint, self.learned, self.learned, self.optimizer
        )
        self.progress = found or Progress(fingerprint, "float32", 0)
        self.model.num_timesteps = self.progress.step
        self.closed_loop = ClosedLoop(sizes, config.validation_episodes, homes=settings.folder)
        self.began = time.monotonic()

    def run(self) -> TrainingResult:
        """Train until all frames are seen or time is up."""
        progress = self.progress
        while progress.step < self.config.frames and not self._is_out_of_time():
            began = time.monotonic()
            self._segment(began)
        if not (self.out / f"{self.sizes.name}.safetensors").is_file() and progress.history:
            self._keep(progress.history[-1])
        return TrainingResult(
            name=self.sizes.name,
            checkpoint=self.out / f"{self.sizes.name}.safetensors",
            metrics=progress.history[-1] if progress.history else {},
            epochs=progress.epoch,
            best_epoch=progress.epoch,
            seconds=progress.elapsed_s,
            precision="float32",
        )

    def _segment(self, began: float) -> None:
        """New episodes and random numbers, some rollouts and updates, a checkpoint."""
        config, progress, model = self.config, self.progress, self.model
        set_random_seed(config.seed + 1000 * progress.epoch)
        far_m = config.far_after(progress.step)
        self.robots.begin(progress.epoch, far_m)
        model._last_obs = None
        watch = _Watch(self._told)
        model.learn(config.segment_frames, watch, log_interval=1, reset_num_timesteps=False)
        progress.epoch += 1
        progress.best_epoch = progress.epoch
        progress.step = int(model.num_timesteps)
        record: dict[str, int | float] = {
            "epoch": progress.epoch,
            "frames": progress.step,
            "far_m": round(far_m, 3),
            **watch.figures(),
        }
        simulated_s = time.monotonic() - began
        record["frames_per_second"] = round(config.segment_frames / simulated_s, 1)
        is_last = progress.step >= config.frames
        if progress.epoch % config.validate_every == 0 or is_last:
            measured = self.closed_loop.measure(network_of(model, self.sizes, self.sight))
            record |= {f"val_{name}": value for name, value in measured.items()}
        progress.history.append(record)
        progress.elapsed_s += time.monotonic() - began
        self._log(record)
        self._keep(record)
        write_metrics(self.directory, progress.history)
        save_state(self.directory, progress, self.learned, self.learned, self.optimizer)

    def _keep(self, record: Mapping[str, int | float]) -> None:
        shown = {key: value for key, value in record.items() if key != "frames_per_second"}
        about = {
            "toponav": toponav.__version__,
            "training": asdict(self.config),
            "metrics": shown,
            "frames": self.progress.step,
            "hours": round(self.progress.elapsed_s / 3600, 3),
            **run_metadata(self.preset, self.progress.fingerprint, ()),
        }
        network = network_of(self.model, self.sizes, self.sight)
        save_checkpoint(network, self.out / f"{self.sizes.name}.safetensors", about)

    def _log(self, record: Mapping[str, int | float]) -> None:
        for name, value in record.items():
            self.model.logger.record(f"toponav/{name}", value)
        self.model.logger.dump(int(record["frames"]))

    def _told(self, frames: int, figures: Mapping[str, int | float]) -> None:
        if self.report is not None:
            self.report(self.sizes.name, frames, max(self.config.frames, frames), figures)

    def _is_out_of_time(self) -> bool:
        """Whether another segment would not fit."""
        if self.config.max_minutes is None:
            return False
        spent_s = time.monotonic() - self.began
        segments = max(self.progress.epoch, 1)
        each_s = self.progress.elapsed_s / segments
        return spent_s + each_s > self.config.max_minutes * 60


class _Watch(BaseCallback):
    """Counts what the episodes of a segment came to."""

    def __init__(self, told: Callable[[int, Mapping[str, int | float]], None]) -> None:
        super().__init__()
        self._told = told
        self._episodes: list[tuple[float, float, float, float]] = []

    def figures(self) -> dict[str, int | float]:
        """Means over the episodes that ended."""
        if not self._episodes:
            return {"episodes": 0}
        reward, length, success, spl = np.mean(self._episodes, axis=0).tolist()
        return {
            "episodes": len(self._episodes),
            "reward": reward,
            "length": length,
            "train_success": success,
            "train_spl": spl,
        }

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                one = info["episode"]
                self._episodes.append(
                    (one["r"], one["l"], float(info["is_success"]), float(info["spl"]))
                )
        return True

    def _on_rollout_end(self) -> None:
        loss = self.logger.name_to_value.get("train/loss", 0.0)
        self._told(int(self.num_timesteps), {"loss": float(loss), **self.figures()})


def _model(
    sizes: ImageGoalConfig, config: ReinforcementConfig, robots: VecEnv
) -> PPO | RecurrentPPO:
    set_random_seed(config.seed)
    shared: dict[str, Any] = {
        "features_extractor_class": TrunkExtractor,
        "features_extractor_kwargs": {"config": sizes},
        "net_arch": {"pi": [], "vf": []},
        "normalize_images": False,
        "optimizer_kwargs": {"eps": 1e-5},
    }
    settings: dict[str, Any] = {
        "learning_rate": config.learning_rate,
        "n_steps": config.steps,
        "batch_size": config.batch_size,
        "n_epochs": config.epochs,
        "gamma": config.discount,
        "gae_lambda": config.trace,
        "clip_range": config.clip,
        "ent_coef": config.entropy,
        "device": "cuda" if torch.cuda.is_available() else "cpu",
        "seed": config.seed,
    }
    model: PPO | RecurrentPPO
    if sizes.memory == "lstm":
        shared |= {
            "lstm_hidden_size": sizes.memory_size,
            # A critic on the actor's memory would not be allowed to change it; this one, without
            # memory, teaches the trunk too.
            "shared_lstm": False,
            "enable_critic_lstm": False,
        }
        model = RecurrentPPO("MultiInputLstmPolicy", robots, policy_kwargs=shared, **settings)
    else:
        model = PPO("MultiInputPolicy", robots, policy_kwargs=shared, **settings)
    policy: Any = model.policy
    with torch.no_grad():
        policy.action_net.bias[int(Action.STOP)] = config.stop_logit
    return model


def _logger(directory: Path) -> Logger:
    """TensorBoard's events where it is installed, else nothing: the curve is in metrics.jsonl."""
    formats = ["tensorboard"] if find_spec("tensorboard") is not None else []
    return configure(str(directory / "tensorboard"), formats)


def _fingerprint(
    sizes: ImageGoalConfig,
    config: ReinforcementConfig,
    settings: RolloutSettings,
    sight: Sight | None,
) -> str:
    """Digest of all that decides the result but the clock, the number of frames and processes."""
    kept = asdict(config)
    for name in ("frames", "max_minutes", "workers", "validation_episodes", "validate_every"):
        del kept[name]
    drawn = asdict(settings)
    del drawn["folder"]
    document = {
        "config": kept,
        "network": asdict(sizes),
        "settings": drawn,
        "eyes": digest_of_weights(sight) if sight is not None else None,
        "toponav": toponav.__version__,
        "torch": torch.__version__,
    }
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
