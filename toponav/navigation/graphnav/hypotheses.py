"""Where a robot may be: several pose filters, weighed by what the pose network makes of each."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Float, Float64, UInt8

from toponav.core.errors import InputError
from toponav.core.vocabulary import NodeKind
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.map_picture import MapArrays
from toponav.models.graphnav.metric.pages import draw_beliefs, pages_of
from toponav.models.graphnav.metric.pose_filter import PoseFilter, PoseFilterConfig
from toponav.models.graphnav.metric.pose_network import PoseNetwork

__all__ = ["HypothesesConfig", "PoseHypotheses"]

_BACK_M: Final = 1.0
_AHEAD_M: Final = 2.5


@dataclass(frozen=True)
class HypothesesConfig:
    """Where hypotheses begin, and when they are given up."""

    rings_m: tuple[float, ...] = (1.6, 3.2, 4.8, 6.4)
    """Hypotheses lie on half rings of these radii around the first node, on the room's side."""
    spacing_m: float = 1.8
    """Distance between neighbours on a ring."""
    start_std_m: float = 0.9
    """Spread of each hypothesis."""
    prior_m: float = 3.5
    """A hypothesis this far from the node is less likely by a factor of 0.6."""
    give_up: float = 7.0
    """One whose log-weight is this much below the best one's is given up."""
    same_m: float = 0.35
    """Two that have come this near to each other are one."""
    same_rad: float = 0.25
    """And whose headings differ by no more than this."""

    def __post_init__(self) -> None:
        values = (*self.rings_m, *(v for k, v in vars(self).items() if k != "rings_m"))
        if not all(0.0 < value < 1000.0 for value in values):
            raise InputError(
                f"every setting must be positive, got {self}",
                where="HypothesesConfig",
                remedy="leave it at its default",
            )


class PoseHypotheses:
    """A mixture of pose filters: particles that each carry a normal distribution.

    The robot is told its room's node and not where in the room it stands: as far as six metres
    from it, with the door out of sight. The pose network, asked from one hypothesis, says how
    probable an offset of zero is: that density weighs the hypothesis, as far as the frame is
    news. Where the door comes into view one hypothesis wins, and what is left is one filter.

    Args:
        task: Map and plan.
        network: Says how far off a believed pose is.
        filter_config: Noise of each filter.
        config: Where hypotheses begin and end.
    """

    def __init__(
        self,
        task: NavigationTask,
        network: PoseNetwork,
        filter_config: PoseFilterConfig,
        config: HypothesesConfig | None = None,
    ) -> None:
        self.config = config or HypothesesConfig()
        self._network = network
        self._pages = pages_of([MapArrays.of(task.map, task.plan)])
        starts = _starts(task, self.config)
        own = {**vars(filter_config), "start_std_m": self.config.start_std_m}
        self.filters = PoseFilter(starts, PoseFilterConfig(**own))
        away = np.hypot(*(starts[:, :2] - starts[0, :2]).T)
        self._log_weight = -0.5 * (away / self.config.prior_m) ** 2
        self._progress_m = np.zeros(len(starts))

    def __len__(self) -> int:
        return len(self._log_weight)

    @property
    def best(self) -> int:
        """The likeliest hypothesis."""
        return int(self._log_weight.argmax())

    @property
    def pose(self) -> Float64[np.ndarray, " 3"]:
        """The likeliest x, y and yaw."""
        found: np.ndarray = self.filters.pose[self.best]
        return found

    @property
    def std_in_robot(self) -> Float64[np.ndarray, " 3"]:
        """Of the likeliest hypothesis: metres forward and left, radians."""
        found: np.ndarray = self.filters.std_in_robot[self.best]
        return found

    @property
    def progress_m(self) -> float:
        """Metres of the plan behind the likeliest pose."""
        return float(self._progress_m[self.best])

    def predict(self, step: Float[np.ndarray, " 3"]) -> None:
        """Move all by a dead-reckoned step: metres forward and left, radians turned."""
        self.filters.predict(np.tile(step, (len(self), 1)))

    @torch.inference_mode()
    def correct(self, view: UInt8[np.ndarray, "forward left"]) -> None:
        """Lay what was seen over the map around each hypothesis; weigh, move and thin them out.

        Args:
            view: The local map's far view.
        """
        config = self._network.config.local_map
        count = len(self)
        bounds = np.stack([self._progress_m - _BACK_M, self._progress_m + _AHEAD_M], axis=1)
        drawn = draw_beliefs(
            self._pages,
            np.zeros(count, np.int64),
            self.filters.pose,
            bounds,
            config.far_cell_m,
            config.view_cells,
        )
        self._progress_m = drawn.progress_m
        views = torch.from_numpy(view)[None].expand(count, -1, -1)
        mean, log_std = self._network(views, torch.from_numpy(drawn.pictures))
        if not (torch.isfinite(mean).all() and torch.isfinite(log_std).all()):
            return
        offset, std = mean.numpy().astype(np.float64), log_std.exp().numpy().astype(np.float64)
        if count > 1:
            doubted = std * self.filters.config.doubt
            density = -np.log(doubted).sum(1) - 0.5 * ((offset / doubted) ** 2).sum(1)
            self._log_weight += self.filters.news[:count] * density
        self.filters.correct(offset, std)
        self._thin_out()

    def _thin_out(self) -> None:
        """Give up the unlikely, and of those that have met all but the likeliest."""
        if len(self) == 1:
            return
        config, pose = self.config, self.filters.pose
        kept: list[int] = []
        for one in np.argsort(-self._log_weight).tolist():
            if self._log_weight[one] < self._log_weight[self.best] - config.give_up:
                break
            turn = pose[kept, 2] - pose[one, 2]
            met = np.hypot(*(pose[kept, :2] - pose[one, :2]).T) < config.same_m
            met &= np.abs(np.arctan2(np.sin(turn), np.cos(turn))) < config.same_rad
            if met.any():
                continue
            kept.append(one)
        chosen = np.array(kept)
        self.filters.choose(chosen)
        self._log_weight = self._log_weight[chosen] - self._log_weight[chosen].max()
        self._progress_m = self._progress_m[chosen]


def _starts(task: NavigationTask, config: HypothesesConfig) -> Float64[np.ndarray, "poses 3"]:
    """The first node, and places around it on the side of the room."""
    plan, topological_map = task.plan, task.map
    node = topological_map.node(plan.nodes[0])
    yaw_rad = topological_map.edge(plan.edges[0]).yaw_rad if plan.edges else 0.0
    starts = [(node.x_m, node.y_m, yaw_rad)]
    if node.kind is not NodeKind.ROOM or not plan.edges:
        return np.array(starts)
    # The plan leaves the room; the room is behind.
    beyond = topological_map.node(plan.nodes[min(2, len(plan.nodes) - 1)])
    inward_rad = math.atan2(node.y_m - beyond.y_m, node.x_m - beyond.x_m)
    for radius_m in config.rings_m:
        places = max(3, math.ceil(math.pi * radius_m / config.spacing_m))
        for share in (np.arange(places) + 0.5) / places - 0.5:
            angle = inward_rad + math.pi * float(share)
            starts.append(
                (
                    node.x_m + radius_m * math.cos(angle),
                    node.y_m + radius_m * math.sin(angle),
                    yaw_rad,
                )
            )
    return np.array(starts)
