"""GTL for weights of preset `best`: the agent is told its true pose."""

from toponav.core.episode import Belief, Observation, Velocity
from toponav.evaluation.protocol import Truth
from toponav.maps.task import NavigationTask
from toponav.navigation.graphnav.metric_agent import MetricGraphNavAgent

__all__ = ["TruePoseAgent"]


class TruePoseAgent:
    """GTL with preset `best`: the steering network, told the true pose at every step.

    Its belief is the truth's node, so that what it fails is the steering's.
    """

    def __init__(self, agent: MetricGraphNavAgent) -> None:
        self._agent = agent
        self._truth: Truth | None = None

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""
        self._agent.reset(task)

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def observe_truth(self, truth: Truth) -> None:
        """Take note of the true pose."""
        self._truth = truth
        self._agent.tell_pose(truth.pose.x_m, truth.pose.y_m, truth.pose.yaw_rad)

    def act(self, observation: Observation) -> Velocity:
        """The command at the true pose."""
        return self._agent.act(observation)

    def belief(self) -> Belief:
        """The true node, and what the agent makes of it."""
        believed = self._agent.belief()
        if self._truth is None or self._truth.node is None:
            return believed
        return Belief(
            self._truth.node,
            self._truth.edge,
            self._truth.behavior,
            stopped_because=believed.stopped_because,
        )
