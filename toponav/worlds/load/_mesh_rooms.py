"""Rooms and doors of an imported building: by its labels, or by its walls."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame
from toponav.worlds.load.mesh_parts import Notes
from toponav.worlds.rooms import outline_m
from toponav.worlds.scene import Door, Room
from toponav.worlds.segment_rooms import Opening, openings_between, segment_rooms

__all__ = ["doors_of", "rooms_from_labels", "rooms_from_walls"]

_LEAST_ROOM_M2 = 1.0
_OPEN_SPACE_M2 = 80.0
_ELONGATED = 2.8
_VOTES = 3
_USE_OF = {
    name: (use, weight)
    for use, names in {
        RoomKind.BEDROOM: {
            "bed": 4,
            "bunk_bed": 4,
            "child_bed": 4,
            "nightstand": 1,
            "wardrobe": 1,
        },
        RoomKind.KITCHEN: {
            "stove": 3,
            "oven": 2,
            "refrigerator": 2,
            "kitchen_cabinet": 2,
            "range_hood": 2,
            "dishwasher": 2,
        },
        RoomKind.LIVING_ROOM: {"sofa": 6, "coffee_table": 2, "tv_stand": 2, "fireplace": 2},
        RoomKind.BATHROOM: {"toilet": 3, "bathtub": 4, "shower": 3, "washbasin": 2, "bidet": 3},
        RoomKind.STUDY: {"desk": 2, "office_chair": 1, "bookcase": 1},
        RoomKind.DINING_ROOM: {"dining_table": 2, "chair": 1},
    }.items()
    for name, weight in names.items()
}
"""What each piece of furniture says about its room, and how loudly."""


def rooms_from_labels(
    named: Sequence[tuple[str, RoomKind]],
    cells: Int16[np.ndarray, "rows cols"],
    free: Bool[np.ndarray, "rows cols"],
    grid: GridFrame,
) -> tuple[tuple[Room, ...], tuple[Door, ...], Int16[np.ndarray, "rows cols"]]:
    """The rooms that the file names, and the openings between them."""
    names = _unique([name for name, _ in named])
    # Floor just beside a room, under a table or in a scan's gap, is that room's too.
    away, (row, col) = ndimage.distance_transform_edt(cells < 0, return_indices=True)
    near = (away * grid.resolution_m <= 0.3) & free
    room_index = np.where(near | (cells >= 0), cells[row, col], -1)
    room_index = np.where(free, room_index, -1).astype(np.int16)
    rooms = tuple(
        Room(name, kind, outline_m(cells == number, grid))
        for number, (name, (_, kind)) in enumerate(zip(names, named, strict=True))
    )
    openings = openings_between(room_index, ~free, grid.resolution_m, origin_m=grid.origin_m)
    return rooms, doors_of(openings, names), room_index


def rooms_from_walls(
    grid: GridFrame,
    structure: Bool[np.ndarray, "rows cols"],
    free: Bool[np.ndarray, "rows cols"],
    inside: Bool[np.ndarray, "rows cols"],
    things: Sequence[tuple[str, tuple[float, float]]],
    notes: Notes,
) -> tuple[tuple[Room, ...], tuple[Door, ...], Int16[np.ndarray, "rows cols"]]:
    """The rooms that the walls cut the floor into; `things` are furniture classes and places."""
    found = segment_rooms(
        structure,
        grid.resolution_m,
        origin_m=grid.origin_m,
        outside=~inside & ~structure,
    )
    labels = np.where(free, found.room_index, -1)
    area_m2 = np.bincount(labels[labels >= 0], minlength=found.rooms) * grid.resolution_m**2
    keep = area_m2 >= _LEAST_ROOM_M2
    outdoors = np.ones(len(keep), bool)
    for edge in (labels[:3], labels[-3:], labels[:, :3], labels[:, -3:]):
        outdoors &= np.isin(np.arange(len(keep)), edge)
    if (outdoors & keep).any() and area_m2[keep & ~outdoors].sum() > 0.2 * area_m2.sum():
        notes.add("ground around the building left out of the rooms")
        keep &= ~outdoors
    number = np.where(keep, np.cumsum(keep) - 1, -1)
    room_index = np.where(labels >= 0, number[labels], -1).astype(np.int16)
    uses = _uses(things, found.room_index, number, grid)
    kinds = [uses.get(at) or _kind(room_index == at, grid) for at in range(int(keep.sum()))]
    names = _numbered(kinds)
    rooms = tuple(
        Room(name, kind, outline_m(room_index == at, grid))
        for at, (name, kind) in enumerate(zip(names, kinds, strict=True))
    )
    openings = [
        Opening((int(number[a]), int(number[b])), opening.segment_m, opening.width_m)
        for opening in found.doors
        for a, b in [opening.rooms]
        if keep[a] and keep[b]
    ]
    notes.add(f"{len(rooms)} rooms and {len(openings)} doors found by the walls: no labels")
    return rooms, doors_of(openings, names), room_index


def doors_of(openings: Sequence[Opening], names: Sequence[str]) -> tuple[Door, ...]:
    """Doors, numbered, from openings."""
    return tuple(
        Door(
            f"door_{number}",
            np.round(opening.segment_m, 4),
            round(float(opening.width_m), 4),
            (names[opening.rooms[0]], names[opening.rooms[1]]),
        )
        for number, opening in enumerate(openings, start=1)
    )


def _uses(
    things: Sequence[tuple[str, tuple[float, float]]],
    labels: np.ndarray,
    number: np.ndarray,
    grid: GridFrame,
) -> dict[int, RoomKind]:
    """What rooms are used for by the furniture that stands in or beside them."""
    if not (labels >= 0).any():
        return {}
    row, col = ndimage.distance_transform_edt(
        labels < 0, return_distances=False, return_indices=True
    )
    votes: dict[int, Counter[RoomKind]] = {}
    heard: set[tuple[int, str]] = set()
    for kind, place in things:
        at = grid.cell_of(*place)
        if kind in _USE_OF and 0 <= at[0] < grid.rows and 0 <= at[1] < grid.cols:
            room = int(number[labels[row[at], col[at]]])
            use, weight = _USE_OF[kind]
            if room >= 0 and (room, kind) not in heard:
                heard.add((room, kind))
                votes.setdefault(room, Counter())[use] += weight
    is_home = any(use != RoomKind.STUDY for found in votes.values() for use in found)
    uses = {}
    for room, found in votes.items():
        use, count = found.most_common(1)[0]
        if count >= _VOTES:
            uses[room] = use if is_home or use != RoomKind.STUDY else RoomKind.OFFICE
    return uses


def _kind(cells: np.ndarray, grid: GridFrame) -> RoomKind:
    """What a room may be by its shape: long ones are hallways, large ones open."""
    area_m2 = float(cells.sum()) * grid.resolution_m**2
    half_m = float(ndimage.distance_transform_edt(np.pad(cells, 1)).max()) * grid.resolution_m
    if area_m2 > _ELONGATED * (2 * half_m) ** 2 and half_m < 2.5:
        return RoomKind.HALLWAY
    return RoomKind.OPEN_SPACE if area_m2 > _OPEN_SPACE_M2 else RoomKind.OFFICE


def _numbered(kinds: Sequence[RoomKind]) -> list[str]:
    """`kind_number` for each, as the Stanford areas name their rooms."""
    count: Counter[RoomKind] = Counter()
    names = []
    for kind in kinds:
        count[kind] += 1
        names.append(f"{kind}_{count[kind]}")
    return names


def _unique(names: Sequence[str]) -> list[str]:
    """Printable names, each once: a second `Bedroom` becomes `Bedroom 2`."""
    count: Counter[str] = Counter()
    unique: list[str] = []
    for name in names:
        plain = "".join(letter for letter in name if letter.isprintable()).strip() or "room"
        count[plain] += 1
        candidate = plain if count[plain] == 1 else f"{plain} {count[plain]}"
        while candidate in unique:
            count[plain] += 1
            candidate = f"{plain} {count[plain]}"
        unique.append(candidate)
    return unique
