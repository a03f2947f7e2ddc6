"""The two agents that use the truth on purpose: GTL and the expert."""

import dataclasses
from typing import Protocol, runtime_checkable

from toponav.core.episode import Belief, Observation, Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior
from toponav.evaluation.protocol import Truth
from toponav.maps.plan import Plan
from toponav.maps.task import NavigationTask
from toponav.navigation.graphnav.behavior_selection import BehaviorSelector

__all__ = ["Driver", "ExpertAgent", "GroundTruthLocationAgent", "PathPlanner"]


@runtime_checkable
class Driver(Protocol):
    """Executes one behaviour at a time (`toponav.navigation.graphnav.driver.BehaviorDriver`)."""

    stopped_because: str
    """Why it stopped the robot by itself, or an empty string."""

    def reset(self) -> None:
        """Forget the frames seen so far."""

    def drive(self, behavior: Behavior, observation: Observation) -> Velocity:
        """The command of the behaviour's network."""


@runtime_checkable
class PathPlanner(Protocol):
    """A driver that knows the floor plan (`toponav.data.expert.Expert`)."""

    def reset(self, plan: Plan, pose: Pose2) -> None:
        """Prepare to follow a plan."""

    def act(self, pose: Pose2, velocity: Velocity) -> Velocity:
        """The command for this control step."""


class GroundTruthLocationAgent:
    """GTL: GraphNav's behaviour networks, told the true node at every step.

    Off the plan, and where no node fits, it keeps the last valid behaviour, as GraphNav does
    with a localization off the plan. It shows what the behaviour networks are worth without
    localization errors.

    Reference:
        GraphNav, section VII, "GTL".
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._selector: BehaviorSelector | None = None
        self._truth: Truth | None = None
        self._belief = Belief()

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""
        self._driver.reset()
        self._selector = BehaviorSelector(task)
        self._truth = None
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def observe_truth(self, truth: Truth) -> None:
        """Take note of the true node."""
        self._truth = truth

    def act(self, observation: Observation) -> Velocity:
        """The command of the behaviour that the plan wants at the true node."""
        assert self._selector is not None, "reset the agent first"
        assert self._truth is not None, "show the agent the truth first"
        behavior = self._selector.select(self._truth.node)
        command = self._driver.drive(behavior, observation)
        self._belief = Belief(
            self._truth.node,
            self._truth.edge,
            behavior,
            stopped_because=self._driver.stopped_because,
        )
        return command

    def belief(self) -> Belief:
        """The truth, and the behaviour selected from it."""
        return self._belief


class ExpertAgent:
    """The planner that recorded the training data, driving with the floor plan.

    It is the ceiling: what it fails, the map and the protocol make hard for everyone.
    """

    def __init__(self, planner: PathPlanner) -> None:
        self._planner = planner
        self._plan: Plan | None = None
        self._is_placed = False
        self._truth: Truth | None = None
        self._belief = Belief()

    def reset(self, task: NavigationTask) -> None:
        """Begin an episode."""
        self._plan = task.plan
        self._is_placed = False
        self._truth = None
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Nothing here is random."""

    def observe_truth(self, truth: Truth) -> None:
        """Take note of the true pose."""
        self._truth = truth

    def act(self, observation: Observation) -> Velocity:
        """The planner's command at the true pose; the image is not looked at."""
        assert self._plan is not None, "reset the agent first"
        assert self._truth is not None, "show the agent the truth first"
        truth = self._truth
        self._belief = Belief(truth.node, truth.edge, truth.behavior)
        try:
            if not self._is_placed:
                self._planner.reset(self._plan, truth.pose)
                self._is_placed = True
            return self._planner.act(truth.pose, truth.velocity)
        except InputError as error:
            # No way to the goal from here: that is a failed episode, not a failed evaluation.
            self._belief = dataclasses.replace(self._belief, stopped_because=error.rule)
            return Velocity(0.0, 0.0)

    def belief(self) -> Belief:
        """The truth."""
        return self._belief
