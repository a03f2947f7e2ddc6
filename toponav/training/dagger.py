"""DAgger: let the learner drive, record what the expert would have done there."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Observation, Velocity
from toponav.core.errors import InputError
from toponav.data.driving import Driver
from toponav.maps.task import NavigationTask
from toponav.models.checkpoints import holds_metric_weights, load_weights
from toponav.navigation.graphnav.agent import GraphNavAgent, load_agent
from toponav.navigation.graphnav.behavior_selection import BehaviorSelector
from toponav.navigation.graphnav.driver import BehaviorDriver
from toponav.navigation.graphnav.metric_agent import MetricGraphNavAgent, load_metric_agent
from toponav.sim.simulation import SimState

__all__ = ["LearnerFactory", "RolloutAgent"]

RolloutAgent = Literal["gtl", "graphnav", "graphnav_pf"]
_MEAN_TURN_STEPS = 25


class _LearnerTurns:
    """The learner and the expert take turns at the wheel; the expert's command is the label.

    Turns have random lengths, so that the expert also shows how to go on from wherever the
    learner has got to.
    """

    def __init__(self, driver: BehaviorDriver, agent: GraphNavAgent | None, share: float) -> None:
        self._driver = driver
        self._agent = agent
        self._share = share
        self._random = np.random.default_rng(0)
        self._selector: BehaviorSelector | None = None
        self._expert_drives = False

    def reset(self, task: NavigationTask, random: np.random.Generator, attempt: int) -> None:
        """Begin a drive."""
        self._random = random
        self._selector = BehaviorSelector(task)
        self._expert_drives = bool(random.random() < self._share)
        self._driver.reset()
        if self._agent is not None:
            self._agent.reseed(int(random.integers(2**31)))
            self._agent.reset(task)

    def act(
        self, observation: Observation, state: SimState, expert: Velocity, node: str | None
    ) -> Velocity:
        """The learner's command, or the expert's while it has the wheel."""
        if self._random.random() < 1.0 / _MEAN_TURN_STEPS:
            self._expert_drives = bool(self._random.random() < self._share)
        learner = self._learner_command(observation, node)
        return expert if self._expert_drives else learner

    def _learner_command(self, observation: Observation, node: str | None) -> Velocity:
        if self._agent is not None:
            return self._agent.act(observation)
        assert self._selector is not None, "reset the driver first"
        return self._driver.drive(self._selector.select(node), observation)


class _MetricTurns:
    """The same with preset `best`, which believes in poses; told its true one when `is_told`."""

    def __init__(self, agent: MetricGraphNavAgent, share: float, *, is_told: bool) -> None:
        self._agent, self._share, self._is_told = agent, share, is_told
        self._random = np.random.default_rng(0)
        self._expert_drives = False

    def reset(self, task: NavigationTask, random: np.random.Generator, attempt: int) -> None:
        """Begin a drive."""
        self._random = random
        self._expert_drives = bool(random.random() < self._share)
        self._agent.reset(task)

    def act(
        self, observation: Observation, state: SimState, expert: Velocity, node: str | None
    ) -> Velocity:
        """The learner's command, or the expert's while it has the wheel."""
        if self._random.random() < 1.0 / _MEAN_TURN_STEPS:
            self._expert_drives = bool(self._random.random() < self._share)
        if self._is_told:
            self._agent.tell_pose(state.pose.x_m, state.pose.y_m, state.pose.yaw_rad)
        learner = self._agent.act(observation)
        if not self._expert_drives:
            return learner
        self._agent.overruled(expert)
        return expert


@dataclass(frozen=True)
class LearnerFactory:
    """Makes the learner that drives while a DAgger round is recorded.

    Args:
        weights: Folder of checkpoints, or the name of a shipped preset.
        agent: `gtl` picks behaviours by the true node, the others localize themselves.
        expert_share: Fraction of the time that the expert drives (DAgger's beta).
        camera: The camera that the dataset is recorded with.

    Reference:
        Ross, Gordon, Bagnell 2011, arXiv:1011.0686.
    """

    weights: str
    agent: RolloutAgent = "gtl"
    expert_share: float = 0.3
    camera: PinholeCamera = field(default_factory=PinholeCamera)

    def __post_init__(self) -> None:
        if not 0.0 <= self.expert_share < 1.0:
            raise InputError(
                f"the expert's share must lie in [0, 1), got {self.expert_share}",
                where="--expert-share",
                remedy="use `toponav collect graphnav` for the expert alone",
            )

    @property
    def source(self) -> str:
        """Who drove, as the dataset's manifest names it."""
        return f"dagger:{self.agent}"

    def __call__(self) -> Driver:
        """The learner with its own copy of the networks, on one thread."""
        import torch

        torch.set_num_threads(1)
        if holds_metric_weights(self.weights):
            metric = load_metric_agent(self.weights, pose_filter=True, camera=self.camera)
            return _MetricTurns(metric, self.expert_share, is_told=self.agent == "gtl")
        driver = BehaviorDriver(load_weights(self.weights).behaviors, self.camera)
        agent = None
        if self.agent != "gtl":
            agent = load_agent(
                self.weights, particle_filter=self.agent == "graphnav_pf", camera=self.camera
            )
        return _LearnerTurns(driver, agent, self.expert_share)
