"""Walls, doors and windows of a home on its fine grid, from the plan of its rooms."""

import math
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._home_circulation import Border, Link
from toponav.worlds.generate._home_growth import COARSE_M, OUTSIDE, Labels
from toponav.worlds.generate._home_program import RoomSpec

__all__ = ["CELL_M", "Opening", "Shell", "raise_shell"]

CELL_M = 0.05
_SCALE = round(COARSE_M / CELL_M)
_PAD = 6
_OUTER_WALL = 3
_DOOR_CELLS = {RoomKind.BATHROOM: (15, 17), RoomKind.STORAGE: (15, 17)}
_USUAL_DOOR_CELLS = (16, 19)

Cells = Bool[np.ndarray, "rows cols"]


@dataclass(frozen=True)
class Opening:
    """A way through a wall.

    Attributes:
        outer: Number of the room that one comes from; -1 for outside.
        inner: Number of the room that one enters; the opening's cells belong to it.
        horizontal: Whether the wall runs along x.
        line: Fine row or column in front of which the wall's middle lies.
        start: First fine cell of the opening along the wall.
        stop: Cell behind the last one.
        side: +1 where the inner room lies at larger rows or columns, else -1.
        hinge: 0 without a leaf; -1 or +1 for the leaf's end of the opening.
        open_rad: Angle between the leaf and the closed door.
        top_m: Height of the opening.
    """

    outer: int
    inner: int
    horizontal: bool
    line: int
    start: int
    stop: int
    side: int
    hinge: int
    open_rad: float
    top_m: float

    @property
    def width_m(self) -> float:
        """Clear width."""
        return (self.stop - self.start) * CELL_M

    def box(self, before: int, after: int, widen: int = 0) -> tuple[slice, slice]:
        """Cells from `before` outside the wall's middle to `after` inside it."""
        low, high = (before, after) if self.side > 0 else (after, before)
        across = slice(max(self.line - low, 0), self.line + high)
        along = slice(max(self.start - widen, 0), self.stop + widen)
        return (across, along) if self.horizontal else (along, across)

    def point_m(self, along: float | int, across: float) -> tuple[float, float]:
        """World (x, y) of fine coordinates along the wall and across it, inwards positive."""
        a, c = along * CELL_M, (self.line + self.side * across) * CELL_M
        return (a, c) if self.horizontal else (c, a)


@dataclass(eq=False)
class Shell:
    """The building without furniture.

    Attributes:
        specs: Its rooms.
        room_index: Room of each floor cell, openings included; -1 in walls and outside.
        wall: Cells of walls, from floor to ceiling or above an opening.
        openings: Doors and wide openings between rooms.
        entrance: The front door, closed.
        ceiling_m: Height of the ceiling.
        keep_free: Floor that nothing may stand on: ways through openings.
    """

    specs: tuple[RoomSpec, ...]
    room_index: Int16[np.ndarray, "rows cols"]
    wall: Cells
    openings: list[Opening]
    entrance: Opening | None
    ceiling_m: float
    keep_free: Cells = field(init=False)

    def __post_init__(self) -> None:
        self.keep_free = np.zeros(self.wall.shape, dtype=bool)
        for opening in self.openings:
            deep = 16 if opening.hinge == 0 else opening.stop - opening.start + 4
            self.keep_free[opening.box(14, deep, 1)] = True
        if self.entrance is not None:
            self.keep_free[self.entrance.box(0, 20, 2)] = True
        self.keep_free &= self.room_index >= 0


def raise_shell(
    rng: np.random.Generator,
    specs: tuple[RoomSpec, ...],
    labels: Labels,
    links: list[Link],
    walls: list[Border],
) -> Shell | None:
    """Walls around the rooms of a plan, and an opening for each link; None where one has no room.

    Args:
        rng: Chooses doors' places and widths.
        specs: The rooms.
        labels: The plan on coarse cells.
        links: Doors to make.
        walls: All straight stretches of wall of the plan.
    """
    fine = np.repeat(np.repeat(labels, _SCALE, axis=0), _SCALE, axis=1)
    fine = np.pad(fine, _PAD, constant_values=OUTSIDE).astype(np.int16)
    highest = ndimage.maximum_filter(fine, 3)
    lowest = ndimage.minimum_filter(fine, 3)
    inside = fine >= 0
    near_home = ndimage.maximum_filter(inside, 2 * _OUTER_WALL + 1)
    wall = (inside & (highest != lowest)) | (~inside & near_home)
    index = np.where(wall | ~inside, -1, fine).astype(np.int16)
    top_m = float(rng.choice([2.0, 2.05, 2.1]))
    openings: list[Opening] = []
    for link in links:
        opening = _place_opening(rng, specs, link, openings, top_m)
        if opening is None:
            return None
        openings.append(opening)
    for opening in openings:
        box = opening.box(1, 1)
        wall[box] = False
        index[box] = opening.inner
    entrance = _place_entrance(rng, specs, walls, openings, index)
    ceiling_m = float(rng.choice([2.4, 2.5, 2.6, 2.7, 2.8]))
    return Shell(specs, index, wall, openings, entrance, ceiling_m)


