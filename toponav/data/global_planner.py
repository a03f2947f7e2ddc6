"""The expert's global planner: cost to go over (x, y, heading), and smooth paths down it.

The plan's protocol truth enters the costs: where a node off the plan would be the robot's true
node, passing is dear, so a path keeps to where the plan's own nodes are nearest.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int32
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data import path_kernels as paths
from toponav.data import planning_kernels as kernels
from toponav.data.truth_table import TruthTable
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["CostToGo", "GlobalPlanner", "PlannerCosts"]

_UNITS_PER_CELL = 20
_CELL_M = 0.1
_NARROW_M = 2.0


@dataclass(frozen=True)
class PlannerCosts:
    """What the global planner avoids, as multiples of the cost of free driving."""

    hard_m: float = 0.20
    """Robot centres nearer than this to an obstacle are forbidden where a way exists without."""
    least_m: float = 0.185
    """Robot centres nearer than this are always forbidden."""
    tight_m: float = 0.30
    """Nearer than this is dear."""
    tight_cost: float = 10.0
    """Extra cost at `hard_m`, falling to none at `tight_m`."""
    comfort_m: float = 1.2
    """Farther than this is all the same."""
    comfort_cost: float = 1.5
    """Extra cost at no clearance, falling to none at `comfort_m`."""
    off_plan_cost: float = 12.0
    """Extra cost where the true node would not be on the plan."""
    line_m: float = 0.25
    """Distance from the plan's edges that costs nothing."""
    line_cost: float = 0.8
    """Extra cost per metre farther."""
    turn_cost: float = 0.6
    """Cost of turning by one lattice heading while driving, in cells."""
    pivot_cost: float = 3.0
    """Cost of turning by one lattice heading on the spot, in cells."""


@dataclass(frozen=True, eq=False)
class CostToGo:
    """Cost to the goal of one plan from every (cell, heading) near the plan.

    Attributes:
        value: Least cost, in integer units; huge where there is no way.
        cell_id: Row of `cells` per cell of the planning grid, -1 where it does not reach.
        cells: (row, col) of each cell.
        goal: Which (cell, heading) are the goal.
        weight: Cost of driving through each cell.
        off_plan: How far off the plan each (cell, heading) is, 0 to 1.
        reach_m: How far from the plan's edges it covers.
    """

    value: Int32[np.ndarray, " states"]
    cell_id: Int32[np.ndarray, "rows cols"]
    cells: Int32[np.ndarray, "cells 2"]
    goal: Bool[np.ndarray, "cells headings"]
    weight: Float[np.ndarray, " cells"]
    off_plan: Float[np.ndarray, "cells headings"]
    reach_m: float


