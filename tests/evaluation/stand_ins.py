"""Agents for tests that need no weights: they drive with the truth and pretend to localize."""

from dataclasses import replace

import numpy as np

from toponav.core.episode import Agent, Belief, Observation, Velocity
from toponav.evaluation.agents import AGENTS, AgentContext, ExpertAgent
from toponav.evaluation.protocol import Truth
from toponav.maps.task import NavigationTask


class Daydreamer(ExpertAgent):
    """Drives as the expert does, and believes the truth smeared over the edges around."""

    def __init__(self, expert: ExpertAgent, context: AgentContext) -> None:
        super().__init__(expert._planner)
        self._map = context.map
        self._rng = np.random.default_rng(context.seed)
        self._edge = ""

    def reseed(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def reset(self, task: NavigationTask) -> None:
        super().reset(task)
        self._edge = task.plan.edges[0]

    def act(self, observation: Observation) -> Velocity:
        command = super().act(observation)
        belief = super().belief()
        self._edge = belief.edge or self._edge
        edge = self._map.edge(self._edge)
        near = [
            *self._map.out_edges(edge.source),
            *self._map.out_edges(edge.target),
            *self._map.in_edges(edge.source),
        ]
        weight = {other.id: 0.4 * self._rng.random() ** 3 for other in near}
        weight[edge.id] = 1.0
        total = sum(weight.values())
        probability = {name: value / total for name, value in weight.items()}
        self._belief = replace(
            belief,
            node=edge.source,
            edge=edge.id,
            behavior=edge.behavior,
            edge_probability=probability,
        )
        return command

    def belief(self) -> Belief:
        return self._belief


def daydreamer(context: AgentContext) -> Agent[NavigationTask]:
    expert = AGENTS["expert"].build(context)
    assert isinstance(expert, ExpertAgent)
    return Daydreamer(expert, context)


class Spinner:
    """Turns on the spot."""

    def reset(self, task: NavigationTask) -> None:
        self._belief = Belief(task.start_node, task.plan.edges[0])

    def observe_truth(self, truth: Truth) -> None:
        self.truth = truth

    def act(self, observation: Observation) -> Velocity:
        return Velocity(0.0, 0.0)

    def belief(self) -> Belief:
        return self._belief


def spinner(context: AgentContext) -> Agent[NavigationTask]:
    return Spinner()
