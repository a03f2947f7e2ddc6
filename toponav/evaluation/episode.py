"""One agent driving one plan: simulator, agent and judge in step."""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from toponav.core.episode import Agent, Belief, Observation, Velocity
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior
from toponav.evaluation.protocol import (
    DEVIATION_RULES,
    CollisionRule,
    DeviationRule,
    EpisodeJudge,
    Truth,
    Verdict,
)
from toponav.maps.plan import Plan
from toponav.maps.task import NavigationTask

__all__ = [
    "EpisodeRecord",
    "PrivilegedAgent",
    "ReseedableAgent",
    "RobotState",
    "Simulator",
    "Step",
    "StepView",
    "run_episode",
]


@runtime_checkable
class RobotState(Protocol):
    """What a simulator says of the robot after a step (`toponav.sim.simulation.SimState`)."""

    @property
    def pose(self) -> Pose2:
        """Pose in the map frame."""

    @property
    def velocity(self) -> Velocity:
        """Measured velocity."""

    @property
    def contact(self) -> str | None:
        """What the robot touched other than the floor, or None."""

    @property
    def time_s(self) -> float:
        """Seconds since the episode began."""


@runtime_checkable
class Simulator(Protocol):
    """What an episode needs of a simulator (`toponav.sim.simulation.Simulation`)."""

    def reset(self, pose: Pose2) -> RobotState:
        """Put the robot down."""

    def step(self, command: Velocity) -> RobotState:
        """One control step of 0.2 s."""

    def observe(self) -> Observation:
        """What the camera sees now."""


@runtime_checkable
class PrivilegedAgent(Protocol):
    """An agent that is shown the truth before it acts: GTL and the expert."""

    def observe_truth(self, truth: Truth) -> None:
        """Take note of where the robot really is."""


@runtime_checkable
class ReseedableAgent(Protocol):
    """An agent whose random numbers can start afresh, so that it serves many episodes."""

    def reseed(self, seed: int) -> None:
        """Repeat exactly from here on, given the same seed."""


@dataclass(frozen=True)
class Step:
    """One control step, as the agent met it; the truth is that before the command.

    Attributes:
        time_s: Seconds since the episode began.
        x_m: True position along x.
        y_m: True position along y.
        yaw_rad: True heading.
        linear_m_s: Commanded speed.
        angular_rad_s: Commanded turn rate.
        true_node: True node, or None where no node fits.
        true_edge: The plan's edge out of the true node, or None.
        true_behavior: What a correctly localized robot executes, or None off the plan.
        believed_node: Node the agent thinks it is at, or None.
        believed_edge: Edge the agent thinks it is on, or None.
        behavior: Behaviour the agent executed, or None.
        stopped_because: Why the agent stopped by itself, or an empty string.
        plan_probability: Probability that the agent gave each edge of the plan.
        elsewhere_probability: Probability that the agent gave edges off the plan.
        act_ms: Time that the agent took to decide.
    """

    time_s: float
    x_m: float
    y_m: float
    yaw_rad: float
    linear_m_s: float
    angular_rad_s: float
    true_node: str | None
    true_edge: str | None
    true_behavior: str | None
    believed_node: str | None
    believed_edge: str | None
    behavior: str | None
    stopped_because: str
    plan_probability: tuple[float, ...]
    elsewhere_probability: float
    act_ms: float


@dataclass(frozen=True)
class EpisodeRecord:
    """What happened in one episode.

    Attributes:
        agent: Name of the agent.
        index: Number of the episode in its suite.
        plan: The plan that the agent was given.
        behaviors: Behaviour of each edge of the plan.
        transitions: Semantic transition of each edge of the plan, such as `office->hallway`.
        strict: Verdict by the paper's rule.
        tolerant: Verdict by the softer rule.
        timeout_s: When the run would have timed out.
        wall_s: Wall time of the run.
        steps: Every control step, until the last verdict.
        collisions: The rule on contacts behind `strict` and `tolerant`.
        by_other_collision_rule: Strict and tolerant verdict of the same run by the other rule
            on contacts, where it was judged by both.
    """

    agent: str
    index: int
    plan: Plan
    behaviors: tuple[Behavior, ...]
    transitions: tuple[str, ...]
    strict: Verdict
    tolerant: Verdict
    timeout_s: float
    wall_s: float
    steps: tuple[Step, ...]
    collisions: CollisionRule = "fail"
    by_other_collision_rule: tuple[Verdict, Verdict] | None = None

    @property
    def driven_m(self) -> float:
        """Distance driven until the tolerant verdict, in metres."""
        return sum(
            math.hypot(after.x_m - before.x_m, after.y_m - before.y_m)
            for before, after in itertools.pairwise(self.judged_steps("tolerant"))
        )

    def verdict(
        self, deviation: DeviationRule, collisions: CollisionRule | None = None
    ) -> Verdict | None:
        """How the run ended by these rules, or None where it was not judged by them.

        Args:
            deviation: Rule on leaving the plan.
            collisions: Rule on contacts; the record's own if None.
        """
        own = (self.strict, self.tolerant)
        is_own = collisions in (None, self.collisions)
        found = own if is_own else self.by_other_collision_rule
        return None if found is None else found[0 if deviation == "strict" else 1]

    def judged_steps(self, deviation: DeviationRule) -> tuple[Step, ...]:
        """The steps until the verdict; what came after counts for softer rules only."""
        verdict = self.strict if deviation == "strict" else self.tolerant
        return self.steps[: verdict.step]


