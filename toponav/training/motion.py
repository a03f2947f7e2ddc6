"""Dead reckoning as training sees it: what was commanded since the robot came to an edge."""

from typing import Final

import numpy as np
from jaxtyping import Bool, Float64, Int64, Integer

from toponav.models.graphnav.graph_tensors import Motion
from toponav.training.samples import TrainingData, first_frames

__all__ = ["MotionSampler"]

_PERIOD_S: Final = 0.2
# A robot in use notices a new edge too early or too late: by this much, one sigma.
_LATE_M: Final = 0.35
_LATE_RAD: Final = 0.15
_SCALE: Final = 0.05
_SEGMENTS_BACK: Final = 3


class MotionSampler:
    """Draws the motion that an agent would have added up, with the errors that it would make.

    Args:
        data: Trajectories with the commands that were executed.
    """

    def __init__(self, data: TrainingData) -> None:
        executed = np.asarray(data.executed, dtype=np.float64)
        self._edge = np.asarray(data.edge)
        trajectory = np.asarray(data.trajectory)
        # The command of a frame is executed after it.
        self._driven_m = _before_each(np.abs(executed[:, 0]) * _PERIOD_S)
        self._turned_rad = _before_each(executed[:, 1] * _PERIOD_S)
        self._begin = first_frames(trajectory)
        segments = trajectory.astype(np.int64) << 32 | (self._edge.astype(np.int64) & 0xFFFFFFFF)
        self._entered = first_frames(segments)

    def draw(
        self,
        frames: Int64[np.ndarray, " batch"],
        previous_edge: Integer[np.ndarray, " batch"],
        rng: np.random.Generator,
    ) -> list[Motion]:
        """The motion at each frame since the robot came to its previous edge.

        Args:
            frames: Index of each frame.
            previous_edge: Index, in its map, of the edge that the robot thinks it is on. If it
                was on that edge lately, that is when it came to it. If not, it has just
                jumped there in its mind, and anything up to a metre has passed since.
            rng: Source of the errors.
        """
        entered, is_known = self._last_entry(frames, previous_edge)
        driven_m = self._driven_m[frames] - self._driven_m[entered]
        turned_rad = self._turned_rad[frames] - self._turned_rad[entered]
        driven_m = np.where(is_known, driven_m, rng.uniform(0.0, 1.0, len(frames)))
        turned_rad = np.where(is_known, turned_rad, rng.normal(0.0, 0.2, len(frames)))
        # Before the first edge there is nothing to be late for.
        is_late = np.where(entered > self._begin[frames], 1.0, 0.0)
        driven_m *= rng.normal(1.0, _SCALE, len(frames))
        driven_m += is_late * rng.normal(0.0, _LATE_M, len(frames))
        turned_rad = turned_rad + is_late * rng.normal(0.0, _LATE_RAD, len(frames))
        return [
            Motion(max(driven, 0.0), turned)
            for driven, turned in zip(driven_m.tolist(), turned_rad.tolist(), strict=True)
        ]

    def _last_entry(
        self, frames: Int64[np.ndarray, " batch"], previous_edge: Integer[np.ndarray, " batch"]
    ) -> tuple[Int64[np.ndarray, " batch"], Bool[np.ndarray, " batch"]]:
        """When the robot last came to each edge, and whether it lately did."""
        entered = self._entered[frames]
        is_known = self._edge[frames] == previous_edge
        candidate = entered
        for _ in range(_SEGMENTS_BACK):
            has_earlier = candidate > self._begin[frames]
            candidate = np.where(
                has_earlier, self._entered[np.maximum(candidate - 1, 0)], candidate
            )
            fits = ~is_known & has_earlier & (self._edge[candidate] == previous_edge)
            entered = np.where(fits, candidate, entered)
            is_known = is_known | fits
        return entered, is_known


def _before_each(steps: Float64[np.ndarray, " frames"]) -> Float64[np.ndarray, " frames"]:
    """The sum of all steps before each frame."""
    return np.concatenate([[0.0], np.cumsum(steps)[:-1]])
