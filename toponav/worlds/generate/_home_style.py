"""The colours and coverings of a home: one style, varied from room to room."""

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate._home_program import RoomSpec
from toponav.worlds.generate.surfaces import SURFACE_KINDS, variants

__all__ = ["EACH_OBJECT", "Palette", "draw_palettes"]

Palette = dict[str, int]
"""The variant of each kind of surface, and the home's choices as 0 or 1."""

EACH_OBJECT = ("picture", "rug", "plastic", "cushion", "books", "leaf", "wicker")
"""Kinds of surface that every object chooses for itself."""

_EACH_ROOM = ("paint", "wallpaper", "fabric", "cushion", "curtain", "linen", "carpet", "stone")
_BY_KIND = {RoomKind.BATHROOM: ("wall_tiles", "floor_tiles"), RoomKind.KITCHEN: ("floor_tiles",)}


def draw_palettes(
    rng: np.random.Generator, specs: tuple[RoomSpec, ...], held_out: bool
) -> list[Palette]:
    """A palette for each room, from the surfaces of test homes or from all others."""

    def pick(kind: str) -> int:
        return int(rng.choice(variants(kind, held_out)))

    home = {kind: pick(kind) for kind in SURFACE_KINDS}
    home |= {
        "has_parquet": int(rng.random() < 0.3),
        "has_carpet": int(rng.random() < 0.4),
        "has_kitchen_tiles": int(rng.random() < 0.7),
        "has_wooden_trim": int(rng.random() < 0.25),
        "has_wooden_doors": int(rng.random() < 0.45),
        "has_wooden_front": int(rng.random() < 0.4),
        "has_wallpaper": 0,
    }
    palettes = []
    for spec in specs:
        room = dict(home)
        for kind in _EACH_ROOM:
            if rng.random() < 0.7:
                room[kind] = pick(kind)
        for kind in _BY_KIND.get(spec.kind, ()):
            room[kind] = pick(kind)
        if rng.random() < 0.4:
            room["wood"] = pick("wood")
        papered = spec.kind in (RoomKind.BEDROOM, RoomKind.DINING_ROOM, RoomKind.LIVING_ROOM)
        room["has_wallpaper"] = int(papered and rng.random() < 0.35)
        room["front"] = room["wood"] if room["has_wooden_front"] else room["painted"]
        palettes.append(room)
    return palettes
