"""Topological maps of any building, drawn as people drew the maps of four Stanford areas."""

import itertools
import math
from collections import defaultdict
from dataclasses import dataclass, field, replace

import networkx as nx
import numpy as np
from jaxtyping import Int32

from toponav.core.errors import InputError
from toponav.core.geometry import angle_difference
from toponav.core.vocabulary import Behavior, NodeKind, RoomKind
from toponav.maps._corridor import Corridor
from toponav.maps._node_sizes import sizes_for_passing
from toponav.maps._openings import find_openings, grown_rooms
from toponav.maps._passages import Passages, passages_of
from toponav.maps._places import Place, places_of
from toponav.maps._rooms import RoomNodes, room_nodes
from toponav.maps._segmented import with_rooms
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["map_by_measuring"]

_RADIUS_M = 0.18
_LANE_M = 0.115
"""Half the distance between the two directions."""
_TURN_M = 0.92
"""Distance along the corridor from a door's axis to where a turn begins or is complete."""
_BEYOND_M = 0.3
"""At junctions a turn is complete this far beyond the walls of the corridor turned out of."""
_NEAR_M = 0.5
_SHARE_M = 0.6
"""Pairs closer than this along a corridor become one."""
_LANES = (NodeKind.HALLWAY, NodeKind.OPEN_SPACE)
_OPEN = (RoomKind.OPEN_SPACE, RoomKind.LOUNGE)


@dataclass(frozen=True)
class _Arm:
    """A way in and out of a place: node to come from, node to go to, heading out."""

    source: str
    target: str
    heading_rad: float
    is_room: bool


@dataclass
class _Drawing:
    """Nodes and edges drawn so far."""

    scene: Scene
    territory: Int32[np.ndarray, "rows cols"]
    free: FreeSpace
    nodes: dict[str, Node] = field(default_factory=dict)
    behaviors: dict[tuple[str, str], Behavior] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=lambda: defaultdict(int))


def map_by_measuring(scene: Scene) -> TopologicalMap:
    """The map of a building from its floor: rooms, the openings between them, its hallways.

    Raises:
        InputError: When no opening joins two rooms.
    """
    scene = with_rooms(scene)
    territory = grown_rooms(scene)
    openings = find_openings(scene, territory)
    passage_rooms = {n for n, room in enumerate(scene.rooms) if not room.kind.is_enclosed}
    if not openings:
        raise InputError(
            f"no opening of half a metre or more joins any two of its {len(scene.rooms)} rooms",
            where=f"scene {scene.name}",
            remedy="open the doors of the building, or draw the map by hand: toponav map edit",
        )
    drawing = _Drawing(scene, territory, FreeSpace.of(scene, _RADIUS_M))
    rooms = room_nodes(scene, territory, drawing.free, openings, passage_rooms)
    drawing.nodes.update(rooms.nodes)
    for door in rooms.exits:
        drawing.behaviors[rooms.exits[door].room, door] = Behavior.FIND_DOOR
    if passage_rooms:
        passages = passages_of(scene, territory, openings, passage_rooms)
        _draw_passages(drawing, passages, rooms)
    for source, target in rooms.through:
        drawing.behaviors[source, target] = Behavior.STRAIGHT
    return _finished(drawing)


def _draw_passages(drawing: _Drawing, passages: Passages, rooms: RoomNodes) -> None:
    """Lanes along every corridor, and the ways in and out of every place."""
    placed = places_of(passages, rooms.entrances)
    arms: dict[int, list[_Arm]] = defaultdict(list)
    everything = {id(place): place for places in placed.values() for place in places}
    for key, place in everything.items():
        arms[key] += [
            _Arm(entrance.door, entrance.room, entrance.heading_rad, is_room=True)
            for entrance in place.entrances
        ]
    for number in sorted(placed):
        _draw_corridor(drawing, passages, number, placed[number], arms)
    for key in everything:
        _join(drawing, arms[key])
    for point, gate in sorted(passages.gates.items()):
        if gate.is_beside:
            _join_beside(drawing, passages, point, placed, rooms, arms)


def _join_beside(
    drawing: _Drawing,
    passages: Passages,
    point: int,
    placed: dict[int, list[Place]],
    rooms: RoomNodes,
    arms: dict[int, list[_Arm]],
) -> None:
    """Connects a way across an open space with the doors that it faces and the lanes beside.

    People lead the outer lanes into the open space and leave those between the doors alone.
    """
    gate = passages.gates[point]
    faced = {entrance.door for opening, entrance in rooms.entrances if gate.faces(opening)}
    own = [
        arm
        for number, end in passages.at_point(point)
        for arm in arms[id(placed[number][-1 if end else 0])]
    ]
    for places in placed.values():
        covered = [
            place
            for place in places
            if place.point is None and any(entrance.door in faced for entrance in place.entrances)
        ]
        if not covered:
            continue
        lanes = [[arm for arm in arms[id(place)] if not arm.is_room] for place in covered]
        sides = [lanes[0][0], lanes[-1][-1]]
        doors = [arm for place in covered for arm in arms[id(place)] if arm.source in faced]
        for arm in own:
            for other in (*sides, *doors):
                _join(drawing, [arm, other])


