"""Rooms and the doors between them, from nothing but a floor plan's cells.

The free space is cut where it is narrow. Every peak of the distance to the nearest wall starts
a region (a watershed); regions then grow together over their widest passage first, until only
passages as narrow as doors are left between them.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16, Int32
from scipy import ndimage
from skimage.measure import label as label_pieces
from skimage.segmentation import watershed

from toponav.core.errors import InputError
from toponav.worlds.grid_kernels import distance_to_solid

__all__ = ["Opening", "RoomShapes", "Segmentation", "openings_between", "segment_rooms"]

_EIGHT = np.ones((3, 3), bool)


@dataclass(frozen=True)
class RoomShapes:
    """What tells a door from a wide passage and a room from a niche.

    Attributes:
        widest_door_m: A passage up to this width parts two rooms where it is at most
            `narrowing` of the width of the narrower one.
        widest_arch_m: So does a passage up to this width where it is at most `arch_narrowing`.
        narrowing: Share of the width of a room.
        arch_narrowing: Share of the width of a room.
        least_room_m2: Smaller regions belong to the neighbour with the widest passage.
        loose_m: Pieces shorter than this that touch no wall are furniture, and ignored.
    """

    widest_door_m: float = 1.6
    widest_arch_m: float = 4.0
    narrowing: float = 0.8
    arch_narrowing: float = 0.6
    least_room_m2: float = 1.5
    loose_m: float = 2.5

    def __post_init__(self) -> None:
        limits = {
            "widest_door_m": 0.3 <= self.widest_door_m <= 10,
            "widest_arch_m": 0 <= self.widest_arch_m <= 20,
            "narrowing": 0 < self.narrowing <= 1,
            "arch_narrowing": 0 < self.arch_narrowing <= 1,
            "least_room_m2": 0 <= self.least_room_m2 <= 1000,
            "loose_m": 0 <= self.loose_m <= 100,
        }
        for name, holds in limits.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where="RoomShapes",
                    remedy="give metres, and the narrowing as a share of 1",
                )

    def parts(self, width_m: float, share: float) -> bool:
        """Whether a passage of this width, and this share of the narrower room's, is a door."""
        is_door = width_m <= self.widest_door_m and share <= self.narrowing
        return is_door or (width_m <= self.widest_arch_m and share <= self.arch_narrowing)


