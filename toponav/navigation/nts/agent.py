"""The agent of Neural Topological SLAM, and its two ablations."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    NODE_RADIUS_M,
    Action,
    BeliefEdge,
    BeliefGhost,
    BeliefNode,
    ImageGoal,
    ImageNavBelief,
    PanoramaObservation,
)
from toponav.maps.image_graph import ImageGraph
from toponav.models.checkpoints import load_nts
from toponav.models.nts.network import NTSNetwork
from toponav.navigation.nts.exploration import Exploration, ExplorationConfig, exploration_of
from toponav.navigation.nts.global_policy import GlobalPolicy, GlobalPolicyConfig
from toponav.navigation.nts.goal_finder import FinderConfig, GoalFinder
from toponav.navigation.nts.graph_update import GraphUpdate, GraphUpdateConfig
from toponav.navigation.nts.local_map import LocalMap
from toponav.navigation.nts.local_policy import LocalPolicy, LocalPolicyConfig
from toponav.navigation.nts.perception import Perception, View, fault_of
from toponav.navigation.nts.pose_tracking import PoseTracker

__all__ = ["NTSAgent", "NTSAgentConfig"]


@dataclass(frozen=True)
class NTSAgentConfig:
    """How the agent decides."""

    use_graph: bool = True
    """Without, it heads for the best-scored direction of what it sees (the paper's ablation)."""
    use_score: bool = True
    """Without, it picks ghosts by chance (the paper's ablation)."""
    keep_panoramas: bool = True
    """Whether nodes keep their pictures, for display and for saving."""
    finder: FinderConfig | None = None
    """When the goal counts as found; by the network's modality when left out."""
    graph: GraphUpdateConfig = field(default_factory=GraphUpdateConfig)
    ghosts: GlobalPolicyConfig | None = None
    """How ghosts are chosen; by the network's modality when left out."""
    exploration: ExplorationConfig | None = None
    """How ghosts are explored; by the network's modality when left out."""
    local: LocalPolicyConfig = field(default_factory=LocalPolicyConfig)
    approach_steps: int = 70
    """The goal's place is given up when it was not reached in so many steps."""
    sure_m: float = 0.35
    """So near, what stands between the robot and the goal does not matter."""


class NTSAgent:
    """Explores until it sees the goal, goes there and stops.

    Args:
        network: The multi-task network; whether it asks for depth says what the agent uses.
        config: How it decides.
        seed: Of its random choices.

    Example:
        >>> agent = NTSAgent.from_weights("nts", depth=True)
        >>> agent.reset(goal)  # doctest: +SKIP
        >>> action = agent.act(observation)  # doctest: +SKIP
    """

    def __init__(
        self, network: NTSNetwork, config: NTSAgentConfig | None = None, *, seed: int = 0
    ) -> None:
        self.config = config or NTSAgentConfig()
        self.perception = Perception(network)
        self._seed = seed
        self._episode = 0
        self._finder: GoalFinder | None = None
        self._last_action: Action | None = None
        self._view: View | None = None
        self._subgoal: Pose2 | None = None
        self._step = -1
        self._approach = 0
        self._mode, self._why = "explore", ""
        self._begin()

    @staticmethod
    def from_weights(
        weights: str | Path = "nts",
        *,
        depth: bool,
        config: NTSAgentConfig | None = None,
        seed: int = 0,
    ) -> "NTSAgent":
        """The agent with weights of a folder, or with those that ship (`nts`)."""
        return NTSAgent(load_nts(weights, depth=depth), config, seed=seed)

    @property
    def graph(self) -> ImageGraph:
        """The map so far."""
        return self._update.graph

    @property
    def seen(self) -> LocalMap:
        """The occupancy that it drives on, in the frame of the start."""
        return self._local.map

    def reseed(self, seed: int) -> None:
        """Starts random choices afresh from the next `reset` on."""
        self._seed = seed

    def reset(self, goal: ImageGoal, *, keep_map: bool = False) -> None:
        """Begins an episode.

        Args:
            goal: The picture to find; a broken one ends the episode with a reason.
            keep_map: Go on from the map and pose of the last episode, for sequential goals.
        """
        if not keep_map:
            self._episode = 0
            self._begin()
        else:
            self._episode += 1
        self._mode, self._why, self._subgoal = "explore", "", None
        self._finder = None
        self._approach = 0
        wants_depth = self.perception.depth
        fault = fault_of(goal.rgb, goal.depth_m, wants_depth=wants_depth)
        if fault:
            self._why = f"the goal cannot be looked for: {fault}"
            return
        seen = self.perception.see(goal.rgb, goal.depth_m)
        self._finder = GoalFinder(self.perception, seen, self.config.finder)
        ghosts = self.config.ghosts or GlobalPolicyConfig(by_floor=wants_depth)
        ghosts = replace(ghosts, use_score=self.config.use_score)
        policy = GlobalPolicy(self.perception, seen, ghosts, self._rng)
        self._exploration.begin(policy, self._finder)
        if keep_map and self.config.use_graph:
            self._look_back()

    def act(self, observation: PanoramaObservation) -> Action:
        """The next action."""
        self._step += 1
        finder = self._finder
        if finder is None:
            self._mode = "stop"
            return Action.STOP
        fault = fault_of(observation.rgb, observation.depth_m, wants_depth=self.perception.depth)
        if fault:
            return self._blind(observation)
        view = self.perception.see(observation.rgb, observation.depth_m)
        pose = self._tracker.update(observation.odometry, view.signature, self._last_action)
        self._view = view
        self._local.observe(observation, pose, None if self.perception.depth else view.obstacle_m)
        is_new = self._update.update(view, observation.rgb, pose, self._step)
        self._update.remove_explored(pose)
        if self.config.use_graph:
            self._exploration.look(view, pose, self._step, is_new=is_new)
        finder.look(view, pose, self._step)
        if finder.has_arrived and self._is_there(pose):
            self._mode, self._why = "stop", "the goal's picture looks like this place"
            action = Action.STOP
        else:
            action = self._move(pose)
        self._last_action = action
        return action

    def stop_denied(self) -> None:
        """Where stopping does not end an episode: the place was wrong, look elsewhere."""
        if self._finder is not None:
            self._finder.has_arrived = False
            self._finder.give_up()

    def belief(self) -> ImageNavBelief:
        """What it thinks after the last `act`."""
        finder, view, score = self._finder, self._view, None
        if view is not None and finder is not None and self.config.use_score:
            score = self.perception.compare([view], finder.goal).score[0]
        return replace(self.belief_in_brief(), score=score)

    def belief_in_brief(self) -> ImageNavBelief:
        """The same without the scores from here, which nothing but a picture needs."""
        graph, finder, view = self.graph, self._finder, self._view
        place = finder.place if finder is not None else None
        return ImageNavBelief(
            pose=self._tracker.pose,
            nodes=tuple(BeliefNode(n.pose, n.step, n.panorama) for n in graph.nodes),
            edges=tuple(BeliefEdge(edge.source, edge.target) for edge in graph.edges),
            ghosts=tuple(
                BeliefGhost(ghost.node, graph.pose_of_ghost(ghost), ghost.score)
                for ghost in graph.ghosts
            ),
            node=self._update.node,
            goal_node=None if place is None else _nearest(graph, place),
            goal=place,
            subgoal=self._subgoal,
            explorable=None if view is None else view.explorable,
            mode=self._mode,
            stopped_because=self._why,
        )

    def _begin(self) -> None:
        self._rng = np.random.default_rng(self._seed)
        self._update = GraphUpdate(self.perception, self.config.graph, self.config.keep_panoramas)
        self._tracker = PoseTracker(aligned=self.perception.depth)
        self._local = LocalPolicy(self.config.local, self._seed)
        self._last_action = None
        self._view = None
        self._subgoal = None
        self._step = -1
        self._approach = 0
        self._mode, self._why = "explore", ""
        explored = self.config.exploration or exploration_of(self.perception.depth)
        self._exploration = Exploration(explored, self._update, self._local, self._rng)

    def _look_back(self) -> None:
        """Localizes a new goal in the map that is there already."""
        assert self._finder is not None
        for node, view in zip(self.graph.nodes, self._update.views, strict=True):
            self._finder.consider(view, node.pose)

    def _is_there(self, pose: Pose2) -> bool:
        """Whether nothing stands between the robot and the goal that it has seen from here."""
        assert self._finder is not None
        place = self._finder.place
        assert place is not None
        is_near = pose.distance_to(place) < self.config.sure_m
        return is_near or self._local.is_straight((place.x_m, place.y_m))

    def _move(self, pose: Pose2) -> Action:
        finder = self._finder
        assert finder is not None
        if finder.place is not None:
            self._mode = "approach"
            self._approach += 1
            if self._approach <= self.config.approach_steps:
                return self._drive(finder.place)
            finder.give_up()
        self._approach = 0
        self._mode = "explore"
        return self._drive(self._where_to_explore(pose))

    def _where_to_explore(self, pose: Pose2) -> Pose2:
        if self.config.use_graph:
            place = self._exploration.where(pose, self._step)
            self._mode = "wander" if self._exploration.is_wandering else "explore"
            return place
        view, finder = self._view, self._finder
        assert view is not None
        assert finder is not None
        score = self.perception.compare([view], finder.goal).score[0]
        least = self.config.graph.explorable
        return self._exploration.greedy(view, score, least, pose, self._step)

    def _drive(self, place: Pose2) -> Action:
        self._subgoal = place
        return self._local.action((place.x_m, place.y_m))

    def _blind(self, observation: PanoramaObservation) -> Action:
        """The cameras are dead: feel the way on the map that is there."""
        pose = self._tracker.update(observation.odometry, None, self._last_action)
        self._local.observe(observation, pose)
        action = self._drive(self._exploration.wander(pose, self._step))
        self._mode = "recover"
        self._last_action = action
        return action


def _nearest(graph: ImageGraph, place: Pose2) -> int | None:
    """The node that a place belongs to, where there is one."""
    near = [(node.pose.distance_to(place), node.number) for node in graph.nodes]
    return min(near)[1] if near and min(near)[0] < NODE_RADIUS_M else None