def _draw_corridor(
    drawing: _Drawing,
    passages: Passages,
    number: int,
    places: list[Place],
    arms: dict[int, list[_Arm]],
) -> None:
    """Pairs of nodes between the places of a corridor, and the lanes between the pairs."""
    corridor = passages.corridors[number]
    along = [0.0, *(place.along_m[number] for place in places[1:-1]), corridor.length_m]
    for (here, here_m), (after, after_m) in itertools.pairwise(zip(places, along, strict=True)):
        leave = here_m + _reach_m(drawing, passages, number, here, 0)
        arrive = after_m - _reach_m(drawing, passages, number, after, 1)
        if here.point is not None and after.point is not None:
            spare_m = min(_BEYOND_M, max(0.0, (_SHARE_M + leave - arrive) / 2 + 1e-6))
            leave, arrive = leave - spare_m, arrive + spare_m
        if arrive - leave < _SHARE_M:
            middle = min(max((leave + arrive) / 2, here_m), after_m)
            near = far = _draw_pair(drawing, corridor, middle)
        else:
            near = _draw_pair(drawing, corridor, leave)
            far = _draw_pair(drawing, corridor, arrive)
            drawing.behaviors[near[0], far[0]] = Behavior.CORRIDOR_FOLLOW
            drawing.behaviors[far[1], near[1]] = Behavior.CORRIDOR_FOLLOW
        leaving = _heading(corridor, here_m, here.point is not None and here_m == 0.0, 0)
        coming = _heading(corridor, after_m, after.point is not None, 1)
        arms[id(here)].append(_Arm(near[1], near[0], leaving, is_room=False))
        arms[id(after)].append(_Arm(far[0], far[1], coming, is_room=False))


def _heading(corridor: Corridor, along_m: float, at_end: bool, end: int) -> float:
    """Heading of the corridor away from a place on it, onward (0) or back (1)."""
    if at_end:
        return corridor.leaving_rad(end)
    return corridor.at(along_m)[2] + (math.pi if end else 0.0)


def _reach_m(drawing: _Drawing, passages: Passages, number: int, place: Place, end: int) -> float:
    """Distance along a corridor from a place to where a turn there begins or is complete."""
    if place.point is None:
        return _TURN_M
    if len(passages.at_point(place.point)) == 1 and place.point not in passages.gates:
        return _TURN_M if place.entrances else 0.3
    x_m, y_m = passages.points_m[place.point]
    row, col = drawing.scene.grid.cell_of(x_m, y_m)
    near = round(_NEAR_M / drawing.scene.grid.resolution_m)
    window = drawing.free.clearance_m[
        max(row - near, 0) : max(row + near + 1, 0), max(col - near, 0) : max(col + near + 1, 0)
    ]
    return float(window.max(initial=0.0)) + _BEYOND_M


def _draw_pair(drawing: _Drawing, corridor: Corridor, along_m: float) -> tuple[str, str]:
    """Two nodes at a distance along a corridor: one along its direction, one against it."""
    x_m, y_m, yaw = corridor.at(along_m)
    scene = drawing.scene
    row, col = scene.grid.cell_of(x_m, y_m)
    inside = 0 <= row < scene.grid.rows and 0 <= col < scene.grid.cols
    index = int(drawing.territory[row, col]) - 1 if inside else -1
    room = scene.rooms[index].name if index >= 0 else None
    kind = NodeKind.HALLWAY
    if index >= 0 and scene.rooms[index].kind in _OPEN:
        kind = NodeKind.OPEN_SPACE
    base = room or "passage"
    drawing.counts[base] += 1
    names = []
    for heading, right_m in ((yaw, _LANE_M), (yaw + math.pi, -_LANE_M)):
        name = f"{base}-{drawing.counts[base]}{_suffix(heading)}"
        at = (x_m + right_m * math.sin(yaw), y_m - right_m * math.cos(yaw))
        drawing.nodes[name] = Node(name, kind, *_free_spot(drawing, at), room)
        names.append(name)
    return names[0], names[1]


def _free_spot(drawing: _Drawing, at: tuple[float, float]) -> tuple[float, float]:
    """The nearest place where the robot fits, or the place itself where there is none near."""
    if drawing.free.is_free(*at):
        return at
    try:
        return drawing.scene.grid.center_of(*drawing.free.nearest_free(*at))
    except InputError:
        return at


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
            drawing.behaviors[come.source, go.target] = behavior


def _finished(drawing: _Drawing) -> TopologicalMap:
    """The map of the largest part in which every room can be reached from every other."""
    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_nodes_from(drawing.nodes)
    graph.add_edges_from(drawing.behaviors)
    parts = list(nx.strongly_connected_components(graph))
    kinds = {name: node.kind for name, node in drawing.nodes.items()}
    main = max(
        parts,
        key=lambda part: (sum(kinds[n] is NodeKind.ROOM for n in part), len(part), min(part)),
    )
    if sum(kinds[name] is NodeKind.ROOM for name in main) < 2:
        raise InputError(
            "no two of its rooms can be reached from each other",
            where=f"scene {drawing.scene.name}",
            remedy="open the doors of the building, or draw the map by hand: toponav map edit",
        )
    lanes = {name for name in drawing.nodes if kinds[name] in _LANES}
    near = graph.subgraph(lanes | main)
    inside = min(main)
    dead_ends = nx.descendants(near, inside) | nx.ancestors(near, inside)
    kept = main | (dead_ends & lanes)
    nodes = [node for name, node in drawing.nodes.items() if name in kept]
    by_id = {node.id: node for node in nodes}
    edges = tuple(
        edge_along(by_id[source], by_id[target], behavior)
        for (source, target), behavior in drawing.behaviors.items()
        if source in kept and target in kept
    )
    sizes = sizes_for_passing(nodes, edges)
    sized = tuple(replace(node, size=sizes.get(node.id, 1.0)) for node in nodes)
    return TopologicalMap(drawing.scene.name, MapFrame(), sized, edges)
