"""Motion from the robot's own commands: the only odometry that the agent has."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64

__all__ = ["CommandOdometry", "motion_steps"]

_PERIOD_S = 0.2


@dataclass(frozen=True)
class CommandOdometry:
    """How much of a command a robot carries out within its control step and the next.

    The defaults are least squares over 392,138 steps of the simulated TurtleBot 2; what they
    leave is 3 mm and 0.4 degrees a step. Another robot needs its own numbers.
    """

    linear_now: float = 0.466
    """Share of the commanded speed that shows in the same step."""
    linear_next: float = 0.530
    """Share that shows in the step after."""
    angular_now: float = 0.705
    """Share of the commanded turn rate that shows in the same step."""
    angular_next: float = 0.260
    """Share that shows in the step after: wheels slip a little in turns."""

    def step(
        self, command: Float[np.ndarray, " 2"], last: Float[np.ndarray, " 2"]
    ) -> Float64[np.ndarray, " 3"]:
        """Metres forward, metres left and radians turned in a step.

        Args:
            command: Speed (m/s) and turn rate (rad/s) commanded for the step.
            last: The same for the step before.
        """
        return np.array(
            [
                _PERIOD_S * (self.linear_now * command[0] + self.linear_next * last[0]),
                0.0,
                _PERIOD_S * (self.angular_now * command[1] + self.angular_next * last[1]),
            ]
        )


def motion_steps(
    executed: Float[np.ndarray, "frames 2"],
    is_first: np.ndarray,
    odometry: CommandOdometry | None = None,
) -> Float64[np.ndarray, "frames 3"]:
    """The motion from each recorded frame to the next.

    Args:
        executed: Commands carried out after each frame.
        is_first: Whether a trajectory begins at the frame.
        odometry: The robot's response.
    """
    model = odometry or CommandOdometry()
    commands = np.asarray(executed, dtype=np.float64)
    last = np.concatenate([np.zeros((1, 2)), commands[:-1]])
    last[is_first] = 0.0
    steps = np.zeros((len(commands), 3))
    steps[:, 0] = _PERIOD_S * (model.linear_now * commands[:, 0] + model.linear_next * last[:, 0])
    steps[:, 2] = _PERIOD_S * (
        model.angular_now * commands[:, 1] + model.angular_next * last[:, 1]
    )
    return steps
