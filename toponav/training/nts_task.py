"""Learning the functions of Neural Topological SLAM from pairs of panoramas of one home."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float16, Float32, Float64, Int64, UInt8
from torch import Tensor
from torch.nn import functional

from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M
from toponav.data.nts.labels import SCORE_LENGTH_M
from toponav.models.nts.heads import PairPrediction, PlacePrediction
from toponav.models.nts.network import NTSNetwork
from toponav.training.config import TrainingConfig

__all__ = ["HomeSamples", "NTSBatch", "NTSTask"]

_PANORAMAS_A_HOME = 16
_SAME_SHARE = 0.5
_ITSELF_SHARE = 0.06
_CLOSE_SHARE, _CLOSE_M = 0.5, 4.5
_HELD_OUT_EVERY = 9
_WEIGHTS = {"connection": 1.0, "direction": 0.5, "distance": 1.0, "explorable": 1.0}
_SCORE_WEIGHT, _CHOICE_WEIGHT, _RANGE_WEIGHT = 1.0, 0.5, 0.5
_KIND_WEIGHT, _TOWARD_WEIGHT = 0.2, 0.5
_SAME_NODE_WEIGHT = 0.25
_CHOICE_M = 1.5
_LEAST_SCORE = 1e-3
_LIGHT, _TINT = (0.8, 1.2), (0.94, 1.06)


@dataclass(frozen=True, eq=False)
class HomeSamples:
    """The panoramas of one home, as the network sees them, and the labels of all pairs.

    Attributes:
        images: As `network_input` makes them, with depth.
        obstacle_m: Ranges to obstacles, as `obstacle_profile` makes them.
        sight_m: Ranges of level sight, as `sight_profile` makes them.
        poses: Where they were taken.
        same_node: Whether the second of two belongs to the node of the first.
        explorable: Whether there is something to explore in each direction.
        score: How fast the second of two is reached in each direction of the first, 0..1.
        kind: Kind of room that each was taken in, by its number in `ROOM_KINDS`; -1 for none.
        toward: How fast another node in a room of each kind is reached in each direction; -1
            where the home has none.
    """

    images: UInt8[np.ndarray, "places channels rows cols"]
    obstacle_m: Float32[np.ndarray, "places ranges"]
    sight_m: Float32[np.ndarray, "places ranges"]
    poses: Float64[np.ndarray, "places 3"]
    same_node: Bool[np.ndarray, "places places"]
    explorable: Bool[np.ndarray, "places directions"]
    score: Float16[np.ndarray, "places places directions"]
    kind: Int64[np.ndarray, " places"]
    toward: Float16[np.ndarray, "places kinds directions"]

    def __len__(self) -> int:
        return len(self.images)


@dataclass(frozen=True, eq=False)
class NTSBatch:
    """Panoramas, which of them are paired, and the labels.

    Attributes:
        images: Panoramas.
        source: Number of the source of each pair.
        goal: Number of its goal.
        same_node: 1 where they belong to one node.
        direction: Direction of the goal from the source.
        distance_m: Distance of the goal.
        explorable: Of each panorama.
        obstacle_m: Of each panorama.
        sight_m: Of each panorama.
        score: Of each pair and direction.
        any_source: Number of the source of every two panoramas of one home.
        any_goal: Number of its goal.
        any_same_node: 1 where they belong to one node.
        any_score: Of each of these pairs and direction.
        kind: Of each panorama.
        toward: Of each panorama, kind of room and direction.
    """

    images: Tensor
    source: Tensor
    goal: Tensor
    same_node: Tensor
    direction: Tensor
    distance_m: Tensor
    explorable: Tensor
    obstacle_m: Tensor
    sight_m: Tensor
    score: Tensor
    any_source: Tensor
    any_goal: Tensor
    any_same_node: Tensor
    any_score: Tensor
    kind: Tensor
    toward: Tensor


class NTSTask:
    """What the loop needs to train the network.

    A batch holds 16 panoramas a home, each encoded once. F_S learns from all pairs of them;
    pairs that are compared direction by direction, which costs more, are drawn: half of them of
    one node where there are so many, a quarter close by and not of one node. Every ninth home
    is held out.

    Args:
        model: The network.
        homes: Samples of each home.
        config: How to train; the batch size counts panoramas.
        pairs_per_image: Pairs drawn for each panorama of a batch.
    """

    def __init__(
        self,
        model: NTSNetwork,
        homes: Sequence[HomeSamples],
        config: TrainingConfig,
        pairs_per_image: int = 4,
    ) -> None:
        self.model = model
        self.name = "nts_rgbd" if model.config.depth else "nts_rgb"
        held_out = [len(homes) > 1 and k % _HELD_OUT_EVERY == 1 for k in range(len(homes))]
        self._homes = [home for home, held in zip(homes, held_out, strict=True) if not held]
        self._val_homes = [home for home, held in zip(homes, held_out, strict=True) if held]
        self._config = config
        self._pairs = pairs_per_image

    @property
    def samples(self) -> int:
        """How many different panoramas there are to learn from."""
        return sum(map(len, self._homes))

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[NTSBatch]:
        """`steps` batches in random order."""
        for _ in range(steps):
            yield self._batch(self._homes, rng, mirror=self._config.mirror)

    def loss(self, model: torch.nn.Module, batch: NTSBatch) -> Tensor:
        """The weighted sum of the losses of all heads."""
        return _loss(*_predict(model, batch), batch)

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Losses and errors on the homes held out; `score` is what to maximize."""
        rng = np.random.default_rng(self._config.seed)
        homes = self._val_homes or self._homes
        size = self._config.batch_size
        most = max(1, self._config.most_validation_samples // size)
        batches = min(max(1, sum(map(len, homes)) // size), most)
        found: dict[str, list[Tensor]] = {}
        for _ in range(batches):
            batch = self._batch(homes, rng, mirror=False)
            pair, place, any_score = _predict(model, batch)
            for name, value in _measures(pair, place, batch).items():
                found.setdefault(name, []).append(value)
            found.setdefault("val_loss", []).append(_loss(pair, place, any_score, batch)[None])
        metrics: dict[str, int | float] = {
            name: float(torch.cat(values).float().mean()) for name, values in found.items()
        }
        return {"score": -metrics["val_loss"], **metrics}

    def _batch(
        self, homes: Sequence[HomeSamples], rng: np.random.Generator, *, mirror: bool
    ) -> NTSBatch:
        batch = self._config.batch_size
        count = max(1, batch // _PANORAMAS_A_HOME)
        size = max(2, batch // count)
        parts, first = [], 0
        for _ in range(count):
            home = homes[int(rng.integers(len(homes)))]
            chosen = rng.choice(len(home), min(size, len(home)), replace=False)
            parts.append(self._of_home(home, chosen, first, rng))
            if mirror:
                _vary_light(parts[-1], rng)
            first += len(chosen)
        joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        if not self.model.config.depth:
            joined["images"] = joined["images"][:, :3]
        if mirror and rng.random() < 0.5:
            _mirror(joined)
        joined["direction"] = joined["direction"] % DIRECTIONS
        return NTSBatch(
            **{
                name: torch.from_numpy(np.ascontiguousarray(value))
                for name, value in joined.items()
            }
        )

    def _of_home(
        self,
        home: HomeSamples,
        chosen: Int64[np.ndarray, " batch"],
        first: int,
        rng: np.random.Generator,
    ) -> dict[str, np.ndarray]:
        same = home.same_node[np.ix_(chosen, chosen)]
        xy_m = home.poses[chosen, :2]
        close = np.hypot(*(xy_m[:, None] - xy_m[None]).transpose(2, 0, 1)) < _CLOSE_M
        source, goal = _draw_pairs(same, close, len(chosen) * self._pairs, rng)
        any_source, any_goal = np.nonzero(~np.eye(len(chosen), dtype=bool))
        one, other = home.poses[chosen[source]], home.poses[chosen[goal]]
        away = other[:, :2] - one[:, :2]
        yaw = np.arctan2(away[:, 1], away[:, 0]) - one[:, 2]
        step = 2 * math.pi / DIRECTIONS
        return {
            "images": home.images[chosen],
            "source": source + first,
            "goal": goal + first,
            "same_node": same[source, goal].astype(np.float32),
            "direction": np.floor(yaw / step + 0.5).astype(np.int64) % DIRECTIONS,
            "distance_m": np.minimum(np.hypot(*away.T), 2 * NODE_RADIUS_M).astype(np.float32),
            "explorable": home.explorable[chosen].astype(np.float32),
            "obstacle_m": home.obstacle_m[chosen],
            "sight_m": home.sight_m[chosen],
            "score": home.score[chosen[source], chosen[goal]].astype(np.float32),
            "any_source": any_source + first,
            "any_goal": any_goal + first,
            "any_same_node": same[any_source, any_goal].astype(np.float32),
            "any_score": home.score[chosen[any_source], chosen[any_goal]].astype(np.float32),
            "kind": home.kind[chosen],
            "toward": home.toward[chosen].astype(np.float32),
        }


def _predict(
    model: torch.nn.Module, batch: NTSBatch
) -> tuple[PairPrediction, PlacePrediction, Tensor]:
    assert isinstance(model, NTSNetwork)
    features = model.encode(batch.images)
    pair = model.pair(features[batch.source], features[batch.goal])
    any_score = model.scores(features, batch.any_source, batch.any_goal)
    return pair, model.place(features), any_score


def _loss(
    pair: PairPrediction, place: PlacePrediction, any_score: Tensor, batch: NTSBatch
) -> Tensor:
    near = batch.same_node > 0.5
    turned = near & (batch.distance_m > 0.3)
    logs = functional.binary_cross_entropy_with_logits
    total = _WEIGHTS["connection"] * logs(pair.connection.float(), batch.same_node)
    direction = functional.cross_entropy(
        pair.direction.float(), batch.direction, reduction="none", label_smoothing=0.05
    )
    total = total + _WEIGHTS["direction"] * _mean_over(direction, turned)
    distance = functional.smooth_l1_loss(
        pair.distance_m.float(), batch.distance_m, reduction="none", beta=0.3
    )
    total = total + _WEIGHTS["distance"] * _mean_over(distance, near)
    total = total + _WEIGHTS["explorable"] * logs(place.explorable.float(), batch.explorable)
    total = total + _score_loss(
        pair.score.float(), batch.score, batch.explorable[batch.source], batch.same_node
    )
    total = total + _score_loss(
        any_score.float(),
        batch.any_score,
        batch.explorable[batch.any_source],
        batch.any_same_node,
    )
    for predicted, truth in (
        (place.obstacle_m, batch.obstacle_m),
        (place.sight_m, batch.sight_m),
    ):
        off = ((predicted.float() + 0.2).log() - (truth + 0.2).log()).abs()
        total = total + _RANGE_WEIGHT * off.mean()
    kind = functional.cross_entropy(place.kind.float(), batch.kind, ignore_index=-1)
    known = (batch.toward >= 0) & (batch.explorable[:, None] > 0.5)
    toward = logs(place.toward.float(), batch.toward.clamp(min=0.0), reduction="none")
    return total + _KIND_WEIGHT * kind + _TOWARD_WEIGHT * _mean_over(toward, known)


def _score_loss(score: Tensor, truth: Tensor, explorable: Tensor, same: Tensor) -> Tensor:
    """How wrong scores are, and how wrong choosing a direction by them is.

    Scores of one place differ little: most of what there is to learn from their size is how far
    goals are in general. The second part looks at differences alone: the chance of each
    direction, if the shorter way is taken the likelier, the more it is shorter.
    """
    usable = explorable > 0.5
    weight = torch.where(same > 0.5, _SAME_NODE_WEIGHT, 1.0)
    size = functional.binary_cross_entropy_with_logits(score, truth, reduction="none")
    total = _SCORE_WEIGHT * (size * usable * weight[:, None]).sum()
    total = total / (usable * weight[:, None]).sum().clamp(min=1.0)
    some = usable.any(1)
    chance = functional.log_softmax(_by_length(functional.logsigmoid(score), usable), dim=1)
    wanted = functional.softmax(_by_length(truth.clamp(min=_LEAST_SCORE).log(), usable), dim=1)
    off = torch.where(usable, wanted * (wanted.clamp(min=1e-6).log() - chance), 0.0).sum(1)
    return total + _CHOICE_WEIGHT * (off * some * weight).sum() / (some * weight).sum().clamp(
        min=1.0
    )


def _by_length(log_score: Tensor, usable: Tensor) -> Tensor:
    """Logits of a choice: a metre more makes it exp(1 / `_CHOICE_M`) times less likely."""
    return (log_score * (SCORE_LENGTH_M / _CHOICE_M)).masked_fill(~usable, -1e4)


def _draw_pairs(
    same: Bool[np.ndarray, "batch batch"],
    close: Bool[np.ndarray, "batch batch"],
    count: int,
    rng: np.random.Generator,
) -> tuple[Int64[np.ndarray, " pairs"], Int64[np.ndarray, " pairs"]]:
    """Sources and goals: some themselves, many of one node or close by, others of any two."""
    size = len(same)
    apart = same & ~np.eye(size, dtype=bool)
    near = rng.permutation(np.flatnonzero(apart))[: int(count * _SAME_SHARE)]
    itself = rng.integers(size, size=max(1, int(count * _ITSELF_SHARE))) * (size + 1)
    left = max(1, count - len(near) - len(itself))
    beside = rng.permutation(np.flatnonzero(close & ~same))[: int(left * _CLOSE_SHARE)]
    others = np.flatnonzero(~same)
    far = rng.choice(others if len(others) else np.arange(size * size), left - len(beside))
    drawn = np.concatenate([near, itself, beside, far])
    return drawn // size, drawn % size


def _vary_light(home: dict[str, np.ndarray], rng: np.random.Generator) -> None:
    """Make one home's pictures brighter or darker, and a little of another colour."""
    gain = rng.uniform(*_LIGHT) * rng.uniform(*_TINT, size=3)
    levels = np.arange(256, dtype=np.float32)
    images = home["images"].copy()
    for channel in range(3):
        table = np.clip(np.rint(levels * gain[channel]), 0, 255).astype(np.uint8)
        images[:, channel] = table[images[:, channel]]
    home["images"] = images


def _mirror(batch: dict[str, np.ndarray]) -> None:
    """Swap left and right."""
    # Columns lie half a step beside the directions that they are averaged into.
    batch["images"] = np.roll(batch["images"][..., ::-1], 4, axis=-1)
    batch["direction"] = -batch["direction"]
    for name in ("explorable", "score", "any_score", "toward", "obstacle_m", "sight_m"):
        batch[name] = np.roll(batch[name][..., ::-1], 1, axis=-1)


def _mean_over(values: Tensor, mask: Tensor) -> Tensor:
    kept = mask.to(values.dtype)
    return (values * kept).sum() / kept.sum().clamp(min=1.0)


def _measures(pair: PairPrediction, place: PlacePrediction, batch: NTSBatch) -> dict[str, Tensor]:
    """What people read: a value per sample."""
    near = batch.same_node > 0.5
    turned = near & (batch.distance_m > 0.3)
    off = (pair.direction.argmax(1) - batch.direction + 6) % DIRECTIONS - 6
    explorable = batch.explorable[batch.source] > 0.5
    choice = explorable.any(1) & ~near
    guess = pair.score.masked_fill(~explorable, -1e9).argmax(1)
    wanted = batch.score.masked_fill(~explorable, -1.0)
    gained = wanted.gather(1, guess[:, None])[:, 0]
    mean = (batch.score * explorable).sum(1) / explorable.sum(1).clamp(min=1)
    length_m = -SCORE_LENGTH_M * wanted.clamp(min=_LEAST_SCORE).log()
    shortest_m = length_m.amin(1)
    detour_m = (length_m - shortest_m[:, None]) * explorable
    known = batch.kind >= 0
    return {
        "connection_recall": (pair.connection > 0)[near].float(),
        "connection_rejection": (pair.connection <= 0)[~near].float(),
        "direction_within_30deg": (off.abs() <= 1)[turned].float(),
        "distance_error_m": (pair.distance_m - batch.distance_m).abs()[near],
        "explorable_accuracy": ((place.explorable > 0) == (batch.explorable > 0.5))
        .float()
        .flatten(),
        "score_of_choice": gained[choice],
        "score_of_chance": mean[choice],
        "score_of_best": wanted.amax(1)[choice],
        "detour_of_choice_m": detour_m.gather(1, guess[:, None])[:, 0][choice],
        "detour_of_chance_m": (detour_m.sum(1) / explorable.sum(1).clamp(min=1))[choice],
        "kind_accuracy": (place.kind.argmax(1) == batch.kind)[known].float(),
        "obstacle_error_m": (place.obstacle_m - batch.obstacle_m).abs().flatten(),
        "sight_error_m": (place.sight_m - batch.sight_m).abs().flatten(),
    }
