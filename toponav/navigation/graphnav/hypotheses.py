"""Where a robot may be: several pose filters, weighed by what the pose network makes of each."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Bool, Float, Float64, Int64, UInt8

from toponav.core.errors import InputError
from toponav.core.vocabulary import NodeKind
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.map_picture import MapArrays
from toponav.models.graphnav.metric.pages import draw_beliefs, pages_of
from toponav.models.graphnav.metric.pose_filter import PoseFilter, PoseFilterConfig
from toponav.models.graphnav.metric.pose_network import NEAR_M, PoseNetwork
from toponav.navigation.graphnav.node_belief import first_door

__all__ = ["AT_DOOR_M", "HypothesesConfig", "PoseHypotheses"]

AT_DOOR_M: Final = 0.9
"""A robot that has come this near to its first room's door leaves the room."""
_BACK_M: Final = 1.0
_AHEAD_M: Final = 2.5
_TRAIL_M: Final = 0.2


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
    kept: float = 1.0
    """The one that the robot follows is followed until another has so much more log-weight."""
    same_m: float = 0.35
    """Two that have come this near to each other are one."""
    same_rad: float = 0.25
    """And whose headings differ by no more than this."""
    surest: float = 4.0
    """A judgement of more log-odds than this counts for no more."""
    doubted: float = 1.5
    """Begin anew where the judgement of the pose, averaged, is below minus this..."""
    doubt_m: float = 1.0
    """...over so many metres driven."""
    search_m: float = 12.0
    """Places to begin anew are the first ones, moved as the robot did, as long as it has not
    driven farther than this; later, places around where it seems to be."""
    around_m: tuple[float, ...] = (1.3, 2.6)
    """Radii of the rings around where the robot seems to be."""
    at_once: int = 8
    """Of more hypotheses than these, the likeliest and those that waited longest are corrected
    by a frame; the others wait."""
    rest_steps: int = 25
    """After beginning anew, not again for so many steps."""
    creep_steps: int = 20
    """A robot that in so many steps..."""
    creep_m: float = 0.6
    """...has come no farther than this gets nowhere: perhaps it is elsewhere. It begins anew..."""
    blamed: float = 0.5
    """...unless its pose is judged better than this..."""
    penalty: float = 2.0
    """...and then believes in that pose less, by so much log-weight."""

    def __post_init__(self) -> None:
        numbers = [v for v in vars(self).values() if not isinstance(v, tuple)]
        if not all(0.0 < value < 1000.0 for value in (*self.rings_m, *self.around_m, *numbers)):
            raise InputError(
                f"every setting must be positive, got {self}",
                where="HypothesesConfig",
                remedy="leave it at its default",
            )


