"""Rooms for a building whose floor plan names none: cut from its free space, told by shape."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Int16
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.rooms import outline_m
from toponav.worlds.scene import Room, Scene
from toponav.worlds.segment_rooms import Opening, segment_rooms

__all__ = ["LEAST_ROOM_M2", "with_rooms"]

LEAST_ROOM_M2 = 1.5
"""What is smaller is a cupboard."""
_ELONGATED = 2.8
"""A region this many times as large as the square around its largest circle is a hallway."""
_NARROW_M = 2.0
_HALL_DOORS = 2
_CORRIDOR_M, _BUSY_DOORS = 1.5, 3
"""Narrower than a room, with this many doors: a hallway however short."""
_CLUTTER_M = 0.25
"""Furniture is filled in up to this distance from the floor around it."""
_INDOORS = 0.2
"""Share of the floor that must be left when what touches the plan's edges is left out."""
_HUB_ROOMS = 3
"""A region that leads to as many rooms that no hall leads to is a hall, whatever its shape."""


def with_rooms(scene: Scene) -> Scene:
    """The scene with rooms and hallways cut from its free space; itself where it has rooms.

    Raises:
        InputError: When the free space is one piece without narrow places.
    """
    if scene.rooms and (scene.room_index >= 0).any():
        return scene
    cell_m = scene.grid.resolution_m
    found = segment_rooms(scene.occupied, cell_m, outside=_outdoors(scene.occupied))
    labels = np.where(scene.occupied, -1, found.room_index)
    area_m2 = np.bincount(labels[labels >= 0], minlength=found.rooms) * cell_m**2
    keep = [number for number in range(found.rooms) if area_m2[number] >= LEAST_ROOM_M2]
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    inner = [number for number in keep if number not in set(edge.tolist())]
    if len(inner) > 1 and area_m2[inner].sum() > _INDOORS * area_m2.sum():
        keep = inner
    if len(keep) < 2:
        raise InputError(
            f"a map needs at least two rooms, and the free space falls into {len(keep)}",
            where=f"scene {scene.name}",
            remedy="check the resolution and that walls are occupied, or draw the map by hand",
        )
    halls = _halls(labels, keep, found.doors, cell_m)
    index = np.full(labels.shape, -1, np.int16)
    rooms: list[Room] = []
    counts = {"hallway": 0, "room": 0}
    for number in keep:
        cells = labels == number
        index[cells] = len(rooms)
        base = "hallway" if number in halls else "room"
        counts[base] += 1
        kind = RoomKind.HALLWAY if number in halls else RoomKind.OFFICE
        rooms.append(Room(f"{base}_{counts[base]}", kind, outline_m(cells, scene.grid)))
    return replace(scene, room_index=index, rooms=tuple(rooms), doors=())


def _halls(
    labels: Int16[np.ndarray, "rows cols"],
    keep: list[int],
    doors: tuple[Opening, ...],
    cell_m: float,
) -> set[int]:
    """The regions to pass through."""
    halls = set()
    kept = set(keep)
    count = {n: sum(n in door.rooms and set(door.rooms) <= kept for door in doors) for n in keep}
    for number in keep:
        cells = np.pad(labels == number, 2 + round(_CLUTTER_M / cell_m))
        near = ndimage.distance_transform_edt(~cells) * cell_m <= _CLUTTER_M
        whole = ndimage.binary_fill_holes(near)
        half_m = float(ndimage.distance_transform_edt(whole).max()) * cell_m
        area_m2 = float(whole.sum()) * cell_m**2
        long = area_m2 > _ELONGATED * (2 * half_m) ** 2 and half_m < _NARROW_M
        busy = half_m < _CORRIDOR_M and count[number] >= _BUSY_DOORS
        if busy or (long and count[number] >= _HALL_DOORS):
            halls.add(number)
    return _with_hubs(halls, keep, doors)


def _with_hubs(halls: set[int], keep: list[int], doors: tuple[Opening, ...]) -> set[int]:
    """Halls, and the regions through which people get to the rooms that are not at any of them."""
    beside: dict[int, set[int]] = {number: set() for number in keep}
    for door in doors:
        if set(door.rooms) <= set(keep):
            for number in door.rooms:
                beside[number] |= set(door.rooms) - {number}
    halls = set(halls)
    while len(halls) < len(keep):
        lost = {n for n in keep if n not in halls and not beside[n] & halls}
        hub = max((n for n in keep if n not in halls), key=lambda n: len(beside[n] & lost))
        if len(beside[hub] & lost) < _HUB_ROOMS:
            break
        halls.add(hub)
    return halls


def _outdoors(occupied: Bool[np.ndarray, "rows cols"]) -> Bool[np.ndarray, "rows cols"]:
    """Free floor around the building; none where the building fills the plan to its edges."""
    pieces, count = ndimage.label(~occupied)
    edge = np.concatenate([pieces[0], pieces[-1], pieces[:, 0], pieces[:, -1]])
    outer = np.zeros(count + 1, bool)
    outer[np.unique(edge)] = True
    outer[0] = False
    outdoors: np.ndarray = outer[pieces]
    inner = int((pieces > 0).sum() - outdoors.sum())
    return outdoors if inner * 4 > int(outdoors.sum()) else np.zeros_like(outdoors)
