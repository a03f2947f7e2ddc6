"""Ways across open spaces, from one opening to another."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Int32

from toponav.core.geometry import angle_difference
from toponav.maps._centerlines import Lines
from toponav.maps._corridor import Corridor
from toponav.maps._openings import Opening
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["Gate", "cross_open_spaces"]

_COMFORT_M = 0.6
_SNAP_M = 0.8
_ACROSS_M = 6.0
_SAME_SIDE_RAD = math.radians(60.0)
_OPPOSITE_RAD = math.radians(45.0)


@dataclass(frozen=True)
class Gate:
    """Where a way across an open space leaves a hallway."""

    x_m: float
    """The point on the hallway's centre line, along x."""
    y_m: float
    """The same along y."""
    heading_rad: float
    """Heading from the hallway into the open space."""
    right_m: float
    """How far the gap reaches to the right of that heading."""
    left_m: float
    """How far it reaches to the left."""
    is_beside: bool
    """Whether the hallway goes on past it, with several doors opposite, as if it were a wall."""

    def faces(self, door: Opening) -> bool:
        """Whether a robot that comes out of a door has the gap about ahead."""
        left_m = self.aside_m(door)
        return left_m is not None and -self.right_m <= left_m <= self.left_m

    def aside_m(self, door: Opening) -> float | None:
        """How far left of the gap's axis a door opposite lies, None for doors elsewhere."""
        if abs(angle_difference(door.heading_rad, self.heading_rad)) < math.pi - _OPPOSITE_RAD:
            return None
        x_m, y_m = door.x_m - self.x_m, door.y_m - self.y_m
        ahead_m = x_m * math.cos(self.heading_rad) + y_m * math.sin(self.heading_rad)
        left_m = y_m * math.cos(self.heading_rad) - x_m * math.sin(self.heading_rad)
        return left_m if -_ACROSS_M < ahead_m < 0 else None


def cross_open_spaces(
    scene: Scene,
    lines: Lines,
    territory: Int32[np.ndarray, "rows cols"],
    openings: list[Opening],
    open_rooms: set[int],
    passage_rooms: set[int],
    doors: list[Opening],
) -> dict[int, Gate]:
    """Adds ways across open spaces: from opening to opening, or to and from the middle.

    Returns:
        The gates by their point on a hallway.
    """
    gates: dict[int, Gate] = {}
    if not open_rooms:
        return gates
    free = FreeSpace.of(scene, 0.2)
    anchors: dict[int, int] = {}
    chosen: dict[int, list[Opening]] = {
        room: _one_per_neighbour(room, openings, passage_rooms) for room in sorted(open_rooms)
    }
    for room, own in chosen.items():
        if not own:
            continue
        places = _crossing_points(scene, free, territory, room, own)
        ends = []
        for opening, (x_m, y_m) in zip(own, places, strict=True):
            key = id(opening)
            if key not in anchors:
                other = opening.rooms[0] if opening.rooms[1] == room else opening.rooms[1]
                point = lines.add(x_m, y_m)
                if other not in open_rooms:
                    outward = opening if opening.rooms[1] == room else opening.reversed()
                    _attach(lines, point, outward, doors, gates)
                anchors[key] = point
            ends.append(anchors[key])
        if len(ends) == 2:
            lines.pieces.append((ends[0], ends[1]))
        else:
            middle = lines.add(*_middle(scene, free, territory, room, places))
            lines.pieces += [(end, middle) for end in ends]
    return gates


def _one_per_neighbour(
    room: int, openings: list[Opening], passage_rooms: set[int]
) -> list[Opening]:
    """The widest opening on each side to each neighbouring passage."""
    own = [o for o in openings if room in o.rooms and set(o.rooms) <= passage_rooms]
    kept: list[Opening] = []
    for opening in sorted(own, key=lambda one: -one.width_m):
        beside = any(
            other.rooms == opening.rooms
            and abs(angle_difference(other.heading_rad, opening.heading_rad)) < _SAME_SIDE_RAD
            for other in kept
        )
        if not beside:
            kept.append(opening)
    return sorted(kept, key=lambda one: (one.rooms, one.x_m, one.y_m))


