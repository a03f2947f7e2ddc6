"""What can be wrong with a topological map, and what the checks know about its building."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from toponav.core.vocabulary import RoomKind
from toponav.maps.spec import Edge, Node, TopologicalMap

__all__ = ["Building", "Fault", "Rule", "Severity"]


class Rule(StrEnum):
    """The checks by name; the first six are the rules of GraphNav's section IV in order."""

    ONE_NODE_PER_ROOM = "one-node-per-room"
    DOOR_HAS_NODE = "door-has-node"
    FIND_DOOR = "find-door-joins-room-and-door"
    TWO_LANES = "two-lanes-per-corridor"
    ENTER_AT_ROOM = "enter-at-room-node"
    EXIT_AT_DOOR = "exit-from-door-node"
    DOCUMENT = "document-follows-schema"
    UNIQUE_ID = "unique-id"
    EDGE_HAS_NODES = "edge-has-nodes"
    NO_SELF_LOOP = "no-self-loop"
    ONE_EDGE_PER_PAIR = "one-edge-per-pair"
    REACHABLE = "every-room-reachable"
    CONNECTED = "no-dead-end"
    POSITIVE_LENGTH = "positive-length"
    LENGTH_FITS = "length-fits-geometry"
    YAW_FITS = "yaw-fits-geometry"
    BEHAVIOR_FITS = "behavior-fits-geometry"
    IN_FREE_SPACE = "node-in-free-space"
    IN_ITS_ROOM = "node-in-its-room"
    KNOWN_ROOM = "room-exists"
    SIZE_HAS_NODE = "size-has-node"

    @property
    def paper_number(self) -> int | None:
        """Its number in the paper's list of rules, or None."""
        position = list(Rule).index(self) + 1
        return position if position <= 6 else None


class Severity(StrEnum):
    """How bad a fault is."""

    ERROR = "error"
    """The map breaks a rule that agents rely on."""
    WARNING = "warning"
    """Probably a slip; navigation can go on."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with a map."""

    rule: Rule
    """The check that failed."""
    severity: Severity
    """How bad it is."""
    element: str
    """What is at fault: an element's kind and id."""
    place_m: tuple[float, float] | None
    """Where it is in the map's frame, for display; None where it has no place."""
    message: str
    """What holds instead of the rule."""
    remedy: str
    """What to do about it."""
    fixable: bool = False
    """Whether a program can do that without asking anything."""

    def to_document(self) -> dict[str, Any]:
        """The fault as JSON."""
        return {
            "rule": self.rule.value,
            "severity": self.severity.value,
            "element": self.element,
            "place": None if self.place_m is None else list(self.place_m),
            "message": self.message,
            "remedy": self.remedy,
            "fixable": self.fixable,
        }


@dataclass(frozen=True)
class Building:
    """What the checks may ask about the building that a map is of; each answer is optional."""

    rooms: Mapping[str, RoomKind] | None = None
    """Its rooms by exact name."""
    rooms_left_out: frozenset[str] = frozenset()
    """Rooms that are left out of the map on purpose."""
    room_at: Callable[[float, float], str | None] | None = None
    """The room at a position in the map's frame, in metres."""
    is_free: Callable[[float, float], bool] | None = None
    """Whether a robot fits at a position in the map's frame, in metres."""


def node_fault(rule: Rule, node: Node, message: str, remedy: str, **more: Any) -> Fault:
    """A fault of a node, an error unless said otherwise."""
    severity = more.pop("severity", Severity.ERROR)
    place_m = (node.x_m, node.y_m)
    return Fault(rule, severity, f"node {node.id}", place_m, message, remedy, **more)


def edge_fault(
    topological_map: TopologicalMap, rule: Rule, edge: Edge, message: str, remedy: str, **more: Any
) -> Fault:
    """A fault of an edge at its middle, an error unless said otherwise."""
    severity = more.pop("severity", Severity.ERROR)
    source, target = topological_map.node(edge.source), topological_map.node(edge.target)
    place_m = ((source.x_m + target.x_m) / 2, (source.y_m + target.y_m) / 2)
    return Fault(rule, severity, f"edge {edge.id}", place_m, message, remedy, **more)
