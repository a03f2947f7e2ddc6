"""Graph update: localize, add nodes, edges and ghosts, take explored ghosts away."""

import math
from dataclasses import dataclass, field

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M, bin_of_direction, direction_of_bin
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.perception import Perception, View

__all__ = ["GraphUpdate", "GraphUpdateConfig"]


@dataclass(frozen=True)
class GraphUpdateConfig:
    """When places count as the same, as explorable, and as explored."""

    same_node: float = 0.5
    """F_L from which on the robot is in a node."""
    explorable: float = 0.5
    """F_G from which on a direction gets a ghost."""
    candidates: int = 4
    """Nodes that a view is compared with at most, the nearest ones."""
    moved_m: float = 0.4
    """The robot is localized again after driving so far."""
    reached_m: float = 1.0
    """A ghost is explored when the robot comes so near."""


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
        if (
            self._localized_at is not None
            and pose.distance_to(self._localized_at) < self.config.moved_m
        ):
            return False
        self._localized_at = pose
        found = self._localize(view, pose)
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
        """Takes away the ghosts that the robot has reached."""
        reached_m = self.config.reached_m
        self.graph.ghosts[:] = [
            ghost
            for ghost in self.graph.ghosts
            if pose.distance_to(self.graph.pose_of_ghost(ghost)) >= reached_m
        ]

    def _localize(self, view: View, pose: Pose2) -> int | None:
        """The node that the robot is in; the cost does not grow with the graph."""
        near = sorted(
            (pose.distance_to(node.pose), node.number)
            for node in self.graph.nodes
            if pose.distance_to(node.pose) < 1.3 * NODE_RADIUS_M
        )[: self.config.candidates]
        if not near:
            return None
        numbers = [number for _, number in near]
        chance = self.perception.compare([self.views[k] for k in numbers], view).connection
        # Of several that fit, the nearest: both lie in sight.
        for (away_m, number), one in zip(near, chance, strict=True):
            if one > self.config.same_node and away_m < NODE_RADIUS_M:
                return number
        return None

    def _add_ghosts(self, number: int, view: View) -> None:
        node = self.graph.nodes[number]
        taken = set()
        for other in self.graph.nodes[:number]:
            seen = other.pose.relative_to(node.pose)
            if math.hypot(seen.x_m, seen.y_m) < 1.5 * NODE_RADIUS_M:
                taken.add(bin_of_direction(math.atan2(seen.y_m, seen.x_m)))
        self.graph.ghosts[:] = [
            ghost for ghost in self.graph.ghosts if not self._leads_to(ghost, node.pose)
        ]
        for direction in range(DIRECTIONS):
            if view.explorable[direction] > self.config.explorable and direction not in taken:
                away_m = _depth_of(view, direction)
                self.graph.ghosts.append(GhostNode(number, direction, away_m))

    def _leads_to(self, ghost: GhostNode, pose: Pose2) -> bool:
        """Whether a new node lies where the ghost stands for."""
        origin = self.graph.nodes[ghost.node].pose
        seen = pose.relative_to(origin)
        away_m = math.hypot(seen.x_m, seen.y_m)
        if away_m > 1.5 * NODE_RADIUS_M or away_m < 0.5:
            return False
        off = math.atan2(seen.y_m, seen.x_m) - direction_of_bin(ghost.direction)
        off = (off + math.pi) % (2 * math.pi) - math.pi
        return abs(off) < math.pi / DIRECTIONS and away_m > 0.7 * ghost.distance_m


def _depth_of(view: View, direction: int) -> float:
    """How far one sees into a direction, at most the node's radius."""
    range_m = view.signature.range_m
    each = len(range_m) // DIRECTIONS
    part = np.roll(range_m, each // 2)[direction * each : (direction + 1) * each]
    return float(np.clip(part.max(), 1.0, NODE_RADIUS_M))
