"""Places along corridors where a robot may change its behaviour: doors, junctions, bends, ends."""

import math
from collections import defaultdict
from dataclasses import dataclass, field

from toponav.core.geometry import angle_difference
from toponav.maps._openings import Opening
from toponav.maps._passages import Corridor, Passages

__all__ = ["Entrance", "Place", "places_of"]

FACING_M = 1.0
"""Doors on both sides closer than this along the corridor are one place, as people draw them."""
_CORNER_DOOR_M = 1.2
"""A door this close to a junction or bend belongs to it, as far as its direction allows."""
_END_DOOR_M = 1.5


@dataclass(frozen=True)
class Entrance:
    """A way into an enclosed room: its opening, seen from the corridor."""

    door: str
    """Id of its door node."""
    room: str
    """Id of the room node behind it."""
    heading_rad: float
    """Heading with which a robot enters."""


@dataclass
class Place:
    """Where entrances and corridors meet."""

    entrances: list[Entrance] = field(default_factory=list)
    point: int | None = None
    """The junction that it is at, or None for a place along a corridor."""
    along_m: dict[int, float] = field(default_factory=dict)
    """How far along each of its corridors it is; a place along a corridor has one."""


def places_of(
    passages: Passages, entrances: list[tuple[Opening, Entrance]]
) -> dict[int, list[Place]]:
    """The places of each corridor in order, from the one at its start to the one at its end.

    Places at junctions are shared by the corridors that meet there.
    """
    at_point: dict[int, Place] = {}
    for number, corridor in enumerate(passages.corridors):
        for point in (corridor.start, corridor.end):
            at_point.setdefault(point, Place(point=point))
    beside: dict[int, list[tuple[float, Entrance]]] = defaultdict(list)
    for opening, entrance in entrances:
        number, along_m = _corridor_of(passages, opening)
        beside[number].append((along_m, entrance))
    found = {}
    for number, corridor in enumerate(passages.corridors):
        doors = sorted(beside[number], key=lambda one: one[0])
        doors = _give_to_ends(passages, number, doors, at_point)
        inner = [
            Place([entrance for _, entrance in group], None, {number: _middle(group)})
            for group in _facing(doors)
        ]
        found[number] = [at_point[corridor.start], *inner, at_point[corridor.end]]
    return found


def _corridor_of(passages: Passages, opening: Opening) -> tuple[int, float]:
    """The corridor that a door opens to, and how far along it the door is.

    The line ahead of the door counts before a nearer one beside it.
    """
    best = (math.inf, 0, 0.0)
    for number, corridor in enumerate(passages.corridors):
        along_m, aside_m = corridor.nearest(opening.x_m, opening.y_m)
        x_m, y_m, _ = corridor.at(along_m)
        toward = math.atan2(opening.y_m - y_m, opening.x_m - x_m)
        skew = abs(angle_difference(toward, opening.heading_rad)) if aside_m > 0.3 else 0.0
        best = min(best, (aside_m * (1.0 + skew), number, along_m))
    return best[1], best[2]


def _give_to_ends(
    passages: Passages,
    number: int,
    doors: list[tuple[float, Entrance]],
    at_point: dict[int, Place],
) -> list[tuple[float, Entrance]]:
    """The doors that stay along the corridor; those close to its ends go to the places there."""
    corridor = passages.corridors[number]
    left = list(doors)
    for end, point in enumerate((corridor.start, corridor.end)):
        dead_end = len(passages.at_point(point)) == 1
        reach_m = min(_END_DOOR_M if dead_end else _CORNER_DOOR_M, corridor.length_m / 2)
        nearest_first = sorted(
            left, key=lambda one: one[0] if end == 0 else corridor.length_m - one[0]
        )
        for along_m, entrance in nearest_first:
            away_m = along_m if end == 0 else corridor.length_m - along_m
            taken = [other.heading_rad for other in at_point[point].entrances]
            taken += [
                passages.corridors[other].leaving_rad(side)
                for other, side in passages.at_point(point)
            ]
            if away_m <= reach_m and not any(
                abs(angle_difference(entrance.heading_rad, heading)) < math.radians(50.0)
                for heading in taken
            ):
                at_point[point].entrances.append(entrance)
                left.remove((along_m, entrance))
    return left


def _facing(doors: list[tuple[float, Entrance]]) -> list[list[tuple[float, Entrance]]]:
    """Doors along a corridor by place: two on opposite sides are one if close enough."""
    groups: list[list[tuple[float, Entrance]]] = []
    taken: set[str] = set()
    for along_m, entrance in doors:
        if entrance.door in taken:
            continue
        group = [(along_m, entrance)]
        facing = [
            (abs(other_m - along_m), other_m, other)
            for other_m, other in doors
            if other.door not in taken
            and abs(other_m - along_m) < FACING_M
            and abs(angle_difference(other.heading_rad, entrance.heading_rad))
            > math.radians(135.0)
        ]
        if facing:
            _, other_m, other = min(facing, key=lambda one: one[0])
            group.append((other_m, other))
        taken |= {entrance.door for _, entrance in group}
        groups.append(group)
    return sorted(groups, key=_middle)


def _middle(group: list[tuple[float, Entrance]]) -> float:
    return sum(along_m for along_m, _ in group) / len(group)


def _unused(corridor: Corridor) -> None:
    del corridor
