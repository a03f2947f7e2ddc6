"""The simulator as a robot: commands that cease, a clock that only goes on. Without ROS."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from toponav.core.episode import Observation, Velocity
from toponav.core.geometry import Pose2
from toponav.ros.watchdog import CommandTimeout
from toponav.sim.simulation import CONTROL_PERIOD_S, TIMESTEP_S, SimState, Simulation

__all__ = ["TICK_S", "Pace", "SimulatedRobot", "Tick"]

_TICK_SUBSTEPS: Final = 5
TICK_S: Final = _TICK_SUBSTEPS * TIMESTEP_S
"""Time between two odometry messages: 50 Hz."""
_TICKS_PER_FRAME: Final = round(CONTROL_PERIOD_S / TICK_S)
_NS: Final = 10**9
_MOST_BEHIND: Final = 10
_GAP_NS: Final = round(CONTROL_PERIOD_S * _NS)


@dataclass(frozen=True)
class Tick:
    """What happened in one tick."""

    command: Velocity
    """What the robot did: the last command, or zero where none lasts."""
    state: SimState
    time_ns: int
    frame_is_due: bool


class SimulatedRobot:
    """A simulation with a clock that survives resets and a base that stops by itself.

    Args:
        simulation: Where the robot drives.
        start: Where it stands.
        timeout_s: How long a command lasts.
    """

    def __init__(self, simulation: Simulation, start: Pose2, timeout_s: float = 0.5) -> None:
        self._simulation = simulation
        self._commands = CommandTimeout(timeout_s)
        self._offset_ns = 0
        self._ticks = 0
        self._seed = simulation.sensor_seed
        self.start = start
        simulation.reset(start)

    @property
    def time_ns(self) -> int:
        """The clock: simulated time since the first start; a reset does not turn it back."""
        return self._offset_ns + round(self._simulation.state.time_s * _NS)

    @property
    def state(self) -> SimState:
        """The truth now."""
        return self._simulation.state

    def observe(self) -> Observation:
        """What the camera sees now."""
        return self._simulation.observe()

    def reset(self, pose: Pose2 | None = None) -> SimState:
        """The robot at rest at `pose`, or where it last started; the clock goes on by a step.

        Raises:
            InputError: The pose is not inside the building.
        """
        offset_ns = self.time_ns + _GAP_NS
        wanted = pose or self.start
        self._simulation.sensor_seed = self._seed
        state = self._simulation.reset(wanted)
        self._offset_ns, self._ticks, self.start = offset_ns, 0, wanted
        self._commands.clear()
        return state

    def seed(self, seed: int) -> None:
        """Seed of the sensor's errors from the next reset on."""
        self._seed = abs(seed)

    def command(self, command: Velocity) -> None:
        """The robot was told this, now."""
        self._commands.command(command, self.time_ns / _NS)

    def tick(self) -> Tick:
        """A fiftieth of a second on, with the last command while it lasts."""
        now_s = self.time_ns / _NS
        ceased = self._commands.has_ceased(now_s)
        command = self._commands.current(now_s)
        state = self._simulation.advance(command, _TICK_SUBSTEPS, brakes=ceased)
        self._ticks += 1
        return Tick(command, state, self.time_ns, self._ticks % _TICKS_PER_FRAME == 0)


class Pace:
    """When the next tick is due in the time of people.

    Args:
        rate: Simulated seconds per second; 0 is as fast as it can.
        now_s: The clock of people; it never goes back.
    """

    def __init__(self, rate: float, now_s: Callable[[], float] = time.monotonic) -> None:
        self._period_s = TICK_S / rate if rate > 0 else 0.0
        self._now_s = now_s
        self._due_s = now_s()

    def restart(self) -> None:
        """A tick is due now; nothing is late."""
        self._due_s = self._now_s()

    def left_s(self) -> float:
        """Time until the next tick is due, or 0."""
        return max(0.0, self._due_s - self._now_s()) if self._period_s else 0.0

    def tick(self) -> bool:
        """A tick is made; returns whether it comes more than a tick late.

        What is late is made up for, up to ten ticks; more is given up.
        """
        late_s = self._now_s() - self._due_s
        is_late = bool(self._period_s) and late_s > self._period_s
        self._due_s += self._period_s + max(0.0, late_s - _MOST_BEHIND * self._period_s)
        return is_late
