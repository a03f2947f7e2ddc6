"""The registry of agents, and the two that use the truth on purpose: GTL and the expert."""

import dataclasses
import importlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, Belief, Observation, Velocity, VelocityLimits
from toponav.core.errors import InputError, did_you_mean
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior
from toponav.evaluation.protocol import Truth
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask
from toponav.navigation.graphnav.behavior_selection import BehaviorSelector

if TYPE_CHECKING:
    from toponav.worlds.scene import Scene

__all__ = [
    "AGENTS",
    "AgentContext",
    "AgentSpec",
    "ExpertAgent",
    "GroundTruthLocationAgent",
    "check_agent_name",
    "check_weights",
    "make_agent",
]


@dataclass(frozen=True)
class AgentContext:
    """What an agent is built from; agents that are not privileged ignore the scene.

    Attributes:
        scene: The building.
        map: Its topological map.
        camera: The camera that the robot carries.
        limits: What the robot can do.
        weights: Folder or preset of the networks; None is what ships with the package.
        seed: Seed of the agent's random numbers.
    """

    scene: "Scene"
    map: TopologicalMap
    camera: PinholeCamera = field(default_factory=PinholeCamera)
    limits: VelocityLimits = field(default_factory=VelocityLimits)
    weights: str | None = None
    seed: int = 0


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


@dataclass(frozen=True)
class AgentSpec:
    """One line of the registry.

    Attributes:
        title: Name in tables.
        build: Makes the agent.
        is_learned: Whether it has weights.
        is_privileged: Whether it is shown the truth.
    """

    title: str
    build: Callable[[AgentContext], Agent[NavigationTask]]
    is_learned: bool = True
    is_privileged: bool = False


def _graphnav(context: AgentContext) -> Agent[NavigationTask]:
    return _load_graphnav(context, particle_filter=False)


def _graphnav_pf(context: AgentContext) -> Agent[NavigationTask]:
    return _load_graphnav(context, particle_filter=True)


def _load_graphnav(context: AgentContext, *, particle_filter: bool) -> Agent[NavigationTask]:
    from toponav.navigation.graphnav.agent import load_agent

    agent: Agent[NavigationTask] = load_agent(
        context.weights,
        particle_filter=particle_filter,
        camera=context.camera,
        seed=context.seed,
    )
    return agent


def _gtl(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.navigation.graphnav.driver import load_driver

    return GroundTruthLocationAgent(load_driver(context.weights, camera=context.camera))


def _expert(context: AgentContext) -> Agent[NavigationTask]:
    from toponav.data.expert import Expert

    return ExpertAgent(Expert(context.scene, context.map, limits=context.limits))


AGENTS: Mapping[str, AgentSpec] = {
    "graphnav": AgentSpec("GraphNav", _graphnav),
    "graphnav_pf": AgentSpec("GraphNavPF", _graphnav_pf),
    "gtl": AgentSpec("GTL", _gtl, is_privileged=True),
    "expert": AgentSpec("Expert", _expert, is_learned=False, is_privileged=True),
}
"""Every agent of the GraphNav suite by name. PhaseNet and BehavRNN are yet to come."""


def check_agent_name(name: str) -> None:
    """Nothing, if the name is in the registry or is an importable `module:factory`.

    Raises:
        InputError: Otherwise; offers the nearest name.
    """
    if ":" in name:
        _imported_factory(name)
    elif name not in AGENTS:
        raise InputError(
            f"no agent is called '{name}'",
            where="--agent",
            remedy=f"{did_you_mean(name, AGENTS)} Or give your own as module:factory",
        )


def check_weights(weights: str | None, names: Iterable[str]) -> None:
    """Nothing, if the learned ones of these agents find their networks whole.

    Raises:
        InputError: If there are no such weights, or a file of them is broken.
    """
    if any(name in AGENTS and AGENTS[name].is_learned for name in names):
        from toponav.models.checkpoints import load_weights

        load_weights(weights or "compact")


def make_agent(name: str, context: AgentContext) -> Agent[NavigationTask]:
    """The agent of that name.

    Args:
        name: A name of the registry, or `module:factory`, where the factory takes an
            `AgentContext` and returns an agent.
        context: What it is built from.

    Raises:
        InputError: If there is no such agent, or its weights cannot be read.
    """
    check_agent_name(name)
    if ":" in name:
        return _imported_factory(name)(context)
    return AGENTS[name].build(context)


def _imported_factory(name: str) -> Callable[[AgentContext], Agent[NavigationTask]]:
    module_name, _, attribute = name.partition(":")
    try:
        factory: Any = getattr(importlib.import_module(module_name), attribute)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise InputError(
            f"'{name}' cannot be imported: {error}",
            where="--agent",
            remedy="give module:factory of an installed module, or a name of the registry",
        ) from None
    if not callable(factory):
        raise InputError(
            f"'{name}' is not callable",
            where="--agent",
            remedy="name a function that takes an AgentContext and returns an agent",
        )
    made: Callable[[AgentContext], Agent[NavigationTask]] = factory
    return made
