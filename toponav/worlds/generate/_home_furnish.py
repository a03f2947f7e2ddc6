"""Furnishes each room of a home by its kind."""

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.furniture_library import FurnitureLibrary
from toponav.worlds.generate._arrange_kitchen import furnish_kitchen, furnish_kitchenette
from toponav.worlds.generate._arrange_living import (
    furnish_dining_room,
    furnish_hallway,
    furnish_living_room,
    furnish_study,
)
from toponav.worlds.generate._arrange_private import (
    furnish_bathroom,
    furnish_bedroom,
    furnish_storage,
)
from toponav.worlds.generate._home_canvas import Canvas
from toponav.worlds.generate._home_room import RoomBuilder
from toponav.worlds.generate._home_style import Palette
from toponav.worlds.generate._home_walls import WallRun

__all__ = ["furnish_home"]


def furnish_home(
    rng: np.random.Generator,
    canvas: Canvas,
    runs: list[WallRun],
    palettes: list[Palette],
    held_out: bool,
    library: FurnitureLibrary | None,
) -> None:
    """Puts furniture into every room."""
    specs = canvas.shell.specs
    kinds = {spec.kind for spec in specs}
    for number, spec in enumerate(specs):
        room = RoomBuilder(rng, canvas, number, runs, palettes[number], held_out, library)
        if spec.kind is RoomKind.KITCHEN:
            dining = kinds.isdisjoint({RoomKind.DINING_ROOM, RoomKind.LIVING_ROOM})
            furnish_kitchen(room, dining=dining)
        elif spec.kind is RoomKind.LIVING_ROOM:
            if spec.has_kitchenette:
                furnish_kitchenette(room)
            dining = RoomKind.DINING_ROOM not in kinds
            furnish_living_room(room, dining=dining, with_bed=spec.has_bed)
        elif spec.kind is RoomKind.BEDROOM:
            furnish_bedroom(room, main=spec.name.endswith("_1"))
        else:
            {
                RoomKind.DINING_ROOM: furnish_dining_room,
                RoomKind.HALLWAY: furnish_hallway,
                RoomKind.STUDY: furnish_study,
                RoomKind.BATHROOM: furnish_bathroom,
                RoomKind.STORAGE: furnish_storage,
            }[spec.kind](room)