@dataclass(frozen=True)
class StepView:
    """What a watcher of an episode is shown at each step, the camera image included."""

    truth: Truth
    observation: Observation
    belief: Belief
    command: Velocity


def run_episode(
    simulation: Simulator,
    agent: Agent[NavigationTask],
    task: NavigationTask,
    start: Pose2,
    judge: EpisodeJudge,
    *,
    name: str = "agent",
    index: int = 0,
    transitions: tuple[str, ...] = (),
    on_step: Callable[[StepView], None] | None = None,
) -> EpisodeRecord:
    """The record of one run, from the start pose to the last of its verdicts.

    Agents that have `observe_truth` are shown the truth before each `act`; no other agent
    can reach it.

    Args:
        simulation: Where the robot drives.
        agent: What drives it; it is reset first.
        task: Map and plan, all that the agent is told.
        start: Where the robot stands.
        judge: A fresh judge for the same plan and start.
        name: The agent's name in the record.
        index: The episode's number in the record.
        transitions: Semantic transition of each plan edge, for the record.
        on_step: Called after each decision, with what the agent saw and believed.

    Returns:
        The record, with one `Step` per decision.
    """
    began_s = time.perf_counter()
    state = simulation.reset(start)
    agent.reset(task)
    privileged = agent if isinstance(agent, PrivilegedAgent) else None
    steps: list[Step] = []
    while not judge.finished:
        truth = judge.truth(state.pose, state.velocity)
        observation = simulation.observe()
        if privileged is not None:
            privileged.observe_truth(truth)
        asked_s = time.perf_counter()
        command = agent.act(observation)
        act_ms = 1e3 * (time.perf_counter() - asked_s)
        belief = agent.belief()
        steps.append(_step(observation.time_s, truth, command, belief, task.plan, act_ms))
        if on_step is not None:
            on_step(StepView(truth, observation, belief, command))
        state = simulation.step(command)
        judge.update(state.pose, state.contact, state.time_s)
    return EpisodeRecord(
        agent=name,
        index=index,
        plan=task.plan,
        behaviors=tuple(task.map.edge(edge).behavior for edge in task.plan.edges),
        transitions=transitions,
        strict=judge.strict,
        tolerant=judge.tolerant,
        timeout_s=judge.timeout_s,
        wall_s=time.perf_counter() - began_s,
        steps=tuple(steps),
        collisions=judge.rules.collisions,
        by_other_collision_rule=_by_other_rule(judge),
    )


def _by_other_rule(judge: EpisodeJudge) -> tuple[Verdict, Verdict] | None:
    other: CollisionRule = "stuck" if judge.rules.collisions == "fail" else "fail"
    strict, tolerant = (judge.verdicts.get((rule, other)) for rule in DEVIATION_RULES)
    return (strict, tolerant) if strict is not None and tolerant is not None else None


def _step(
    time_s: float,
    truth: Truth,
    command: Velocity,
    belief: Belief,
    plan: Plan,
    act_ms: float,
) -> Step:
    probability = dict(belief.edge_probability)
    if not probability and belief.edge is not None:
        probability = {belief.edge: 1.0}
    on_plan = tuple(float(probability.get(edge, 0.0)) for edge in plan.edges)
    return Step(
        time_s=time_s,
        x_m=truth.pose.x_m,
        y_m=truth.pose.y_m,
        yaw_rad=truth.pose.yaw_rad,
        linear_m_s=command.linear_m_s,
        angular_rad_s=command.angular_rad_s,
        true_node=truth.node,
        true_edge=truth.edge,
        true_behavior=None if truth.behavior is None else str(truth.behavior),
        believed_node=belief.node,
        believed_edge=belief.edge,
        behavior=None if belief.behavior is None else str(belief.behavior),
        stopped_because=belief.stopped_because,
        plan_probability=on_plan,
        elsewhere_probability=max(0.0, float(sum(probability.values())) - sum(on_plan)),
        act_ms=act_ms,
    )
