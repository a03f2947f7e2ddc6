"""Openings between the rooms of a building: where the floor of one meets that of another."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int32
from scipy import ndimage
from skimage.segmentation import watershed

from toponav.worlds.free_space import indoors
from toponav.worlds.scene import Scene

__all__ = ["Opening", "find_openings", "grown_rooms"]

_CLEAR_M = 0.5
"""Narrower gaps are holes in walls, or slits that no robot fits through."""
_SEED_DEPTH_M = 0.15
_JOIN_M = 0.15
"""Pieces of one boundary with a gap up to this (a post, a spot of noise) are one opening."""
_KNOWN_DOOR_M = 1.0
_DOORWAY_M = 2.0
_WIDE_M = 1.0


@dataclass(frozen=True)
class Opening:
    """A gap through which a robot gets from one room into another."""

    rooms: tuple[int, int]
    """Indices of the rooms on either side."""
    x_m: float
    """Centre, along x."""
    y_m: float
    """Centre, along y."""
    heading_rad: float
    """Heading with which a robot gets from the first room into the second."""
    width_m: float
    """Clear width."""

    def reversed(self) -> "Opening":
        """The same gap, seen from the other side."""
        first, second = self.rooms
        return replace(self, rooms=(second, first), heading_rad=self.heading_rad + math.pi)


def find_openings(
    scene: Scene, territory: Int32[np.ndarray, "rows cols"] | None = None
) -> list[Opening]:
    """Every opening that is at least half a metre wide, by rooms and place.

    Args:
        scene: The building, with rooms.
        territory: What `grown_rooms` gave, if it was asked before.
    """
    if territory is None:
        territory = grown_rooms(scene)
    found: list[Opening] = []
    for rooms, points, towards in _boundaries(territory):
        for piece in _pieces(points, _JOIN_M / scene.grid.resolution_m + 1.0):
            opening = _opening(scene, rooms, points[piece], towards[piece])
            if opening.width_m >= _CLEAR_M:
                found.append(opening)
    found = _one_per_doorway(found)
    return [_at_known_door(scene, opening) for opening in found]


def _one_per_doorway(openings: list[Opening]) -> list[Opening]:
    """The openings without the narrower of two side by side: holes in a scan, glass, a post."""
    kept: list[Opening] = []
    for opening in sorted(openings, key=lambda one: -one.width_m):
        beside = any(
            other.rooms == opening.rooms
            and math.hypot(other.x_m - opening.x_m, other.y_m - opening.y_m) < _DOORWAY_M
            for other in kept
        )
        if not beside or opening.width_m >= _WIDE_M:
            kept.append(opening)
    return sorted(kept, key=lambda one: (one.rooms, one.x_m, one.y_m))


def grown_rooms(scene: Scene) -> Int32[np.ndarray, "rows cols"]:
    """The room of each free cell indoors, from 1; 0 elsewhere. Rooms meet at narrow places.

    Rooms grow from well inside over the floor that is nobody's, deep floor first, so that two
    of them meet in the doorway between them.
    """
    cell_m = scene.grid.resolution_m
    free = ~scene.occupied & indoors(scene.room_index, cell_m)
    depth = ndimage.distance_transform_edt(np.pad(~scene.occupied, 1))[1:-1, 1:-1]
    labels = np.where(free, scene.room_index.astype(np.int32) + 1, 0)
    seeds = _deep_inside(labels, _SEED_DEPTH_M / cell_m)
    grown: np.ndarray = watershed(  # type: ignore[no-untyped-call]
        -depth, seeds, mask=free, connectivity=1
    )
    return grown.astype(np.int32)


def _deep_inside(
    labels: Int32[np.ndarray, "rows cols"], depth_cells: float
) -> Int32[np.ndarray, "rows cols"]:
    """The cells of each room farther than this from any other label; all where none is."""
    seeds = np.zeros_like(labels)
    for number, box in enumerate(ndimage.find_objects(labels), start=1):
        if box is None:
            continue
        inside = np.pad(labels[box] == number, 1)
        depth = ndimage.distance_transform_edt(inside)[1:-1, 1:-1]
        inner = depth > min(depth_cells, depth.max() - 1e-6)
        seeds[box][inner] = number
    return seeds


def _boundaries(
    territory: Int32[np.ndarray, "rows cols"],
) -> Iterator[
    tuple[tuple[int, int], Float[np.ndarray, "points 2"], Float[np.ndarray, "points 2"]]
]:
    """Points (col, row) between cells of two rooms, and the way from the first to the second."""
    found: dict[tuple[int, int], list[np.ndarray]] = {}
    for step_row, step_col in ((0, 1), (1, 0)):
        here = territory[: territory.shape[0] - step_row, : territory.shape[1] - step_col]
        there = territory[step_row:, step_col:]
        meet = np.argwhere((here != there) & (here > 0) & (there > 0))
        first, second = here[tuple(meet.T)], there[tuple(meet.T)]
        sign = np.where(first < second, 1.0, -1.0)
        points = np.column_stack(
            [
                np.minimum(first, second) - 1,
                np.maximum(first, second) - 1,
                meet[:, 1] + 0.5 + 0.5 * step_col,
                meet[:, 0] + 0.5 + 0.5 * step_row,
                sign * step_col,
                sign * step_row,
            ]
        )
        for pair in np.unique(points[:, :2], axis=0):
            mine = (points[:, :2] == pair).all(axis=1)
            found.setdefault((int(pair[0]), int(pair[1])), []).append(points[mine, 2:])
    for rooms in sorted(found):
        both = np.concatenate(found[rooms])
        yield rooms, both[:, :2], both[:, 2:]


def _pieces(
    points: Float[np.ndarray, "points 2"], reach_cells: float
) -> list[Bool[np.ndarray, " points"]]:
    """Masks of the groups of points that hang together, the lowest and leftmost first."""
    low = points.min(axis=0)
    cells = np.floor(points - low).astype(np.int64)
    canvas = np.zeros(cells.max(axis=0) + 1, bool)
    canvas[tuple(cells.T)] = True
    steps = max(1, round(reach_cells / 2))
    wide = ndimage.binary_dilation(np.pad(canvas, steps), np.ones((3, 3)), iterations=steps)
    labels, count = ndimage.label(wide, np.ones((3, 3)))
    own = labels[tuple((cells + steps).T)]
    return [own == number for number in range(1, count + 1)]


def _opening(
    scene: Scene,
    rooms: tuple[int, int],
    points: Float[np.ndarray, "points 2"],
    towards: Float[np.ndarray, "points 2"],
) -> Opening:
    """The opening at one piece of boundary."""
    cell_m = scene.grid.resolution_m
    center = points.mean(axis=0)
    normal = towards.sum(axis=0)
    normal = normal / max(float(np.hypot(*normal)), 1e-9)
    along = (points - center) @ np.array([-normal[1], normal[0]])
    width_cells = float(np.ptp(along))
    middle = center + np.array([-normal[1], normal[0]]) * (along.max() + along.min()) / 2
    return Opening(
        rooms,
        scene.grid.origin_m[0] + float(middle[0]) * cell_m,
        scene.grid.origin_m[1] + float(middle[1]) * cell_m,
        math.atan2(float(normal[1]), float(normal[0])),
        width_cells * cell_m,
    )


def _at_known_door(scene: Scene, opening: Opening) -> Opening:
    """The opening moved to the door of the scene that it is at, if any."""
    names = {scene.rooms[number].name for number in opening.rooms}
    best, best_m = opening, _KNOWN_DOOR_M
    for door in scene.doors:
        if set(door.rooms) != names:
            continue
        (ax, ay), (bx, by) = door.segment_m.tolist()
        x_m, y_m = (ax + bx) / 2, (ay + by) / 2
        away_m = math.hypot(x_m - opening.x_m, y_m - opening.y_m)
        if away_m < best_m:
            heading = math.atan2(bx - ax, -(by - ay))
            if math.cos(heading - opening.heading_rad) < 0:
                heading += math.pi
            best_m = away_m
            best = replace(opening, x_m=x_m, y_m=y_m, heading_rad=heading)
    return best
