"""Graph update: localize, add nodes, edges and ghosts, take explored ghosts away."""

import math
from dataclasses import dataclass, field

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M, bin_of_direction, direction_of_bin
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.perception import Perception, View

__all__ = ["GraphUpdate", "GraphUpdateConfig"]

_BEHIND_M = 0.75
_DEPTH_SLACK_M = 0.3
_BEFORE_M = 0.2


@dataclass(frozen=True)
class GraphUpdateConfig:
    """When places count as the same, as explorable, and as explored."""

    same_node: float = 0.5
    """F_L from which on the robot is in a node."""
    radius_m: float = NODE_RADIUS_M
    """A node ends here, whatever F_L says."""
    explorable: float = 0.5
    """F_G from which on a direction gets a ghost."""
    candidates: int = 4
    """Nodes that a view is compared with at most, the nearest ones."""
    moved_m: float = 0.4
    """The robot is localized again after driving so far."""
    reached_m: float = 0.6
    """A ghost is explored when the robot comes so near; there it makes a node, so that what
    lies beyond gets ghosts of its own."""
    apart_m: float = 1.2
    """Where another node is nearer than this, it makes none."""


@dataclass(eq=False)
class GraphUpdate:
    """The graph of an episode and where the robot is in it.

    Attributes:
        perception: The network's functions.
        config: Thresholds.
        keep_panoramas: Whether nodes keep their pictures.
        graph: The map.
        views: What was made of each node's panorama.
        node: Number of the node that the robot is in.
    """

    perception: Perception
    config: GraphUpdateConfig = field(default_factory=GraphUpdateConfig)
    keep_panoramas: bool = True
    graph: ImageGraph = field(default_factory=ImageGraph)
    views: list[View] = field(default_factory=list)
    node: int | None = None
    _localized_at: Pose2 | None = None

    def update(self, view: View, panorama: np.ndarray, pose: Pose2, step: int) -> bool:
        """Takes in a view; whether it became a new node."""
        at_ghost = self._is_at_ghost(pose)
        if (
            not at_ghost
            and self._localized_at is not None
            and pose.distance_to(self._localized_at) < self.config.moved_m
        ):
            return False
        self._localized_at = pose
        found = None if at_ghost else self._localize(view, pose)
        if found is not None:
            if self.node is not None:
                self.graph.add_edge(self.node, found)
            self.node = found
            return False
        kept = panorama if self.keep_panoramas else None
        added = self.graph.add_node(pose, step, kept, view.features[0].numpy())
        self.views.append(view)
        if self.node is not None:
            self.graph.add_edge(self.node, added)
        self.node = added
        self._add_ghosts(added, view)
        return True

    def remove_explored(self, pose: Pose2) -> None:
        """Takes away the ghosts that the robot has reached; edges go when they are searched."""
        reached_m = self.config.reached_m
        self.graph.ghosts[:] = [
            ghost
            for ghost in self.graph.ghosts
            if ghost.unseen_m2 is not None
            or pose.distance_to(self.graph.pose_of_ghost(ghost)) >= reached_m
        ]

    def _is_at_ghost(self, pose: Pose2) -> bool:
        """Whether a ghost was reached where there is no node yet."""
        config, graph = self.config, self.graph
        places = map(graph.pose_of_ghost, graph.ghosts)
        if not any(pose.distance_to(place) < config.reached_m for place in places):
            return False
        return not graph.nodes_near(pose, config.apart_m)

    def _localize(self, view: View, pose: Pose2) -> int | None:
        """The node that the robot is in; the cost does not grow with the graph."""
        near = self.graph.nodes_near(pose, 1.3 * NODE_RADIUS_M)[: self.config.candidates]
        if not near:
            return None
        numbers = [number for _, number in near]
        chance = self.perception.compare([self.views[k] for k in numbers], view).connection
        # Of several that fit, the nearest: both lie in sight.
        for (away_m, number), one in zip(near, chance, strict=True):
            if one > self.config.same_node and away_m < self.config.radius_m:
                return number
        return None

    def _add_ghosts(self, number: int, view: View) -> None:
        node = self.graph.nodes[number]
        self.graph.ghosts[:] = [
            ghost
            for ghost in self.graph.ghosts
            if ghost.unseen_m2 is not None or not self._leads_to(ghost, node.pose)
        ]
        others = [
            self.graph.nodes[other].pose.relative_to(node.pose)
            for _, other in self.graph.nodes_near(node.pose, NODE_RADIUS_M + _BEHIND_M)
            if other != number
        ]
        for direction in range(DIRECTIONS):
            if view.explorable[direction] <= self.config.explorable:
                continue
            away_m, bearing_rad = _deepest(view, direction)
            # A node behind what ends the sight does not lie in this direction.
            is_known = any(
                bin_of_direction(math.atan2(seen.y_m, seen.x_m)) == direction
                and math.hypot(seen.x_m, seen.y_m) < away_m + _BEHIND_M
                for seen in others
            )
            if not is_known:
                self.graph.ghosts.append(
                    GhostNode(number, direction, away_m, bearing_rad=bearing_rad)
                )

    def _leads_to(self, ghost: GhostNode, pose: Pose2) -> bool:
        """Whether a new node lies where the ghost stands for."""
        origin = self.graph.nodes[ghost.node].pose
        seen = pose.relative_to(origin)
        away_m = math.hypot(seen.x_m, seen.y_m)
        if away_m > ghost.distance_m + 2.0 * _BEHIND_M or away_m < 0.5:
            return False
        off = math.atan2(seen.y_m, seen.x_m) - self.graph.bearing_of_ghost(ghost)
        off = (off + math.pi) % (2 * math.pi) - math.pi
        return abs(off) < math.pi / DIRECTIONS and away_m > 0.7 * ghost.distance_m


def _deepest(view: View, direction: int) -> tuple[float, float]:
    """How far one sees into a direction, at most the node's radius, and at which bearing."""
    range_m = np.minimum(view.signature.range_m, NODE_RADIUS_M)
    each = len(range_m) // DIRECTIONS
    part = np.roll(range_m, each // 2)[direction * each : (direction + 1) * each]
    deepest = part.max()
    # Of several that are as deep, the middle one: it keeps away from the jambs.
    rays = np.flatnonzero(part > deepest - _DEPTH_SLACK_M)
    middle = float(rays[len(rays) // 2])
    step_rad = 2.0 * math.pi / len(range_m)
    bearing = direction_of_bin(direction) + (middle - each // 2) * step_rad
    return float(np.clip(deepest - _BEFORE_M, 1.0, NODE_RADIUS_M)), bearing
