"""One drive along a plan: frames in, limited commands out, and why it ended. Without ROS."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32

from toponav.core.episode import Agent, Belief, Observation, Velocity, VelocityLimits
from toponav.data.image_messages import without_holes
from toponav.maps.task import NavigationTask
from toponav.ros.watchdog import Watchdog

__all__ = ["STOP", "DriveConfig", "DriveLoop", "DriveResult", "Progress"]

STOP: Final = Velocity(0.0, 0.0)
"""Stand still."""
Outcome = Literal["reached", "cancelled", "fault", "timeout", "rejected"]
_MOST_STAND_INS: Final = 3


@dataclass(frozen=True)
class DriveConfig:
    """What holds for every drive."""

    limits: VelocityLimits = field(default_factory=VelocityLimits)
    """Speeds that no command exceeds."""
    period_s: float = 0.2
    """Time between decisions: frames that come faster are left out."""
    arrived_steps: int = 3
    """Decisions in a row that believe in the goal until it counts as reached."""
    fault_s: float = 10.0
    """A fault that lasts longer ends the drive."""
    timeout_s: float = 1800.0
    """A drive that lasts longer ends."""
    max_depth_m: float = 3.5
    """Depths beyond this read as this."""


@dataclass(frozen=True)
class Progress:
    """What is said of a drive after each decision."""

    belief: Belief
    command: Velocity
    share: float
    stopped_because: str


@dataclass(frozen=True)
class DriveResult:
    """How a drive ended."""

    outcome: Outcome
    reason: str
    node: str
    share: float
    steps: int

    @property
    def success(self) -> bool:
        """Whether the robot believes that it reached the goal."""
        return self.outcome == "reached"


@runtime_checkable
class _CanBeOverruled(Protocol):
    def overruled(self, command: Velocity) -> None: ...


class DriveLoop:
    """Lets an agent drive, under a watchdog and within limits.

    Frames that were lost are stood in for by the last one, so that an agent that counts frames
    keeps its sense of time. An agent that reckons with its own commands is told when the robot
    did something else.

    Args:
        agent: What drives.
        task: Along which plan.
        config: What holds for every drive.
        watchdog: Judges the frames; its `fault` is the caller's to ask from elsewhere.
        until_cancelled: Whether reaching the goal does not end the drive.
    """

    def __init__(
        self,
        agent: Agent[NavigationTask],
        task: NavigationTask,
        config: DriveConfig,
        watchdog: Watchdog,
        *,
        until_cancelled: bool = False,
    ) -> None:
        self._agent, self.task, self._config = agent, task, config
        self._watchdog, self._until_cancelled = watchdog, until_cancelled
        self._first_s: float | None = None
        self._decided_s = -math.inf
        self._faulty_since_s: float | None = None
        self._last_depth_m: Float32[np.ndarray, "height width"] | None = None
        self._at_goal = self.steps = 0
        self._overruled = False
        self._furthest = 0
        self.command = STOP
        """What the robot was told last."""
        self.stopped_because = ""
        self.fault_s = config.fault_s
        """A fault that lasts longer ends the drive."""
        agent.reset(task)

    def wants(self, stamp_s: float) -> bool:
        """Whether a frame of this time is due; a tenth of a period early is on time."""
        return stamp_s - self._decided_s >= 0.9 * self._config.period_s

    def step(
        self,
        depth_m: Float32[np.ndarray, "height width"],
        stamp_s: float,
        clock: Callable[[], float],
    ) -> Progress:
        """The command for a frame.

        Args:
            depth_m: What the agent's camera sees; holes are 0 or NaN.
            stamp_s: When.
            clock: The same clock, now.
        """
        if self._first_s is None:
            self._first_s = stamp_s
        because = self._watchdog.frame(depth_m, stamp_s, clock(), self.command)
        if because:
            self.overrule(because)
        else:
            self._decide(depth_m, stamp_s, clock)
        self.steps += 1
        self._note(stamp_s)
        return Progress(self._agent.belief(), self.command, self.share, self.stopped_because)

    def overrule(self, because: str) -> None:
        """The robot stands still, for this reason, whatever the agent last said.

        Any thread may call it; the agent is told before it is asked again.
        """
        self.stopped_because = because
        if self.command != STOP:
            self.command = STOP
            self._overruled = True

    @property
    def share(self) -> float:
        """Fraction of the plan's nodes reached, by the agent's belief."""
        return (self._furthest + 1) / len(self.task.plan.nodes)

    def ended(self, stamp_s: float) -> DriveResult | None:
        """How the drive ended by itself, or None while it goes on."""
        config = self._config
        if self._at_goal >= config.arrived_steps and not self._until_cancelled:
            return self.result("reached", f"believes itself at {self.task.goal_node}")
        since_s = self._faulty_since_s
        if since_s is not None and stamp_s - since_s >= config.fault_s:
            return self.result("fault", self.stopped_because)
        if self._first_s is not None and stamp_s - self._first_s >= config.timeout_s:
            return self.result("timeout", f"{config.timeout_s:g} s have passed")
        return None

    def result(self, outcome: Outcome, reason: str) -> DriveResult:
        """How the drive ended, for this reason."""
        node = self._agent.belief().node or ""
        return DriveResult(outcome, reason, node, self.share, self.steps)

    def _decide(
        self,
        depth_m: Float32[np.ndarray, "height width"],
        stamp_s: float,
        clock: Callable[[], float],
    ) -> None:
        usable = without_holes(depth_m, self._config.max_depth_m)
        if self._overruled:
            self._overruled = False
            self._tell_agent(STOP)
        self._watchdog.thinking(clock())
        try:
            self._stand_in_for_lost(stamp_s)
            command = self._agent.act(self._observation(usable, stamp_s))
            too_late = self._watchdog.fault(clock())
        finally:
            self._watchdog.decided()
        self._last_depth_m, self._decided_s = usable, stamp_s
        self.command = self._limited(command)
        self.stopped_because = self._agent.belief().stopped_because
        if too_late:
            self.overrule(too_late)

    def _observation(self, depth_m: np.ndarray, stamp_s: float) -> Observation:
        assert self._first_s is not None
        return Observation(depth_m, round(stamp_s - self._first_s, 6))

    def _stand_in_for_lost(self, stamp_s: float) -> None:
        if self._last_depth_m is None:
            return
        period_s = self._config.period_s
        lost = min(round((stamp_s - self._decided_s) / period_s) - 1, _MOST_STAND_INS)
        for number in range(lost):
            at_s = self._decided_s + (number + 1) * period_s
            self._agent.act(self._observation(self._last_depth_m, at_s))
            self._tell_agent(self.command)

    def _tell_agent(self, command: Velocity) -> None:
        agent: Any = self._agent
        if isinstance(agent, _CanBeOverruled):
            agent.overruled(command)

    def _limited(self, command: Velocity) -> Velocity:
        if not (math.isfinite(command.linear_m_s) and math.isfinite(command.angular_rad_s)):
            self._tell_agent(STOP)
            return STOP
        limited = self._config.limits.clip(command)
        if limited != command:
            self._tell_agent(limited)
        return limited

    def _note(self, stamp_s: float) -> None:
        node = self._agent.belief().node
        position = None if node is None else self.task.plan.position(node)
        if position is not None:
            self._furthest = max(self._furthest, position)
        self._at_goal = self._at_goal + 1 if node == self.task.goal_node else 0
        if not self.stopped_because:
            self._faulty_since_s = None
        elif self._faulty_since_s is None:
            self._faulty_since_s = stamp_s
