"""Localization accuracy as the paper's Table V has it: the network is told where it just was.

The expert drives, and at each step the network is asked with the crop around the edge on which
the robot truly was one step before. So no error of localization leads to another, and none
changes where the robot drives: the number says what one answer is worth.
"""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, Belief, Observation, Velocity
from toponav.evaluation.episode import ReseedableAgent
from toponav.evaluation.privileged import ExpertAgent
from toponav.evaluation.protocol import Truth
from toponav.maps.subgraph import crop
from toponav.maps.task import NavigationTask
from toponav.models.checkpoints import load_weights
from toponav.models.graphnav.graph_tensors import encode_subgraph
from toponav.navigation.graphnav.dead_reckoning import DeadReckoning
from toponav.navigation.graphnav.driver import BehaviorDriver

__all__ = [
    "CropPredictor",
    "EdgePredictor",
    "OverruledAgent",
    "OwnBeliefAgent",
    "TeacherForcedAgent",
]


@runtime_checkable
class EdgePredictor(Protocol):
    """Anything that says which edge the robot is on when told the edge before."""

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""

    def predict(self, observation: Observation, last_edge: str) -> Mapping[str, float]:
        """The probability of each edge, given where the robot truly was one step before."""

    def advance(self, command: Velocity) -> None:
        """Take in the command that the robot was given."""


class CropPredictor:
    """Asks a graph localization network about the crop around the true edge.

    Args:
        weights: A folder of checkpoints, the name of a shipped preset, or None for `compact`.
        camera: The camera that the robot carries.

    Raises:
        InputError: The weights cannot be read, or the camera does not suit them.
    """

    def __init__(self, weights: str | None, camera: PinholeCamera) -> None:
        loaded = load_weights(weights or "compact")
        self._localization = loaded.localization.eval()
        history = max(self._localization.config.frame_offsets) + 1
        self._driver = BehaviorDriver(loaded.behaviors, camera, history=history)
        self._reckoning = DeadReckoning()

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""
        self._task = task
        self._driver.reset()
        self._reckoning.reset(task.start_node)

    def predict(self, observation: Observation, last_edge: str) -> Mapping[str, float]:
        """The network's probability of each edge of the crop; nothing for a bad frame."""
        if not self._driver.observe(observation):
            return {}
        map_, config = self._task.map, self._localization.config
        node = map_.edge(last_edge).source
        around = crop(map_, node, config.ahead, config.behind)
        motion = self._reckoning.since(node)
        graph = encode_subgraph(map_, around, self._task.plan, last_edge, config, motion)
        frames = self._driver.stack(config.frame_offsets)
        probability = self._localization.edge_probabilities(frames, graph)
        return dict(zip(graph.edge_ids, probability.tolist(), strict=True))

    def advance(self, command: Velocity) -> None:
        """Take in the command that the robot was given."""
        self._reckoning.advance(command)


class TeacherForcedAgent:
    """Drives as the expert does, and believes what a network says that is told the truth before.

    Its `localization_accuracy` is the paper's Table V. The true edge is the plan's edge out of
    the true node; where that is unknown the last known one is told.

    Args:
        expert: Drives.
        predictor: Is asked.

    Reference:
        GraphNav, appendix D, Table V.
    """

    def __init__(self, expert: ExpertAgent, predictor: EdgePredictor) -> None:
        self._expert = expert
        self._predictor = predictor

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""
        self._task = task
        self._expert.reset(task)
        self._predictor.reset(task)
        self._last_edge = task.plan.edges[0]
        self._true_edge: str | None = None
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def observe_truth(self, truth: Truth) -> None:
        """Take note of the truth, for the expert now and for the network at the next step."""
        self._expert.observe_truth(truth)
        self._true_edge = truth.edge

    def act(self, observation: Observation) -> Velocity:
        """The expert's command; the network's answer becomes the belief."""
        probability = dict(self._predictor.predict(observation, self._last_edge))
        command = self._expert.act(observation)
        self._predictor.advance(command)
        if probability:
            edge = self._task.map.edge(max(probability, key=probability.__getitem__))
            self._belief = Belief(edge.source, edge.id, edge.behavior, probability)
        else:
            self._belief = Belief(stopped_because="the frame cannot be trusted")
        self._last_edge = self._true_edge or self._last_edge
        return command

    def belief(self) -> Belief:
        """The network's answer."""
        return self._belief


@runtime_checkable
class OverruledAgent(Agent[NavigationTask], Protocol):
    """An agent that goes on localizing when the robot carries out another's command."""

    def overruled(self, command: Velocity) -> None:
        """The robot carried out this command in place of the last one."""


class OwnBeliefAgent:
    """Drives as the expert does, and believes what an agent believes that nothing is told.

    Its `localization_accuracy` is that of the agent along the expert's drives: errors of
    localization lead to others, but none changes where the robot drives.

    Args:
        expert: Drives.
        asked: Localizes; its commands are not carried out.
    """

    def __init__(self, expert: ExpertAgent, asked: OverruledAgent) -> None:
        self._expert = expert
        self._asked = asked

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""
        self._expert.reset(task)
        self._asked.reset(task)

    def reseed(self, seed: int) -> None:
        """Pass the seed on."""
        if isinstance(self._asked, ReseedableAgent):
            self._asked.reseed(seed)

    def observe_truth(self, truth: Truth) -> None:
        """Take note of the truth, for the expert only."""
        self._expert.observe_truth(truth)

    def act(self, observation: Observation) -> Velocity:
        """The expert's command, which the agent is told afterwards."""
        self._asked.act(observation)
        command = self._expert.act(observation)
        self._asked.overruled(command)
        return command

    def belief(self) -> Belief:
        """What the agent thinks."""
        return self._asked.belief()
