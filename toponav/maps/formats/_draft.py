"""A map under import: what a format does not say is guessed, noted, and checked at the end."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeGuard

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import Behavior, NodeKind, RoomKind
from toponav.maps.elements import Edge, MapFrame, Node, edge_along
from toponav.maps.formats._values import Place, is_name
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.schema import map_schema_faults
from toponav.maps.spec import TopologicalMap, map_to_document
from toponav.maps.suggest_behaviors import suggest_behaviors

__all__ = ["MapDraft", "checked", "kind_of_name"]

MOST_NODES, MOST_EDGES = 100_000, 500_000
_LONGEST_NAME = 200
_PASSAGE_WORDS = ("corridor", "passage", "junction", "aisle")
_FOLDED_KINDS = {kind.value.replace("_", ""): kind for kind in RoomKind}


@dataclass
class MapDraft:
    """Nodes and edges of a file, in the order in which they were read."""

    place: Place
    name: str
    frame: MapFrame
    notes: Notes
    nodes: dict[str, Node] = field(default_factory=dict)
    edges: dict[str, Edge] = field(default_factory=dict)
    unknown_behaviors: list[str] = field(default_factory=list)
    _last_number: dict[str, int] = field(default_factory=dict)

    def add_node(
        self,
        place: Place,
        node_id: Any,
        x_m: float,
        y_m: float,
        extras: Mapping[str, Any] | None = None,
    ) -> None:
        """A node, with the `kind`, `room` and `size` that a file of ours has among its extras."""
        node_id = place.name(node_id)
        if node_id in self.nodes:
            raise place.fault(f"two nodes are called '{node_id}'", "give each its own name")
        if len(self.nodes) >= MOST_NODES:
            raise place.fault(f"at most {MOST_NODES:,} nodes are read", "read a part of the map")
        extras = extras or {}
        kind, room = extras.get("kind"), extras.get("room")
        if not isinstance(kind, str) or kind not in _KINDS:
            if kind is not None:
                self.notes.dropped("kinds of nodes", "are not ours", node_id)
            kind = kind_of_name(node_id)
            self.notes.guessed("kinds of nodes", "from their names, else hallway", node_id)
        if room is not None and not is_name(room):
            self.notes.dropped("rooms of nodes", "are no names", node_id)
            room = None
        size = 1.0
        if extras.get("size") is not None:
            size = place.key("size").number(extras["size"], 0.001, 1000.0)
        self.nodes[node_id] = Node(node_id, NodeKind(kind), x_m, y_m, room, size)

    def free_node_id(self, wanted: str) -> str:
        """The name, or with a number behind it when it is taken."""
        return self._free(wanted, self.nodes)

    def add_edge(
        self,
        place: Place,
        source: str,
        target: str,
        edge_id: Any = None,
        extras: Mapping[str, Any] | None = None,
    ) -> None:
        """An edge, with the `behavior`, `yaw` and `length` that a file of ours has."""
        for end in (source, target):
            if end not in self.nodes:
                raise place.fault(
                    f"there is no node '{str(end)[:60]}'", did_you_mean(str(end), self.nodes)
                )
        if len(self.edges) >= MOST_EDGES:
            raise place.fault(f"at most {MOST_EDGES:,} edges are read", "read a part of the map")
        extras = extras or {}
        behavior = extras.get("behavior")
        known = Behavior(behavior) if _is_behavior(behavior) else None
        edge = edge_along(
            self.nodes[source], self.nodes[target], known or Behavior.CORRIDOR_FOLLOW
        )
        if edge_id is not None:
            edge = replace(edge, id=place.name(edge_id))
        free = self._free(edge.id, self.edges)
        if free != edge.id and edge_id is not None:
            self.notes.changed("ids of edges", "were not unique", edge.id)
        edge = replace(edge, id=free)
        if extras.get("yaw") is not None:
            edge = replace(edge, yaw_rad=place.key("yaw").number(extras["yaw"], -6.3, 6.3))
        if extras.get("length") is not None:
            edge = replace(edge, length_m=place.key("length").number(extras["length"], 0.0))
        if known is None:
            self.unknown_behaviors.append(edge.id)
            if behavior is not None:
                self.notes.dropped("behaviours of edges", "are not ours", edge.id)
        self.edges[edge.id] = edge

    def _free(self, wanted: str, taken: Mapping[str, object]) -> str:
        if wanted not in taken and len(wanted) <= _LONGEST_NAME:
            return wanted
        stem = wanted[: _LONGEST_NAME - 10]
        number = self._last_number.get(stem, 1)
        while (name := f"{stem}#{(number := number + 1)}") in taken:
            continue
        self._last_number[stem] = number
        return name

    def finish(self) -> tuple[TopologicalMap, ConversionReport]:
        """The map, which can be saved and loaded again, and what was lost on the way."""
        try:
            made = TopologicalMap(
                self.name, self.frame, tuple(self.nodes.values()), tuple(self.edges.values())
            )
            if self.unknown_behaviors:
                made = suggest_behaviors(made, self.unknown_behaviors)
                self.notes.guessed(
                    "behaviours of edges",
                    "from the kinds of their nodes and the way they bend",
                    self.unknown_behaviors[0],
                    len(self.unknown_behaviors),
                )
        except InputError as error:
            raise self.place.fault(error.rule, error.remedy) from None
        return checked(made, self.place), self.notes.report()


def checked(made: TopologicalMap, place: Place) -> TopologicalMap:
    """The map, if it can be saved and loaded again.

    Raises:
        InputError: If a name or a number is beyond what our format holds.
    """
    faults = map_schema_faults(map_to_document(made))
    if faults:
        raise place.fault(f"{faults[0][0]}: {faults[0][1]}")
    return made


def kind_of_name(name: str) -> NodeKind:
    """The kind of place that a name stands for, with hallway for names that say nothing.

    Example:
        >>> kind_of_name("office_12"), kind_of_name("WayPoint7")
        (<NodeKind.ROOM: 'room'>, <NodeKind.HALLWAY: 'hallway'>)
    """
    folded = name.lower().replace("_", "").replace("-", "").replace(" ", "")
    if "door" in folded:
        return NodeKind.DOOR
    if folded.startswith(_PASSAGE_WORDS):
        return NodeKind.HALLWAY
    for word, kind in _FOLDED_KINDS.items():
        if folded.startswith(word):
            if kind.is_enclosed:
                return NodeKind.ROOM
            is_open = kind in (RoomKind.OPEN_SPACE, RoomKind.LOUNGE)
            return NodeKind.OPEN_SPACE if is_open else NodeKind.HALLWAY
    return NodeKind.ROOM if folded.startswith("room") else NodeKind.HALLWAY


_KINDS = frozenset(kind.value for kind in NodeKind)
_BEHAVIORS = frozenset(behavior.value for behavior in Behavior)


def _is_behavior(value: Any) -> TypeGuard[str]:
    return isinstance(value, str) and value in _BEHAVIORS