@dataclass(frozen=True, eq=False)
class Opening:
    """A narrow passage between two rooms.

    Attributes:
        rooms: Their values in `room_index`, the lower first.
        segment_m: From jamb to jamb; the grid's lower-left corner is `origin_m`.
        width_m: Length of the segment.
    """

    rooms: tuple[int, int]
    segment_m: Float[np.ndarray, "2 2"]
    width_m: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Rooms found in a grid.

    Attributes:
        room_index: 0.. in rooms (by size, the largest first), -1 on walls and outside.
        doors: Narrow passages between rooms.
    """

    room_index: Int16[np.ndarray, "rows cols"]
    doors: tuple[Opening, ...]

    @property
    def rooms(self) -> int:
        """How many rooms were found."""
        return int(self.room_index.max(initial=-1)) + 1


def segment_rooms(
    occupied: Bool[np.ndarray, "rows cols"],
    resolution_m: float,
    *,
    origin_m: tuple[float, float] = (0.0, 0.0),
    outside: Bool[np.ndarray, "rows cols"] | None = None,
    shapes: RoomShapes | None = None,
) -> Segmentation:
    """Rooms and doors of a floor plan.

    Args:
        occupied: Cells that hold a wall or furniture; where the walls alone are known (a
            slice of the building above its furniture), give those.
        resolution_m: Side of a cell.
        origin_m: Lower-left corner of cell (0, 0), from which the doors' segments count.
        outside: Free cells that are not part of the building; default none.
        shapes: What counts as a door and as a room.

    Example:
        >>> plan = np.ones((22, 43), bool)
        >>> plan[1:21, 1:21] = plan[1:21, 22:42] = False
        >>> plan[8:12, 21] = False
        >>> found = segment_rooms(plan, 0.2)
        >>> found.rooms, found.doors[0].rooms
        (2, (0, 1))
    """
    shapes = shapes or RoomShapes()
    walls = _without_loose(occupied, shapes.loose_m / resolution_m)
    solid = walls if outside is None else walls | outside
    width: np.ndarray = distance_to_solid(np.ascontiguousarray(solid)) * np.float32(resolution_m)
    regions = _regions(width, resolution_m)
    merged = _merge(regions, width, resolution_m, shapes)
    room_index, kept = _number(merged, occupied, outside, resolution_m, shapes.least_room_m2)
    doors = _doors(kept, width, resolution_m, origin_m)
    return Segmentation(room_index, doors)


def openings_between(
    room_index: Int16[np.ndarray, "rows cols"],
    occupied: Bool[np.ndarray, "rows cols"],
    resolution_m: float,
    *,
    origin_m: tuple[float, float] = (0.0, 0.0),
    reach_m: float = 0.6,
    widest_m: float = 3.0,
) -> tuple[Opening, ...]:
    """The openings between rooms that are known already, by labels or by hand.

    Args:
        room_index: Room of each cell; -1 is nowhere, such as in a doorway.
        occupied: Cells that hold a wall or furniture.
        resolution_m: Side of a cell.
        origin_m: Lower-left corner of cell (0, 0), from which the openings' segments count.
        reach_m: Rooms are taken to run on this far into free cells of no room.
        widest_m: Wider borders between two rooms are no openings but open plan.
    """
    walls = _without_loose(occupied, RoomShapes().loose_m / resolution_m)
    width: np.ndarray = distance_to_solid(np.ascontiguousarray(walls)) * np.float32(resolution_m)
    away, (row, col) = ndimage.distance_transform_edt(room_index < 0, return_indices=True)
    near = (away * resolution_m <= reach_m) & ~walls
    kept = np.where(near, room_index[row, col], -1).astype(np.int32)
    found = _doors(kept, width, resolution_m, origin_m)
    return tuple(opening for opening in found if opening.width_m <= widest_m)


def _without_loose(occupied: np.ndarray, loose_cells: float) -> np.ndarray:
    """The walls: solid pieces that are long, or that touch the edge of the grid."""
    pieces, count = ndimage.label(occupied, structure=_EIGHT)
    keep = np.zeros(count + 1, bool)
    for number, (rows, cols) in enumerate(ndimage.find_objects(pieces), start=1):
        keep[number] = max(rows.stop - rows.start, cols.stop - cols.start) >= loose_cells
    if not keep.any():
        keep[1:] = True
    walls: np.ndarray = keep[pieces]
    return walls


def _regions(width_m: np.ndarray, resolution_m: float) -> Int32[np.ndarray, "rows cols"]:
    """A region for every peak of the distance to the walls; 0 on walls."""
    free = width_m > 0
    # Slightly smoothed and in steps of a quarter cell, so that a flat ridge is one peak.
    smooth = ndimage.gaussian_filter(width_m, 1.0)
    steps = np.round(smooth / (0.25 * resolution_m)).astype(np.int32)
    highest = ndimage.maximum_filter(steps, size=5)
    peaks = label_pieces((steps == highest) & free, connectivity=2)  # type: ignore[no-untyped-call]
    basins: Int32[np.ndarray, "rows cols"] = watershed(  # type: ignore[no-untyped-call]
        -width_m, peaks, mask=free
    )
    return basins.astype(np.int32)


def _passages(regions: np.ndarray, width_m: np.ndarray) -> dict[tuple[int, int], float]:
    """Half the width of the widest passage between each two neighbouring regions."""
    firsts, seconds, widths = [], [], []
    for near, far in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        a, b = regions[near], regions[far]
        meet = (a != b) & (a > 0) & (b > 0)
        firsts.append(np.minimum(a[meet], b[meet]))
        seconds.append(np.maximum(a[meet], b[meet]))
        widths.append(np.minimum(width_m[near][meet], width_m[far][meet]))
    pairs = np.stack([np.concatenate(firsts), np.concatenate(seconds)], axis=1)
    if not len(pairs):
        return {}
    unique, which = np.unique(pairs, axis=0, return_inverse=True)
    widest = np.zeros(len(unique))
    np.maximum.at(widest, which.ravel(), np.concatenate(widths))
    return {(int(a), int(b)): float(w) for (a, b), w in zip(unique, widest, strict=True)}


def _merge(
    regions: np.ndarray, width_m: np.ndarray, resolution_m: float, shapes: RoomShapes
) -> np.ndarray:
    """Regions grown together over every passage that is no door, the widest first."""
    count = int(regions.max(initial=0))
    peak = np.zeros(count + 1)
    np.maximum.at(peak, regions.ravel(), width_m.ravel())
    area = np.bincount(regions.ravel(), minlength=count + 1) * resolution_m**2
    parent = np.arange(count + 1)

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = parent[parent[number]]
            number = int(parent[number])
        return number

    passages = sorted(_passages(regions, width_m).items(), key=lambda item: (-item[1], item[0]))
    for only_small in (False, True):
        for (first, second), half_m in passages:
            a, b = root(first), root(second)
            if a == b:
                continue
            small = min(area[a], area[b]) < shapes.least_room_m2
            is_door = shapes.parts(2 * half_m, half_m / float(min(peak[a], peak[b])))
            if small if only_small else not is_door:
                keep, gone = min(a, b), max(a, b)
                parent[gone] = keep
                peak[keep] = max(peak[a], peak[b])
                area[keep] = area[a] + area[b]
    roots = np.array([root(number) for number in range(count + 1)])
    merged: np.ndarray = roots[regions]
    return merged


def _number(
    merged: np.ndarray,
    occupied: np.ndarray,
    outside: np.ndarray | None,
    resolution_m: float,
    least_m2: float,
) -> tuple[Int16[np.ndarray, "rows cols"], Int32[np.ndarray, "rows cols"]]:
    """Rooms by size on free cells, and the same under loose furniture too."""
    area = np.bincount(merged.ravel())
    area[0] = 0
    large = np.flatnonzero(area * resolution_m**2 >= max(least_m2, resolution_m**2))
    order = large[np.argsort(-area[large], kind="stable")][: np.iinfo(np.int16).max]
    number = np.full(len(area), -1, np.int32)
    number[order] = np.arange(len(order))
    kept: np.ndarray = number[merged]
    blocked = occupied if outside is None else occupied | outside
    return np.where(blocked, -1, kept).astype(np.int16), kept


def _doors(
    kept: np.ndarray, width_m: np.ndarray, resolution_m: float, origin_m: tuple[float, float]
) -> tuple[Opening, ...]:
    """One opening for every connected border between two rooms."""
    doors = []
    for near, far in _borders(kept):
        rooms = sorted((int(kept[tuple(near[0])]), int(kept[tuple(far[0])])))
        cells = np.concatenate([near, far])
        values = width_m[cells[:, 0], cells[:, 1]]
        middle = cells[int(values.argmax())]
        segment = _jambs(middle, width_m, resolution_m)
        length_m = float(np.hypot(*(segment[1] - segment[0])))
        doors.append(Opening((rooms[0], rooms[1]), segment + np.array(origin_m), length_m))
    return tuple(sorted(doors, key=lambda door: (door.rooms, door.segment_m.tolist())))


def _borders(kept: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """The cells on either side of each connected border between two rooms."""
    pairs = []
    for step in ((0, 1), (1, 0)):
        a = kept[: kept.shape[0] - step[0], : kept.shape[1] - step[1]]
        b = kept[step[0] :, step[1] :]
        here = np.argwhere((a != b) & (a >= 0) & (b >= 0))
        pairs.append(np.concatenate([here, here + step], axis=1))
    both = np.concatenate(pairs)
    if not len(both):
        return []
    names = np.stack([kept[both[:, 0], both[:, 1]], kept[both[:, 2], both[:, 3]]], axis=1)
    names.sort(axis=1)
    borders = []
    for first, second in np.unique(names, axis=0).tolist():
        chosen = both[(names == (first, second)).all(axis=1)]
        seam = np.zeros(kept.shape, bool)
        seam[chosen[:, 0], chosen[:, 1]] = seam[chosen[:, 2], chosen[:, 3]] = True
        pieces, count = ndimage.label(seam, structure=_EIGHT)
        of = pieces[chosen[:, 0], chosen[:, 1]]
        borders += [(chosen[of == n, :2], chosen[of == n, 2:]) for n in range(1, count + 1)]
    return borders


def _jambs(
    middle: np.ndarray, width_m: np.ndarray, resolution_m: float
) -> Float[np.ndarray, "2 2"]:
    """The shortest segment from wall to wall through the middle of a passage, or just beside."""
    reach = max(round(float(width_m[tuple(middle)]) / resolution_m) * 2 + 5, 6)
    row0, col0 = np.maximum(middle - reach, 0)
    solid = width_m[row0 : middle[0] + reach + 1, col0 : middle[1] + reach + 1] <= 0
    solid = np.pad(solid, 1, constant_values=True)
    spread = np.arange(-2, 3)
    near = (middle - (row0, col0) + 1) + np.stack(np.meshgrid(spread, spread), -1).reshape(-1, 2)
    near = near[((near >= 0) & (near < solid.shape)).all(axis=1)]
    near = near[~solid[near[:, 0], near[:, 1]]] + 0.5
    angle = np.arange(0.0, np.pi, np.pi / 16)
    way = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    steps = np.arange(0.0, 2.0 * reach, 0.5)
    lengths = [_walk(solid, near, sign * way, steps) for sign in (1.0, -1.0)]
    # Of equal segments the one nearest to the middle.
    away = np.hypot(*(near - near.mean(axis=0)).T)[:, None]
    point, turn = np.unravel_index(
        int((lengths[0] + lengths[1] + 0.01 * away).argmin()), lengths[0].shape
    )
    ends = [
        near[point] + sign * length[point, turn] * way[turn]
        for sign, length in zip((1.0, -1.0), lengths, strict=True)
    ]
    segment = (np.stack(ends) + np.array([row0 - 1, col0 - 1]))[:, ::-1] * resolution_m
    return np.asarray(segment, np.float64)


def _walk(
    solid: np.ndarray, starts: np.ndarray, ways: np.ndarray, steps: np.ndarray
) -> Float[np.ndarray, "starts ways"]:
    """How far, in cells, from each start along each way until a solid cell."""
    points = starts[:, None, None] + ways[None, :, None] * steps[:, None]
    cells = np.floor(points).astype(int)
    inside = ((cells >= 0) & (cells < solid.shape)).all(axis=-1)
    blocked = ~inside
    blocked[inside] = solid[cells[inside][:, 0], cells[inside][:, 1]]
    far: np.ndarray = np.where(blocked.any(axis=-1), steps[blocked.argmax(axis=-1)], steps[-1])
    return far
