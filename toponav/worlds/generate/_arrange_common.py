"""What most rooms have: curtains, lamps, pictures, plants, radiators and odds and ends."""

from toponav.worlds.generate._home_room import Placed, RoomBuilder

__all__ = ["decorate", "dress_windows", "put_desk"]


def dress_windows(room: RoomBuilder, curtains: float, radiators: float = 0.5) -> None:
    """Curtains beside windows and a radiator below."""
    for run in room.runs:
        for window in run.windows:
            if room.chance(curtains):
                room.hang_curtains(run, window)
            if window.sill_m > 0.7 and room.chance(radiators):
                middle = (window.start_m + window.stop_m) / 2
                room.on_wall("radiator", 0.0, run=run, along_m=middle, tries=1)


def decorate(
    room: RoomBuilder, pictures: int, *, plants: int = 0, clock: float = 0.0, clutter: int = 0
) -> None:
    """Pictures at eye level, plants in corners, things that lie about."""
    for _ in range(int(room.rng.integers(pictures // 2, pictures + 1))):
        room.on_wall("picture", float(room.rng.uniform(1.45, 1.65)))
    if room.chance(clock):
        room.on_wall("clock", float(room.rng.uniform(1.7, 1.95)))
    for _ in range(int(room.rng.integers(0, plants + 1))):
        room.at_wall("plant", corner=True, under_windows=True)
    for _ in range(int(room.rng.integers(0, clutter + 1))):
        room.at_wall(str(room.rng.choice(["box", "book_pile", "fan", "laundry_basket"])), tries=5)


def put_desk(room: RoomBuilder, *, centered: bool = False) -> Placed | None:
    """A desk with its chair, computer and lamp."""
    desk = room.at_wall("desk", centered=centered, under_windows=True)
    if desk is None:
        return None
    room.before(desk, "office_chair", -0.12, turned=True, wobble_rad=0.25)
    room.on_top(desk, "computer", 0.0, 0.3)
    half = desk.size_m[0] / 2
    room.on_top(desk, "table_lamp", half - 0.16, 0.18)
    if room.chance(0.7):
        room.on_top(desk, "book_pile", -half + 0.2, 0.3)
    return desk
