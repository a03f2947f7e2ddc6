"""The GraphNav protocol: one run of a robot judged by the strict and the tolerant rule at once.

Definitions that the paper leaves open are in `JudgeRules`; docs/papers/graphnav.md lists them.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2, angle_difference
from toponav.core.vocabulary import Behavior, Outcome
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap

__all__ = [
    "COLLISION_RULES",
    "DEVIATION_RULES",
    "CollisionRule",
    "DeviationRule",
    "EpisodeJudge",
    "JudgeRules",
    "NodeLocalizer",
    "Truth",
    "Verdict",
    "nominal_time_s",
]

CollisionRule = Literal["fail", "stuck"]
"""`fail`: any contact but the floor ends a run. `stuck`: contact only matters if the robot then
stops moving, as in the authors' code."""
DeviationRule = Literal["strict", "tolerant"]
"""`strict`: one step off the plan ends a run. `tolerant`: a second off the plan does."""

COLLISION_RULES: tuple[CollisionRule, ...] = ("fail", "stuck")
DEVIATION_RULES: tuple[DeviationRule, ...] = ("strict", "tolerant")


@runtime_checkable
class NodeLocalizer(Protocol):
    """Anything that says which node a pose belongs to (`toponav.sim.oracle.TruthLocalizer`)."""

    def node_at(self, pose: Pose2) -> str | None:
        """The node's id, or None where no node fits the pose."""


@dataclass(frozen=True)
class JudgeRules:
    """What ends an episode (design page, "GraphNav protocol")."""

    collisions: CollisionRule = "fail"
    """The rule on contacts behind the verdicts called `strict` and `tolerant`."""
    both_collision_rules: bool = True
    """Whether a run goes on after a contact until it is judged by the softer rule too."""
    tolerance_steps: int = 5
    """Consecutive steps off the plan that fail the tolerant rule (1 s at 5 Hz)."""
    stuck_steps: int = 50
    """Length of the window in which the robot has to move."""
    stuck_distance_m: float = 0.5
    """Less net motion than this within the window, and..."""
    stuck_angle_rad: float = math.radians(20.0)
    """...less net turning than this: stuck."""
    timeout_factor: float = 3.0
    """How many times the nominal time a run may take."""
    nominal_speed_m_s: float = 0.5
    """Speed at which the nominal time drives the plan's legs."""
    nominal_turn_rad_s: float = 1.0
    """Rate at which the nominal time turns from leg to leg."""

    def __post_init__(self) -> None:
        positive = {
            "tolerance_steps": self.tolerance_steps,
            "stuck_steps": self.stuck_steps,
            "stuck_distance_m": self.stuck_distance_m,
            "stuck_angle_rad": self.stuck_angle_rad,
            "timeout_factor": self.timeout_factor,
            "nominal_speed_m_s": self.nominal_speed_m_s,
            "nominal_turn_rad_s": self.nominal_turn_rad_s,
        }
        for name, value in positive.items():
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"{name} must be positive and finite, got {value}",
                    where="JudgeRules",
                    remedy="leave it at its default, which is the protocol's",
                )


@dataclass(frozen=True)
class Truth:
    """Where the robot really is. Only privileged agents (GTL, expert) are shown this.

    Attributes:
        pose: Pose in the map frame.
        velocity: Measured velocity.
        node: True node, or None where no node fits the pose.
        plan_index: Position of `node` in the plan, or None off the plan.
        edge: The plan's edge out of `node`; None off the plan and at the goal.
        behavior: Behaviour of `edge`: what a correctly localized robot executes.
    """

    pose: Pose2
    velocity: Velocity
    node: str | None
    plan_index: int | None
    edge: str | None
    behavior: Behavior | None