def _crossing_points(
    scene: Scene,
    free: FreeSpace,
    territory: Int32[np.ndarray, "rows cols"],
    room: int,
    openings: list[Opening],
) -> list[tuple[float, float]]:
    """Where a robot that crosses the open space passes each opening."""
    middles = [(opening.x_m, opening.y_m) for opening in openings]
    if len(openings) != 2:
        return middles
    cells = [_gap_cells(scene, free, opening) for opening in openings]
    if not all(len(own) for own in cells):
        return middles
    narrow = np.maximum(_COMFORT_M - free.clearance_m, 0.0) / _COMFORT_M
    weight = (1.0 + 8.0 * narrow).astype(np.float32)
    weight[~free.free] = 1.0
    found = []
    for own, other in (cells, cells[::-1]):
        away_m = free.geodesic_from_cells_m(other.astype(np.int32), weight)
        costs = away_m[own[:, 0], own[:, 1]]
        if not np.isfinite(costs).any():
            return middles
        row, col = own[int(np.argmin(costs))]
        found.append(scene.grid.center_of(int(row), int(col)))
    return found


def _gap_cells(scene: Scene, free: FreeSpace, opening: Opening) -> Int32[np.ndarray, "cells 2"]:
    """Free cells (row, col) across an opening."""
    cell_m = scene.grid.resolution_m
    across = np.arange(-opening.width_m / 2, opening.width_m / 2 + cell_m / 2, cell_m)
    x_m = opening.x_m - across * math.sin(opening.heading_rad)
    y_m = opening.y_m + across * math.cos(opening.heading_rad)
    cells = np.array(
        [scene.grid.cell_of(float(x), float(y)) for x, y in zip(x_m, y_m, strict=True)]
    )
    inside = (cells >= 0).all(axis=1) & (cells < scene.grid.shape).all(axis=1)
    cells = cells[inside]
    return np.asarray(cells[free.free[cells[:, 0], cells[:, 1]]], dtype=np.int32)


def _middle(
    scene: Scene,
    free: FreeSpace,
    territory: Int32[np.ndarray, "rows cols"],
    room: int,
    places: list[tuple[float, float]],
) -> tuple[float, float]:
    """A point with space around it in the middle of an open space."""
    inside = np.where(territory == room + 1, free.clearance_m, 0.0)
    cells = np.argwhere(inside >= min(0.8, 0.9 * float(inside.max())))
    centers = np.array([scene.grid.center_of(int(row), int(col)) for row, col in cells])
    wanted = (centers if len(places) == 1 else np.array(places)).mean(axis=0)
    best = int(np.hypot(*(centers - wanted).T).argmin())
    return float(centers[best, 0]), float(centers[best, 1])


def _attach(
    lines: Lines,
    point: int,
    gap: Opening,
    doors: list[Opening],
    gates: dict[int, Gate],
) -> None:
    """Joins a point to the nearest place on the lines that were there before it."""
    x_m, y_m = lines.points[point]
    best, best_m = None, math.inf
    for number, (start, end) in enumerate(lines.pieces):
        corridor = Corridor(start, end, np.array([lines.points[start], lines.points[end]]))
        along_m, aside_m = corridor.nearest(x_m, y_m)
        if aside_m < best_m:
            best, best_m = (number, along_m, corridor), aside_m
    if best is None:
        others = [n for n in range(len(lines.points)) if n != point]
        if others:
            nearest = min(others, key=lambda n: math.dist(lines.points[n], (x_m, y_m)))
            lines.pieces.append((nearest, point))
        return
    number, along_m, corridor = best
    snap_m = {
        end: 0.05 if sum(end in piece for piece in lines.pieces) == 2 else _SNAP_M
        for end in (corridor.start, corridor.end)
    }
    if along_m < snap_m[corridor.start]:
        lines.pieces.append((corridor.start, point))
    elif corridor.length_m - along_m < snap_m[corridor.end]:
        lines.pieces.append((corridor.end, point))
    else:
        at_x_m, at_y_m, _ = corridor.at(along_m)
        gate = _gate(at_x_m, at_y_m, gap)
        sides = {(gate.aside_m(door) or 0.0) > 0 for door in doors if gate.faces(door)}
        if len(sides) > 1:
            gate = replace(gate, is_beside=True)
            foot = lines.add(at_x_m, at_y_m)
        else:
            foot = lines.split(number, at_x_m, at_y_m)
        gates[foot] = gate
        lines.pieces.append((foot, point))


def _gate(x_m: float, y_m: float, gap: Opening) -> Gate:
    """The gate of a point on a centre line and the gap beside it."""
    heading = gap.heading_rad
    left_m = (gap.y_m - y_m) * math.cos(heading) - (gap.x_m - x_m) * math.sin(heading)
    half_m = gap.width_m / 2
    return Gate(x_m, y_m, heading, half_m - left_m, half_m + left_m, is_beside=False)
