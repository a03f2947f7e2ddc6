"""Hallways, junctions and doorways of a building: what a topological map is drawn from."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from toponav.core.errors import InputError, shown
from toponav.core.typed_json import from_json
from toponav.core.vocabulary import NodeKind

__all__ = ["Doorway", "HallwayLayout", "Junction", "Passage"]

_FORMAT = 1


@dataclass(frozen=True)
class Junction:
    """A point where passages meet, bend or end."""

    name: str
    """Unique name."""
    x_m: float
    """Position along x."""
    y_m: float
    """Position along y."""


@dataclass(frozen=True)
class Passage:
    """A straight piece of hallway or open space between two junctions."""

    name: str
    """Unique name."""
    room: str
    """Room of the scene that it runs through."""
    kind: NodeKind
    """`hallway` or `open_space`."""
    start: str
    """Junction at which it begins."""
    end: str
    """Junction at which it ends."""
    start_reach_m: float
    """Distance from the start at which a turn begins or is complete."""
    end_reach_m: float
    """The same distance from the end."""
    width_m: float
    """Distance between its walls."""


@dataclass(frozen=True)
class Doorway:
    """The opening from a passage, or from a junction, into a room."""

    door: str
    """Door of the scene."""
    room: str
    """Room behind it."""
    x_m: float
    """Centre of the opening on the face of the wall that looks to the hallway, along x."""
    y_m: float
    """The same along y."""
    inward_rad: float
    """Heading with which a robot enters."""
    depth_m: float
    """Thickness of the wall."""
    width_m: float
    """Free width."""
    passage: str | None = None
    """Passage along whose side it lies; None for a doorway at a junction."""
    along_m: float = 0.0
    """Distance from the start of that passage."""
    junction: str | None = None
    """Junction that it faces; None for a doorway along a passage."""


@dataclass(frozen=True)
class HallwayLayout:
    """The skeleton of a building's hallways, with its doorways.

    Args:
        junctions: Where passages meet, bend or end.
        passages: Straight pieces between them.
        doorways: Openings into rooms.

    Raises:
        InputError: If a name repeats or an element refers to one that is not there.
    """

    junctions: tuple[Junction, ...]
    passages: tuple[Passage, ...]
    doorways: tuple[Doorway, ...]

    def __post_init__(self) -> None:
        for what, names in (
            ("junction", [junction.name for junction in self.junctions]),
            ("passage", [passage.name for passage in self.passages]),
            ("doorway", [doorway.door for doorway in self.doorways]),
        ):
            if len(set(names)) != len(names):
                raise _fault(f"{what} names must be unique", "rename one")
        for passage in self.passages:
            for end in (passage.start, passage.end):
                if end not in self.junction_by_name:
                    raise _fault(f"passage '{passage.name}' ends at '{end}'", "add the junction")
        for doorway in self.doorways:
            if (doorway.passage is None) == (doorway.junction is None):
                raise _fault(
                    f"doorway '{doorway.door}' lies on a passage or at a junction", "name one"
                )
            if doorway.passage is not None and doorway.passage not in self.passage_by_name:
                raise _fault(f"doorway '{doorway.door}' has no passage", "add the passage")
            if doorway.junction is not None and doorway.junction not in self.junction_by_name:
                raise _fault(f"doorway '{doorway.door}' has no junction", "add the junction")

    @cached_property
    def junction_by_name(self) -> Mapping[str, Junction]:
        """Every junction under its name."""
        return {junction.name: junction for junction in self.junctions}

    @cached_property
    def passage_by_name(self) -> Mapping[str, Passage]:
        """Every passage under its name."""
        return {passage.name: passage for passage in self.passages}

    def length_m(self, passage: Passage) -> float:
        """Distance between the junctions that a passage connects."""
        start, end = self.junction_by_name[passage.start], self.junction_by_name[passage.end]
        return math.hypot(end.x_m - start.x_m, end.y_m - start.y_m)

    def yaw_rad(self, passage: Passage) -> float:
        """Heading along a passage, from its start to its end."""
        start, end = self.junction_by_name[passage.start], self.junction_by_name[passage.end]
        return math.atan2(end.y_m - start.y_m, end.x_m - start.x_m)

    def to_json(self) -> dict[str, Any]:
        """Numbers, strings and lists, as `scene.json` holds them."""
        return {
            "format": _FORMAT,
            "junctions": [asdict(junction) for junction in self.junctions],
            "passages": [asdict(passage) for passage in self.passages],
            "doorways": [asdict(doorway) for doorway in self.doorways],
        }

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> "HallwayLayout":
        """The layout that `to_json` wrote.

        Raises:
            InputError: If a field is missing, unknown or of the wrong type.
        """
        if document.get("format") != _FORMAT:
            raise _fault(
                f"format must be {_FORMAT}, got {shown(document.get('format'))}",
                "update toponav",
            )
        fields = {key: value for key, value in document.items() if key != "format"}
        return from_json(cls, fields, where="hallway layout", remedy="generate the scene again")


def _fault(rule: str, remedy: str) -> InputError:
    return InputError(rule, where="hallway layout", remedy=remedy)
