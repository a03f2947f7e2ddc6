"""Edge classification in crops of the map (section V-C, appendix A-A)."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Int64
from torch import Tensor
from torch.nn import functional as F

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.maps.plan import Plan
from toponav.maps.spec import Edge, TopologicalMap
from toponav.maps.subgraph import crop
from toponav.models.graphnav.graph_tensors import (
    GraphBatch,
    GraphTensors,
    Motion,
    batch_graphs,
    encode_subgraph,
    mirror_graph,
)
from toponav.models.graphnav.localization import LocalizationNetwork, edge_log_probabilities
from toponav.models.graphnav.presets import LocalizationConfig
from toponav.training.config import TrainingConfig
from toponav.training.motion import MotionSampler
from toponav.training.samples import FrameStacks, Split, TrainingData, draw, first_frames

__all__ = ["LocalizationBatch", "LocalizationTask", "draw_previous_edge"]

# How the last location is disturbed: the shares of samples that are told the true edge, the
# one before it, the one after it; the rest are told any edge near enough. A robot in use makes
# all of these mistakes, and one that is only ever told the truth learns to repeat it.
_TOLD_TRUTH, _TOLD_BEFORE, _TOLD_AFTER = 0.4, 0.32, 0.13
_MOST_TRIES = 20


@dataclass(frozen=True)
class LocalizationBatch:
    """Stacks, crops, and which edge of each crop is the true one."""

    frames: Tensor
    graphs: GraphBatch
    target: Tensor


class LocalizationTask:
    """What the loop needs to train the localization network.

    Behaviours are drawn in proportion to the square root of how often they occur, so that
    turns are not drowned by corridors.
    """

    name = "localization"

    def __init__(
        self, model: LocalizationNetwork, data: TrainingData, split: Split, config: TrainingConfig
    ) -> None:
        self.model = model
        self._config = config
        self._data = data
        self._edge = np.asarray(data.edge)
        self._trajectory = np.asarray(data.trajectory)
        self._stacks = FrameStacks(data, model.config.frame_offsets)
        self._motion = MotionSampler(data)
        labelled = self._edge >= 0
        behavior = self._behavior_of_edges(labelled)
        self._pools = [
            np.flatnonzero(labelled & split.train & (behavior == number))
            for number in range(len(Behavior))
        ]
        self._val_pools = [
            np.flatnonzero(labelled & split.val & (behavior == number))
            for number in range(len(Behavior))
        ]
        if not self.samples:
            raise InputError(
                "no frame for learning has an edge",
                where="--data",
                remedy="run `toponav data annotate`, or collect more trajectories",
            )

    @property
    def samples(self) -> int:
        """How many different frames there are to learn from."""
        return sum(len(pool) for pool in self._pools)

    def batches(self, rng: np.random.Generator, steps: int) -> Iterator[LocalizationBatch]:
        """`steps` batches in random order."""
        size = self._config.batch_size
        index = self._balanced(self._pools, steps * size, rng)
        for first in range(0, len(index), size):
            chosen = index[first : first + size]
            mirrored = np.zeros(len(chosen), bool)
            mirrored[: len(chosen) // 2] = self._config.mirror
            previous = [
                draw_previous_edge(*self._where(frame), self.model.config, rng) for frame in chosen
            ]
            told = rng.random(len(chosen)) >= self._config.plan_dropout
            motion = self._motions(chosen, previous, rng)
            yield self._batch(chosen, previous, told, mirrored, motion)

    def loss(self, model: torch.nn.Module, batch: LocalizationBatch) -> Tensor:
        """Mean cross-entropy over the edges of each crop."""
        logits = model(batch.frames, batch.graphs)
        return F.nll_loss(edge_log_probabilities(logits, batch.graphs), batch.target)

    @torch.inference_mode()
    def evaluate(self, model: torch.nn.Module) -> dict[str, int | float]:
        """Accuracy on validation frames; `score` (minus the loss) is what to maximize.

        `accuracy`: the last location disturbed as in training. `true_crop_accuracy`: the last
        frame's true edge given, as the authors measured. `no_plan_accuracy`: as `accuracy`,
        without the plan.
        """
        rng = np.random.default_rng(self._config.seed)
        count = min(self._config.most_validation_samples, sum(map(len, self._val_pools)))
        if not count:
            return {"score": 0.0}
        chosen = self._balanced(self._val_pools, count, rng)
        disturbed = [
            draw_previous_edge(*self._where(frame), self.model.config, rng) for frame in chosen
        ]
        truth = [self._last_true_edge(frame) for frame in chosen]
        right, loss = self._answers(model, chosen, disturbed, True)
        metrics = {"score": -loss, "val_loss": loss, "accuracy": float(right.mean())}
        metrics["true_crop_accuracy"] = float(self._answers(model, chosen, truth, True)[0].mean())
        if self.model.config.edge_features:
            blind, _ = self._answers(model, chosen, disturbed, False)
            metrics["no_plan_accuracy"] = float(blind.mean())
        behavior = np.array([list(Behavior).index(self._where(f)[1].behavior) for f in chosen])
        for number, name in enumerate(Behavior):
            if (behavior == number).any():
                metrics[f"{name}_accuracy"] = float(right[behavior == number].mean())
        return metrics

    def _answers(
        self,
        model: torch.nn.Module,
        chosen: Int64[np.ndarray, " frames"],
        previous: list[Edge],
        told: bool,
    ) -> tuple[Bool[np.ndarray, " frames"], float]:
        """Which frames were placed right, and the mean loss."""
        right, loss = [], 0.0
        rng = np.random.default_rng(self._config.seed)
        size = self._config.batch_size
        for first in range(0, len(chosen), size):
            index = chosen[first : first + size]
            plain = np.zeros(len(index), bool)
            before = previous[first : first + size]
            motion = self._motions(index, before, rng)
            batch = self._batch(index, before, plain | told, plain, motion)
            table = edge_log_probabilities(model(batch.frames, batch.graphs), batch.graphs)
            loss += float(F.nll_loss(table, batch.target, reduction="sum"))
            right.append((table.argmax(1) == batch.target).numpy())
        return np.concatenate(right), loss / len(chosen)

    def _batch(
        self,
        index: Int64[np.ndarray, " batch"],
        previous: list[Edge],
        told: Bool[np.ndarray, " batch"],
        mirrored: Bool[np.ndarray, " batch"],
        motion: list[Motion | None],
    ) -> LocalizationBatch:
        graphs: list[GraphTensors] = []
        target = np.empty(len(index), np.int64)
        config = self.model.config
        for row, (frame, edge) in enumerate(zip(index, previous, strict=True)):
            topological_map, truth, plan = self._where(frame)
            subgraph = crop(topological_map, edge.source, config.ahead, config.behind)
            known = plan if told[row] else None
            graph = encode_subgraph(topological_map, subgraph, known, edge.id, config, motion[row])
            graphs.append(mirror_graph(graph) if mirrored[row] else graph)
            target[row] = subgraph.edges.index(truth.id)
        return LocalizationBatch(
            torch.from_numpy(self._stacks.gather(index, mirrored)),
            batch_graphs(graphs),
            torch.from_numpy(target),
        )

    def _motions(
        self,
        chosen: Int64[np.ndarray, " frames"],
        previous: list[Edge],
        rng: np.random.Generator,
    ) -> list[Motion | None]:
        """What the robot has commanded since it came to each previous edge, about."""
        if not self.model.config.motion_features:
            return [None] * len(chosen)
        numbers = [
            self._where(frame)[0].edge_index[edge.id]
            for frame, edge in zip(chosen, previous, strict=True)
        ]
        return [*self._motion.draw(chosen, np.array(numbers), rng)]

    def _where(self, frame: np.integer) -> tuple[TopologicalMap, Edge, Plan]:
        """Map, true edge and plan of one frame."""
        trajectory = int(self._trajectory[frame])
        topological_map = self._data.map_of(trajectory)
        edge = topological_map.edges[int(self._edge[frame])]
        return topological_map, edge, self._data.plan_of(trajectory)

    def _last_true_edge(self, frame: np.integer) -> Edge:
        """The edge of the frame before, or this frame's own where that is unknown or far."""
        topological_map, edge, _ = self._where(frame)
        if frame == 0 or self._trajectory[frame - 1] != self._trajectory[frame]:
            return edge
        number = int(self._edge[frame - 1])
        if number < 0:
            return edge
        before = topological_map.edges[number]
        return before if _is_inside(topological_map, before, edge, self.model.config) else edge

    def _behavior_of_edges(self, labelled: Bool[np.ndarray, " frames"]) -> np.ndarray:
        behavior = np.full(len(self._edge), -1, np.int8)
        order = {name: number for number, name in enumerate(Behavior)}
        begins = np.unique(first_frames(self._trajectory))
        for first, stop in itertools.pairwise([*begins.tolist(), len(behavior)]):
            edges = self._data.map_of(int(self._trajectory[first])).edges
            kinds = np.array([order[edge.behavior] for edge in edges], np.int8)
            rows = first + np.flatnonzero(labelled[first:stop])
            behavior[rows] = kinds[self._edge[rows]]
        return behavior

    def _balanced(
        self, pools: list[np.ndarray], count: int, rng: np.random.Generator
    ) -> Int64[np.ndarray, " count"]:
        share = np.sqrt([len(pool) for pool in pools])
        counts = rng.multinomial(count, share / share.sum()).tolist()
        parts = [draw(pool, n, rng) for pool, n in zip(pools, counts, strict=True) if n]
        return rng.permutation(np.concatenate(parts))


