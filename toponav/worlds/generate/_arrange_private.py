"""Bedrooms, bathrooms and storage rooms."""

from toponav.worlds.generate._arrange_common import decorate, dress_windows, put_desk
from toponav.worlds.generate._home_room import Placed, RoomBuilder

__all__ = ["furnish_bathroom", "furnish_bedroom", "furnish_storage"]


def furnish_bedroom(room: RoomBuilder, *, main: bool) -> None:
    """A bed with its head at a wall, and where clothes are kept; children's rooms have toys."""
    child = not main and room.chance(0.55)
    bed = _bed(room, main, child)
    if bed is not None and bed.run is not None:
        _beside_bed(room, bed, child)
        if room.chance(0.8):
            high = bed.size_m[2] + float(room.rng.uniform(0.4, 0.55))
            room.on_wall("picture", max(high, 1.5), run=bed.run, along_m=bed.along_m, tries=1)
    room.at_wall("wardrobe", corner=room.chance(0.5), tries=40)
    if room.chance(0.8):
        dresser = room.at_wall("dresser")
        if dresser is not None and dresser.run is not None:
            room.on_wall("mirror", 1.5, run=dresser.run, along_m=dresser.along_m, tries=1)
            room.on_top(dresser, str(room.rng.choice(["vase", "table_lamp", "book_pile"])), 0.25)
    if child:
        put_desk(room)
        for name in ("toy_box", "bookcase", "toy_box", "ottoman"):
            if room.chance(0.7):
                room.at_wall(name, corner=True)
    elif room.chance(0.35):
        put_desk(room)
    for name, share in (("armchair", 0.3), ("laundry_basket", 0.35), ("floor_lamp", 0.2)):
        if room.chance(share):
            room.at_wall(name, corner=True)
    if room.chance(0.35):
        room.rug_in_middle()
    dress_windows(room, 0.9)
    room.hang_lamp()
    decorate(room, 3, plants=1, clutter=2)


def _bed(room: RoomBuilder, main: bool, child: bool) -> Placed | None:
    """The largest bed that fits."""
    names = ["bed", "single_bed"]
    if child:
        names = [str(room.rng.choice(["bunk_bed", "single_bed", "child_bed", "single_bed"]))]
        names.append("single_bed")
    elif not main and room.chance(0.4):
        names = ["single_bed"]
    for name in names:
        centered = name == "bed" or room.chance(0.3)
        bed = room.at_wall(
            name, centered=centered, corner=not centered, under_windows=True, tries=60
        )
        if bed is not None:
            return bed
    return None


def _beside_bed(room: RoomBuilder, bed: Placed, child: bool) -> None:
    """Night stands with lamps, a rug, a bench at the foot."""
    for side in (-1, 1):
        if room.chance(0.6 if child else 0.92):
            stand = room.beside(bed, "nightstand", side)
            if stand is not None:
                room.on_top(stand, "table_lamp" if room.chance(0.75) else "book_pile")
    if room.chance(0.55):
        room.rug(bed, gap_m=-float(room.rng.uniform(0.5, 1.1)))
    if bed.piece.name == "bed" and room.chance(0.2):
        room.before(bed, "bench", 0.05)


def furnish_bathroom(room: RoomBuilder) -> None:
    """Toilet, basin with a mirror, and a tub or a shower."""
    tub_first = room.area_m2 > 5.0 and room.chance(0.65)
    for name in ("bathtub", "shower") if tub_first else ("shower", "bathtub"):
        if room.at_wall(name, corner=True, under_windows=True, tries=40) is not None:
            break
    basin = room.at_wall("washbasin", centered=True, tries=40)
    if basin is not None and basin.run is not None:
        high = 1.55
        if not room.on_wall("mirror", high, run=basin.run, along_m=basin.along_m, tries=1):
            room.on_wall("mirror", high)
        if room.chance(0.5):
            small = room.model("bathroom_cabinet")
            if room.beside(basin, small, 1, 0.05) is None:
                room.beside(basin, small, -1, 0.05)
    room.at_wall("toilet", tries=40, under_windows=True)
    if room.chance(0.45):
        machine = room.at_wall("washing_machine", corner=True)
        if machine is not None and room.chance(0.5):
            room.on_top(machine, "laundry_basket" if room.chance(0.3) else "vase")
    room.on_wall("towel_rack", 0.0)
    for name, share in (("laundry_basket", 0.5), ("trash_can", 0.5), ("stool", 0.15)):
        if room.chance(share):
            room.at_wall(name, corner=True, under_windows=True)
    if room.chance(0.8):
        room.rug_in_middle("bath_mat")
    dress_windows(room, 0.15, 0.4)
    room.hang_lamp()
    if room.chance(0.3):
        room.at_wall("plant", corner=True, under_windows=True)


def furnish_storage(room: RoomBuilder) -> None:
    """Racks, boxes and machines."""
    for name, share in (
        ("storage_rack", 1.0),
        ("storage_rack", 0.7),
        ("washing_machine", 0.5),
        ("box", 0.9),
        ("ladder", 0.5),
        ("vacuum_cleaner", 0.6),
        ("bicycle", 0.25),
        ("ironing_board", 0.35),
        ("box", 0.6),
        ("shoe_rack", 0.3),
        ("fan", 0.3),
    ):
        if room.chance(share):
            room.at_wall(name, corner=name not in ("storage_rack", "bicycle"))
    room.hang_lamp()
