"""The ways through hallways and open spaces: straight corridors between junctions."""

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int32
from scipy import ndimage

from toponav.core.geometry import angle_difference
from toponav.core.vocabulary import RoomKind
from toponav.maps._centerlines import Lines, center_lines
from toponav.maps._corridor import Corridor
from toponav.maps._open_spaces import Gate, cross_open_spaces
from toponav.maps._openings import Opening
from toponav.worlds.scene import Scene

__all__ = ["Passages", "passages_of"]

_BEND_RAD = math.radians(40.0)
_LEAST_WIDTH_M = 0.5
_BESIDE_LABEL_M = 0.6
_STUB_M = 3.0
"""A corridor without doors that leads nowhere is drawn from this length on."""
_WIDE_M = 2.0
_ROUNDNESS = 3.0


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
    gates = cross_open_spaces(scene, lines, territory, openings, open_rooms, passage_rooms, doors)
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
