"""Learning to see how far off a believed pose is, from beliefs that are off by known amounts."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor
from torch.nn import functional

from toponav.models.graphnav.metric.map_picture import MAP_CHANNELS
from toponav.models.graphnav.metric.pages import draw_beliefs
from toponav.models.graphnav.metric.pose_network import FAR_M, NEAR_M, PoseNetwork
from toponav.training.config import TrainingConfig
from toponav.training.metric_data import MetricData
from toponav.training.place_samples import PlaceSamples
from toponav.training.samples import draw, split_frames

__all__ = ["PoseBatch", "PoseTask", "believed_from", "seen_from"]

_START_STEPS = 70
_START_SHARE = 0.6
_START_YAW_RAD = math.radians(25.0)
# Share of samples, sideways and heading error (one sigma).
_ERRORS = ((0.45, 0.25, math.radians(4.0)), (0.35, 0.7, math.radians(9.0)), (0.2, 1.6, 0.3))
_FORWARD = 1.3
_MOST_SHAKE_M = 0.35
_PLACES_SHARE = 0.5
_NEAR_RAD = 0.4
_LEARNT_M = 3.0


@dataclass(frozen=True)
class PoseBatch:
    """Local maps, pictures of the map around beliefs, and the truth seen from those."""

    local_map: Tensor
    map_picture: Tensor
    truth: Tensor


class PoseTask:
    """What the loop needs to train the pose network.

    A belief is the truth moved by a random error, or, in a trajectory's first seconds, what a
    robot would believe that took itself to start at the room's node, facing along the first
    edge. The map's nodes are shaken: people do not draw to the centimetre.

    Args:
        model: The network.
        sets: Data to learn from and to validate on, by buildings.
        config: How to train.
        places: Hypotheses of each set, for a network that judges.
    """

    name = "pose"

    def __init__(
        self,
        model: PoseNetwork,
        sets: Sequence[MetricData],
        config: TrainingConfig,
        places: Sequence[PlaceSamples] = (),
    ) -> None:
        self.model = model
        self._sets = sets
        self._config = config
        self._places = places
        pools, val_pools = [], []
        for number, one in enumerate(sets):
            split = split_frames(one.data)
            pools.append(np.flatnonzero(split.train) | number << 40)
            val_pools.append(np.flatnonzero(split.val) | number << 40)
        self._pool = np.concatenate(pools)
        self._val_pool = np.concatenate(val_pools)
        self._place_pool, self._place_val_pool = self._split_places()
        self._starts = [_StartBeliefs(one) for one in sets]

    def _split_places(self) -> tuple[Int64[np.ndarray, " train"], Int64[np.ndarray, " val"]]:
        """Numbers of the hypotheses in buildings to learn from and to validate on."""
        pools: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        for number, (one, places) in enumerate(zip(self._sets, self._places, strict=False)):
            split = split_frames(one.data)
            for pool, chosen in zip(pools, (split.train, split.val), strict=True):
                pool.append(np.flatnonzero(chosen[places.row]) | number << 40)
        none = [np.zeros(0, np.int64)]
        return np.concatenate(none + pools[0]), np.concatenate(none + pools[1])

    @property
    def samples(self) -> int:
        """How many different samples there are to learn from."""
        return len(self._pool) + len(self._place_pool)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[PoseBatch]:
        """`steps` batches in random order."""
        size = self._config.batch_size
        searched = round(size * _PLACES_SHARE) if len(self._place_pool) else 0
        drawn = draw(self._pool, steps * (size - searched), rng)
        places = draw(self._place_pool, steps * searched, rng) if searched else drawn[:0]
        for step in range(steps):
            one = drawn[step * (size - searched) : (step + 1) * (size - searched)]
            other = places[step * searched : (step + 1) * searched]
            yield self._batch(one, rng, mirror=self._config.mirror, places=other)

    def loss(self, model: torch.nn.Module, batch: PoseBatch) -> Tensor:
        """Mean negative log-likelihood of the true poses."""
        assert isinstance(model, PoseNetwork)
        mean, log_std, log_odds = model.judged(batch.local_map, batch.map_picture)
        loss = PoseNetwork.loss(mean, log_std, batch.truth)
        if log_odds is None:
            return loss.mean()
        away = batch.truth[:, :2].norm(dim=1)
        # Where the truth is out of sight of the belief, the offset cannot be learned.
        learnt = loss[away < _LEARNT_M].sum() / len(loss)
        return learnt + _judgement_loss(log_odds, batch.truth).mean()

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Likelihood and errors on the validation buildings; `score` is what to maximize."""
        assert isinstance(model, PoseNetwork)
        rng = np.random.default_rng(self._config.seed)
        pool = draw(self._val_pool, len(self._val_pool), rng)
        pool = pool[: self._config.most_validation_samples]
        losses, errors, before = [], [], []
        size = self._config.batch_size
        for first in range(0, len(pool), size):
            batch = self._batch(pool[first : first + size], rng, mirror=False)
            mean, log_std = model(batch.local_map, batch.map_picture)
            losses.append(PoseNetwork.loss(mean, log_std, batch.truth))
            errors.append((mean - batch.truth).abs())
            before.append(batch.truth.abs())
        loss = float(torch.cat(losses).mean())
        error, offset = torch.cat(errors).median(0).values, torch.cat(before).median(0).values
        judged = self._judge(model, rng) if model.config.judges else {}
        loss += judged.get("judgement_loss", 0.0)
        return judged | {
            "score": -loss,
            "val_loss": loss,
            "forward_error_m": float(error[0]),
            "left_error_m": float(error[1]),
            "yaw_error_rad": float(error[2]),
            "forward_before_m": float(offset[0]),
            "left_before_m": float(offset[1]),
            "yaw_before_rad": float(offset[2]),
        }

    def _judge(self, model: PoseNetwork, rng: np.random.Generator) -> dict[str, int | float]:
        """How well hypotheses of the validation buildings are told apart."""
        pool = rng.permutation(self._place_val_pool)
        pool = pool[: self._config.most_validation_samples]
        losses, right, near = [], [], []
        size = self._config.batch_size
        for first in range(0, len(pool), size):
            none = np.zeros(0, np.int64)
            batch = self._batch(none, rng, mirror=False, places=pool[first : first + size])
            _, _, log_odds = model.judged(batch.local_map, batch.map_picture)
            assert log_odds is not None
            is_near, is_far = _near_and_far(batch.truth)
            losses.append(_judgement_loss(log_odds, batch.truth))
            right.append(((log_odds > 0) == is_near)[is_near | is_far])
            near.append(is_near.float())
        if not losses:
            return {}
        return {
            "judgement_loss": float(torch.cat(losses).mean()),
            "judged_right": float(torch.cat(right).float().mean()),
            "hypotheses_near": float(torch.cat(near).mean()),
        }

    def _batch(
        self,
        chosen: Int64[np.ndarray, " batch"],
        rng: np.random.Generator,
        mirror: bool,
        places: Int64[np.ndarray, " places"] | None = None,
    ) -> PoseBatch:
        config = self.model.config.local_map
        frames = len(chosen)
        searched = np.zeros(0, np.int64) if places is None else places
        chosen = np.concatenate([chosen, searched])
        count = len(chosen)
        offsets = _random_offsets(count, rng)
        from_start = rng.random(count) < _START_SHARE
        is_searched = np.arange(count) >= frames
        mirrored = (rng.random(count) < 0.5) & mirror
        maps = np.empty((count, config.view_cells, config.view_cells), np.uint8)
        pictures = np.empty((count, MAP_CHANNELS, *maps.shape[1:]), np.float32)
        truth = np.empty((count, 3), np.float32)
        shake_m = np.minimum(np.abs(rng.normal(0.0, 0.15, count)), _MOST_SHAKE_M)
        for number, one in enumerate(self._sets):
            here = np.flatnonzero(chosen >> 40 == number)
            if not len(here):
                continue
            rows = chosen[here] & ((1 << 40) - 1)
            of_search, found = is_searched[here], rows[is_searched[here]]
            if len(found):
                rows[of_search] = self._places[number].row[found]
            true_pose = one.data.pose[rows].astype(np.float64)
            believed = believed_from(true_pose, offsets[here])
            start, has_start = self._starts[number].believed(rows)
            swap = from_start[here] & has_start & ~of_search
            believed[swap] = start[swap]
            page = one.data.trajectory[rows].astype(np.int64)
            most = int(np.diff(one.pages.node_at)[page].max())
            near_m = one.true_progress()[rows].astype(np.float64)
            bounds_m = np.stack([near_m - 2.5, near_m + 2.5], axis=1)
            if len(found):
                believed[of_search] = self._places[number].pose[found]
                bounds_m[of_search] = self._places[number].bounds_m[found]
            drawn = draw_beliefs(
                one.pages,
                page,
                believed,
                bounds_m,
                config.far_cell_m,
                config.view_cells,
                noise_m=rng.normal(size=(len(here), most, 2)) * shake_m[here, None, None],
                mirrored=mirrored[here],
            )
            pictures[here] = drawn.pictures
            maps[here] = one.far[rows]
            truth[here] = seen_from(believed, true_pose)
        maps[mirrored] = maps[mirrored][:, :, ::-1]
        truth[mirrored, 1:] *= -1.0
        return PoseBatch(
            torch.from_numpy(maps), torch.from_numpy(pictures), torch.from_numpy(truth)
        )


