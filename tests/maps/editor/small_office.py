"""A corridor of two lanes with a room on either side, drawn without a fault."""

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.spec import Edge, Node, edge_along

NODES = (
    Node("hall-1", NodeKind.HALLWAY, 0.0, -0.15, "hall"),
    Node("hall-2", NodeKind.HALLWAY, 0.0, 0.15, "hall"),
    Node("hall-3", NodeKind.HALLWAY, 4.0, -0.15, "hall"),
    Node("hall-4", NodeKind.HALLWAY, 4.0, 0.15, "hall"),
    Node("office", NodeKind.ROOM, 2.0, 2.5, "office"),
    Node("office_door", NodeKind.DOOR, 2.0, 1.2, "office"),
    Node("store", NodeKind.ROOM, 2.0, -2.5, "store"),
    Node("store_door", NodeKind.DOOR, 2.0, -1.2, "store"),
)
_BY_ID = {node.id: node for node in NODES}
_WAYS = (
    ("hall-1", "hall-3", Behavior.CORRIDOR_FOLLOW),
    ("hall-4", "hall-2", Behavior.CORRIDOR_FOLLOW),
    ("hall-1", "office", Behavior.TURN_LEFT),
    ("hall-4", "office", Behavior.TURN_RIGHT),
    ("office", "office_door", Behavior.FIND_DOOR),
    ("office_door", "hall-3", Behavior.TURN_LEFT),
    ("office_door", "hall-2", Behavior.TURN_RIGHT),
    ("office_door", "store", Behavior.STRAIGHT),
    ("hall-1", "store", Behavior.TURN_RIGHT),
    ("hall-4", "store", Behavior.TURN_LEFT),
    ("store", "store_door", Behavior.FIND_DOOR),
    ("store_door", "hall-3", Behavior.TURN_RIGHT),
    ("store_door", "hall-2", Behavior.TURN_LEFT),
    ("store_door", "office", Behavior.STRAIGHT),
)
EDGES: tuple[Edge, ...] = tuple(
    edge_along(_BY_ID[source], _BY_ID[target], behavior) for source, target, behavior in _WAYS
)