@dataclass(frozen=True)
class Verdict:
    """How a run ended under one rule.

    Attributes:
        outcome: Success, or what failed.
        nodes_reached: Plan nodes reached; the start node counts, nodes skipped over count.
        plan_nodes: Nodes in the plan.
        step: Control steps until the verdict.
        time_s: Seconds until the verdict.
        node: True node at the verdict, or None.
        contact: What the robot touched, where it collided.
    """

    outcome: Outcome
    nodes_reached: int
    plan_nodes: int
    step: int
    time_s: float
    node: str | None
    contact: str | None = None

    @property
    def success(self) -> bool:
        """Whether the robot reached the goal node."""
        return self.outcome is Outcome.SUCCESS

    @property
    def plan_completion(self) -> float:
        """Fraction of the plan's nodes that were reached."""
        return self.nodes_reached / self.plan_nodes

    @property
    def failed_edge(self) -> int | None:
        """Position in the plan of the edge on which the run ended; None after a success."""
        return None if self.success else self.edges_attempted - 1

    @property
    def edges_attempted(self) -> int:
        """Plan edges begun, from the first: those passed and the one where the run ended."""
        return min(self.nodes_reached, self.plan_nodes - 1)

    @property
    def edges_passed(self) -> int:
        """Plan edges completed, from the first."""
        return self.nodes_reached - 1


def nominal_time_s(
    map_: TopologicalMap, plan: Plan, start: Pose2, rules: JudgeRules | None = None
) -> float:
    """Seconds that a steady driver needs: straight legs at 0.5 m/s plus turns at 1 rad/s.

    The legs run from the start pose to the plan's second node and on from node to node; the
    turns are the heading changes from the start yaw to the first leg and from leg to leg.
    """
    rules = rules or JudgeRules()
    x_m, y_m, heading_rad = start
    distance_m = turning_rad = 0.0
    for node_id in plan.nodes[1:]:
        node = map_.node(node_id)
        leg_m = math.hypot(node.x_m - x_m, node.y_m - y_m)
        if leg_m > 0.0:
            leg_rad = math.atan2(node.y_m - y_m, node.x_m - x_m)
            turning_rad += abs(angle_difference(leg_rad, heading_rad))
            heading_rad = leg_rad
        distance_m += leg_m
        x_m, y_m = node.x_m, node.y_m
    return distance_m / rules.nominal_speed_m_s + turning_rad / rules.nominal_turn_rad_s


