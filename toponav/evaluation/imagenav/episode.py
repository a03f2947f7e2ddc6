"""Runs one episode of image-goal navigation and says what came of each goal."""

import inspect
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Literal, Protocol, get_args, runtime_checkable

from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    Action,
    ImageGoal,
    ImageNavAgent,
    ImageNavBelief,
    ImageNavEpisode,
    PanoramaObservation,
)
from toponav.sim.imagenav import ImageNavSimulation

__all__ = [
    "OUTCOMES",
    "GoalRecord",
    "ImageNavRecord",
    "ImageNavStep",
    "Outcome",
    "PrivilegedImageNavAgent",
    "StepView",
    "run_episode",
]

Outcome = Literal["success", "wrong_stop", "timeout"]
OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
"""How the search for a goal can end."""


@runtime_checkable
class PrivilegedImageNavAgent(Protocol):
    """An agent that is shown the truth, such as the oracle."""

    def attach_truth(self, simulation: ImageNavSimulation) -> None:
        """Hands it the simulation, before each episode begins."""


@dataclass(frozen=True)
class GoalRecord:
    """What came of one goal.

    Attributes:
        goal: Where the picture was taken.
        geodesic_m: Length of the shortest path from where its search began.
        outcome: How the search ended.
        path_m: Distance driven.
        distance_m: Length of the shortest path left at the end.
        steps: Actions taken.
        collisions: Actions that something blocked.
        reason: What the agent says that it stopped for.
    """

    goal: Pose2
    geodesic_m: float
    outcome: Outcome
    path_m: float
    distance_m: float
    steps: int
    collisions: int
    reason: str = ""

    @property
    def success(self) -> bool:
        """Whether it was reached, as the protocol has it."""
        return self.outcome == "success"

    @property
    def spl(self) -> float:
        """Success weighted by path length.

        Reference:
            Anderson et al. 2018, arXiv:1807.06757, Eq. 1.

        Example:
            >>> there = Pose2(4, 0, 0)
            >>> GoalRecord(there, 4.0, "success", 5.0, 0.4, 40, 0).spl
            0.8
        """
        return self.success * self.geodesic_m / max(self.path_m, self.geodesic_m)


@dataclass(frozen=True)
class ImageNavStep:
    """One action: the truth before it, and what the agent thought.

    Attributes:
        goal: Number of the goal it was for.
        x_m: True position.
        y_m: True position.
        yaw_rad: True heading.
        action: What the agent did.
        collided: Whether something blocked it.
        mode: What the agent says that it was doing.
        nodes: How many nodes its map had.
        ghosts: How many unexplored places.
        act_ms: How long it thought.
    """

    goal: int
    x_m: float
    y_m: float
    yaw_rad: float
    action: int
    collided: bool
    mode: str
    nodes: int
    ghosts: int
    act_ms: float


@dataclass(frozen=True)
class ImageNavRecord:
    """Everything that is kept of an episode.

    Attributes:
        agent: The agent's label.
        episode: Which episode.
        rooms: Rooms of the building.
        goals: What came of each goal, in order.
        steps: Every action.
        wall_s: How long it took, rendering included.
    """

    agent: str
    episode: ImageNavEpisode
    rooms: int
    goals: tuple[GoalRecord, ...]
    steps: tuple[ImageNavStep, ...]
    wall_s: float


@dataclass(frozen=True, eq=False)
class StepView:
    """What can be shown of one action.

    Attributes:
        goal: Number of the goal.
        goal_pose: Where its picture was taken.
        goal_image: Its picture.
        pose: True pose before the action.
        observation: What the robot saw.
        action: What it did.
        belief: What it thought.
    """

    goal: int
    goal_pose: Pose2
    goal_image: ImageGoal
    pose: Pose2
    observation: PanoramaObservation
    action: Action
    belief: ImageNavBelief


OnStep = Callable[[StepView], None]


def run_episode(
    simulation: ImageNavSimulation,
    agent: ImageNavAgent,
    episode: ImageNavEpisode,
    *,
    label: str,
    seed: int,
    more_goals: Iterable[Pose2] = (),
    on_step: OnStep | None = None,
) -> ImageNavRecord:
    """The record of one episode.

    Every goal has the simulation's number of steps. After a goal, reached or not, the robot goes
    on from where it is; an agent whose `reset` knows `keep_map` keeps what it has learned. Where
    stopping ends nothing, an agent with a method `stop_denied` is told that it was wrong.

    Args:
        simulation: The robot in the episode's building.
        agent: Who drives.
        episode: Where from and where to.
        label: The agent's name in the results.
        seed: Seed of the noise.
        more_goals: Goals that follow the episode's.
        on_step: Called after each action.
    """
    began_s = time.perf_counter()
    if isinstance(agent, PrivilegedImageNavAgent):
        agent.attach_truth(simulation)
    goals: list[GoalRecord] = []
    steps: list[ImageNavStep] = []
    for number, goal in enumerate((episode.goal, *more_goals)):
        if number == 0:
            image = simulation.reset(episode.start, goal, seed)
            geodesic_m = episode.geodesic_m
        else:
            image = simulation.next_goal(goal)
            geodesic_m = simulation.distance_to_goal_m()
        _reset(agent, image, keep_map=number > 0)
        goals.append(_seek(simulation, agent, image, geodesic_m, steps, number, on_step))
    rooms, wall_s = len(simulation.scene.rooms), time.perf_counter() - began_s
    return ImageNavRecord(label, episode, rooms, tuple(goals), tuple(steps), wall_s)


def _reset(agent: ImageNavAgent, image: ImageGoal, *, keep_map: bool) -> None:
    if keep_map and "keep_map" in inspect.signature(agent.reset).parameters:
        agent.reset(image, keep_map=True)  # type: ignore[call-arg]
    else:
        agent.reset(image)


def _seek(
    simulation: ImageNavSimulation,
    agent: ImageNavAgent,
    image: ImageGoal,
    geodesic_m: float,
    steps: list[ImageNavStep],
    number: int,
    on_step: OnStep | None,
) -> GoalRecord:
    """Acts until the search for one goal is over; adds its steps to the list."""
    # What only a picture needs costs time: agents that know it leave it out of a short answer.
    brief = None if on_step is not None else getattr(agent, "belief_in_brief", None)
    believe: Callable[[], ImageNavBelief] = brief or agent.belief
    while True:
        pose = simulation.state.pose
        observation = simulation.observe()
        began_s = time.perf_counter()
        action = Action(agent.act(observation))
        act_ms = 1e3 * (time.perf_counter() - began_s)
        belief = believe()
        state = simulation.step(action)
        step = ImageNavStep(
            number, *pose, int(action), state.collided, belief.mode, len(belief.nodes),
            len(belief.ghosts), act_ms,
        )  # fmt: skip
        steps.append(step)
        if on_step is not None:
            on_step(StepView(number, simulation.goal, image, pose, observation, action, belief))
        if state.done:
            break
        if action == Action.STOP and hasattr(agent, "stop_denied"):
            agent.stop_denied()
    stopped = action == Action.STOP and simulation.stop
    found = GoalRecord(
        goal=simulation.goal,
        # A goal that is sampled where the robot already stands still has a length.
        geodesic_m=max(geodesic_m, 1e-3),
        outcome="wrong_stop" if stopped else "timeout",
        path_m=state.path_m,
        distance_m=simulation.distance_to_goal_m(),
        steps=state.step,
        collisions=state.collisions,
        reason=belief.stopped_because,
    )
    return replace(found, outcome="success") if state.success else found
