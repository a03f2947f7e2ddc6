"""The ways through hallways and open spaces: straight corridors between junctions."""

import math
from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int32
from scipy import ndimage

from toponav.core.geometry import angle_difference
from toponav.core.vocabulary import RoomKind
from toponav.maps._centerlines import Lines, center_lines
from toponav.maps._openings import Opening
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["Corridor", "Gate", "Passages", "passages_of"]

_BEND_RAD = math.radians(40.0)
_LEAST_WIDTH_M = 0.5
_BESIDE_LABEL_M = 0.6
_STUB_M = 3.0
"""A corridor without doors that leads nowhere is drawn from this length on."""
_WIDE_M = 2.0
_ROUNDNESS = 3.0
_COMFORT_M = 0.6
_LOOK_M = 1.5
_SNAP_M = 0.8
_ACROSS_M = 6.0
_SAME_SIDE_RAD = math.radians(60.0)
_OPPOSITE_RAD = math.radians(45.0)


@dataclass(frozen=True)
class Corridor:
    """A way from one junction, bend or dead end to another."""

    start: int
    """Point at which it begins."""
    end: int
    """Point at which it ends."""
    line_m: Float[np.ndarray, "points 2"]
    """Its course, nearly straight."""

    @property
    def length_m(self) -> float:
        """Length of its course."""
        return float(self._steps_m.sum())

    @property
    def _steps_m(self) -> Float[np.ndarray, " steps"]:
        steps = np.diff(self.line_m, axis=0)
        return np.asarray(np.hypot(steps[:, 0], steps[:, 1]))

    def at(self, along_m: float) -> tuple[float, float, float]:
        """Position and heading at a distance from the start; goes on straight beyond the ends."""
        steps = self._steps_m
        number = int(np.searchsorted(np.cumsum(steps), along_m))
        number = min(max(number, 0), len(steps) - 1)
        rest = along_m - float(steps[:number].sum())
        before, after = self.line_m[number], self.line_m[number + 1]
        unit = (after - before) / max(float(steps[number]), 1e-9)
        x_m, y_m = before + rest * unit
        return float(x_m), float(y_m), math.atan2(float(unit[1]), float(unit[0]))

    def leaving_rad(self, end: int) -> float:
        """Heading with which it leaves one of its ends (0 start, 1 end), seen from afar."""
        look_m = min(_LOOK_M, self.length_m)
        near = self.line_m[0] if end == 0 else self.line_m[-1]
        far = self.at(look_m if end == 0 else self.length_m - look_m)
        return math.atan2(far[1] - float(near[1]), far[0] - float(near[0]))

    def nearest(self, x_m: float, y_m: float) -> tuple[float, float]:
        """How far along and how far aside the nearest point of the course is."""
        start, step = self.line_m[:-1], np.diff(self.line_m, axis=0)
        length = np.maximum(self._steps_m, 1e-9)
        offset = np.array([x_m, y_m]) - start
        share = np.clip((offset * step).sum(axis=1) / length**2, 0.0, 1.0)
        away = offset - share[:, None] * step
        aside = np.hypot(away[:, 0], away[:, 1])
        best = int(aside.argmin())
        return float(length[:best].sum() + share[best] * length[best]), float(aside[best])


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


@dataclass(frozen=True)
class Passages:
    """Corridors and the points where they meet."""

    points_m: list[tuple[float, float]]
    """Junctions, bends and dead ends (others may be unused)."""
    corridors: list[Corridor]
    """Ways between them."""
    gates: dict[int, Gate]
    """Points where a hallway opens to an open space."""

    def at_point(self, point: int) -> list[tuple[int, int]]:
        """Corridors that touch a point, each with the end (0 start, 1 end) that does."""
        return [
            (number, end)
            for number, corridor in enumerate(self.corridors)
            for end, touched in enumerate((corridor.start, corridor.end))
            if touched == point
        ]


def passages_of(
    scene: Scene,
    territory: Int32[np.ndarray, "rows cols"],
    openings: list[Opening],
    passage_rooms: set[int],
) -> Passages:
    """The corridors of a building's hallways and across its open spaces.

    Args:
        scene: The building.
        territory: Room of each free cell from 1, as `grown_rooms` gives it.
        openings: All openings between rooms.
        passage_rooms: Rooms to pass through: hallways, lobbies, lounges, open spaces.
    """
    open_rooms = _open_rooms(scene, territory, openings, passage_rooms)
    floor = _clean_floor(scene, territory, passage_rooms - open_rooms)
    lines = center_lines(floor, scene.grid.resolution_m, scene.grid.origin_m)
    doors = [
        opening if opening.rooms[0] in passage_rooms else opening.reversed()
        for opening in openings
        if len(passage_rooms.intersection(opening.rooms)) == 1
    ]
    _drop_stubs(lines, doors, {})
    gates = _cross_open_spaces(scene, lines, territory, openings, open_rooms, passage_rooms, doors)
    _drop_stubs(lines, doors, gates)
    return _chained(lines, gates)


