"""Neural Topological SLAM with the truth for some of its four functions, to show where it loses.

Graph update, global and local policy are the agent's own; only what the network would have said
is replaced. `localization` is F_L, `relative_pose` F_R, `explorable` F_G and `score` F_S.
"""

import math
from collections.abc import Collection
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal, get_args
from weakref import WeakKeyDictionary

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M, ImageGoal
from toponav.data.nts.ground import Ground
from toponav.data.nts.labels import exits_of, score_of
from toponav.models.nts.network import NTSNetwork
from toponav.navigation.nts.agent import NTSAgent, NTSAgentConfig
from toponav.navigation.nts.goal_finder import FinderConfig, GoalFinder
from toponav.navigation.nts.perception import PairView, Perception, View
from toponav.navigation.nts.registration import Registration, register
from toponav.sim.imagenav import ImageNavSimulation
from toponav.worlds.grid_kernels import geodesic_cells
from toponav.worlds.scene import Scene
from toponav.worlds.sight_kernels import is_clear

__all__ = ["FUNCTIONS", "Function", "OracleAgent", "TruePerception"]

Function = Literal["localization", "relative_pose", "explorable", "score"]
FUNCTIONS: tuple[Function, ...] = get_args(Function)
"""The paper's four functions: F_L, F_R, F_G, F_S."""


class TruePerception(Perception):
    """The network's functions, some of them replaced by the labels that it was trained on.

    Args:
        network: Answers the others.
        truths: Which are the truth.
    """

    def __init__(self, network: NTSNetwork, truths: Collection[Function]) -> None:
        super().__init__(network)
        self.truths = frozenset(truths)
        self.simulation: ImageNavSimulation | None = None
        self.sees_goal = False
        self._poses: WeakKeyDictionary[View, Pose2] = WeakKeyDictionary()
        self._field: tuple[Any, np.ndarray] | None = None

    def see(self, rgb: Any, depth_m: Any) -> View:
        """What one panorama says alone; remembers where it was taken."""
        view = super().see(rgb, depth_m)
        pose = self.pose_now
        if "explorable" in self.truths:
            explorable = np.zeros(DIRECTIONS, np.float32)
            explorable[exits_of(self.ground, pose).bins] = 1.0
            view = replace(view, explorable=explorable)
        self._poses[view] = pose
        return view

    def compare(self, sources: list[View], goal: View) -> PairView:
        """What some views and a goal say together."""
        pair = super().compare(sources, goal)
        there = self._poses[goal]
        seen = [there.relative_to(self._poses[source]) for source in sources]
        away_m = np.array([math.hypot(one.x_m, one.y_m) for one in seen], np.float32)
        if "localization" in self.truths:
            same = [self.is_same_node(self._poses[source], there) for source in sources]
            pair = replace(pair, connection=np.array(same, np.float32))
        if "relative_pose" in self.truths:
            bearing = np.array([math.atan2(one.y_m, one.x_m) for one in seen], np.float32)
            pair = replace(pair, direction_rad=bearing, distance_m=away_m)
        if "score" in self.truths:
            rows = [self._score(self._poses[source], there) for source in sources]
            pair = replace(pair, score=np.stack(rows))
        return pair

    @property
    def pose_now(self) -> Pose2:
        """Where what is looked at now was taken."""
        assert self.simulation is not None, "the runner attaches the truth before each episode"
        return self.simulation.goal if self.sees_goal else self.simulation.state.pose

    def pose_of(self, view: View) -> Pose2:
        """Where a view was taken."""
        return self._poses[view]

    @property
    def ground(self) -> Ground:
        """Where one can stand and see in the building."""
        assert self.simulation is not None
        return _ground(self.simulation.scene)

    def is_same_node(self, here: Pose2, there: Pose2) -> bool:
        """Whether one place is in sight of the other within the node's radius."""
        if here.distance_to(there) > NODE_RADIUS_M:
            return False
        ends = [_in_cells(self.ground, pose) for pose in (here, there)]
        return bool(is_clear(self.ground.opaque, *ends[0], *ends[1]))

    def _score(self, here: Pose2, there: Pose2) -> np.ndarray:
        """How fast `there` is reached through each direction of `here`, as the labels have it."""
        exits = exits_of(self.ground, here)
        via_m = np.full(DIRECTIONS, np.inf, np.float32)
        if len(exits.cells):
            to_goal_m, from_here_m = self._field_m(there), self._fresh_field_m(here)
            at = exits.cells[:, 0], exits.cells[:, 1]
            np.minimum.at(via_m, exits.bins, to_goal_m[at] + from_here_m[at])
        return np.asarray(score_of(via_m), np.float32)

    def _field_m(self, there: Pose2) -> np.ndarray:
        """Distances to the goal; the last one asked for is kept."""
        key = (id(self.ground), tuple(there))
        if self._field is None or self._field[0] != key:
            self._field = (key, self._fresh_field_m(there))
        return self._field[1]

    def _fresh_field_m(self, pose: Pose2) -> np.ndarray:
        ground = self.ground
        own = ground.nearest_free(ground.cells_of(np.array([[pose.x_m, pose.y_m]])))
        cells: np.ndarray = geodesic_cells(ground.free, np.ones((1, 1), np.float32), 1.0, own)
        return cells * np.float32(ground.grid.resolution_m)