class _StartBeliefs:
    """What dead reckoning alone says, from the plan's first node along its first edge."""

    def __init__(self, one: MetricData) -> None:
        first = one.first
        trajectory = np.asarray(one.data.trajectory)
        starts = np.array([one.start_pose(number) for number in range(one.data.trajectories)])
        began = starts[trajectory]
        turn = np.cumsum(one.steps[:, 2]) - one.steps[:, 2]
        yaw = began[:, 2] + turn - turn[first]
        middle = yaw + 0.5 * one.steps[:, 2]
        x = _sum_before(one.steps[:, 0] * np.cos(middle), first)
        y = _sum_before(one.steps[:, 0] * np.sin(middle), first)
        self._believed = np.stack([began[:, 0] + x, began[:, 1] + y, yaw], axis=1)
        away = one.data.pose[first, 2] - began[:, 2]
        is_aligned = np.abs(np.arctan2(np.sin(away), np.cos(away))) < _START_YAW_RAD
        self._fits = is_aligned & (np.arange(len(first)) - first <= _START_STEPS)

    def believed(
        self, rows: Int64[np.ndarray, " batch"]
    ) -> tuple[Float64[np.ndarray, "batch 3"], Bool[np.ndarray, " batch"]]:
        """The believed poses, and where they mean something: early in a drive begun ahead."""
        return self._believed[rows], self._fits[rows]


