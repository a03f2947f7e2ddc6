"""The safety watchdog: says when a robot must stand still, whatever the agent wants.

It knows times and a few facts about frames, and nothing of ROS: the node feeds it and asks it
fifty times a second, from a thread of its own. Every clock is the caller's, in seconds.
"""

import math
import threading
import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from toponav.core.episode import Velocity
from toponav.core.errors import InputError

__all__ = ["CommandTimeout", "Watchdog", "WatchdogConfig"]

_STANDING = 0.01
_FLAT_M = 1e-3


@dataclass(frozen=True)
class WatchdogConfig:
    """When a robot must stand still."""

    max_age_s: float = 0.5
    """A frame older than this is not fresh, by its stamp and by its arrival."""
    max_act_s: float = 0.5
    """An agent that thinks longer than this is dead."""
    frozen_s: float = 0.5
    """Equal frames over this long, while the robot drives, are frozen."""
    max_invalid_share: float = 0.5
    """Share of pixels that may be NaN: sensors mark holes so (REP-118), and fewer are holes."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"{name} must be positive and finite, got {value}",
                    where="WatchdogConfig",
                    remedy="leave it at its default",
                )


class Watchdog:
    """Judges frames, the agent's pulse and the age of both. All methods may be called anywhere.

    Args:
        config: Its thresholds.

    Example:
        >>> watchdog = Watchdog()
        >>> watchdog.start(0.0)
        >>> watchdog.fault(0.6)
        'no depth frame for 0.6 s'
    """

    def __init__(self, config: WatchdogConfig | None = None) -> None:
        self.config = config or WatchdogConfig()
        self._lock = threading.Lock()
        self.start(0.0)

    def start(self, now_s: float) -> None:
        """Begin a run: what was before is forgotten, and everything counts from now."""
        with self._lock:
            self._stamp_s = self._arrived_s = now_s
            self._thinking_since_s: float | None = None
            self._bad_frame = ""
            self._checksum: int | None = None
            self._same_since_s = now_s
            self._newest_s = -math.inf

    def frame(
        self,
        depth_m: Float32[np.ndarray, "height width"],
        stamp_s: float,
        now_s: float,
        last_command: Velocity,
    ) -> str:
        """Why this frame must not become a velocity, or an empty string.

        Args:
            depth_m: The frame as the sensor gave it: holes are 0 or NaN.
            stamp_s: When it was taken.
            now_s: The same clock, now.
            last_command: What the robot is doing.
        """
        invalid = float(np.isnan(depth_m).mean()) if depth_m.size else 1.0
        checksum = zlib.crc32(np.ascontiguousarray(depth_m).data)
        with self._lock:
            if stamp_s <= self._newest_s:
                return "the frame is not newer than the last"
            self._newest_s = stamp_s
            self._bad_frame = self._fault_of(invalid, checksum, stamp_s, depth_m, last_command)
            if not self._bad_frame:
                self._stamp_s, self._arrived_s = stamp_s, now_s
                if now_s - stamp_s > self.config.max_age_s:
                    return f"the frame is {now_s - stamp_s:.1f} s old"
            return self._bad_frame

    def thinking(self, now_s: float) -> None:
        """The agent was asked for a command."""
        with self._lock:
            self._thinking_since_s = now_s

    def decided(self) -> None:
        """The agent gave its command."""
        with self._lock:
            self._thinking_since_s = None

    def fault(self, now_s: float) -> str:
        """Why the robot must stand still now, or an empty string."""
        limit_s = self.config.max_age_s
        with self._lock:
            if self._bad_frame:
                return self._bad_frame
            waited_s = now_s - self._arrived_s
            if waited_s > limit_s:
                return f"no depth frame for {waited_s:.1f} s"
            age_s = now_s - self._stamp_s
            if age_s > limit_s:
                return f"the newest depth frame is {age_s:.1f} s old"
            since_s = self._thinking_since_s
            if since_s is not None and now_s - since_s > self.config.max_act_s:
                return f"the agent has not answered for {now_s - since_s:.1f} s"
        return ""

    def _fault_of(
        self,
        invalid: float,
        checksum: int,
        stamp_s: float,
        depth_m: Float32[np.ndarray, "height width"],
        last_command: Velocity,
    ) -> str:
        if invalid > self.config.max_invalid_share:
            return f"{invalid:.0%} of the depth frame is NaN"
        moving = max(abs(last_command.linear_m_s), abs(last_command.angular_rad_s)) > _STANDING
        suspicious = checksum == self._checksum and (
            self._bad_frame.endswith("frozen") or (moving and not _shows_only_planes(depth_m))
        )
        if not suspicious:
            self._checksum, self._same_since_s = checksum, stamp_s
            return ""
        same_s = stamp_s - self._same_since_s
        if same_s < self.config.frozen_s:
            return ""
        return f"the depth frame has been the same for {same_s:.1f} s of driving: frozen"


class CommandTimeout:
    """The robot's own rule: a command that is not repeated in time ends.

    Args:
        timeout_s: How long a command lasts.

    Example:
        >>> timeout = CommandTimeout(0.5)
        >>> timeout.command(Velocity(0.3, 0.0), 1.0)
        >>> timeout.current(1.5).linear_m_s, timeout.current(1.52).linear_m_s
        (0.3, 0.0)
    """

    def __init__(self, timeout_s: float = 0.5) -> None:
        self.timeout_s = timeout_s
        self._lock = threading.Lock()
        self._command, self._at_s = Velocity(0.0, 0.0), -math.inf

    def command(self, command: Velocity, now_s: float) -> None:
        """The robot was told this; what is not finite means zero."""
        finite = math.isfinite(command.linear_m_s) and math.isfinite(command.angular_rad_s)
        with self._lock:
            self._command = command if finite else Velocity(0.0, 0.0)
            self._at_s = now_s

    def has_ceased(self, now_s: float) -> bool:
        """Whether no command has come for too long."""
        with self._lock:
            # A microsecond for sums of steps that are not exact.
            return now_s - self._at_s > self.timeout_s + 1e-6

    def current(self, now_s: float) -> Velocity:
        """What the robot does now."""
        if self.has_ceased(now_s):
            return Velocity(0.0, 0.0)
        with self._lock:
            return self._command

    def clear(self) -> None:
        """Forget the last command."""
        with self._lock:
            self._command, self._at_s = Velocity(0.0, 0.0), -math.inf


def _shows_only_planes(depth_m: Float32[np.ndarray, "height width"]) -> bool:
    """Whether every row is of one depth, as floor and ceiling are to a level camera."""
    return bool((np.abs(depth_m - depth_m[:, :1]) < _FLAT_M).all())
