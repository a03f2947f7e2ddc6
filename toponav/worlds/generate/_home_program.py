"""Which rooms a home has, and how large each wants to be."""

from dataclasses import dataclass

import numpy as np

from toponav.core.vocabulary import RoomKind

__all__ = ["FEWEST_ROOMS", "MOST_ROOMS", "RoomSpec", "draw_program"]

FEWEST_ROOMS, MOST_ROOMS = 2, 9

# Homes of six to nine rooms are the common case: they span 10 to 16 m, as far as the longest
# goals of image-goal navigation.
_ROOM_COUNTS = {2: 0.02, 3: 0.04, 4: 0.07, 5: 0.11, 6: 0.19, 7: 0.23, 8: 0.19, 9: 0.15}

_AREA_M2: dict[RoomKind, tuple[float, float]] = {
    RoomKind.LIVING_ROOM: (20.0, 34.0),
    RoomKind.KITCHEN: (9.0, 16.0),
    RoomKind.DINING_ROOM: (10.5, 17.0),
    RoomKind.BEDROOM: (10.0, 18.0),
    RoomKind.BATHROOM: (5.0, 8.5),
    RoomKind.HALLWAY: (8.0, 13.0),
    RoomKind.STUDY: (8.0, 13.0),
    RoomKind.STORAGE: (3.5, 6.0),
}
_EXTRAS: tuple[tuple[RoomKind, float, int], ...] = (
    (RoomKind.BEDROOM, 0.34, 4),
    (RoomKind.DINING_ROOM, 0.2, 1),
    (RoomKind.BATHROOM, 0.2, 2),
    (RoomKind.STUDY, 0.16, 1),
    (RoomKind.STORAGE, 0.1, 1),
)


@dataclass(frozen=True)
class RoomSpec:
    """A room to be laid out."""

    name: str
    kind: RoomKind
    area_m2: float
    has_kitchenette: bool = False
    has_bed: bool = False

    @property
    def is_public(self) -> bool:
        """Whether guests are led into it, so that wide openings suit it."""
        return self.kind in (RoomKind.LIVING_ROOM, RoomKind.DINING_ROOM, RoomKind.KITCHEN)


def draw_program(rng: np.random.Generator, rooms: int | None) -> tuple[RoomSpec, ...]:
    """The rooms of a home, hallways included, from the most public to the most private."""
    count = rooms or int(rng.choice(list(_ROOM_COUNTS), p=list(_ROOM_COUNTS.values())))
    kinds = _kinds(rng, count)
    scale = float(rng.uniform(0.92, 1.22))
    has_kitchen = RoomKind.KITCHEN in kinds
    seen: dict[RoomKind, int] = {}
    specs = []
    for kind in kinds:
        seen[kind] = seen.get(kind, 0) + 1
        low, high = _AREA_M2[kind]
        area_m2 = float(rng.uniform(low, high)) * scale
        if kind is RoomKind.BEDROOM:
            area_m2 = area_m2 * (1.12 if seen[kind] == 1 else 0.88)
        if kind is RoomKind.LIVING_ROOM and not has_kitchen:
            area_m2 += 7.0
        if kind is RoomKind.KITCHEN and RoomKind.LIVING_ROOM not in kinds:
            area_m2 += 7.0
        specs.append(
            RoomSpec(
                f"{kind}_{seen[kind]}",
                kind,
                area_m2,
                has_kitchenette=kind is RoomKind.LIVING_ROOM and not has_kitchen,
                has_bed=kind is RoomKind.LIVING_ROOM and RoomKind.BEDROOM not in kinds,
            )
        )
    return tuple(specs)


def _kinds(rng: np.random.Generator, count: int) -> list[RoomKind]:
    """Kinds in order of publicness; from five rooms on there is a hallway."""
    if count == 2:
        return [RoomKind.LIVING_ROOM, RoomKind.BATHROOM]
    if count == 3:
        first = RoomKind.LIVING_ROOM if rng.random() < 0.6 else RoomKind.KITCHEN
        return [first, RoomKind.BEDROOM, RoomKind.BATHROOM]
    kinds = [RoomKind.LIVING_ROOM, RoomKind.KITCHEN, RoomKind.BEDROOM, RoomKind.BATHROOM]
    if count >= 5:
        kinds.append(RoomKind.HALLWAY)
    while len(kinds) < count:
        open_kinds = [(kind, share) for kind, share, most in _EXTRAS if kinds.count(kind) < most]
        shares = np.array([share for _, share in open_kinds])
        kinds.append(open_kinds[int(rng.choice(len(open_kinds), p=shares / shares.sum()))][0])
    order = [RoomKind.HALLWAY, *(kind for kind in _AREA_M2 if kind is not RoomKind.HALLWAY)]
    return sorted(kinds, key=order.index)
