"""Where doors go: who may be entered from whom, and how good a plan is for living in."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._home_growth import COARSE_M, OUTSIDE, Labels
from toponav.worlds.generate._home_program import RoomSpec

__all__ = ["Border", "Link", "borders", "links_of", "plan_cost"]

_NEVER = 1e3
_DOOR_CELLS = 5
"""A straight border must be this long to hold a door with its jambs."""


@dataclass(frozen=True)
class Border:
    """A straight stretch of wall between two rooms (or a room and outside).

    Attributes:
        low: Room on the side of the lower row or column.
        high: Room on the other side.
        horizontal: Whether the wall runs along x.
        line: Row or column in front of which it lies.
        start: First cell along it.
        stop: Cell behind the last one.
    """

    low: int
    high: int
    horizontal: bool
    line: int
    start: int
    stop: int

    @property
    def length(self) -> int:
        """Number of coarse cells along the wall."""
        return self.stop - self.start


@dataclass(frozen=True)
class Link:
    """A door to make: from one room into a more private one."""

    outer: int
    inner: int
    border: Border


def borders(labels: Labels) -> list[Border]:
    """Every straight stretch between two different labels."""
    found = []
    for horizontal in (True, False):
        grid = labels if horizontal else labels.T
        for line in range(1, grid.shape[0]):
            below, above = grid[line - 1], grid[line]
            differs = below != above
            start = 0
            for at in range(1, grid.shape[1] + 1):
                ends = (
                    at == grid.shape[1] or below[at] != below[start] or above[at] != above[start]
                )
                if ends:
                    if differs[start]:
                        low, high = int(below[start]), int(above[start])
                        found.append(Border(low, high, horizontal, line, start, at))
                    start = at
    return found


def links_of(specs: tuple[RoomSpec, ...], walls: list[Border]) -> tuple[list[Link], float]:
    """The doors that lead to every room, and what their detours cost; high when some cannot be."""
    best: dict[tuple[int, int], Border] = {}
    for wall in walls:
        if OUTSIDE in (wall.low, wall.high) or wall.length < _DOOR_CELLS:
            continue
        pair = (wall.low, wall.high) if wall.low < wall.high else (wall.high, wall.low)
        if pair not in best or wall.length > best[pair].length:
            best[pair] = wall
    joined, cost = {0}, 0.0
    links: list[Link] = []
    while len(joined) < len(specs):
        options = [
            (_entry_cost(specs, outer, inner), outer, inner)
            for outer in joined
            for inner in range(len(specs))
            if inner not in joined and (min(outer, inner), max(outer, inner)) in best
        ]
        price, outer, inner = min(options, default=(_NEVER, 0, 0))
        if price >= _NEVER:
            return links, cost + _NEVER * (len(specs) - len(joined))
        cost += price
        joined.add(inner)
        links.append(Link(outer, inner, best[min(outer, inner), max(outer, inner)]))
    return links + _loops(specs, links, best), cost


def _entry_cost(specs: tuple[RoomSpec, ...], outer: int, inner: int) -> float:
    """How odd it is to enter one room from another."""
    has_hallway = any(spec.kind is RoomKind.HALLWAY for spec in specs)
    one, other = specs[outer].kind, specs[inner].kind
    if one is RoomKind.HALLWAY or other is RoomKind.HALLWAY:
        return 0.0
    if one is RoomKind.BEDROOM and other is RoomKind.BATHROOM:
        private = specs[inner].name.endswith("_2") or len(specs) <= 3
        return 0.5 if private else _NEVER
    if one is RoomKind.BEDROOM and other is RoomKind.STUDY:
        return 2.5
    if one in (RoomKind.BEDROOM, RoomKind.BATHROOM, RoomKind.STORAGE, RoomKind.STUDY):
        return _NEVER
    if specs[outer].is_public and specs[inner].is_public:
        return 0.1
    if other is RoomKind.BATHROOM and one in (RoomKind.KITCHEN, RoomKind.DINING_ROOM):
        return 4.0 if has_hallway else 1.5
    if other is RoomKind.STORAGE:
        return 0.3
    if one is RoomKind.LIVING_ROOM:
        return 1.2 if has_hallway else 0.3
    return 2.5


def _loops(
    specs: tuple[RoomSpec, ...], links: list[Link], best: dict[tuple[int, int], Border]
) -> list[Link]:
    """Second ways: between public rooms, and from them to the hallway."""
    made = {frozenset((link.outer, link.inner)) for link in links}
    more = []
    for (low, high), wall in sorted(best.items(), key=lambda item: item[0]):
        if frozenset((low, high)) in made or wall.length < 6:
            continue
        kinds = {specs[low].kind, specs[high].kind}
        if (specs[low].is_public and specs[high].is_public) or kinds == {
            RoomKind.HALLWAY,
            RoomKind.KITCHEN,
        }:
            more.append(Link(low, high, wall))
    return more


_NARROWEST: dict[RoomKind, int] = {
    RoomKind.LIVING_ROOM: 12,
    RoomKind.BEDROOM: 10,
    RoomKind.KITCHEN: 9,
    RoomKind.DINING_ROOM: 11,
    RoomKind.STUDY: 9,
    RoomKind.BATHROOM: 7,
    RoomKind.STORAGE: 6,
    RoomKind.HALLWAY: 4,
}
"""Side in cells of the square that must fit everywhere in a room."""


def plan_cost(specs: tuple[RoomSpec, ...], labels: Labels) -> tuple[float, list[Link]]:
    """How far a plan is from one to live in, and its doors."""
    walls = borders(labels)
    links, cost = links_of(specs, walls)
    if cost >= _NEVER:
        return cost, links
    for number, spec in enumerate(specs):
        mask = labels == number
        cells = int(mask.sum())
        if cells == 0:
            return _NEVER * len(specs), links
        # A part of a hallway may have been crossed off by the outline.
        if ndimage.label(mask)[1] > 1:
            cost += _NEVER
        side = _NARROWEST[spec.kind]
        kept = _opened(mask, side)
        if not kept.any():
            cost += _NEVER / 2
        cost += 9.0 * (cells - int(kept.sum())) / cells
        cost += _shape_cost(spec, mask, cells)
        cost += _window_cost(number, spec, walls)
    return cost, links


def _opened(mask: np.ndarray, side: int) -> np.ndarray:
    """The cells of all squares of this side that fit into a mask."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    part = mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1].astype(np.uint8)
    shift = -1 if side % 2 == 0 else 0
    for axis in (0, 1):
        part = ndimage.minimum_filter1d(part, side, axis, mode="constant")
    for axis in (0, 1):
        part = ndimage.maximum_filter1d(part, side, axis, mode="constant", origin=shift)
    return part > 0


def _shape_cost(spec: RoomSpec, mask: np.ndarray, cells: int) -> float:
    """Wrong area, long rectangles and ragged outlines."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    tall, wide = int(rows[-1] - rows[0]) + 1, int(cols[-1] - cols[0]) + 1
    wanted = spec.area_m2 / COARSE_M**2
    off = abs(float(np.log(cells / wanted)))
    cost = 1.5 * max(off - 0.2, 0.0) + (6.0 * max(off - 0.45, 0.0))
    if spec.kind is RoomKind.HALLWAY:
        return cost * 0.5
    cost += 2.0 * max(max(tall, wide) / min(tall, wide) - 1.7, 0.0)
    filled = cells / (tall * wide)
    return cost + 4.0 * max(0.82 - filled, 0.0)


def _window_cost(number: int, spec: RoomSpec, walls: list[Border]) -> float:
    """Rooms to live in need an outer wall."""
    if spec.kind in (RoomKind.HALLWAY, RoomKind.STORAGE, RoomKind.BATHROOM):
        return 0.0
    outer = sum(
        wall.length
        for wall in walls
        if OUTSIDE in (wall.low, wall.high) and number in (wall.low, wall.high)
    )
    return 0.0 if outer >= 6 else 4.0