class OracleAgent(NTSAgent):
    """Neural Topological SLAM with the truth for some functions.

    Args:
        network: Answers the others.
        truths: Which are the truth; all four make the oracle.
        config: How it decides.
        seed: Of its random choices.
    """

    perception: TruePerception

    def __init__(
        self,
        network: NTSNetwork,
        truths: Collection[Function] = FUNCTIONS,
        config: NTSAgentConfig | None = None,
        *,
        seed: int = 0,
    ) -> None:
        super().__init__(network, config, seed=seed)
        self.perception = TruePerception(network, truths)
        self._begin()

    def attach_truth(self, simulation: ImageNavSimulation) -> None:
        """Takes the building, the true pose and the goal from the simulation."""
        self.perception.simulation = simulation

    def reset(self, goal: ImageGoal, *, keep_map: bool = False) -> None:
        """Begins an episode."""
        self.perception.sees_goal = True
        try:
            super().reset(goal, keep_map=keep_map)
        finally:
            self.perception.sees_goal = False
        finds = self.perception.truths & {"localization", "relative_pose"}
        if self._finder is not None and finds:
            kept = self._finder
            self._finder = _TrueFinder(self.perception, kept.goal, kept.config)
            self._finder.place, self._finder.score = kept.place, kept.score


class _TrueFinder(GoalFinder):
    """The agent's finder with the truth of whether and where the goal is in sight, or of one."""

    def __init__(self, perception: TruePerception, goal: View, config: FinderConfig) -> None:
        super().__init__(perception, goal, config)
        self._truth = perception

    def look(self, view: View, pose: Pose2, step: int) -> Pose2 | None:
        """Where the goal is, in the frame of the start, after another view."""
        here, there = self._truth.pose_of(view), self._truth.pose_of(self.goal)
        in_sight = self._truth.is_same_node(here, there)
        if "localization" in self._truth.truths:
            if in_sight:
                self._take(self._relative(view, here, there), pose)
                self._arrive(pose)
            return self.place
        place = super().look(view, pose, step)
        if (
            place is not None
            and in_sight
            and place.distance_to(pose.compose(there.relative_to(here))) < NODE_RADIUS_M / 2
        ):
            self._take(Registration(there.relative_to(here), self.score), pose)
        return self.place

    def _relative(self, view: View, here: Pose2, there: Pose2) -> Registration:
        if "relative_pose" in self._truth.truths:
            return Registration(there.relative_to(here), 1.0)
        return register(view.signature, self.goal.signature, self.config.reach_m)

    def _arrive(self, pose: Pose2) -> None:
        assert self.place is not None
        self.has_arrived = pose.distance_to(self.place) < self.config.stop_m


@lru_cache(maxsize=2)
def _ground(scene: Scene) -> Ground:
    return Ground.of(scene)


def _in_cells(ground: Ground, pose: Pose2) -> tuple[float, float]:
    x0_m, y0_m = ground.grid.origin_m
    cell_m = ground.grid.resolution_m
    return (pose.y_m - y0_m) / cell_m, (pose.x_m - x0_m) / cell_m
