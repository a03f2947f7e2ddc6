"""What the pose filter would have believed along recorded drives."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32, Float64, Int64

from toponav.models.graphnav.metric.pages import draw_beliefs
from toponav.models.graphnav.metric.pose_filter import PoseFilter, PoseFilterConfig
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.training.metric_data import MetricData
from toponav.training.precision import autocast

__all__ = ["ReplayedBeliefs", "replay_beliefs"]

_AT_ONCE = 256
_ASKEW_RAD = math.radians(20.5)
PROGRESS_BACK_M, PROGRESS_AHEAD_M = 1.0, 2.5
"""From one step to the next, progress along the plan changes by no more than this."""


@dataclass(frozen=True)
class ReplayedBeliefs:
    """The filter's state at each frame, after it took the frame in.

    Attributes:
        pose: x, y, yaw in the map's frame.
        std: Metres forward and left, radians.
        progress_m: Metres of the plan behind the believed pose.
    """

    pose: Float32[np.ndarray, "frames 3"]
    std: Float32[np.ndarray, "frames 3"]
    progress_m: Float32[np.ndarray, " frames"]


def replay_beliefs(
    one: MetricData,
    network: PoseNetwork,
    config: PoseFilterConfig | None = None,
    *,
    trajectories: Int64[np.ndarray, " chosen"] | None = None,
    precision: str = "float32",
    on_progress: Callable[[int, int], None] | None = None,
) -> ReplayedBeliefs:
    """Run the filter along drives, from what a robot is told at their starts.

    Args:
        one: Recorded drives.
        network: The pose network.
        config: The filter's noise.
        trajectories: Which drives; all when None. Frames of the others stay zero.
        precision: Number format of the network.
        on_progress: Told how many drives of how many are done.
    """
    count = len(one)
    out = ReplayedBeliefs(
        np.zeros((count, 3), np.float32),
        np.zeros((count, 3), np.float32),
        np.zeros(count, np.float32),
    )
    wanted = np.arange(one.data.trajectories) if trajectories is None else trajectories
    lengths = np.diff(one.data.starts)[wanted]
    wanted = wanted[np.argsort(-lengths, kind="stable")]
    network.eval()
    for first in range(0, len(wanted), _AT_ONCE):
        if on_progress is not None:
            on_progress(first, len(wanted))
        _replay_some(one, network, config, wanted[first : first + _AT_ONCE], precision, out)
    return out


def _replay_some(
    one: MetricData,
    network: PoseNetwork,
    config: PoseFilterConfig | None,
    page: Int64[np.ndarray, " robots"],
    precision: str,
    out: ReplayedBeliefs,
) -> None:
    """Drives in lock-step, the longest first."""
    begin = one.data.starts[page]
    lengths = np.diff(one.data.starts)[page]
    beliefs = PoseFilter(_starts(one, page), config)
    progress = np.zeros(len(page))
    for step in range(int(lengths.max(initial=0))):
        alive = int((lengths > step).sum())
        if alive < len(beliefs.pose):
            beliefs.keep(alive)
            progress = progress[:alive]
        rows = begin[:alive] + step
        if step:
            beliefs.predict(one.steps[rows - 1])
        progress = _correct(one, network, page[:alive], rows, beliefs, progress, precision)
        out.pose[rows] = beliefs.pose
        out.std[rows] = beliefs.std_in_robot
        out.progress_m[rows] = progress


def _starts(
    one: MetricData, page: Int64[np.ndarray, " robots"]
) -> Float64[np.ndarray, "robots 3"]:
    """What robots are told; one that began askew is told its heading, give or take 20 degrees.

    Drives that begin facing anywhere teach how to turn round, but no robot in use begins so.
    """
    starts = np.array([one.start_pose(int(number)) for number in page])
    yaw = one.data.pose[one.data.starts[page], 2].astype(np.float64)
    away = yaw - starts[:, 2]
    is_askew = np.abs(np.arctan2(np.sin(away), np.cos(away))) > _ASKEW_RAD
    spread = np.random.default_rng(0).uniform(-_ASKEW_RAD, _ASKEW_RAD, one.data.trajectories)
    starts[is_askew, 2] = (yaw + spread[page])[is_askew]
    return starts


@torch.inference_mode()
def _correct(
    one: MetricData,
    network: PoseNetwork,
    page: Int64[np.ndarray, " robots"],
    rows: Int64[np.ndarray, " robots"],
    beliefs: PoseFilter,
    progress: np.ndarray,
    precision: str,
) -> np.ndarray:
    """Take in a frame; returns the progress along the plan."""
    config = network.config.local_map
    bounds = np.stack([progress - PROGRESS_BACK_M, progress + PROGRESS_AHEAD_M], axis=1)
    drawn = draw_beliefs(
        one.pages, page, beliefs.pose, bounds, config.far_cell_m, config.view_cells
    )
    with autocast("bfloat16" if precision == "bfloat16" else "float32"):
        mean, log_std = network(torch.from_numpy(one.far[rows]), torch.from_numpy(drawn.pictures))
    beliefs.correct(mean.numpy(), log_std.exp().numpy())
    return drawn.progress_m
