"""The protocol's true node for every planning cell and heading, looked up instead of computed."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16, Int32

from toponav.data import planning_kernels as kernels
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.sim.oracle import ALIGNMENT_RAD
from toponav.worlds.scene import Scene

__all__ = ["TruthTable"]


@dataclass(frozen=True, eq=False)
class TruthTable:
    """What `TruthLocalizer.node_at` says at the middle of each cell that a robot can reach.

    Attributes:
        row_of: Row of the table per planning cell, -1 where no robot can be.
        node: Index of the true node by row and heading bin, -1 where there is none.
        room: Number of the enclosed room of each row, negative outside.
        node_room: Number of each node's room, -1 where it has none.
    """

    row_of: Int32[np.ndarray, "rows cols"]
    node: Int16[np.ndarray, "reachable bins"]
    room: Int32[np.ndarray, " reachable"]
    node_room: Int32[np.ndarray, " nodes"]

    @staticmethod
    def of(
        scene: Scene,
        topological_map: TopologicalMap,
        reachable: Bool[np.ndarray, "rows cols"],
        cell_m: float,
    ) -> "TruthTable":
        """The table of the reachable cells of a planning grid.

        Args:
            scene: The building.
            topological_map: Its map.
            reachable: Which cells, from the lower-left corner of the scene's grid.
            cell_m: Side of a planning cell.
        """
        nodes = topological_map.nodes
        numbers = {room.name: number for number, room in enumerate(scene.rooms)}
        node_room = np.array([numbers.get(node.room or "", -1) for node in nodes], np.int32)
        row_of = np.full(reachable.shape, -1, dtype=np.int32)
        row_of[reachable] = np.arange(np.count_nonzero(reachable), dtype=np.int32)
        xy = (np.argwhere(reachable)[:, ::-1] + 0.5) * cell_m
        room = _enclosed_room(scene, xy)
        table = np.empty((len(xy), kernels.BINS), dtype=np.int16)
        kernels.truth_by_heading(
            xy,
            room,
            topological_map.positions_m - np.array(scene.grid.origin_m),
            np.array([node.size for node in nodes], dtype=np.float64),
            node_room,
            _aligned(topological_map),
            table,
        )
        return TruthTable(row_of, table, room, node_room)

    def on_plan(self, topological_map: TopologicalMap, plan: Plan) -> Bool[np.ndarray, " nodes"]:
        """Which of the map's nodes are the plan's."""
        on_plan = np.zeros(len(self.node_room), dtype=bool)
        on_plan[[topological_map.node_index[node] for node in plan.nodes]] = True
        return on_plan

    def in_other_room(self, on_plan: Bool[np.ndarray, " nodes"]) -> Bool[np.ndarray, "rows cols"]:
        """Cells in enclosed rooms that no node of the plan is in."""
        visited = self.node_room[on_plan]
        foreign = (self.room >= 0) & ~np.isin(self.room, visited)
        found: np.ndarray = foreign[self.row_of] & (self.row_of >= 0)
        return found


def _enclosed_room(scene: Scene, xy: Float[np.ndarray, "cells 2"]) -> Int32[np.ndarray, " cells"]:
    """The enclosed room at each point; -1 in passages, `NOWHERE` where a scene has no room."""
    if not scene.rooms:
        return np.full(len(xy), -1, dtype=np.int32)
    enclosed = np.array([room.kind.is_enclosed for room in scene.rooms])
    cells = (xy / scene.grid.resolution_m).astype(int)
    room = scene.room_index[cells[:, 1], cells[:, 0]]  # -1 takes the last number
    numbers = np.append(np.where(enclosed, np.arange(len(enclosed)), -1), kernels.NOWHERE)
    found: np.ndarray = numbers[room].astype(np.int32)
    return found


def _aligned(topological_map: TopologicalMap) -> Bool[np.ndarray, "nodes bins"]:
    """Whether an edge at each node is along each heading bin, as the protocol has it."""
    bins = np.arange(kernels.BINS) * (2 * math.pi / kernels.BINS)
    aligned = np.zeros((len(topological_map.nodes), kernels.BINS), dtype=bool)
    for edge in topological_map.edges:
        along = np.cos(bins - edge.yaw_rad) > math.cos(ALIGNMENT_RAD)
        aligned[topological_map.node_index[edge.source]] |= along
        aligned[topological_map.node_index[edge.target]] |= along
    return aligned
