"""Topological maps drawn from a building's hallways as the authors drew theirs by hand.

Every place where a robot may change its behaviour - a doorway, two doorways face to face, a
junction, a bend - has arms. A hallway arm carries a pair of nodes, one a direction, driving on
the right; a doorway arm carries a door node in the opening and a room node behind it. The
distances are those measured on the authors' maps of four Stanford areas.
"""

import itertools
import math
from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np

from toponav.core.errors import InputError
from toponav.core.geometry import angle_difference
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps._node_sizes import sizes_for_passing
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap
from toponav.worlds.layout import Doorway, HallwayLayout, Passage
from toponav.worlds.scene import Scene

__all__ = ["map_from_layout"]

_LANE_M = 0.115
"""Half the distance between the two directions."""
_SHARE_M = 0.6
"""Pairs closer than this along a hallway become one."""
_FACING_M = 0.35
"""Doorways closer than this along a hallway make one place."""


@dataclass(frozen=True)
class _Arm:
    """A way in and out of a place: node to come from, node to go to, heading out."""

    source: str
    target: str
    heading_rad: float
    is_room: bool


@dataclass
class _Place:
    """A doorway, junction or bend, at a distance along a passage."""

    along_m: float
    before_m: float
    after_m: float
    doorways: list[Doorway] = field(default_factory=list)
    junction: str | None = None
    arms: list[_Arm] = field(default_factory=list)


@dataclass
class _Drawing:
    """Nodes and edges drawn so far."""

    layout: HallwayLayout
    rng: np.random.Generator
    nodes: dict[str, Node] = field(default_factory=dict)
    edges: dict[str, Edge] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    def connect(self, source: str, target: str, behavior: Behavior) -> None:
        """Adds an edge along the straight line between two nodes."""
        a, b = self.nodes[source], self.nodes[target]
        self.edges[f"{source}->{target}"] = Edge(
            f"{source}->{target}",
            source,
            target,
            behavior,
            math.atan2(b.y_m - a.y_m, b.x_m - a.x_m),
            math.hypot(b.x_m - a.x_m, b.y_m - a.y_m),
        )

    def jitter(self, spread_m: float) -> float:
        """A hand's inaccuracy, at most two spreads."""
        return float(np.clip(self.rng.normal(0.0, spread_m), -2 * spread_m, 2 * spread_m))


def map_from_layout(scene: Scene) -> TopologicalMap:
    """The topological map of a generated building, under the paper's six rules.

    Args:
        scene: A building with a `HallwayLayout`.

    Raises:
        InputError: When the scene has no layout; such a building needs a drawn map.

    Example:
        >>> from toponav.worlds.generate.office import generate_office
        >>> drawn = map_from_layout(generate_office(3))
        >>> drawn.node("office_1").kind.value
        'room'

    Reference:
        Chen et al., A Behavioral Approach to Visual Navigation with Graph Localization
        Networks, RSS 2019, section IV.
    """
    layout = scene.layout
    if not isinstance(layout, HallwayLayout):
        raise InputError(
            "a map is drawn from a hallway layout, and this scene has none",
            where=f"scene {scene.name}",
            remedy="generate the scene, or draw the map by hand: toponav map edit",
        )
    rng = np.random.default_rng([scene.provenance.seed or 0, 7])
    drawing = _Drawing(layout, rng)
    door_arms = {doorway.door: _draw_doorway(drawing, doorway) for doorway in layout.doorways}
    junctions: dict[str, list[_Arm]] = defaultdict(list)
    for doorway in layout.doorways:
        if doorway.junction is not None:
            junctions[doorway.junction].append(door_arms[doorway.door])
    for passage in layout.passages:
        for place in _draw_passage(drawing, passage, door_arms):
            if place.junction is not None:
                junctions[place.junction] += place.arms
            else:
                _join(drawing, place.arms)
    for arms in junctions.values():
        _join(drawing, arms)
    edges = tuple(drawing.edges.values())
    used = {end for edge in edges for end in (edge.source, edge.target)}
    nodes = [node for node in drawing.nodes.values() if node.id in used]
    sizes = sizes_for_passing(nodes, edges)
    sized = tuple(replace(node, size=sizes.get(node.id, 1.0)) for node in nodes)
    return TopologicalMap(scene.name, MapFrame(), sized, edges)