def _span(border: Border) -> tuple[int, int]:
    """Fine cells of a border inside the walls that end there."""
    return _PAD + border.start * _SCALE + 2, _PAD + border.stop * _SCALE - 2


def _place_opening(
    rng: np.random.Generator,
    specs: tuple[RoomSpec, ...],
    link: Link,
    others: list[Opening],
    top_m: float,
) -> Opening | None:
    """The opening of one link, clear of the others."""
    outer, inner, border = link.outer, link.inner, link.border
    low, high = _span(border)
    kinds = specs[outer].kind, specs[inner].kind
    public = specs[outer].is_public and specs[inner].is_public
    to_hall = RoomKind.HALLWAY in kinds and (specs[outer].is_public or specs[inner].is_public)
    if specs[inner].kind is RoomKind.HALLWAY or (
        specs[outer].kind is not RoomKind.HALLWAY and specs[inner].is_public and not public
    ):
        outer, inner = inner, outer
    wide = (public and rng.random() < 0.75) or (to_hall and rng.random() < 0.35)
    if wide:
        width = int(rng.integers(22, 45))
        width = min(width, high - low - 4)
        wide = width >= 20
    if not wide:
        least, most = _DOOR_CELLS.get(specs[inner].kind, _USUAL_DOOR_CELLS)
        width = int(rng.integers(least, most + 1))
    if width > high - low - 1:
        return None
    bare = wide or (rng.random() < (0.6 if public else 0.12))
    # Swung up to two thirds open in front, the leaf would stand in the way.
    open_rad = math.radians(float(rng.uniform(88.0, 112.0)))
    head_m = float(rng.choice([top_m, top_m + 0.15])) if wide else top_m
    side = 1 if border.high == inner else -1
    line = _PAD + border.line * _SCALE
    starts = _starts(rng, low, high, width, wide)
    for start in starts:
        middle = start + width / 2
        hinge = -1 if middle - low < high - middle else 1
        opening = Opening(
            outer,
            inner,
            border.horizontal,
            line,
            start,
            start + width,
            side,
            0 if bare else hinge,
            open_rad,
            head_m,
        )
        if all(_apart(opening, other) for other in others):
            return opening
    return None


def _starts(rng: np.random.Generator, low: int, high: int, width: int, wide: bool) -> list[int]:
    """Where an opening may begin, best first: doors near corners, wide ones near the middle."""
    every = np.arange(low + 1, high - width)
    if len(every) == 0:
        return [low]
    middle = (low + high - width) / 2
    off = np.abs(every - middle)
    worth = -off if wide else np.minimum(off, (high - low) / 2 - width / 2 - 2)
    return [int(start) for start in every[np.argsort(-(worth + rng.normal(0, 3, len(every))))]]


def _apart(one: Opening, other: Opening) -> bool:
    """Whether two openings leave room for each other's leaf."""
    if one.horizontal == other.horizontal and abs(one.line - other.line) < 24:
        if one.line == other.line:
            return one.stop + 5 <= other.start or other.stop + 5 <= one.start
        if {one.outer, one.inner}.isdisjoint({other.outer, other.inner}):
            return True
        return True
    if one.horizontal != other.horizontal:
        return not _boxes_meet(_swing(one), _swing(other))
    return True


def _swing(opening: Opening) -> tuple[slice, slice]:
    leaf = opening.hinge != 0
    return opening.box(3, (opening.stop - opening.start + 2) if leaf else 4, 1)


def _boxes_meet(one: tuple[slice, slice], other: tuple[slice, slice]) -> bool:
    return all(a.start < b.stop and b.start < a.stop for a, b in zip(one, other, strict=True))


def _place_entrance(
    rng: np.random.Generator,
    specs: tuple[RoomSpec, ...],
    walls: list[Border],
    openings: list[Opening],
    index: Int16[np.ndarray, "rows cols"],
) -> Opening | None:
    """A closed front door in an outer wall of the most public room that has one."""
    order = (RoomKind.HALLWAY, RoomKind.LIVING_ROOM, RoomKind.KITCHEN, RoomKind.DINING_ROOM)
    width = 18
    options = []
    for wall in walls:
        number = max(wall.low, wall.high)
        low, high = _span(wall)
        if min(wall.low, wall.high) == OUTSIDE and high - low >= width + 2:
            kind = specs[number].kind
            if kind in order:
                options.append((order.index(kind), float(rng.random()), wall, number))
    for _, _, wall, number in sorted(options, key=lambda option: option[:2]):
        low, high = _span(wall)
        start = int(rng.integers(low + 1, high - width + 1))
        side = 1 if wall.high == number else -1
        line = _PAD + wall.line * _SCALE
        door = Opening(-1, number, wall.horizontal, line, start, start + width, side, -1, 0.0, 2.1)
        if all(_apart(door, other) for other in openings):
            return door
    return None