def _sum_before(
    values: Float64[np.ndarray, " frames"], first: Int64[np.ndarray, " frames"]
) -> Float64[np.ndarray, " frames"]:
    """The sum of the earlier values of each frame's trajectory."""
    total = np.cumsum(values) - values
    return np.asarray(total - total[first])


def _near_and_far(truth: Tensor) -> tuple[Tensor, Tensor]:
    """Which beliefs are near the truth, and which elsewhere; some are neither."""
    away = truth[:, :2].norm(dim=1)
    turn = torch.atan2(truth[:, 2].sin(), truth[:, 2].cos()).abs()
    return (away < NEAR_M) & (turn < _NEAR_RAD), away > FAR_M


def _judgement_loss(log_odds: Tensor, truth: Tensor) -> Tensor:
    """Cross-entropy of near against elsewhere; 0 in between."""
    is_near, is_far = _near_and_far(truth)
    loss = functional.binary_cross_entropy_with_logits(
        log_odds, is_near.to(log_odds.dtype), reduction="none"
    )
    return loss * (is_near | is_far)


def believed_from(
    true_pose: Float64[np.ndarray, "batch 3"], offset: Float64[np.ndarray, "batch 3"]
) -> Float64[np.ndarray, "batch 3"]:
    """The beliefs from which the true poses are seen at `offset`."""
    yaw = true_pose[:, 2] - offset[:, 2]
    c, s = np.cos(yaw), np.sin(yaw)
    x = true_pose[:, 0] - (offset[:, 0] * c - offset[:, 1] * s)
    y = true_pose[:, 1] - (offset[:, 0] * s + offset[:, 1] * c)
    return np.stack([x, y, yaw], axis=1)


def seen_from(
    believed: Float64[np.ndarray, "batch 3"], true_pose: Float64[np.ndarray, "batch 3"]
) -> Float64[np.ndarray, "batch 3"]:
    """The true poses in the believed ones: metres forward and left, radians to the left."""
    c, s = np.cos(believed[:, 2]), np.sin(believed[:, 2])
    dx, dy = (true_pose[:, :2] - believed[:, :2]).T
    turn = true_pose[:, 2] - believed[:, 2]
    wrapped = np.arctan2(np.sin(turn), np.cos(turn))
    return np.stack([dx * c + dy * s, -dx * s + dy * c, wrapped], axis=1)


def _random_offsets(count: int, rng: np.random.Generator) -> Float64[np.ndarray, "batch 3"]:
    shares = [share for share, _, _ in _ERRORS]
    kind = rng.choice(len(_ERRORS), count, p=shares)
    sides = np.array([side for _, side, _ in _ERRORS])[kind]
    turns = np.array([turn for _, _, turn in _ERRORS])[kind]
    offsets = rng.normal(size=(count, 3))
    offsets[:, 0] *= sides * _FORWARD
    offsets[:, 1] *= sides
    offsets[:, 2] *= turns
    return offsets