class GlobalPlanner:
    """Plans paths for the plans of one map in one scene.

    Args:
        scene: The building.
        topological_map: The map whose plans are driven.
        costs: What to avoid.
    """

    def __init__(
        self, scene: Scene, topological_map: TopologicalMap, costs: PlannerCosts | None = None
    ) -> None:
        self.scene = scene
        self.map = topological_map
        self.costs = costs or PlannerCosts()
        self.resolution_m = float(scene.grid.resolution_m)
        self._origin = np.array(scene.grid.origin_m, dtype=float)
        space = FreeSpace.of(scene, self.costs.least_m)
        self.clearance_m = np.ascontiguousarray(space.clearance_m)
        self._rows = int(scene.grid.rows * self.resolution_m / _CELL_M)
        self._cols = int(scene.grid.cols * self.resolution_m / _CELL_M)
        self._clear = self._clearance_of_cells(space)

    @cached_property
    def _truth(self) -> TruthTable:
        reachable = self._clear >= self.costs.least_m
        return TruthTable.of(self.scene, self.map, reachable, _CELL_M)

    def cost_to_go(self, plan: Plan, reach_m: float = 2.0) -> CostToGo:
        """The cost to the plan's goal from everywhere within `reach_m` of its edges.

        Rooms that the plan does not visit are left out unless it looks farther than 2 m.
        """
        truth = self._truth
        on_plan = truth.on_plan(self.map, plan)
        segments = self._segments(plan)
        away = kernels.distance_to_segments(self._rows, self._cols, _CELL_M, segments, reach_m)
        usable = np.isfinite(away) & (truth.row_of >= 0)
        if reach_m <= _NARROW_M:
            usable &= ~truth.in_other_room(on_plan)
        cells = np.argwhere(usable).astype(np.int32)
        cell_id = np.full(usable.shape, -1, dtype=np.int32)
        cell_id[usable] = np.arange(len(cells), dtype=np.int32)
        weight = self._weights(self._clear[usable], away[usable])
        rows = truth.row_of[usable]
        off = kernels.off_plan_fraction(truth.node, rows, on_plan)
        goal = self._goal_states(plan, cells, truth.node[rows][:, :: kernels.BINS_PER_HEADING])
        return self._solved(cell_id, cells, goal, weight, off, reach_m)

    def avoiding(
        self, field: CostToGo, poses: Float[np.ndarray, "poses 3"], extra: float
    ) -> CostToGo:
        """The cost to go where passing near these poses (x, y, yaw) is dearer by `extra`."""
        off = field.off_plan.copy()
        kernels.raise_near(off, field.cell_id, poses, _CELL_M, 0.2, extra)
        return self._solved(
            field.cell_id, field.cells, field.goal, field.weight, off, field.reach_m
        )

    def _solved(
        self,
        cell_id: np.ndarray,
        cells: np.ndarray,
        goal: np.ndarray,
        weight: np.ndarray,
        off: np.ndarray,
        reach_m: float,
    ) -> CostToGo:
        value = kernels.cost_to_go(
            cell_id, cells, weight, off, goal, self.costs.off_plan_cost, self.costs.turn_cost,
            self.costs.pivot_cost, _UNITS_PER_CELL,
        )  # fmt: skip
        return CostToGo(value, cell_id, cells, goal, weight, off, reach_m)

    def path(
        self, field: CostToGo, pose: Pose2
    ) -> tuple[Float[np.ndarray, "points 2"], float] | None:
        """A smooth path from the pose to the goal, 5 cm a point, and the heading at its end.

        Positions are relative to the scene grid's corner. None where there is no way.
        """
        start = self._nearest_state(field, pose)
        if start is None:
            return None
        states = kernels.descend(
            field.value, field.cell_id, field.cells, field.weight, field.off_plan, start,
            self.costs.off_plan_cost, self.costs.turn_cost, self.costs.pivot_cost, _UNITS_PER_CELL,
        )  # fmt: skip
        if len(states) == 0:
            return None
        final_yaw = float(states[-1] % kernels.HEADINGS) * 2 * math.pi / kernels.HEADINGS
        cells = field.cells[states // kernels.HEADINGS]
        points = (cells[:, ::-1] + 0.5) * _CELL_M
        points = points[np.r_[True, np.any(np.diff(points, axis=0) != 0, axis=1)]]
        points = np.concatenate([self.local_xy(pose)[None], points[1:]])
        points = paths.smooth(
            paths.resample(points, 0.1),
            self.clearance_m, self.resolution_m, 150, 0.45, 0.015, 0.15, 0.4, 0.2,
        )  # fmt: skip
        return paths.resample(points, 0.05), final_yaw

    def local_xy(self, pose: Pose2) -> Float[np.ndarray, "2"]:
        """The position relative to the scene grid's corner."""
        local: np.ndarray = np.array([pose.x_m, pose.y_m]) - self._origin
        return local

    def _segments(self, plan: Plan) -> np.ndarray:
        """Ends of the plan's edges, (x, y, x, y) from the grid's corner."""
        spots = np.array([(self.map.node(n).x_m, self.map.node(n).y_m) for n in plan.nodes])
        spots = spots - self._origin
        ends = spots[1:] if len(spots) > 1 else spots
        return np.ascontiguousarray(np.concatenate([spots[: len(ends)], ends], axis=1))

    def _weights(self, clear: np.ndarray, away: np.ndarray) -> np.ndarray:
        costs = self.costs
        tight = np.clip((costs.tight_m - clear) / (costs.tight_m - costs.hard_m), 0, None)
        comfort = np.clip((costs.comfort_m - clear) / costs.comfort_m, 0, None)
        weight = 1 + costs.comfort_cost * comfort**2 + costs.tight_cost * tight**2
        weight += np.where(clear < costs.hard_m, 20.0, 0.0)
        weight += costs.line_cost * np.clip(away - costs.line_m, 0, None)
        return weight.astype(np.float64)

    def _clearance_of_cells(self, space: FreeSpace) -> Float[np.ndarray, "rows cols"]:
        """Clearance at the middle of each planning cell; none outdoors."""
        middles = (np.mgrid[0 : self._rows, 0 : self._cols] + 0.5) * _CELL_M / self.resolution_m
        clear = ndimage.map_coordinates(self.clearance_m, middles - 0.5, order=1, mode="nearest")
        row, col = np.minimum(middles.astype(int), np.array(space.free.shape)[:, None, None] - 1)
        clear[~ndimage.binary_dilation(space.free, iterations=2)[row, col]] = 0.0
        return np.asarray(clear, dtype=float)

    def _goal_states(
        self, plan: Plan, cells: np.ndarray, truth: np.ndarray
    ) -> Bool[np.ndarray, "cells headings"]:
        """States about the goal node: where it is the true node, nearest to it."""
        node = self.map.node(plan.nodes[-1])
        is_goal = truth == self.map.node_index[node.id]
        x = (cells[:, 1] + 0.5) * _CELL_M + self._origin[0] - node.x_m
        y = (cells[:, 0] + 0.5) * _CELL_M + self._origin[1] - node.y_m
        distance = np.hypot(x, y)
        candidates = is_goal.any(axis=1)
        if not candidates.any():
            raise InputError(
                "the goal must have free floor about it where it is the robot's true node",
                where=f"map {self.map.name}, node {node.id}",
                remedy="move the node to free floor inside its room, or choose another goal",
            )
        clear = self._clear[cells[:, 0], cells[:, 1]]
        penalty = distance + np.clip(0.3 - clear, 0, None) * 10
        near = penalty <= penalty[candidates].min() + 0.15
        return np.asarray(is_goal & near[:, None])

    def _nearest_state(self, field: CostToGo, pose: Pose2) -> int | None:
        """The state at or near the pose that reaches the goal, by distance then heading."""
        x, y = pose.x_m - self._origin[0], pose.y_m - self._origin[1]
        turn = 2 * math.pi / kernels.HEADINGS
        heading = round(pose.yaw_rad / turn) % kernels.HEADINGS
        row, col = int(y / _CELL_M), int(x / _CELL_M)
        own = paths.sample_bilinear(self.clearance_m, self.resolution_m, x, y)
        floor = min(own, self.costs.least_m) - 0.02
        best = None
        for radius in (1, 3, 6):
            low_row, low_col = max(0, row - radius), max(0, col - radius)
            patch = field.cell_id[low_row : row + radius + 1, low_col : col + radius + 1]
            found = np.argwhere(patch >= 0)
            for dr, dc in found:
                state = int(patch[dr, dc]) * kernels.HEADINGS + heading
                if field.value[state] >= 1 << 30:
                    continue
                to_x, to_y = (low_col + dc + 0.5) * _CELL_M, (low_row + dr + 0.5) * _CELL_M
                away = math.hypot(to_x - x, to_y - y)
                if best is not None and away >= best[0]:
                    continue
                between = paths.chord_clearance(
                    self.clearance_m, self.resolution_m, x, y, to_x, to_y
                )
                if between >= floor:
                    best = (away, state)
            if best is not None:
                return best[1]
        return None