def draw_previous_edge(
    topological_map: TopologicalMap,
    truth: Edge,
    plan: Plan,
    config: LocalizationConfig,
    rng: np.random.Generator,
) -> Edge:
    """An edge that the robot may have thought it was on when it is on `truth`.

    Its source is the crop's centre. Edges whose crop lacks the true edge are drawn again, as in
    appendix A-A1. Networks that are shown only the crop, not the edge, learn from centres
    drawn evenly around the truth, as the authors' do.
    """
    share = rng.random() if config.edge_features else 1.0
    if share < _TOLD_TRUTH:
        return truth
    share -= _TOLD_TRUTH
    for _ in range(_MOST_TRIES):
        if share < _TOLD_BEFORE:
            candidates = _on_plan_first(topological_map.in_edges(truth.source), plan, rng)
        elif share < _TOLD_BEFORE + _TOLD_AFTER:
            candidates = _on_plan_first(topological_map.out_edges(truth.target), plan, rng)
        else:
            around = crop(topological_map, truth.source, config.ahead, config.behind)
            candidates = tuple(topological_map.edge(edge) for edge in around.edges)
        if not candidates:
            return truth
        edge = candidates[int(rng.integers(len(candidates)))]
        if _is_inside(topological_map, edge, truth, config):
            return edge
    return truth


def _on_plan_first(
    edges: tuple[Edge, ...], plan: Plan, rng: np.random.Generator
) -> tuple[Edge, ...]:
    """Those on the plan, three times in four; else all."""
    planned = tuple(edge for edge in edges if plan.edge_from(edge.source) == edge.id)
    return planned if planned and rng.random() < 0.75 else edges


def _is_inside(
    topological_map: TopologicalMap, center: Edge, truth: Edge, config: LocalizationConfig
) -> bool:
    nodes = crop(topological_map, center.source, config.ahead, config.behind).nodes
    return truth.source in nodes and truth.target in nodes
