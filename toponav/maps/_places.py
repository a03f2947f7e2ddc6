"""Places along corridors where a robot may change its behaviour: doors, junctions, bends, ends."""

import math
from collections import defaultdict
from dataclasses import dataclass, field

from toponav.core.geometry import angle_difference
from toponav.maps._openings import Opening
from toponav.maps._passages import Passages

__all__ = ["Entrance", "Place", "places_of"]

FACING_M = 0.99
"""Doors on both sides closer than this along the corridor are one place, as people draw them."""
_CORNER_DOOR_M = 0.9
"""A door this close to a junction or bend belongs to it, as far as its direction allows."""
_END_DOOR_M = 1.5
_SAME_SIDE_RAD = math.radians(50.0)


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


@dataclass(frozen=True)
class _Door:
    """An entrance beside a corridor."""

    along_m: float
    opening: Opening
    entrance: Entrance


def places_of(
    passages: Passages, entrances: list[tuple[Opening, Entrance]]
) -> dict[int, list[Place]]:
    """The places of each corridor in order, from the one at its start to the one at its end.

    Places at junctions are shared by the corridors that meet there.
    """
    at_point: dict[int, Place] = {}
    for corridor in passages.corridors:
        for point in (corridor.start, corridor.end):
            at_point.setdefault(point, Place(point=point))
    beside: dict[int, list[_Door]] = defaultdict(list)
    for opening, entrance in entrances:
        number, along_m = _corridor_of(passages, opening)
        beside[number].append(_Door(along_m, opening, entrance))
    found = {}
    for number, corridor in enumerate(passages.corridors):
        doors = sorted(beside[number], key=lambda door: door.along_m)
        doors = _give_to_ends(passages, number, doors, at_point)
        inner = [
            Place([door.entrance for door in group], None, {number: _middle(group)})
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
    passages: Passages, number: int, doors: list[_Door], at_point: dict[int, Place]
) -> list[_Door]:
    """The doors that stay along the corridor; those close to its ends go to the places there."""
    corridor = passages.corridors[number]
    left = list(doors)
    for point, backwards in ((corridor.start, False), (corridor.end, True)):
        dead_end = len(passages.at_point(point)) == 1
        reach_m = min(_END_DOOR_M if dead_end else _CORNER_DOOR_M, corridor.length_m / 2)
        for door in reversed(left) if backwards else list(left):
            away_m = corridor.length_m - door.along_m if backwards else door.along_m
            taken = [other.heading_rad for other in at_point[point].entrances]
            taken += [
                passages.corridors[other].leaving_rad(side)
                for other, side in passages.at_point(point)
            ]
            gate = passages.gates.get(point)
            near = away_m <= reach_m or (gate is not None and gate.faces(door.opening))
            if near and not any(
                abs(angle_difference(door.entrance.heading_rad, heading)) < _SAME_SIDE_RAD
                for heading in taken
            ):
                at_point[point].entrances.append(door.entrance)
                left.remove(door)
    return left


def _facing(doors: list[_Door]) -> list[list[_Door]]:
    """Doors along a corridor by place: two on opposite sides are one if close enough."""
    pairs = sorted(
        (aside_m, number, other)
        for number, door in enumerate(doors)
        for other in range(number + 1, len(doors))
        if (aside_m := _aside_m(door, doors[other])) < FACING_M
    )
    groups: list[list[_Door]] = []
    taken: set[int] = set()
    for _, number, other in pairs:
        if not taken & {number, other}:
            taken |= {number, other}
            groups.append([doors[number], doors[other]])
    groups += [[door] for number, door in enumerate(doors) if number not in taken]
    return sorted(groups, key=_middle)


def _aside_m(door: _Door, other: _Door) -> float:
    """How far a robot that goes straight from one door to another must move aside."""
    heading = door.entrance.heading_rad
    if abs(angle_difference(other.entrance.heading_rad, heading)) < math.pi - _SAME_SIDE_RAD:
        return math.inf
    x_m, y_m = other.opening.x_m - door.opening.x_m, other.opening.y_m - door.opening.y_m
    return abs(y_m * math.cos(heading) - x_m * math.sin(heading))


def _middle(group: list[_Door]) -> float:
    return sum(door.along_m for door in group) / len(group)
