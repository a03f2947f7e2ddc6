"""The papers' words, one spelling each."""

from enum import StrEnum

__all__ = ["Behavior", "Difficulty", "NodeKind", "Outcome", "RoomKind"]


class Behavior(StrEnum):
    """What a robot does along one edge of a topological map (GraphNav, section IV)."""

    CORRIDOR_FOLLOW = "corridor_follow"
    FIND_DOOR = "find_door"
    TURN_LEFT = "turn_left"
    TURN_RIGHT = "turn_right"
    STRAIGHT = "straight"


class NodeKind(StrEnum):
    """What a node of a topological map stands for."""

    ROOM = "room"
    DOOR = "door"
    HALLWAY = "hallway"
    OPEN_SPACE = "open_space"


class RoomKind(StrEnum):
    """What a room is used for, in the words of Stanford 2D-3D-S and of homes."""

    OFFICE = "office"
    CONFERENCE_ROOM = "conference_room"
    WC = "wc"
    STORAGE = "storage"
    PANTRY = "pantry"
    COPY_ROOM = "copy_room"
    AUDITORIUM = "auditorium"
    LOUNGE = "lounge"
    LOBBY = "lobby"
    HALLWAY = "hallway"
    OPEN_SPACE = "open_space"
    KITCHEN = "kitchen"
    LIVING_ROOM = "living_room"
    DINING_ROOM = "dining_room"
    BEDROOM = "bedroom"
    BATHROOM = "bathroom"
    STUDY = "study"

    @property
    def is_enclosed(self) -> bool:
        """Whether the paper calls it an actual room: neither hallway, open space nor lounge."""
        return self not in _PASSAGES


_PASSAGES = frozenset({RoomKind.HALLWAY, RoomKind.OPEN_SPACE, RoomKind.LOUNGE, RoomKind.LOBBY})


class Outcome(StrEnum):
    """How an episode of the GraphNav protocol ended."""

    SUCCESS = "success"
    DEVIATED = "deviated"
    STUCK = "stuck"
    COLLIDED = "collided"
    TIMEOUT = "timeout"


class Difficulty(StrEnum):
    """Length class of a plan by its node count (GraphNav, section VII)."""

    I = "I"  # noqa: E741
    II = "II"
    III = "III"

    @staticmethod
    def of_plan(node_count: int) -> "Difficulty":
        """The class of a plan with this many nodes: up to 10, 11 to 20, more than 20."""
        if node_count <= 10:
            return Difficulty.I
        return Difficulty.II if node_count <= 20 else Difficulty.III
