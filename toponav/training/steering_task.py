"""Behavioural cloning of the expert from believed poses: one network for all behaviours."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float32, Float64, Int64
from torch import Tensor

from toponav.models.graphnav.metric.map_picture import MAP_CHANNELS
from toponav.models.graphnav.metric.pages import draw_beliefs
from toponav.models.graphnav.metric.steering import (
    STEERING_FEATURES,
    SteeringNetwork,
    steering_features,
)
from toponav.training.belief_replay import ReplayedBeliefs
from toponav.training.config import TrainingConfig
from toponav.training.metric_data import MetricData
from toponav.training.samples import draw, split_frames

__all__ = ["SteeringBatch", "SteeringTask"]

_SURE_SHARE = 0.25
_SURE_STD = np.array([0.06, 0.05, 0.03])
_NEAR_M = 1.0
_COMMAND_NOISE = np.array([0.08, 0.25])
_TURNING_RAD_S = 0.3
_LOST_M, _LOST_RAD = 3.5, 0.6
_MOST_SHAKE_M = 0.2


@dataclass(frozen=True)
class SteeringBatch:
    """What the network sees, and the expert's commands."""

    local_map: Tensor
    map_picture: Tensor
    profile: Tensor
    features: Tensor
    command: Tensor


class SteeringTask:
    """What the loop needs to train the steering network.

    Most samples are drawn from what the filter believed along the drive; a share from nearly
    the truth, so that the network also drives well for a robot that knows where it is.

    Args:
        model: The network.
        sets: Drives to learn from and to validate on, by buildings.
        beliefs: What the filter believed along each set's drives.
        config: How to train.
    """

    name = "steering"

    def __init__(
        self,
        model: SteeringNetwork,
        sets: Sequence[MetricData],
        beliefs: Sequence[ReplayedBeliefs],
        config: TrainingConfig,
    ) -> None:
        self.model = model
        self._sets, self._beliefs, self._config = sets, beliefs, config
        self._last = [_last_commands(one) for one in sets]
        pools, val_pools = [], []
        for number, one in enumerate(sets):
            is_found, split = _is_found(one, beliefs[number]), split_frames(one.data)
            pools.append(np.flatnonzero(split.train & is_found) | number << 40)
            val_pools.append(np.flatnonzero(split.val & is_found) | number << 40)
        self._pool, self._val_pool = np.concatenate(pools), np.concatenate(val_pools)

    @property
    def samples(self) -> int:
        """How many different samples there are to learn from."""
        return len(self._pool)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[SteeringBatch]:
        """`steps` batches in random order."""
        size = self._config.batch_size
        drawn = draw(self._pool, steps * size, rng)
        for first in range(0, len(drawn), size):
            yield self._batch(drawn[first : first + size], rng, training=True)

    def loss(self, model: torch.nn.Module, batch: SteeringBatch) -> Tensor:
        """Mean cost of the commands."""
        assert isinstance(model, SteeringNetwork)
        outputs = model(batch.local_map, batch.map_picture, batch.profile, batch.features)
        return model.head.loss(outputs, batch.command).mean()

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Loss and errors on the validation buildings; `score` is what to maximize."""
        assert isinstance(model, SteeringNetwork)
        rng = np.random.default_rng(self._config.seed)
        pool = draw(self._val_pool, len(self._val_pool), rng)
        pool = pool[: self._config.most_validation_samples]
        losses, errors, wrong, turning = [], [], 0, 0
        size = self._config.batch_size
        for first in range(0, len(pool), size):
            batch = self._batch(pool[first : first + size], rng, training=False)
            outputs = model(batch.local_map, batch.map_picture, batch.profile, batch.features)
            losses.append(model.head.loss(outputs, batch.command))
            velocity = model.head.velocity(outputs)
            errors.append((velocity - batch.command).abs())
            turns = batch.command[:, 1].abs() > _TURNING_RAD_S
            turning += int(turns.sum())
            wrong += int((velocity[turns, 1] * batch.command[turns, 1] <= 0).sum())
        loss = float(torch.cat(losses).mean())
        error = torch.cat(errors).mean(0)
        return {
            "score": -loss,
            "val_loss": loss,
            "speed_error_m_s": float(error[0]),
            "turn_error_rad_s": float(error[1]),
            "wrong_side": wrong / max(turning, 1),
        }

    def _batch(
        self, chosen: Int64[np.ndarray, " batch"], rng: np.random.Generator, training: bool
    ) -> SteeringBatch:
        config, count = self.model.config, len(chosen)
        cells = config.local_map.view_cells
        is_sure = rng.random(count) < (_SURE_SHARE if training else 0.0)
        mirrored = (rng.random(count) < 0.5) & (training and self._config.mirror)
        shake_m = np.minimum(np.abs(rng.normal(0.0, 0.08, count)), _MOST_SHAKE_M) * training
        maps = np.empty((count, cells, cells), np.uint8)
        pictures = np.empty((count, MAP_CHANNELS, cells, cells), np.float32)
        profiles = np.empty((count, config.image.rows, config.image.cols), np.uint8)
        features = np.empty((count, STEERING_FEATURES), np.float32)
        command = np.empty((count, 2), np.float32)
        for number, one in enumerate(self._sets):
            here = np.flatnonzero(chosen >> 40 == number)
            if not len(here):
                continue
            rows = chosen[here] & ((1 << 40) - 1)
            pose, std, progress = self._believed(number, rows, is_sure[here], rng)
            page = one.data.trajectory[rows].astype(np.int64)
            most = int(np.diff(one.pages.node_at)[page].max())
            drawn = draw_beliefs(
                one.pages,
                page,
                pose,
                np.stack([progress - _NEAR_M, progress + _NEAR_M], axis=1),
                config.local_map.near_cell_m,
                cells,
                noise_m=rng.normal(size=(len(here), most, 2)) * shake_m[here, None, None],
                mirrored=mirrored[here],
            )
            last = (
                self._last[number][rows]
                + training * rng.normal(size=(len(here), 2)) * _COMMAND_NOISE
            )
            last[mirrored[here], 1] *= -1.0
            pictures[here], maps[here] = drawn.pictures, one.near[rows]
            profiles[here] = one.data.frames[rows]
            features[here] = steering_features(drawn.features, last, std, config.limits)
            command[here] = one.data.command[rows]
        maps[mirrored] = maps[mirrored][:, :, ::-1]
        profiles[mirrored] = profiles[mirrored][:, :, ::-1]
        command[mirrored, 1] *= -1.0
        return SteeringBatch(*map(torch.from_numpy, (maps, pictures, profiles, features, command)))

    def _believed(
        self,
        number: int,
        rows: Int64[np.ndarray, " batch"],
        is_sure: np.ndarray,
        rng: np.random.Generator,
    ) -> tuple[
        Float64[np.ndarray, "batch 3"],
        Float64[np.ndarray, "batch 3"],
        Float64[np.ndarray, " batch"],
    ]:
        """Poses, their spread, and the progress along the plan."""
        one, beliefs = self._sets[number], self._beliefs[number]
        pose = beliefs.pose[rows].astype(np.float64)
        std = beliefs.std[rows].astype(np.float64)
        progress = beliefs.progress_m[rows].astype(np.float64)
        noise = rng.normal(size=(len(rows), 3)) * _SURE_STD
        pose[is_sure] = one.data.pose[rows[is_sure]] + noise[is_sure]
        std[is_sure] = _SURE_STD
        progress[is_sure] = one.true_progress()[rows[is_sure]]
        return pose, std, progress


def _is_found(one: MetricData, beliefs: ReplayedBeliefs) -> Bool[np.ndarray, " frames"]:
    """Where the belief has to do with the truth: nobody can say how to drive from elsewhere."""
    away = np.hypot(*(beliefs.pose[:, :2] - one.data.pose[:, :2]).T)
    turn = beliefs.pose[:, 2] - one.data.pose[:, 2]
    askew = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    return np.asarray((away < _LOST_M) & (askew < _LOST_RAD))


def _last_commands(one: MetricData) -> Float32[np.ndarray, "frames 2"]:
    """The command carried out before each frame; zero where a drive begins."""
    last = np.concatenate([np.zeros((1, 2), np.float32), one.data.executed[:-1]])
    last[one.first == np.arange(len(one))] = 0.0
    return last.astype(np.float32)