class PoseHypotheses:
    """A mixture of pose filters: particles that each carry a normal distribution.

    The robot is told its room's node and not where in the room it stands: as far as six metres
    from it, with the door out of sight. The pose network judges each hypothesis; where the door
    comes into view one of them wins, and what is left is one filter. Where that one is judged
    to be elsewhere for a while, the search begins anew, as a particle filter that spreads
    particles again.

    Args:
        arrays: Map and plan.
        task: The same.
        network: Says how far off a believed pose is, and whether it is near the truth.
        filter_config: Noise of each filter.
        config: Where hypotheses begin and end.
    """

    def __init__(
        self,
        arrays: MapArrays,
        task: NavigationTask,
        network: PoseNetwork,
        filter_config: PoseFilterConfig,
        config: HypothesesConfig | None = None,
    ) -> None:
        self.config = config or HypothesesConfig()
        self._network, self._arrays = network, arrays
        self._pages = pages_of([arrays])
        self._starts = _starts(task, self.config)
        self._filter_config = PoseFilterConfig(
            **{**vars(filter_config), "start_std_m": self.config.start_std_m}
        )
        self._door, self._door_m = first_door(arrays, task)
        away = np.hypot(*(self._starts[:, :2] - self._starts[0, :2]).T)
        self._prior = -0.5 * (away / self.config.prior_m) ** 2
        self._moved = np.zeros(3)
        self._driven_m = 0.0
        self._trail = [(0.0, 0.0)]
        self._lately: deque[tuple[float, float]] = deque(maxlen=self.config.creep_steps + 1)
        self._begin(self._starts, self._prior, np.zeros(len(away)))
        self.restarts = 0

    def _begin(
        self,
        poses: Float64[np.ndarray, "poses 3"],
        log_weight: Float64[np.ndarray, " poses"],
        progress_m: Float64[np.ndarray, " poses"],
        inside: Bool[np.ndarray, " poses"] | None = None,
    ) -> None:
        self.filters = PoseFilter(poses, self._filter_config)
        self._log_weight = log_weight - log_weight.max()
        self._progress_m = progress_m
        is_in_room = self._door is not None
        self._inside = np.full(len(poses), is_in_room) if inside is None else inside
        self._waited = np.zeros(len(poses), np.int64)
        self._judged = np.zeros(len(poses))
        self._followed = int(self._log_weight.argmax())
        self._rest = self.config.rest_steps

    def __len__(self) -> int:
        return len(self._log_weight)

    @property
    def followed(self) -> int:
        """The hypothesis that the robot follows: the likeliest, or one hardly less likely.

        Where several are about as likely, following each in turn would lead nowhere.
        """
        return self._followed

    @property
    def pose(self) -> Float64[np.ndarray, " 3"]:
        """The followed one's x, y and yaw."""
        found: np.ndarray = self.filters.pose[self.followed]
        return found

    @property
    def std_in_robot(self) -> Float64[np.ndarray, " 3"]:
        """Of the followed hypothesis: metres forward and left, radians."""
        found: np.ndarray = self.filters.std_in_robot[self.followed]
        return found

    @property
    def progress_m(self) -> float:
        """Metres of the plan behind the followed pose."""
        return float(self._progress_m[self.followed])

    @property
    def is_inside(self) -> bool:
        """Whether the followed pose has not come by its first room's door yet."""
        return bool(self._inside[self.followed])

    @property
    def judged(self) -> float:
        """Averaged log-odds that the followed pose is near the truth, since it was begun."""
        return float(self._judged[self.followed])

    @property
    def is_early(self) -> bool:
        """Whether the robot, wherever it takes itself to be, may still be in its first room."""
        return self._door is not None and self._driven_m < self.config.search_m

    def predict(self, step: Float[np.ndarray, " 3"]) -> None:
        """Move all by a dead-reckoned step: metres forward and left, radians turned."""
        self.filters.predict(np.tile(step, (len(self), 1)))
        self._moved = _composed(self._moved[None], step)[0]
        self._driven_m += math.hypot(step[0], step[1])
        self._lately.append((float(self._moved[0]), float(self._moved[1])))
        if math.dist(self._trail[-1], self._moved[:2].tolist()) > _TRAIL_M:
            self._trail.append((float(self._moved[0]), float(self._moved[1])))

    @torch.inference_mode()
    def correct(self, view: UInt8[np.ndarray, "forward left"]) -> None:
        """Lay what was seen over the map around each hypothesis; weigh, move and thin them out.

        Args:
            view: The local map's far view.
        """
        config = self._network.config.local_map
        due = self._due()
        drawn = draw_beliefs(
            self._pages,
            np.zeros(len(due), np.int64),
            self.filters.pose[due],
            self.bounds_m[due],
            config.far_cell_m,
            config.view_cells,
        )
        self._progress_m[due] = drawn.progress_m
        views = torch.from_numpy(view)[None].expand(len(due), -1, -1)
        mean, log_std, log_odds = self._network.judged(views, torch.from_numpy(drawn.pictures))
        if not (torch.isfinite(mean).all() and torch.isfinite(log_std).all()):
            return
        offset, std = mean.numpy().astype(np.float64), log_std.exp().numpy().astype(np.float64)
        news = self.filters.news[due]
        if log_odds is None:
            doubted = std * self.filters.config.doubt
            judged = -np.log(doubted).sum(1) - 0.5 * ((offset / doubted) ** 2).sum(1)
        else:
            surest = self.config.surest
            judged = np.nan_to_num(log_odds.numpy().astype(np.float64)).clip(-surest, surest)
        if len(self) > 1:
            self._log_weight[due] += news * judged
        self.filters.correct_some(due, offset, std)
        if log_odds is not None:
            share = np.minimum(1.0, self.filters.config.news_m * news / self.config.doubt_m)
            self._judged[due] += share * (judged - self._judged[due])
        self._leave_rooms()
        self._thin_out()
        likeliest = int(self._log_weight.argmax())
        if self._log_weight[likeliest] > self._log_weight[self._followed] + self.config.kept:
            self._followed = likeliest
        self._rest = max(0, self._rest - 1)
        if not self._rest and self._network.config.judges:
            judged = self._judged[self.followed]
            if judged < -self.config.doubted:
                self.begin_anew()
            elif judged < self.config.blamed and self._creeps():
                self.begin_anew(self.config.penalty)

    def _creeps(self) -> bool:
        """Whether the robot hardly gets on."""
        if len(self._lately) <= self.config.creep_steps:
            return False
        return math.dist(self._lately[0], self._lately[-1]) < self.config.creep_m

    def _due(self) -> Int64[np.ndarray, " due"]:
        """Which hypotheses this frame corrects, the followed one first."""
        first = self._followed
        order = np.argsort(-self._waited, kind="stable")
        due = np.concatenate([[first], order[order != first]])[: self.config.at_once]
        self._waited += 1
        self._waited[due] = 0
        return due

    @property
    def bounds_m(self) -> Float64[np.ndarray, "poses 2"]:
        """Between which lengths of the plan the progress of each hypothesis is sought."""
        low, high = self._progress_m - _BACK_M, self._progress_m + _AHEAD_M
        # Behind a wall, the plan's corridor may be nearer than its door.
        high = np.where(self._inside, np.minimum(high, self._door_m), high)
        return np.stack([np.minimum(low, high), high], axis=1)

    def begin_anew(self, penalty: float = 0.0) -> None:
        """Search again: the belief has proved to be wrong.

        Args:
            penalty: Log-weight that places near the old belief lose.
        """
        self.restarts += 1
        at, inside = self.pose.copy(), self.is_inside
        poses = [at[None], _around(at, self.config)]
        progress = [np.full(1 + len(poses[1]), self.progress_m)]
        within = [np.full(1 + len(poses[1]), inside)]
        away_m = np.hypot(*(poses[1][:, :2] - at[:2]).T)
        weight = [np.array([-1.0]), -0.5 * (away_m / self.config.prior_m) ** 2]
        if self.is_early:
            poses.append(_composed(self._starts, self._moved))
            has_left = self._have_left()
            seen_m = self._door_m + np.where(has_left, self._driven_m, 0.0)
            progress.append(
                np.array(
                    [
                        self._arrays.progress_m(x, y, self._door_m if left else 0.0, most)
                        for (x, y, _), left, most in zip(poses[2], has_left, seen_m, strict=True)
                    ]
                )
            )
            within.append(~has_left)
            weight.append(self._prior)
        places = np.concatenate(poses)
        is_old = np.hypot(*(places[:, :2] - at[:2]).T) < NEAR_M
        self._begin(
            places,
            np.concatenate(weight) - penalty * is_old,
            np.concatenate(progress),
            np.concatenate(within),
        )

    def _have_left(self) -> Bool[np.ndarray, " starts"]:
        """Whether the way driven leads by the room's door, from each of the first places."""
        trail = np.array([*self._trail, self._moved[:2]])
        c, s = np.cos(self._starts[:, 2, None]), np.sin(self._starts[:, 2, None])
        x = self._starts[:, 0, None] + c * trail[:, 0] - s * trail[:, 1]
        y = self._starts[:, 1, None] + s * trail[:, 0] + c * trail[:, 1]
        assert self._door is not None
        return np.asarray(np.hypot(x - self._door[0], y - self._door[1]).min(axis=1) < AT_DOOR_M)

    def _leave_rooms(self) -> None:
        if self._door is not None:
            away_m = np.hypot(*(self.filters.pose[:, :2] - self._door).T)
            self._inside &= away_m >= AT_DOOR_M

    def _thin_out(self) -> None:
        """Give up the unlikely, and of those that have met all but the likeliest."""
        if len(self) == 1:
            return
        config, pose = self.config, self.filters.pose
        kept: list[int] = []
        followed = 0
        for one in np.argsort(-self._log_weight).tolist():
            if self._log_weight[one] < self._log_weight.max() - config.give_up:
                break
            turn = pose[kept, 2] - pose[one, 2]
            met = np.hypot(*(pose[kept, :2] - pose[one, :2]).T) < config.same_m
            met &= np.abs(np.arctan2(np.sin(turn), np.cos(turn))) < config.same_rad
            if one == self._followed:
                # One that has met a likelier one is followed in that.
                followed = int(met.argmax()) if met.any() else len(kept)
            if not met.any():
                kept.append(one)
        chosen = np.array(kept)
        self._followed = followed
        self.filters.choose(chosen)
        self._log_weight = self._log_weight[chosen] - self._log_weight[chosen].max()
        self._progress_m, self._inside = self._progress_m[chosen], self._inside[chosen]
        self._waited, self._judged = self._waited[chosen], self._judged[chosen]


def _composed(
    poses: Float64[np.ndarray, "poses 3"], step: Float[np.ndarray, " 3"]
) -> Float64[np.ndarray, "poses 3"]:
    """Poses moved by a step in their own frames."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + c * step[0] - s * step[1]
    y = poses[:, 1] + s * step[0] + c * step[1]
    return np.stack([x, y, poses[:, 2] + step[2]], axis=1)


def _around(
    pose: Float64[np.ndarray, " 3"], config: HypothesesConfig
) -> Float64[np.ndarray, "poses 3"]:
    """Places around a pose, facing as it does."""
    poses = []
    for radius_m in config.around_m:
        places = max(4, math.ceil(2.0 * math.pi * radius_m / config.spacing_m))
        for angle in 2.0 * math.pi * np.arange(places) / places:
            x, y = radius_m * math.cos(angle), radius_m * math.sin(angle)
            poses.append((pose[0] + x, pose[1] + y, pose[2]))
    return np.array(poses)


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
