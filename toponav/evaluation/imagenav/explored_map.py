"""A topological map from what a robot saw: rooms, doors and behaviours out of its occupancy."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.maps.construct import map_from_scene
from toponav.maps.spec import TopologicalMap
from toponav.navigation.nts.local_map import LocalMap
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Scene, scene_from_heights

__all__ = ["map_of_floor", "seen_floor", "with_rooms_of"]

_WALL_M = 2.7
_CELL_M = 0.05
_SPECK_M2 = 0.02
"""What is occupied on less than this, with floor all around, is noise."""
_SHADOW_M2 = 0.6
"""Unseen floor of less than this, with seen floor around, is floor behind something low."""
_MARGIN_M = 0.5


def seen_floor(seen: LocalMap, start: Pose2, name: str) -> Scene:
    """The floor plan that a robot saw, with the building's axes: what was not seen is solid.

    Args:
        seen: Its occupancy, in the frame of its start.
        start: Where that frame lies in the building's.
        name: Name of the building.
    """
    known = np.argwhere(seen.evidence < 0)
    if not len(known):
        raise InputError(
            "the robot saw no floor", where=f"exploring {name}", remedy="let it take more steps"
        )
    corners = [seen.center_of(*cell) for cell in known.tolist()]
    cos, sin = np.cos(start.yaw_rad), np.sin(start.yaw_rad)
    turned = np.array(corners) @ np.array([[cos, sin], [-sin, cos]]) + [start.x_m, start.y_m]
    low, high = turned.min(axis=0) - _MARGIN_M, turned.max(axis=0) + _MARGIN_M
    origin = np.floor(low / _CELL_M) * _CELL_M
    cols, rows = np.ceil((high - origin) / _CELL_M).astype(int).tolist()
    grid = GridFrame(_CELL_M, (float(origin[0]), float(origin[1])), rows, cols)
    evidence = _turned(seen, start, grid)
    occupied = evidence > 0
    floor = evidence < 0
    floor |= _small(occupied, _SPECK_M2) | _small(evidence == 0, _SHADOW_M2)
    floor = _largest(floor)
    return scene_from_heights(name, grid, np.where(floor, 0.0, _WALL_M), ceiling_m=_WALL_M)


def map_of_floor(floor: Scene) -> tuple[TopologicalMap, Scene]:
    """The topological map of a floor plan, and the plan with the rooms that the map names.

    Raises:
        InputError: Where the floor falls into no rooms.
    """
    from toponav.maps._segmented import with_rooms

    roomed = with_rooms(floor)
    return map_from_scene(roomed), roomed


def with_rooms_of(building: Scene, plan: Scene) -> Scene:
    """A building with the rooms of a plan of it, under the plan's names.

    What drives on the plan's map is judged in them: the map knows no other names.
    """
    rows, cols = np.mgrid[: building.grid.rows, : building.grid.cols]
    cell_m = building.grid.resolution_m
    x_m = building.grid.origin_m[0] + (cols + 0.5) * cell_m
    y_m = building.grid.origin_m[1] + (rows + 0.5) * cell_m
    index = _at(plan.room_index, plan.grid, x_m, y_m, -1)
    return replace(building, rooms=plan.rooms, room_index=index, doors=(), layout=None)


def _turned(seen: LocalMap, start: Pose2, grid: GridFrame) -> Int16[np.ndarray, "rows cols"]:
    """The evidence on a grid with the building's axes."""
    rows, cols = np.mgrid[: grid.rows, : grid.cols]
    x_m = grid.origin_m[0] + (cols + 0.5) * grid.resolution_m - start.x_m
    y_m = grid.origin_m[1] + (rows + 0.5) * grid.resolution_m - start.y_m
    cos, sin = np.cos(start.yaw_rad), np.sin(start.yaw_rad)
    side = len(seen.evidence)
    half_m = side * seen.config.cell_m / 2
    own = GridFrame(seen.config.cell_m, (-half_m, -half_m), side, side)
    return _at(seen.evidence, own, x_m * cos + y_m * sin, y_m * cos - x_m * sin, 0)


def _at(
    values: np.ndarray, grid: GridFrame, x_m: np.ndarray, y_m: np.ndarray, outside: int
) -> Int16[np.ndarray, "rows cols"]:
    """The value of the cell at each point."""
    row = np.floor((y_m - grid.origin_m[1]) / grid.resolution_m).astype(int)
    col = np.floor((x_m - grid.origin_m[0]) / grid.resolution_m).astype(int)
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    found = np.full(row.shape, outside, np.int16)
    found[inside] = values[row[inside], col[inside]]
    return found


def _small(cells: Bool[np.ndarray, "rows cols"], area_m2: float) -> Bool[np.ndarray, "rows cols"]:
    """Those cells that hang together in pieces of less than an area."""
    pieces, count = ndimage.label(cells, np.ones((3, 3)))
    sizes = np.bincount(pieces.ravel(), minlength=count + 1) * _CELL_M**2
    small: np.ndarray = (sizes < area_m2)[pieces] & cells
    return small


def _largest(cells: Bool[np.ndarray, "rows cols"]) -> Bool[np.ndarray, "rows cols"]:
    """The largest piece."""
    pieces, count = ndimage.label(cells)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    largest: np.ndarray = pieces == int(sizes.argmax())
    return largest
