"""Global policy: the ghost from which the goal is reached soonest, and the way there."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import direction_of_bin
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.perception import Perception, View

__all__ = ["GlobalPolicy", "GlobalPolicyConfig"]

_SCORE_LENGTH_M = 5.0
_FARTHEST_M = 60.0
_LEAST_LEFT_M = 0.5
_LEAST_M2 = 0.6
_SAY_M = 10.0
_SAME_WAY_RAD = math.radians(40.0)
DriveLength = Callable[[float, float], float]


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
    explorable: float = 0.5
    """F_G from which on F_S says something about a direction."""
    score_trust: float = 0.8
    """How far differences of predicted ways are believed."""
    by_floor: bool = False
    """Whether the most unsearched floor for each metre of driving is chosen, weighed with F_S:
    the goal is somewhere in it. Else the shortest way to the goal by F_S alone."""
    usual_m2: float = 6.0
    """Unsearched floor behind a ghost of which that is not known."""
    most_m2: float = 15.0
    """More floor does not count: it is not searched from one place."""
    hysteresis: float = 0.3
    """By floor, another ghost has to be so much better (natural logarithm) to be chosen."""


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
        self._by_node: dict[int, Float32[np.ndarray, " directions"]] = {}

    def score_ghosts(self, graph: ImageGraph, views: list[View]) -> None:
        """Scores the ghosts that have no score yet; nodes are compared with the goal once."""
        if not self.config.use_score:
            return
        unscored = [ghost for ghost in graph.ghosts if ghost.score is None]
        new = sorted({ghost.node for ghost in unscored} - self._by_node.keys())
        if new:
            found = self._perception.compare([views[number] for number in new], self._goal).score
            self._by_node.update(zip(new, found, strict=True))
        for ghost in unscored:
            ghost.score = self._score_of(ghost, views[ghost.node])

    def choose(
        self, graph: ImageGraph, node: int | None, pose: Pose2, drive_m: DriveLength | None = None
    ) -> GhostNode | None:
        """The ghost to explore; None where there is none.

        Args:
            graph: The map.
            node: The node that the robot is in.
            pose: Where it is.
            drive_m: The drive to a place, infinite where no way is known; by the graph when left
                out.
        """
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
        costs = self._costs(graph, node, pose, drive_m)
        best = int(np.argmin(costs))
        if self.chosen is not None:
            now = next(k for k, ghost in enumerate(graph.ghosts) if ghost is self.chosen)
            least = self.config.hysteresis if self.config.by_floor else self.config.hysteresis_m
            if costs[best] > costs[now] - least:
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

    def _score_of(self, ghost: GhostNode, view: View) -> float:
        """F_S into a ghost's direction.

        F_S learned nothing about directions that are not explorable: the nearest one that is
        stands for an edge of the searched floor, or all of them where none is near.
        """
        scores = self._by_node[ghost.node]
        if ghost.unseen_m2 is None or ghost.bearing_rad is None:
            return float(scores[ghost.direction])
        open_to = np.flatnonzero(view.explorable > self.config.explorable)
        if not len(open_to):
            return float(scores[ghost.direction])
        off = [abs(wrap_angle(ghost.bearing_rad - direction_of_bin(int(k)))) for k in open_to]
        nearest = int(np.argmin(off))
        if off[nearest] > _SAME_WAY_RAD:
            return float(scores[open_to].mean())
        return float(scores[open_to[nearest]])

    def _costs(
        self, graph: ImageGraph, node: int | None, pose: Pose2, drive_m: DriveLength | None
    ) -> list[float]:
        """What choosing each ghost costs, from the way there and F_S from there.

        Metres that the goal is away through it; by floor, the logarithm of metres to drive for
        each square metre searched, where e times less counts for 10 m nearer by F_S.
        """
        lengths = graph.distances_m(node)[0] if node is not None else [0.0] * len(graph.nodes)
        costs = []
        for ghost in graph.ghosts:
            place = graph.pose_of_ghost(ghost)
            there_m = math.inf if drive_m is None else drive_m(place.x_m, place.y_m)
            if not there_m < _FARTHEST_M:
                direct_m = pose.distance_to(place)
                around_m = lengths[ghost.node] + ghost.distance_m
                if node == ghost.node or not math.isfinite(around_m):
                    around_m = direct_m
                there_m = max(direct_m, min(around_m, direct_m + 6.0))
            score = 0.1 if ghost.score is None else ghost.score
            via_m = -_SCORE_LENGTH_M * math.log(min(max(score, 1e-3), 1.0))
            left_m = via_m - ghost.distance_m
            if ghost.unseen_m2 is not None:
                left_m = max(left_m, _LEAST_LEFT_M)
            if not self.config.by_floor:
                costs.append(there_m + self.config.score_trust * left_m)
                continue
            area_m2 = self.config.usual_m2 if ghost.floor_m2 is None else ghost.floor_m2
            area_m2 = min(max(area_m2, _LEAST_M2), self.config.most_m2)
            costs.append(math.log((there_m + 1.0) / area_m2) + left_m / _SAY_M)
        return costs
