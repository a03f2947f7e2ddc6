"""Global policy: the ghost from which the goal is reached soonest, and the way there."""

import math
from dataclasses import dataclass

import numpy as np

from toponav.core.geometry import Pose2
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.perception import Perception, View

__all__ = ["GlobalPolicy", "GlobalPolicyConfig"]

_SCORE_LENGTH_M = 5.0


@dataclass(frozen=True)
class GlobalPolicyConfig:
    """How ghosts are chosen."""

    use_score: bool = True
    """Whether F_S chooses; else chance does (the paper's ablation)."""
    hysteresis_m: float = 1.5
    """Another ghost has to be so much nearer to the goal to be chosen instead."""
    patience_steps: int = 90
    """A ghost that was not reached in so many steps is given up."""
    subgoal_m: float = 0.8
    """Nodes of the path that are so near count as reached."""
    score_trust: float = 0.8
    """How far differences of predicted ways are believed."""


class GlobalPolicy:
    """Chooses where to explore.

    Args:
        perception: The network's functions.
        goal: The goal's view.
        config: How it chooses.
        rng: Decides where `use_score` is off.
    """

    def __init__(
        self,
        perception: Perception,
        goal: View,
        config: GlobalPolicyConfig,
        rng: np.random.Generator,
    ) -> None:
        self.config = config
        self.chosen: GhostNode | None = None
        self._perception = perception
        self._goal = goal
        self._rng = rng
        self._steps = 0
        self._nodes = -1

    def score_ghosts(self, graph: ImageGraph, views: list[View]) -> None:
        """Scores the ghosts that have no score yet; nodes are compared with the goal once."""
        new = sorted({ghost.node for ghost in graph.ghosts if ghost.score is None})
        if not new or not self.config.use_score:
            return
        found = self._perception.compare([views[number] for number in new], self._goal).score
        by_node = dict(zip(new, found, strict=True))
        for ghost in graph.ghosts:
            if ghost.score is None:
                ghost.score = float(by_node[ghost.node][ghost.direction])

    def choose(self, graph: ImageGraph, node: int | None, pose: Pose2) -> GhostNode | None:
        """The ghost to explore; None where there is none."""
        self._steps += 1
        if self.chosen is not None and self._steps > self.config.patience_steps:
            self.drop(graph)
        if self.chosen is not None and not any(g is self.chosen for g in graph.ghosts):
            self.chosen = None
        if not graph.ghosts:
            return None
        if not self.config.use_score:
            if self.chosen is None:
                self._take(graph.ghosts[int(self._rng.integers(len(graph.ghosts)))])
            return self.chosen
        if self.chosen is not None and len(graph.nodes) == self._nodes:
            # Nothing new was seen: a choice that changes with every step leads nowhere.
            return self.chosen
        self._nodes = len(graph.nodes)
        costs = self._costs_m(graph, node, pose)
        best = int(np.argmin(costs))
        if self.chosen is not None:
            now = next(k for k, ghost in enumerate(graph.ghosts) if ghost is self.chosen)
            if costs[best] > costs[now] - self.config.hysteresis_m:
                return self.chosen
        self._take(graph.ghosts[best])
        return self.chosen

    def drop(self, graph: ImageGraph) -> None:
        """Gives the chosen ghost up."""
        graph.ghosts[:] = [ghost for ghost in graph.ghosts if ghost is not self.chosen]
        self.chosen = None

    def subgoal(self, graph: ImageGraph, node: int | None, ghost: GhostNode, pose: Pose2) -> Pose2:
        """The next place on the way to a ghost (Dijkstra): a node, or the ghost itself."""
        place = graph.pose_of_ghost(ghost)
        if node is None or node == ghost.node:
            return place
        for number in graph.shortest_path(node, ghost.node)[1:]:
            step = graph.nodes[number].pose
            if pose.distance_to(step) > self.config.subgoal_m:
                return step
        return place

    def _take(self, ghost: GhostNode) -> None:
        self.chosen, self._steps = ghost, 0

    def _costs_m(self, graph: ImageGraph, node: int | None, pose: Pose2) -> list[float]:
        """Metres that the goal is away through each ghost: the way there, and F_S from there."""
        lengths = graph.distances_m(node)[0] if node is not None else [0.0] * len(graph.nodes)
        scores = [ghost.score if ghost.score is not None else 0.1 for ghost in graph.ghosts]
        costs = []
        for ghost, score in zip(graph.ghosts, scores, strict=True):
            place = graph.pose_of_ghost(ghost)
            direct_m = pose.distance_to(place)
            around_m = lengths[ghost.node] + ghost.distance_m
            if node == ghost.node or not math.isfinite(around_m):
                around_m = direct_m
            there_m = max(direct_m, min(around_m, direct_m + 6.0))
            via_m = -_SCORE_LENGTH_M * math.log(min(max(score, 1e-3), 1.0))
            costs.append(there_m + self.config.score_trust * (via_m - ghost.distance_m))
        return costs