def _draw_doorway(drawing: _Drawing, doorway: Doorway) -> _Arm:
    """A door node in the opening, a room node behind it, and the way from one to the other."""
    rng = drawing.rng
    inner_m = min(doorway.depth_m, 0.4)
    to_door_m = float(np.clip(rng.normal(inner_m, 0.1), 0.06, inner_m + 0.2))
    to_room_m = to_door_m + float(np.clip(rng.gamma(5.0, 0.066), 0.18, 0.8))
    inward = doorway.inward_rad
    for name, kind, depth_m in (
        (doorway.door, NodeKind.DOOR, to_door_m),
        (doorway.room, NodeKind.ROOM, to_room_m),
    ):
        aside_m = drawing.jitter(0.03)
        drawing.nodes[name] = Node(
            name,
            kind,
            doorway.x_m + depth_m * math.cos(inward) - aside_m * math.sin(inward),
            doorway.y_m + depth_m * math.sin(inward) + aside_m * math.cos(inward),
            doorway.room,
        )
    drawing.connect(doorway.room, doorway.door, Behavior.FIND_DOOR)
    return _Arm(doorway.door, doorway.room, inward, is_room=True)


def _draw_passage(drawing: _Drawing, passage: Passage, door_arms: dict[str, _Arm]) -> list[_Place]:
    """The places of a passage with their arms along it, joined to one another."""
    places = _places(drawing, passage)
    yaw = drawing.layout.yaw_rad(passage)
    for place in places:
        place.arms += [door_arms[doorway.door] for doorway in place.doorways]
    for here, after in itertools.pairwise(places):
        leave = here.along_m + here.after_m
        arrive = after.along_m - after.before_m
        if arrive - leave < _SHARE_M:
            middle = (leave + arrive) / 2 + drawing.jitter(0.05)
            near = far = _draw_pair(drawing, passage, middle)
        else:
            near = _draw_pair(drawing, passage, leave)
            far = _draw_pair(drawing, passage, arrive)
            drawing.connect(near[0], far[0], Behavior.CORRIDOR_FOLLOW)
            drawing.connect(far[1], near[1], Behavior.CORRIDOR_FOLLOW)
        here.arms.append(_Arm(near[1], near[0], yaw, is_room=False))
        after.arms.append(_Arm(far[0], far[1], yaw + math.pi, is_room=False))
    return places


def _places(drawing: _Drawing, passage: Passage) -> list[_Place]:
    """Start, doorways in order, end; a bare dead end is a place only where a node fits."""
    layout = drawing.layout
    length_m = layout.length_m(passage)
    places = [_Place(0.0, 0.0, passage.start_reach_m, junction=passage.start)]
    doorways = sorted(
        (doorway for doorway in layout.doorways if doorway.passage == passage.name),
        key=lambda doorway: doorway.along_m,
    )
    for doorway in doorways:
        last = places[-1]
        if last.doorways and doorway.along_m - last.doorways[0].along_m < _FACING_M:
            last.doorways.append(doorway)
            last.along_m = (last.doorways[0].along_m + doorway.along_m) / 2
        else:
            places.append(_Place(doorway.along_m, 0.0, 0.0, [doorway]))
    for place in places[1:]:
        place.before_m, place.after_m = _turns_m(drawing, passage, place.doorways)
    places.append(_Place(length_m, passage.end_reach_m, 0.0, junction=passage.end))
    for end, inner in ((0, 1), (-1, -2)):
        _settle_end(drawing, passage, places, end, inner)
    return places


