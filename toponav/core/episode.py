"""What passes between a robot and an agent, whatever either is made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float32, Int32, UInt8

from toponav.core.vocabulary import Behavior

__all__ = ["Agent", "Belief", "Observation", "Velocity", "VelocityLimits"]

Task = TypeVar("Task", contravariant=True)


@dataclass(frozen=True)
class Velocity:
    """A command for a differential-drive robot."""

    linear_m_s: float
    angular_rad_s: float


@dataclass(frozen=True)
class VelocityLimits:
    """What a TurtleBot 2 class robot does at most (the 0.5 m/s cap is GraphNav's)."""

    linear_m_s: float = 0.5
    angular_rad_s: float = 1.5
    linear_m_s2: float = 1.0
    angular_rad_s2: float = 4.0

    def clip(self, command: Velocity) -> Velocity:
        """The command within the speed limits; driving backwards is allowed to 0.2 m/s."""
        return Velocity(
            float(np.clip(command.linear_m_s, -0.2, self.linear_m_s)),
            float(np.clip(command.angular_rad_s, -self.angular_rad_s, self.angular_rad_s)),
        )


@dataclass(frozen=True)
class Observation:
    """What the robot senses at one control step.

    Attributes:
        depth_m: Z-depth in metres; 0 where the sensor saw nothing.
        time_s: Seconds since the episode began.
        rgb: Colour image, where the robot has one.
        semantic: Class of what each pixel shows, where it was asked for; the truth, not sensed.
        instance: Object that each pixel shows, where it was asked for; the truth, not sensed.
    """

    depth_m: Float32[np.ndarray, "height width"]
    time_s: float
    rgb: UInt8[np.ndarray, "height width 3"] | None = None
    semantic: UInt8[np.ndarray, "height width"] | None = None
    instance: Int32[np.ndarray, "height width"] | None = None


@dataclass(frozen=True)
class Belief:
    """What an agent thinks, for display and for the localization metrics.

    Attributes:
        node: Node it thinks it is at, or None.
        edge: Edge it thinks it is on, or None.
        behavior: Behaviour it is executing, or None.
        edge_probability: Probability of each edge that it considered, by edge id.
        stopped_because: Why it stopped the robot by itself, or an empty string.
    """

    node: str | None = None
    edge: str | None = None
    behavior: Behavior | None = None
    edge_probability: Mapping[str, float] = field(default_factory=dict)
    stopped_because: str = ""


@runtime_checkable
class Agent(Protocol[Task]):
    """Observation in, velocity out. Deterministic given its seed."""

    def reset(self, task: Task) -> None:
        """Begin an episode."""

    def act(self, observation: Observation) -> Velocity:
        """The command for this control step."""

    def belief(self) -> Belief:
        """What it thinks after the last `act`."""