class EpisodeJudge:
    """Follows one run and says how it ended, by both rules on deviation and both on contact.

    The strict rule fails at the first step whose true node is not in the plan; the tolerant
    rule after five consecutive ones. A step without a true node is evidence of neither: it
    is never a deviation (as in the authors' code) and does not interrupt a count. The run
    goes on until the last verdict is in. At one step, contact comes before success, then
    deviation, stuck and timeout.

    Args:
        map_: The topological map.
        plan: What the robot was asked to follow.
        truth: Says which node a pose belongs to.
        start: Where the robot stands; it is taken to be at the plan's first node.
        rules: Thresholds; the default is the protocol.

    Example:
        >>> judge = EpisodeJudge(map, plan, localizer, start)  # doctest: +SKIP
        >>> while not judge.finished:  # doctest: +SKIP
        ...     state = simulation.step(agent.act(simulation.observe()))
        ...     judge.update(state.pose, state.contact, state.time_s)
        >>> judge.strict.outcome, judge.tolerant.plan_completion  # doctest: +SKIP
        (<Outcome.DEVIATED: 'deviated'>, 0.9)
    """

    def __init__(
        self,
        map_: TopologicalMap,
        plan: Plan,
        truth: NodeLocalizer,
        start: Pose2,
        rules: JudgeRules | None = None,
    ) -> None:
        self.rules = rules or JudgeRules()
        self.plan = plan
        self.timeout_s = self.rules.timeout_factor * nominal_time_s(map_, plan, start, self.rules)
        self._localizer = truth
        self._index = {node: index for index, node in enumerate(plan.nodes)}
        self._behaviors = tuple(map_.edge(edge).behavior for edge in plan.edges)
        self._recent = deque([start], maxlen=self.rules.stuck_steps + 1)
        self._off_plan_steps = 0
        self._furthest = 0
        self._verdicts: dict[tuple[DeviationRule, CollisionRule], Verdict] = {}
        own = self.rules.collisions
        softest: CollisionRule = "stuck" if self.rules.both_collision_rules else own
        self._last: tuple[DeviationRule, CollisionRule] = ("tolerant", softest)
        self.step = 0
        self.node: str | None = plan.nodes[0]
        """True node after the last update; the plan's first node before any."""

    @property
    def finished(self) -> bool:
        """Whether the run is over: all verdicts are in."""
        return self._last in self._verdicts

    @property
    def strict(self) -> Verdict:
        """The verdict by the paper's rule: one step off the plan fails."""
        return self.verdict("strict")

    @property
    def tolerant(self) -> Verdict:
        """The verdict by the softer rule: a second off the plan fails."""
        return self.verdict("tolerant")

    def verdict(
        self, deviation: DeviationRule, collisions: CollisionRule | None = None
    ) -> Verdict:
        """The verdict by these rules; on contacts the judge's own rule if none is named."""
        found = self._verdicts.get((deviation, collisions or self.rules.collisions))
        assert found is not None, f"the {deviation} verdict is not in yet"
        return found

    @property
    def verdicts(self) -> Mapping[tuple[DeviationRule, CollisionRule], Verdict]:
        """Every verdict that is in, by rule on deviation and rule on contact."""
        return self._verdicts

    def truth(self, pose: Pose2, velocity: Velocity) -> Truth:
        """What privileged agents may know now; call it with the pose of the last update."""
        index = None if self.node is None else self._index.get(self.node)
        on_edge = index is not None and index < len(self._behaviors)
        return Truth(
            pose=pose,
            velocity=velocity,
            node=self.node,
            plan_index=index,
            edge=self.plan.edges[index] if index is not None and on_edge else None,
            behavior=self._behaviors[index] if index is not None and on_edge else None,
        )

    def update(self, pose: Pose2, contact: str | None, time_s: float) -> Outcome | None:
        """Judge one control step.

        Args:
            pose: Pose after the step, in the map frame.
            contact: What the robot touched other than the floor, or None.
            time_s: Seconds since the episode began.

        Returns:
            The outcome by the softest rules once the run is over, else None.
        """
        assert not self.finished, "the run is over"
        self.step += 1
        self._recent.append(pose)
        self.node = self._localizer.node_at(pose)
        self._count_progress()
        deviated: dict[DeviationRule, bool] = {
            "strict": self.node is not None and self.node not in self._index,
            "tolerant": self._off_plan_steps >= self.rules.tolerance_steps,
        }
        for deviation in DEVIATION_RULES:
            for collisions in COLLISION_RULES:
                if (deviation, collisions) in self._verdicts:
                    continue
                touched = contact is not None and collisions == "fail"
                outcome = self._outcome(touched, time_s, deviated=deviated[deviation])
                if outcome is not None:
                    found = self._verdict(outcome, contact, time_s)
                    self._verdicts[deviation, collisions] = found
        return self._verdicts[self._last].outcome if self.finished else None

    def _count_progress(self) -> None:
        if self.node is None:
            return
        index = self._index.get(self.node)
        if index is None:
            self._off_plan_steps += 1
        else:
            self._off_plan_steps = 0
            self._furthest = max(self._furthest, index)

    def _outcome(self, touched: bool, time_s: float, *, deviated: bool) -> Outcome | None:
        """What ends the run at this step under one pair of rules, or None."""
        if touched:
            return Outcome.COLLIDED
        if self.node == self.plan.nodes[-1]:
            return Outcome.SUCCESS
        if deviated:
            return Outcome.DEVIATED
        if self._is_stuck():
            return Outcome.STUCK
        return Outcome.TIMEOUT if time_s >= self.timeout_s else None

    def _is_stuck(self) -> bool:
        if len(self._recent) <= self.rules.stuck_steps:
            return False
        then, now = self._recent[0], self._recent[-1]
        turned_rad = abs(angle_difference(now.yaw_rad, then.yaw_rad))
        return (
            now.distance_to(then) < self.rules.stuck_distance_m
            and turned_rad < self.rules.stuck_angle_rad
        )

    def _verdict(self, outcome: Outcome, contact: str | None, time_s: float) -> Verdict:
        return Verdict(
            outcome=outcome,
            nodes_reached=self._furthest + 1,
            plan_nodes=len(self.plan.nodes),
            step=self.step,
            time_s=time_s,
            node=self.node,
            contact=contact if outcome is Outcome.COLLIDED else None,
        )
