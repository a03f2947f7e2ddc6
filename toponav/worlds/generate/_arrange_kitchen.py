"""Kitchens: a worktop along one wall or two, with its machines, and a table where one fits."""

import math

from toponav.worlds.generate._arrange_common import decorate, dress_windows
from toponav.worlds.generate._arrange_living import _dining_set
from toponav.worlds.generate._home_room import Placed, RoomBuilder
from toponav.worlds.generate._home_shell import CELL_M
from toponav.worlds.generate._home_walls import WallRun
from toponav.worlds.generate._pieces_kitchen import MODULE_M

__all__ = ["furnish_kitchen", "furnish_kitchenette"]

_ORDER = ("sink", "dishwasher", "kitchen_cabinet", "stove", "kitchen_cabinet", "kitchen_cabinet")


def furnish_kitchen(room: RoomBuilder, *, dining: bool) -> None:
    """The worktop first, then a table or an island in what is left."""
    modules = _worktop(room, 8 if room.area_m2 > 9 else 6)
    if len(modules) < 4:
        modules += _worktop(room, 4, second=True)
    if room.area_m2 > 13 and not dining and room.chance(0.4):
        island = room.in_middle("kitchen_island", room_m=0.75)
        if island is not None:
            room.around(island, "stool", int(room.rng.integers(1, 4)), 0.02)
            room.hang_lamp(island)
    elif dining or room.chance(0.75):
        _dining_set(room, room_m=0.5, kitchen=not dining or room.area_m2 < 13)
    for name, share in (("trash_can", 0.8), ("china_cabinet", 0.2), ("stool", 0.2)):
        if room.chance(share):
            room.at_wall(name, corner=True)
    dress_windows(room, 0.3, 0.3)
    room.hang_lamp()
    decorate(room, 2, plants=1, clock=0.7)


def furnish_kitchenette(room: RoomBuilder) -> None:
    """A short worktop in a living room."""
    _worktop(room, 4)


def _worktop(room: RoomBuilder, most: int, *, second: bool = False) -> list[Placed]:
    """Modules side by side along the best wall, round its corner if there are more."""
    best: list[Placed] = []
    for run in room.runs[:4] if not second else room.runs[1:5]:
        if run.length_m >= 1.9:
            best = _line(room, run, most)
            if len(best) >= 3:
                break
    if best and len(best) < most and not second:
        first = best[0].run
        others = [run for run in room.runs if first is not None and _meet(first, run)]
        for run in others:
            best += _line(room, run, min(most - len(best), 3), machines=False)
            if len(best) >= most:
                break
    return best


def _meet(one: WallRun, other: WallRun) -> bool:
    """Whether two walls share a corner of the room."""
    if one.horizontal == other.horizontal:
        return False
    return (
        min(abs(one.line_m - other.start_m), abs(one.line_m - other.stop_m)) < 0.06
        and min(abs(other.line_m - one.start_m), abs(other.line_m - one.stop_m)) < 0.06
    )


def _line(room: RoomBuilder, run: WallRun, most: int, *, machines: bool = True) -> list[Placed]:
    """A refrigerator at one end and modules in a row; gaps where a door is."""
    placed: list[Placed] = []
    at, end, step = run.start_m, run.stop_m, 1
    if room.chance(0.5):
        at, end, step = end, at, -1
    names = list(_ORDER) if machines else ["kitchen_cabinet"] * 4
    names += ["kitchen_cabinet"] * most
    if machines:
        fridge = room.model("refrigerator")
        # Whole cells, so that neighbours share none.
        wide = CELL_M * math.ceil(fridge.shape.size_m[0] / CELL_M)
        cold = room.put_at(fridge, run, at + step * wide / 2)
        if cold is not None:
            placed.append(cold)
            at += step * wide
    while (end - at) * step >= MODULE_M - 1e-6 and len(placed) < most:
        middle = at + step * MODULE_M / 2
        name = names[0]
        module = room.put_at(room.model(name), run, middle, low_only=True)
        if module is not None:
            names.pop(0)
            placed.append(module)
            at += step * MODULE_M
            _above(room, run, middle, module)
        else:
            at += step * 0.15
    return placed


def _above(room: RoomBuilder, run: WallRun, along: float, module: Placed) -> None:
    """Tiles behind, a cabinet or a hood above, small machines on top."""
    name = module.piece.name
    room.tile_wall(run, (along - MODULE_M / 2, along + MODULE_M / 2), (0.9, 1.42))
    room.on_wall(
        "range_hood" if name == "stove" else "upper_cabinet", 0.0, run=run, along_m=along, tries=1
    )
    if name in ("kitchen_cabinet", "dishwasher") and room.chance(0.45):
        room.on_top(module, "microwave" if room.chance(0.5) else "kettle", 0.0, 0.25, z_m=0.905)
