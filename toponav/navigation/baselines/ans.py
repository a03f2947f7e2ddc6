"""Active Neural SLAM adapted to image goals: its mapper, pose estimator and long-term goals.

Where ANS learns its global policy by reinforcement, the long-term goal is here the edge of the
map with the most unseen floor for the drive; docs/nts.md says what follows from that.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from toponav.core.geometry import Pose2
from toponav.core.imagenav import ImageGoal, PanoramaObservation
from toponav.navigation.baselines.frontier import Frontier, FrontierAgent, FrontierConfig
from toponav.navigation.nts.local_map import Window
from toponav.navigation.nts.perception import Perception, View
from toponav.navigation.nts.registration import Signature, align

__all__ = ["ActiveNeuralSlamAgent", "AnsConfig"]


@dataclass(frozen=True)
class AnsConfig(FrontierConfig):
    """How it explores."""

    patience_steps: int = 25
    """A long-term goal holds so many steps, as in the paper of ANS."""
    view_m: float = 2.5
    """Unseen floor so near to a frontier counts for it."""
    least_agreement: float = 0.5
    """Consecutive panoramas correct the odometry where they agree at least so well."""
    most_correction_m: float = 0.1
    """The odometry of one step is never corrected by more."""


class ActiveNeuralSlamAgent(FrontierAgent):
    """Explores for coverage, correcting its pose by what it sees, until the goal is seen.

    Args:
        perception: The network's functions.
        config: How it explores.
        seed: Seed of what it does where it is stuck.

    Reference:
        Chaplot et al. 2020, "Learning to Explore using Active Neural SLAM".
    """

    def __init__(
        self, perception: Perception, config: AnsConfig | None = None, seed: int = 0
    ) -> None:
        self._ans = config or AnsConfig()
        self._seen: Signature | None = None
        self._read: Pose2 | None = None
        super().__init__(perception, self._ans, seed)

    def reset(self, goal: ImageGoal, keep_map: bool = False) -> None:
        """Looks for another place; the map is kept where it is told so."""
        if not keep_map:
            self._seen, self._read = None, None
        super().reset(goal, keep_map)

    def locate(self, observation: PanoramaObservation, view: View) -> Pose2:
        """The last pose and the step since, corrected by laying this panorama over the last."""
        # The tracker keeps what the odometry says, without the jumps that no robot makes.
        read = self._tracker.update(observation.odometry, None, self._action)
        moved = read if self._read is None else read.relative_to(self._read)
        if self._seen is not None:
            found = align(self._seen, view.signature, moved)
            is_near = found.pose.distance_to(moved) <= self._ans.most_correction_m
            if found.score >= self._ans.least_agreement and is_near:
                moved = found.pose
        self._read, self._seen = read, view.signature
        return self._pose.compose(moved)

    def choose(
        self, window: Window, found: list[Frontier], known: Bool[np.ndarray, "rows cols"]
    ) -> Frontier:
        """The frontier with the most unseen floor near by for each metre of driving."""
        cell_m = self._policy.map.config.cell_m
        reach = round(self._ans.view_m / cell_m)

        def gain(frontier: Frontier) -> float:
            row, col = frontier.cells.mean(axis=0).astype(int).tolist()
            seen = known[
                max(row - reach, 0) : row + reach + 1, max(col - reach, 0) : col + reach + 1
            ]
            unseen = (2 * reach + 1) ** 2 - int(seen.sum())
            return unseen * cell_m**2 / (1.0 + frontier.drive_m)

        return max(found, key=gain)
