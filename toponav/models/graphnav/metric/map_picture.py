"""The topological map as a picture around a believed pose, and the plan as numbers."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int64

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.models.graphnav.metric import map_picture_kernels as kernels
from toponav.models.graphnav.metric.kept_way import KeptWay, kept_way

__all__ = ["AHEAD_M", "MAP_CHANNELS", "PLAN_FEATURES", "MapArrays"]

MAP_CHANNELS: Final = kernels.CHANNELS
AHEAD_M: Final = (0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.5)
"""Points of the plan are given at these distances ahead."""
PLAN_FEATURES: Final = 2 * len(AHEAD_M) + 1 + 3 * len(Behavior)
_AHEAD: Final = np.array(AHEAD_M)
_KIND: Final = {
    NodeKind.ROOM: 0,
    NodeKind.DOOR: 1,
    NodeKind.HALLWAY: 2,
    NodeKind.OPEN_SPACE: 2,
}


@dataclass(frozen=True)
class MapArrays:
    """A map and a plan as arrays, in the map's frame.

    Attributes:
        node_xy: Positions.
        node_kind: 0 room, 1 door, 2 hallway or open space.
        on_plan: Whether the plan passes the node.
        edges: Source and target of each edge, as indices of nodes.
        kept: The line along the plan's nodes.
        behaviors: Behaviour due at each of the line's points, as its place in `list(Behavior)`.
    """

    node_xy: Float64[np.ndarray, "nodes 2"]
    node_kind: Int64[np.ndarray, " nodes"]
    on_plan: Bool[np.ndarray, " nodes"]
    edges: Int64[np.ndarray, "edges 2"]
    kept: KeptWay
    behaviors: Int64[np.ndarray, " points"]

    @staticmethod
    def of(topological_map: TopologicalMap, plan: Plan) -> "MapArrays":
        """The arrays of a map and a plan on it."""
        index = topological_map.node_index
        order = list(Behavior)
        kept = kept_way(topological_map, plan)
        due = [order.index(behavior) for behavior in plan.behaviors(topological_map)] or [0]
        return MapArrays(
            np.array([[node.x_m, node.y_m] for node in topological_map.nodes], dtype=float),
            np.array([_KIND[node.kind] for node in topological_map.nodes], dtype=np.int64),
            np.array([node.id in plan for node in topological_map.nodes], dtype=bool),
            np.array(
                [[index[edge.source], index[edge.target]] for edge in topological_map.edges],
                dtype=np.int64,
            ).reshape(-1, 2),
            kept,
            np.array(due, dtype=np.int64)[kept.edge],
        )

    def way(
        self, node_xy: Float[np.ndarray, "nodes 2"] | None = None
    ) -> tuple[Float64[np.ndarray, "points 2"], Float64[np.ndarray, " points"]]:
        """The line along the plan, and the metres along it at each of its points."""
        points = kernels.way_points(
            self.node_xy if node_xy is None else node_xy,
            self.kept.ends,
            self.kept.share,
            self.kept.shift_m,
        )
        return points, kernels.arc_lengths(points)

    def stops_m(self) -> Float64[np.ndarray, " stops"]:
        """Metres along the line at each of the plan's nodes."""
        _, arc = self.way()
        return np.asarray(arc[self.kept.stop])

    def draw(
        self,
        pose: Float[np.ndarray, " 3"],
        progress_m: float,
        cell_m: float,
        out: Float32[np.ndarray, "channels forward left"],
        node_xy: Float[np.ndarray, "nodes 2"] | None = None,
    ) -> None:
        """Draw the map around a pose (x, y, yaw): rows go forward, columns to the left.

        Args:
            pose: Where the robot takes itself to be.
            progress_m: Metres of the plan behind it.
            cell_m: Side of a pixel.
            out: The picture.
            node_xy: Positions other than the map's own, as when training shakes them.
        """
        positions = self.node_xy if node_xy is None else node_xy
        points, arc = self.way(positions)
        kernels.draw_map(
            positions,
            self.node_kind,
            self.on_plan,
            self.edges,
            points,
            arc,
            progress_m,
            pose,
            cell_m,
            out,
        )

    def progress_m(self, x_m: float, y_m: float, low_m: float, high_m: float) -> float:
        """Metres of the plan that lie behind a position, sought between two such lengths."""
        points, arc = self.way()
        return float(kernels.progress_on(points, arc, x_m, y_m, low_m, high_m))

    def plan_features(
        self, pose: Float[np.ndarray, " 3"], progress_m: float
    ) -> Float32[np.ndarray, " features"]:
        """Points of the plan ahead in the robot's frame, what is left, and the behaviours."""
        points, arc = self.way()
        out = np.zeros(PLAN_FEATURES, np.float32)
        kernels.path_features(
            points, arc, self.behaviors, progress_m, pose, _AHEAD, len(Behavior), out
        )
        return out