def _turns_m(drawing: _Drawing, passage: Passage, doorways: list[Doorway]) -> tuple[float, float]:
    """Distances along the hallway from doorways' axis to where turns begin and are complete.

    The angles of the turns are such that a robot driving past, or straight across from door to
    door, is not within 36 degrees of them, as long as the usual distances allow.
    """
    start, yaw = drawing.layout.junction_by_name[passage.start], drawing.layout.yaw_rad(passage)

    def aside_m(name: str) -> float:
        node = drawing.nodes[name]
        return abs((node.y_m - start.y_m) * math.cos(yaw) - (node.x_m - start.x_m) * math.sin(yaw))

    door_m = min(aside_m(doorway.door) for doorway in doorways)
    if len(doorways) > 1:
        least_m = 0.8 * max(aside_m(doorway.room) for doorway in doorways)
        most_m = max(least_m + 0.05, 1.1 * door_m)
        before_m, after_m = drawing.rng.uniform(least_m, most_m, size=2)
    else:
        most_m = max(0.6, min(1.6, 0.98 * door_m))
        before_m, after_m = np.clip(drawing.rng.normal(0.92, 0.24, size=2), 0.55, most_m)
    return float(before_m), float(after_m)


def _settle_end(
    drawing: _Drawing, passage: Passage, places: list[_Place], end: int, inner: int
) -> None:
    """At a dead end, puts the last pair just past the last doorway, if there is room for it."""
    place, neighbour = places[end], places[inner]
    layout = drawing.layout
    name = place.junction
    leads = sum(name in (other.start, other.end) for other in layout.passages)
    leads += sum(doorway.junction == name for doorway in layout.doorways)
    if leads > 1:
        return
    room_m = abs(place.along_m - neighbour.along_m)
    if not neighbour.doorways:
        if end == 0:
            place.after_m = min(passage.start_reach_m, room_m / 2)
        else:
            place.before_m = min(passage.end_reach_m, room_m / 2)
        return
    want_m = neighbour.before_m if end == 0 else neighbour.after_m
    want_m = min(want_m, room_m - 0.35)
    if end == 0:
        neighbour.before_m, place.after_m = want_m, room_m - want_m
    else:
        neighbour.after_m, place.before_m = want_m, room_m - want_m


def _draw_pair(drawing: _Drawing, passage: Passage, along_m: float) -> tuple[str, str]:
    """Two nodes at a distance along a passage: one along its direction, one against it."""
    layout = drawing.layout
    start = layout.junction_by_name[passage.start]
    yaw = layout.yaw_rad(passage)
    drawing.counts[passage.room] += 1
    number = drawing.counts[passage.room]
    aside_m = drawing.jitter(0.06)
    names = []
    for heading in (yaw, yaw + math.pi):
        right_m = _LANE_M * float(np.clip(drawing.rng.normal(1.0, 0.45), 0.2, 2.2))
        along = along_m + drawing.jitter(0.03)
        name = f"{passage.room}-{number}{_suffix(heading)}"
        left = yaw + math.pi / 2
        across = aside_m + right_m * (-1.0 if heading == yaw else 1.0)
        drawing.nodes[name] = Node(
            name,
            passage.kind,
            start.x_m + along * math.cos(yaw) + across * math.cos(left),
            start.y_m + along * math.sin(yaw) + across * math.sin(left),
            passage.room,
        )
        names.append(name)
    return names[0], names[1]


def _suffix(heading_rad: float) -> str:
    """The authors' letter for a direction: right, up, left or down on the floor plan."""
    return "ruld"[round(heading_rad / (math.pi / 2)) % 4]


def _join(drawing: _Drawing, arms: list[_Arm]) -> None:
    """Connects every way into a place with every way out of it but the way back."""
    for come in arms:
        for go in arms:
            if come is go or come.source == go.target:
                continue
            turn = angle_difference(go.heading_rad, come.heading_rad + math.pi)
            if abs(turn) > math.radians(135.0):
                continue
            if abs(turn) < math.radians(45.0):
                behavior = Behavior.STRAIGHT if go.is_room else Behavior.CORRIDOR_FOLLOW
            else:
                behavior = Behavior.TURN_LEFT if turn > 0 else Behavior.TURN_RIGHT
            drawing.connect(come.source, go.target, behavior)
