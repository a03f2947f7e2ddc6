"""Where to explore while the goal is not in sight: ghosts, then edges, then anywhere."""

import math
from dataclasses import dataclass, field

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M, direction_of_bin
from toponav.maps.image_graph import GhostNode
from toponav.navigation.nts.ghost_update import update_ghosts
from toponav.navigation.nts.global_policy import GlobalPolicy
from toponav.navigation.nts.goal_finder import GoalFinder
from toponav.navigation.nts.graph_update import GraphUpdate
from toponav.navigation.nts.local_policy import LocalPolicy
from toponav.navigation.nts.perception import View
from toponav.navigation.nts.searched_floor import SearchConfig, SearchedFloor

__all__ = ["Exploration", "ExplorationConfig", "exploration_of"]

_AT_EDGE_M = 0.35


@dataclass(frozen=True)
class ExplorationConfig:
    """How ghosts are driven to."""

    search: SearchConfig | None = field(default_factory=SearchConfig)
    """What counts as searched. Without, ghosts are where the network says alone, and go when
    they are reached."""
    refresh_steps: int = 8
    """Ghosts are compared with what was searched in so many steps at least."""
    refresh_m: float = 0.4
    """And after driving so far."""
    stalled_steps: int = 30
    """A ghost to which the way did not become shorter in so many steps is given up."""
    greedy_steps: int = 8
    """Without a graph, the direction is chosen anew in so many steps."""


def exploration_of(depth: bool) -> ExplorationConfig:
    """How ghosts are explored with a depth camera, or by predicted ranges alone.

    Ranges that are 0.3 m off make edges where there are none: ghosts are the network's alone.
    """
    return ExplorationConfig() if depth else ExplorationConfig(search=None)


