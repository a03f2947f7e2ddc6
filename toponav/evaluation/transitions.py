"""Semantic transitions: from what kind of place to what kind of place an edge leads."""

from collections.abc import Mapping

from toponav.core.vocabulary import Behavior, RoomKind
from toponav.maps.plan import Plan
from toponav.maps.spec import Edge, Node, TopologicalMap

__all__ = ["edge_transition", "plan_transitions"]

_TURNS = frozenset({Behavior.TURN_LEFT, Behavior.TURN_RIGHT})


def plan_transitions(
    map_: TopologicalMap, plan: Plan, room_kinds: Mapping[str, RoomKind]
) -> tuple[str, ...]:
    """The transition of each edge of a plan, in order.

    Args:
        map_: The topological map.
        plan: A plan through it.
        room_kinds: What each room is used for, by name; rooms that are not in it are named
            by the kind of the node.
    """
    return tuple(edge_transition(map_, map_.edge(edge), room_kinds) for edge in plan.edges)


def edge_transition(map_: TopologicalMap, edge: Edge, room_kinds: Mapping[str, RoomKind]) -> str:
    """`junction`, `within office` or `office->hallway`.

    A junction is a turn between passages: neither end lies in an actual room. A door node
    belongs to its room, so the turn out of an office is `office->hallway`.

    Reference:
        GraphNav, section VI-B: "whether the robot struggles more with turning *into* offices
        compared to turning *out of* them".
    """
    source, target = map_.node(edge.source), map_.node(edge.target)
    kinds = [_place(node, room_kinds) for node in (source, target)]
    enclosed = any(kind in _ENCLOSED for kind in kinds)
    if edge.behavior in _TURNS and not enclosed:
        return "junction"
    if source.room is not None and source.room == target.room:
        return f"within {kinds[0]}"
    return "->".join(kinds)


def _place(node: Node, room_kinds: Mapping[str, RoomKind]) -> str:
    kind = room_kinds.get(node.room) if node.room is not None else None
    return str(kind if kind is not None else node.kind)


# A map without a scene has only node kinds: of those, rooms and doors are enclosed.
_ENCLOSED = frozenset({str(kind) for kind in RoomKind if kind.is_enclosed} | {"room", "door"})
