"""Runs single episodes of a suite; what it returns depends on the episode alone."""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, VelocityLimits
from toponav.evaluation.agents import AgentChoice, AgentContext, make_agent
from toponav.evaluation.episode import (
    EpisodeRecord,
    PrivilegedAgent,
    ReseedableAgent,
    StepView,
    run_episode,
)
from toponav.evaluation.protocol import EpisodeJudge, JudgeRules
from toponav.evaluation.provenance import hash_of_code, hash_of_weights
from toponav.evaluation.suite import Suite, seed_of
from toponav.evaluation.transitions import plan_transitions
from toponav.maps.task import NavigationTask
from toponav.sim.oracle import TruthLocalizer
from toponav.sim.simulation import Simulation

__all__ = ["EpisodeWorker", "RunSettings"]


@dataclass(frozen=True)
class RunSettings:
    """Everything besides suite and agent that an episode depends on."""

    weights: str | None = None
    """Weights of the learned agents: a folder or a preset; None is what ships."""
    camera: PinholeCamera = field(default_factory=PinholeCamera)
    """The robot's depth camera."""
    limits: VelocityLimits = field(default_factory=VelocityLimits)
    """What the robot can do."""
    rules: JudgeRules = field(default_factory=JudgeRules)
    """What ends an episode."""
    seed: int = 0
    """Seed of the agents' random numbers."""


class EpisodeWorker:
    """Keeps a building, a simulator and agents, and runs the episodes that it is asked for.

    Every agent starts each episode afresh, with a seed made from (seed, agent, episode), so
    that it does not matter which worker runs what, nor in which order.

    Args:
        suite: The episodes.
        settings: What they depend on besides.
        choices: Agents with weights or settings of their own; others are known by their name
            in the registry.
    """

    def __init__(
        self, suite: Suite, settings: RunSettings, choices: Iterable[AgentChoice] = ()
    ) -> None:
        self.suite = suite
        self.settings = settings
        self._choices = {choice.label: choice for choice in choices}
        self._agents: dict[str, Agent[NavigationTask]] = {}
        self._keys_of_weights: dict[str, str] = {}
        self._warm: set[str] = set()

    @cached_property
    def localizer(self) -> TruthLocalizer:
        """Says which node a pose belongs to; as the authors judge it, any heading in a room."""
        return TruthLocalizer(self.suite.map, self.suite.scene, any_heading_in_rooms=True)

    @cached_property
    def simulation(self) -> Simulation:
        """The robot in the building."""
        return Simulation(self.suite.scene, self.settings.camera, self.settings.limits)

    def choice(self, label: str) -> AgentChoice:
        """What a label in the results stands for."""
        if label not in self._choices:
            self._choices[label] = AgentChoice.parse(label)
        return self._choices[label]

    def weights_of(self, label: str) -> str | None:
        """The folder or preset of weights that an agent gets; None is what ships."""
        return self.choice(label).weights or self.settings.weights

    def key(self, agent: str, index: int) -> str:
        """A hash of everything that the episode's record depends on, this package's code too."""
        task, choice = self.suite.task(index), self.choice(agent)
        description: dict[str, Any] = {
            "code": hash_of_code(),
            "agent": choice.agent,
            "options": choice.options,
            "weights": self.weights_hash(agent),
            "scene": self.suite.scene.content_hash,
            "map": self.suite.map_hash,
            "plan": [task.plan.nodes, task.plan.edges],
            "start": tuple(task.start),
            "camera": asdict(self.settings.camera),
            "limits": asdict(self.settings.limits),
            "rules": asdict(self.settings.rules),
            "seed": self._seed(agent, index),
        }
        return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()

    def prepare(self, agent: str) -> None:
        """Build the agent now, so that broken weights are found before anything is written."""
        self._agent(agent, self.suite.tasks[0].index)

    def run(
        self, agent: str, index: int, on_step: Callable[[StepView], None] | None = None
    ) -> EpisodeRecord:
        """The record of one episode.

        Args:
            agent: Name in the registry, or label of a choice.
            index: Number of the episode in the suite.
            on_step: Called after each decision.
        """
        suite, task = self.suite, self.suite.task(index)
        if agent not in self._warm:
            self._warm_up(agent, index)
        judge = self._judge(index)
        return run_episode(
            self.simulation,
            self._agent(agent, index),
            NavigationTask(suite.map, task.plan),
            task.start,
            judge,
            name=agent,
            index=index,
            transitions=plan_transitions(suite.map, task.plan, self._room_kinds),
            on_step=on_step,
        )

    def _judge(self, index: int) -> EpisodeJudge:
        suite, task = self.suite, self.suite.task(index)
        return EpisodeJudge(suite.map, task.plan, self.localizer, task.start, self.settings.rules)

    def _warm_up(self, name: str, index: int) -> None:
        """A first step whose record is thrown away, so that compiling counts for no episode."""
        self._warm.add(name)
        suite, task, agent = self.suite, self.suite.task(index), self._agent(name, index)
        state = self.simulation.reset(task.start)
        agent.reset(NavigationTask(suite.map, task.plan))
        if isinstance(agent, PrivilegedAgent):
            agent.observe_truth(self._judge(index).truth(state.pose, state.velocity))
        self.simulation.step(agent.act(self.simulation.observe()))

    @cached_property
    def _room_kinds(self) -> dict[str, Any]:
        return {room.name: room.kind for room in self.suite.scene.rooms}

    def _agent(self, name: str, index: int) -> Agent[NavigationTask]:
        """The agent with its random numbers started afresh."""
        seed = self._seed(name, index)
        kept: Any = self._agents.get(name)
        if isinstance(kept, ReseedableAgent):
            kept.reseed(seed)
            return self._agents[name]
        context = AgentContext(
            self.suite.scene,
            self.suite.map,
            self.settings.camera,
            self.settings.limits,
            self.weights_of(name),
            seed,
            dict(self.choice(name).options),
        )
        self._agents[name] = make_agent(self.choice(name).agent, context)
        return self._agents[name]

    def _seed(self, agent: str, index: int) -> int:
        """The same for two weights of one agent, so that chance tells them apart the least."""
        return seed_of("episode", self.settings.seed, self.choice(agent).agent, index)

    def weights_hash(self, agent: str) -> str:
        """SHA-256 over the agent's weights; empty for one that has none."""
        spec = self.choice(agent).spec
        if spec is not None and not spec.is_learned:
            return ""
        weights = str(self.weights_of(agent))
        if weights not in self._keys_of_weights:
            self._keys_of_weights[weights] = hash_of_weights(self.weights_of(agent))
        return self._keys_of_weights[weights]