class Exploration:
    """Chooses places to drive to.

    Args:
        config: How.
        update: The graph and the robot's place in it.
        local: The map, and what can be reached on it.
        rng: Of its random choices.
    """

    def __init__(
        self,
        config: ExplorationConfig,
        update: GraphUpdate,
        local: LocalPolicy,
        rng: np.random.Generator,
    ) -> None:
        self.config = config
        self.is_wandering = False
        self._update, self._local, self._rng = update, local, rng
        self._floor = None if config.search is None else SearchedFloor(local.map, config.search)
        self._policy: GlobalPolicy | None = None
        self._finder: GoalFinder | None = None
        self._refreshed: tuple[Pose2, int] | None = None
        self._greedy: tuple[int, Pose2] | None = None
        self._edge: tuple[int, Pose2] | None = None
        self._given_up: list[tuple[float, float]] = []
        self._progress: tuple[GhostNode, Pose2, float, int] | None = None

    def begin(self, policy: GlobalPolicy, finder: GoalFinder) -> None:
        """A new goal: what was searched for the last one is not searched for it.

        Args:
            policy: Chooses among ghosts.
            finder: Knows doubtful places of the goal.
        """
        self._policy, self._finder = policy, finder
        self._given_up, self._refreshed = [], None
        graph = self._update.graph
        for ghost in graph.ghosts:
            ghost.score = None
        policy.score_ghosts(graph, self._update.views)
        if self._floor is not None:
            self._floor.forget()
            for node, view in zip(graph.nodes, self._update.views, strict=True):
                self._floor.look(view, node.pose)

    def look(self, view: View, pose: Pose2, step: int, *, is_new: bool) -> None:
        """Takes in a view, which may have become a node."""
        assert self._policy is not None
        if self._floor is not None:
            self._floor.look(view, pose)
            if is_new or self._is_due(pose, step):
                self._refresh(pose, step)
                return
        if is_new:
            self._policy.score_ghosts(self._update.graph, self._update.views)

    def where(self, pose: Pose2, step: int) -> Pose2:
        """The place to drive to."""
        self.is_wandering = False
        policy, update, floor = self._policy, self._update, self._floor
        assert policy is not None
        drive_m = None if floor is None else floor.drive_m
        for _ in range(4):
            ghost = policy.choose(update.graph, update.node, pose, drive_m)
            if ghost is None:
                break
            place = update.graph.pose_of_ghost(ghost)
            is_there = ghost.unseen_m2 is not None and pose.distance_to(place) < _AT_EDGE_M
            if is_there or self._is_stalled(ghost, place, step):
                self._give_up(place)
                continue
            if self._local.can_reach((place.x_m, place.y_m)):
                return place
            if update.node != ghost.node:
                return policy.subgoal(update.graph, update.node, ghost, pose)
            self._give_up(place)
        return self._what_is_left(pose, step)

    def greedy(self, view: View, score: np.ndarray, least: float, pose: Pose2, step: int) -> Pose2:
        """Straight into the direction with the best score, with no memory but that.

        Args:
            view: What is seen.
            score: F_S in its directions.
            least: F_G from which on a direction is explorable.
            pose: Where the robot is.
            step: Now.
        """
        if self._greedy is not None:
            until, place = self._greedy
            if step < until and pose.distance_to(place) > 0.5:
                return place
        open_to = view.explorable > least
        chances = np.where(open_to, score, score * 0.05) if open_to.any() else score
        away = direction_of_bin(int(chances.argmax()))
        x_m, y_m = NODE_RADIUS_M * math.cos(away), NODE_RADIUS_M * math.sin(away)
        place = pose.compose(Pose2(x_m, y_m, away))
        self._greedy = (step + self.config.greedy_steps, place)
        return place

    def wander(self, pose: Pose2, step: int) -> Pose2:
        """Nothing is left to explore: go through the map again."""
        self.is_wandering = True
        graph = self._update.graph
        if self._greedy is None or step >= self._greedy[0]:
            if graph.nodes and self._rng.random() < 0.7:
                place = graph.nodes[int(self._rng.integers(len(graph.nodes)))].pose
            else:
                away = direction_of_bin(int(self._rng.integers(DIRECTIONS)))
                place = pose.compose(Pose2(2 * math.cos(away), 2 * math.sin(away), 0.0))
            self._greedy = (step + 40, place)
        return self._greedy[1]

    def _is_due(self, pose: Pose2, step: int) -> bool:
        """Whether ghosts have to be compared with what was searched."""
        if self._refreshed is None:
            return True
        at, since = self._refreshed
        has_moved = pose.distance_to(at) >= self.config.refresh_m
        return has_moved or step - since >= self.config.refresh_steps

    def _refresh(self, pose: Pose2, step: int) -> None:
        assert self._floor is not None
        assert self._policy is not None
        graph = self._update.graph
        self._refreshed = (pose, step)
        if graph.nodes:
            update_ghosts(graph, self._floor, self._local.map, pose)
            self._policy.score_ghosts(graph, self._update.views)

    def _give_up(self, place: Pose2) -> None:
        """Drops the chosen ghost, for good."""
        assert self._policy is not None
        if self._floor is not None:
            self._floor.give_up(place.x_m, place.y_m)
        self._policy.drop(self._update.graph)

    def _is_stalled(self, ghost: GhostNode, place: Pose2, step: int) -> bool:
        """Whether the way to a ghost has not become shorter for a while."""
        left_m = self._local.distance_m((place.x_m, place.y_m))
        before = self._progress
        is_same = before is not None and before[0] is ghost and before[1].distance_to(place) < 0.3
        if before is None or not is_same or left_m < before[2] - 0.2:
            self._progress = before = (ghost, place, left_m, step)
        return step - before[3] > self.config.stalled_steps

    def _what_is_left(self, pose: Pose2, step: int) -> Pose2:
        """Where to go when no ghost is left: doubtful places of the goal, then closer looks."""
        if self._floor is None:
            return self._frontier(pose, step) or self._guess() or self.wander(pose, step)
        guess = self._guess()
        if guess is not None:
            return guess
        if self._floor.search_closely():
            self._refresh(pose, step)
            return self.where(pose, step)
        return self._frontier(pose, step) or self.wander(pose, step)

    def _frontier(self, pose: Pose2, step: int) -> Pose2 | None:
        """Where what is known ends, when no ghost is left; kept until it is reached."""
        if self._edge is not None:
            until, place = self._edge
            is_open = self._local.is_edge((place.x_m, place.y_m))
            if is_open and step < until and pose.distance_to(place) > 0.5:
                return place
            if is_open:
                # What still is an edge from near by cannot be reached.
                self._given_up.append((place.x_m, place.y_m))
            self._edge = None
        frontier = self._local.frontier(self._given_up)
        if frontier is None:
            return None
        place = Pose2(*frontier, 0.0)
        self._edge = (step + 30, place)
        return place

    def _guess(self) -> Pose2 | None:
        """Where the goal may be after all: a place within reach, too doubtful so far."""
        finder = self._finder
        while finder is not None and finder.take_best_guess():
            place = finder.place
            assert place is not None
            if self._local.can_reach((place.x_m, place.y_m)):
                return place
            finder.set_aside()
        return None