def _open_rooms(
    scene: Scene,
    territory: Int32[np.ndarray, "rows cols"],
    openings: list[Opening],
    passage_rooms: set[int],
) -> set[int]:
    """Passages to cross from opening to opening, not to follow: wide, and as long as wide."""
    found = set()
    joined = {room for o in openings if set(o.rooms) <= passage_rooms for room in o.rooms}
    cell_m = scene.grid.resolution_m
    for room in sorted(passage_rooms & joined):
        cells = territory == room + 1
        if not cells.any():
            continue
        whole = ndimage.binary_fill_holes(np.pad(cells, 1))
        wide_m = float(ndimage.distance_transform_edt(whole).max()) * cell_m
        round_ = float(cells.sum()) * cell_m**2 < _ROUNDNESS * math.pi * wide_m**2
        hallway = scene.rooms[room].kind in (RoomKind.HALLWAY, RoomKind.LOBBY)
        if not hallway or (wide_m > _WIDE_M and round_):
            found.add(room)
    return found if passage_rooms - found else set()


def _clean_floor(
    scene: Scene, territory: Int32[np.ndarray, "rows cols"], rooms: set[int]
) -> Bool[np.ndarray, "rows cols"]:
    """Floor of these rooms without slits in walls and floor that only leaked in."""
    cell_m = scene.grid.resolution_m
    named = np.isin(scene.room_index, sorted(rooms))
    floor = np.isin(territory, [room + 1 for room in sorted(rooms)])
    if not floor.any():
        return np.asarray(floor)
    floor &= ndimage.distance_transform_edt(~named) * cell_m <= _BESIDE_LABEL_M
    padded = np.pad(floor, 2)
    core = ndimage.distance_transform_edt(padded) * cell_m >= _LEAST_WIDTH_M / 2
    if not core.any():
        return np.asarray(floor)
    near = ndimage.distance_transform_edt(~core) * cell_m <= _LEAST_WIDTH_M / 2
    return np.asarray((near & padded)[2:-2, 2:-2])


def _cross_open_spaces(
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


def _drop_stubs(lines: Lines, doors: list[Opening], gates: dict[int, Gate]) -> None:
    """Removes short dead ends without doors."""
    while True:
        touching: dict[int, list[int]] = defaultdict(list)
        for number, piece in enumerate(lines.pieces):
            for point in piece:
                touching[point].append(number)
        drop = None
        for chain in _chained(lines, gates).corridors:
            loose = [
                point
                for point in (chain.start, chain.end)
                if len(touching[point]) == 1 and point not in gates
            ]
            if len(loose) == 1 and chain.length_m < _STUB_M and not _serves(lines, chain, doors):
                drop = chain
                break
        if drop is None:
            return
        on_chain = {tuple(point) for point in drop.line_m.tolist()}
        lines.pieces = [
            piece
            for piece in lines.pieces
            if not all(tuple(lines.points[point]) in on_chain for point in piece)
        ]


def _serves(lines: Lines, chain: Corridor, doors: list[Opening]) -> bool:
    """Whether any door is nearer to this chain than to every other line."""
    on_chain = {tuple(point) for point in chain.line_m.tolist()}
    for door in doors:
        own_m = chain.nearest(door.x_m, door.y_m)[1]
        if own_m > 3.0:
            continue
        others = [
            Corridor(0, 1, np.array([lines.points[a], lines.points[b]])).nearest(
                door.x_m, door.y_m
            )[1]
            for a, b in lines.pieces
            if not (tuple(lines.points[a]) in on_chain and tuple(lines.points[b]) in on_chain)
        ]
        if not others or own_m < min(others) - 1e-6:
            return True
    return False


def _chained(lines: Lines, gates: dict[int, Gate]) -> Passages:
    """Pieces put together where they go on straight."""
    touching: dict[int, list[int]] = defaultdict(list)
    for number, piece in enumerate(lines.pieces):
        for point in piece:
            touching[point].append(number)
    places = {point for point, own in touching.items() if _is_place(lines, point, own)}
    if not places and touching:
        places = {min(touching)}
    corridors, used = [], set()
    for point in sorted(places):
        for number in touching[point]:
            if number in used:
                continue
            used.add(number)
            walk = [point, _other(lines, number, point)]
            while walk[-1] not in places:
                onward = next((n for n in touching[walk[-1]] if n not in used), None)
                if onward is None:
                    break
                used.add(onward)
                walk.append(_other(lines, onward, walk[-1]))
            course = np.array([lines.points[number] for number in walk])
            corridors.append(Corridor(walk[0], walk[-1], course))
    return Passages(list(lines.points), corridors, gates)


def _is_place(lines: Lines, point: int, own: list[int]) -> bool:
    """Whether corridors end at a point: it is no place on the way, or the way bends there."""
    if len(own) != 2:
        return True
    here = np.array(lines.points[point])
    headings = []
    for number in own:
        there = np.array(lines.points[_other(lines, number, point)])
        headings.append(math.atan2(*(there - here)[::-1]))
    return abs(angle_difference(headings[1], headings[0] + math.pi)) > _BEND_RAD


def _other(lines: Lines, piece: int, point: int) -> int:
    start, end = lines.pieces[piece]
    return end if start == point else start
