"""What the robot has told its wheels since it came to a node."""

from toponav.core.episode import Velocity
from toponav.models.graphnav.graph_tensors import Motion

__all__ = ["DeadReckoning"]

_PERIOD_S = 0.2
_FORGET_STEPS = 25


class DeadReckoning:
    """Adds up the robot's own commands; no odometry and no pose from outside enters.

    A belief that flickers between two nodes does not restart the count: a node that was left
    less than five seconds ago keeps the moment at which the robot came to it.
    """

    def __init__(self) -> None:
        self.reset("")

    def reset(self, node: str) -> None:
        """Begin an episode at this node."""
        self._step = 0
        self._driven_m = self._turned_rad = 0.0
        self._entered = {node: Motion(0.0, 0.0)}
        self._last_seen = {node: 0}

    def advance(self, command: Velocity) -> None:
        """Take in the command of one control step."""
        self._step += 1
        self._driven_m += abs(command.linear_m_s) * _PERIOD_S
        self._turned_rad += command.angular_rad_s * _PERIOD_S

    def since(self, node: str) -> Motion:
        """The motion since the robot came to the node that it takes itself to be at."""
        seen = self._last_seen.get(node)
        if seen is None or self._step - seen > _FORGET_STEPS:
            self._entered[node] = Motion(self._driven_m, self._turned_rad)
        self._last_seen[node] = self._step
        entered = self._entered[node]
        return Motion(self._driven_m - entered.driven_m, self._turned_rad - entered.turned_rad)
