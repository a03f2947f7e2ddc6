"""Living rooms, dining rooms, studies and hallways."""

from toponav.worlds.generate._arrange_common import decorate, dress_windows, put_desk
from toponav.worlds.generate._home_room import RoomBuilder

__all__ = ["furnish_dining_room", "furnish_hallway", "furnish_living_room", "furnish_study"]


def furnish_living_room(room: RoomBuilder, *, dining: bool, with_bed: bool) -> None:
    """A sofa that faces a television over a coffee table, and what stands around them."""
    if with_bed:
        _sleeping_corner(room)
    stand = room.at_wall("tv_stand", centered=True, under_windows=True)
    if stand is not None:
        room.on_top(stand, "tv", 0.0, 0.22)
        if room.chance(0.5):
            room.on_top(stand, "vase", stand.size_m[0] / 2 - 0.12)
    _seats(room, stand)
    if dining:
        _dining_set(room, room_m=0.45)
    if room.chance(0.85):
        shelf = room.at_wall("bookcase")
        if shelf is not None and room.chance(0.4):
            room.beside(shelf, "bookcase", 1)
    for name, share in (
        ("fireplace", 0.2),
        ("piano", 0.15),
        ("sideboard", 0.4),
        ("floor_lamp", 0.7),
        ("armchair", 0.3),
        ("guitar", 0.15),
    ):
        if room.chance(share):
            room.at_wall(name, corner=name in ("floor_lamp", "armchair", "guitar"))
    dress_windows(room, 0.75)
    room.hang_lamp()
    decorate(room, 5, plants=3, clock=0.3, clutter=1)


def _seats(room: RoomBuilder, stand) -> None:  # type: ignore[no-untyped-def]
    """Sofa, coffee table, rug and armchairs."""
    sofa = None
    name = "corner_sofa" if room.area_m2 > 20 and room.chance(0.3) else "sofa"
    if stand is not None and room.area_m2 > 17 and room.chance(0.45):
        sofa = room.before(stand, name, float(room.rng.uniform(1.9, 2.6)), turned=True)
    if sofa is None:
        sofa = room.at_wall(name, facing=stand, under_windows=True, tries=40)
    if sofa is None:
        sofa = room.at_wall("sofa", under_windows=True, tries=40) or room.at_wall("armchair")
    if sofa is None:
        return
    room.rug(sofa, gap_m=float(room.rng.uniform(-0.3, 0.05)))
    if sofa.piece.name != "corner_sofa":
        table = room.before(sofa, "coffee_table", float(room.rng.uniform(0.3, 0.42)))
        if table is not None and room.chance(0.6):
            room.on_top(table, str(room.rng.choice(["vase", "book_pile"])))
        if room.chance(0.6):
            side = int(room.rng.choice([-1, 1]))
            small = room.beside(sofa, "side_table", side, 0.06)
            if small is not None:
                room.on_top(small, "table_lamp")
    if room.chance(0.5):
        chair = room.model("armchair")
        gap = 1.25 if room.chance(0.5) else 0.9
        room.before(sofa, chair, gap, turned=True, right_m=float(room.rng.uniform(-1, 1)))
    if room.chance(0.35):
        room.before(sofa, "ottoman", 0.5, right_m=float(room.rng.choice([-0.95, 0.95])))


def _sleeping_corner(room: RoomBuilder) -> None:
    bed = room.at_wall("bed", corner=True, under_windows=True, tries=40)
    if bed is not None:
        stand = room.beside(bed, "nightstand", 1) or room.beside(bed, "nightstand", -1)
        if stand is not None:
            room.on_top(stand, "table_lamp")
    room.at_wall("wardrobe", corner=True)


def _dining_set(room: RoomBuilder, *, room_m: float = 0.6, kitchen: bool = False) -> bool:
    """A table where there is room for it, chairs around it and a lamp above."""
    table = room.in_middle("kitchen_table" if kitchen else "dining_table", room_m=room_m)
    if table is None:
        table = room.at_wall("kitchen_table", under_windows=True)
    if table is None:
        return False
    room.around(table, "chair", int(room.rng.integers(2, 4)) if kitchen else 8)
    room.on_top(table, "vase" if room.chance(0.7) else "kettle")
    room.hang_lamp(table)
    return True


def furnish_dining_room(room: RoomBuilder) -> None:
    """A table in the middle with chairs, and cabinets for dishes."""
    table_first = _dining_set(room)
    for name, share in (("sideboard", 0.75), ("china_cabinet", 0.6), ("sideboard", 0.2)):
        if room.chance(share):
            board = room.at_wall(name, centered=True)
            if board is not None and name == "sideboard":
                room.on_top(board, "vase", 0.3)
                if room.chance(0.5):
                    room.on_top(board, "table_lamp", -0.35)
    if not table_first:
        room.at_wall("bench")
    if room.chance(0.5):
        room.rug_in_middle()
    dress_windows(room, 0.7)
    decorate(room, 4, plants=2, clock=0.35)


def furnish_study(room: RoomBuilder) -> None:
    """A desk, books, and somewhere to read."""
    put_desk(room)
    for name, share in (
        ("bookcase", 1.0),
        ("bookcase", 0.7),
        ("filing_cabinet", 0.6),
        ("armchair", 0.5),
        ("dresser", 0.15),
        ("floor_lamp", 0.5),
        ("fitness", 0.25),
        ("guitar", 0.2),
    ):
        if room.chance(share):
            placed = room.at_wall(name, corner=name not in ("bookcase", "dresser"))
            if placed is not None and name == "filing_cabinet":
                room.on_top(placed, "printer")
    if room.chance(0.5):
        room.rug_in_middle()
    room.on_wall("shelf", 0.0)
    dress_windows(room, 0.5)
    room.hang_lamp()
    decorate(room, 3, plants=1, clock=0.4, clutter=2)


def furnish_hallway(room: RoomBuilder) -> None:
    """Coats, shoes, a console with a mirror, a runner."""
    if room.chance(0.85):
        room.on_wall("coat_rack", 0.0)
    for name, share in (("shoe_rack", 0.7), ("console_table", 0.5), ("bench", 0.25)):
        if room.chance(share):
            placed = room.at_wall(name, tries=25)
            if placed is not None and name == "console_table":
                room.on_top(placed, "vase", 0.2)
                assert placed.run is not None
                room.on_wall("mirror", 1.5, run=placed.run, along_m=placed.along_m, tries=1)
    if room.chance(0.4):
        room.at_wall("umbrella_stand", corner=True)
    if room.chance(0.3):
        room.at_wall("bookcase", tries=20)
    if room.chance(0.75):
        room.rug_in_middle("runner")
    room.hang_lamp()
    dress_windows(room, 0.2)
    decorate(room, 6, plants=1, clock=0.2)
    room.lay_door_mat()
