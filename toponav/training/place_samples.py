"""Where robots took themselves to be early in recorded drives: what a judge has to tell apart."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float32, Int64

from toponav.core.vocabulary import NodeKind
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.pose_filter import PoseFilterConfig
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.navigation.graphnav.hypotheses import HypothesesConfig, PoseHypotheses
from toponav.training.metric_data import MetricData

__all__ = ["PlaceSamples", "replay_hypotheses"]

_STEPS: Final = 90
_EVERY: Final = 3
_AT_ONCE: Final = 3
_ASKEW_RAD: Final = math.radians(25.0)
_AGAIN: Final = 0.6


@dataclass(frozen=True)
class PlaceSamples:
    """Hypotheses of robots, right and wrong ones.

    Attributes:
        row: The frame.
        pose: The hypothesis: x, y, yaw in the map's frame.
        bounds_m: Between which lengths of the plan its progress is sought.
    """

    row: Int64[np.ndarray, " samples"]
    pose: Float32[np.ndarray, "samples 3"]
    bounds_m: Float32[np.ndarray, "samples 2"]

    def __len__(self) -> int:
        return len(self.row)


def replay_hypotheses(
    one: MetricData,
    network: PoseNetwork,
    rng: np.random.Generator,
    *,
    trajectories: Int64[np.ndarray, " chosen"] | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> PlaceSamples:
    """Search for the robot along the first seconds of drives, as it would, and note where.

    Most searches are begun anew once, at a random time: that scatters hypotheses around a robot
    that had found itself.

    Args:
        one: Recorded drives.
        network: The pose network.
        rng: Draws what is noted.
        trajectories: Which drives; all when None. Those begun askew are left out.
        on_progress: Told how many drives of how many are done.
    """
    rows: list[int] = []
    poses: list[np.ndarray] = []
    bounds: list[np.ndarray] = []
    wanted = np.arange(one.data.trajectories) if trajectories is None else trajectories
    config = HypothesesConfig(doubted=900.0)
    network.eval()
    for done, number in enumerate(wanted.tolist()):
        if on_progress is not None:
            on_progress(done, len(wanted))
        start = one.start_pose(number)
        first = int(one.data.starts[number])
        away = float(one.data.pose[first, 2]) - start[2]
        task = NavigationTask(one.data.map_of(number), one.data.plan_of(number))
        is_room = task.map.node(task.plan.nodes[0]).kind is NodeKind.ROOM
        if not is_room or abs(math.remainder(away, 2.0 * math.pi)) > _ASKEW_RAD:
            continue
        search = PoseHypotheses(one.arrays_of(number), task, network, PoseFilterConfig(), config)
        last = min(int(one.data.starts[number + 1]), first + _STEPS)
        again = first + int(rng.integers(10, _STEPS)) if rng.random() < _AGAIN else -1
        for row in range(first, last):
            if row > first:
                search.predict(one.steps[row - 1])
            if row == again:
                search.begin_anew()
            is_new = row in (first, again)
            if not is_new:
                search.correct(one.far[row])
            if is_new or (row - first) % _EVERY == 0:
                noted = rng.permutation(len(search))[:_AT_ONCE]
                noted = np.unique(np.append(noted, search.followed))
                rows += [row] * len(noted)
                poses.append(search.filters.pose[noted].astype(np.float32))
                bounds.append(search.bounds_m[noted].astype(np.float32))
            if is_new:
                search.correct(one.far[row])
    return PlaceSamples(
        np.array(rows, dtype=np.int64),
        np.concatenate([*poses, np.zeros((0, 3), np.float32)]),
        np.concatenate([*bounds, np.zeros((0, 2), np.float32)]),
    )
