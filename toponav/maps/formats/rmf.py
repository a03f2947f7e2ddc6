"""Buildings of Open-RMF's traffic editor (`*.building.yaml`): vertices and lanes of one level."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from toponav.core.errors import did_you_mean
from toponav.maps.elements import MapFrame
from toponav.maps.formats._draft import MapDraft
from toponav.maps.formats._values import Place, is_name
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.spec import TopologicalMap

__all__ = ["map_from_rmf"]

_MOST_FIDUCIALS = 50
_NO_PLACE = "our maps hold the graph alone"
_DROPPED = (
    "walls",
    "floors",
    "models",
    "doors",
    "human_lanes",
    "holes",
    "layers",
)
_LARGEST_PX = 1e9


@dataclass(frozen=True)
class _ToMetres:
    """Turns a level's pixels, y up, into metres of the building."""

    scale: float = 1.0
    rotation_rad: float = 0.0
    shift_m: tuple[float, float] = (0.0, 0.0)

    def __call__(self, x: float, y: float) -> tuple[float, float]:
        cosine, sine = math.cos(self.rotation_rad), math.sin(self.rotation_rad)
        return (
            (cosine * x - sine * y) * self.scale + self.shift_m[0],
            (sine * x + cosine * y) * self.scale + self.shift_m[1],
        )


def map_from_rmf(
    document: Any, where: str, name: str, level: str | None = None
) -> tuple[TopologicalMap, ConversionReport]:
    """The map of one level of a building, in metres, and what was dropped or guessed.

    Pixels become metres by the level's measurements, or by the fiducials that it shares with
    the reference level, as Open-RMF's own tools compute it.

    Args:
        document: The YAML document.
        where: The file that it came from, for messages.
        name: Name of the map where the file has none.
        level: Level to read; the reference level, or the first with lanes, when not given.

    Raises:
        InputError: If it is no building, or its coordinates are not those of a drawing or
            metres; names the element.

    Reference:
        https://osrf.github.io/ros2multirobotbook/traffic-editor.html
    """
    root, notes = Place(where), Notes()
    building = root.mapping(document)
    levels = root.key("levels").mapping(building.get("levels"))
    reference = _reference(building, levels)
    chosen = level if level is not None else _first_with_lanes(levels, reference)
    if chosen is None or chosen not in levels:
        raise root.key("levels").fault(
            f"there is no level '{chosen}'" if chosen else "must have a level with lanes",
            did_you_mean(chosen or "", levels),
        )
    for other in levels:
        if other != chosen:
            notes.dropped("other levels", "one level is one map: name it with --level", other)
    place = root.key(f"levels.{chosen}")
    content = place.mapping(levels[chosen])
    to_metres, up = _to_metres(root, building, reference, chosen, notes)
    for key in _DROPPED:
        if isinstance(content.get(key), list | dict):
            notes.dropped(key, _NO_PLACE, count=len(content[key]))
    if building.get("lifts"):
        notes.dropped("lifts", _NO_PLACE, count=len(root.key("lifts").mapping(building["lifts"])))
    given = building.get("building_name", building.get("name"))
    title = given if is_name(given) and given != "building" else name
    several = len(levels) > 1 and len(title) + len(chosen) < 200
    draft = MapDraft(root, f"{title} {chosen}" if several else title, MapFrame("map"), notes)
    _read_graph(draft, place, content, to_metres, up)
    return draft.finish()


def _read_graph(
    draft: MapDraft, place: Place, level: Mapping[str, Any], to_metres: _ToMetres, up: float
) -> None:
    vertices = place.key("vertices").sequence(level.get("vertices") or [])
    lanes_place = place.key("lanes")
    lanes = [
        (lanes_place.index(number), *_ends(lanes_place.index(number), raw, len(vertices)), raw)
        for number, raw in enumerate(lanes_place.sequence(level.get("lanes") or []))
    ]
    used = {index for _, start, end, _ in lanes for index in (start, end)}
    names: dict[int, str] = {}
    for number, raw in enumerate(vertices):
        if number in used:
            names[number] = _add_vertex(
                draft, place.key("vertices").index(number), number, raw, to_metres, up
            )
    draft.notes.dropped("vertices", "no lane leads to them", count=len(vertices) - len(used))
    joined: set[tuple[int, int]] = set()
    graphs: set[str] = set()
    for lane, start, end, raw in lanes:
        parameters = lane.mapping(raw[2]) if len(raw) > 2 else {}
        graphs.add(str(_parameter(parameters, "graph_idx"))[:20])
        ways = [(start, end)]
        if _parameter(parameters, "bidirectional") is True:
            ways.append((end, start))
        for way in ways:
            if way in joined or way[0] == way[1]:
                draft.notes.dropped("lanes", "double another, or lead back to their start")
            else:
                joined.add(way)
                draft.add_edge(lane, names[way[0]], names[way[1]])
        if _parameter(parameters, "orientation") or _parameter(parameters, "speed_limit"):
            draft.notes.dropped("orientations and speed limits of lanes", "our edges have none")
    if len(graphs) > 1:
        draft.notes.changed(
            "graphs of several fleets", "their lanes make one map", count=len(graphs)
        )


def _add_vertex(
    draft: MapDraft, place: Place, number: int, raw: Any, to_metres: _ToMetres, up: float
) -> str:
    vertex = place.sequence(raw, at_least=2)
    x, y = (place.index(axis).number(vertex[axis], -_LARGEST_PX, _LARGEST_PX) for axis in (0, 1))
    given = vertex[3] if len(vertex) > 3 else ""
    if isinstance(given, int) and not isinstance(given, bool):
        given = str(given)
    node_id = given if is_name(given) else f"v{number}"
    if not is_name(given):
        draft.notes.guessed("names of vertices", "from their numbers", node_id)
    free = draft.free_node_id(node_id)
    if free != node_id:
        draft.notes.changed("names of vertices", "were not unique", node_id)
    if len(vertex) > 4 and vertex[4]:
        draft.notes.dropped("parameters of vertices", "such as chargers and docks", node_id)
    draft.add_node(place, free, *to_metres(x, up * y))
    return free


def _ends(place: Place, raw: Any, count: int) -> tuple[int, int]:
    edge = place.sequence(raw, at_least=2)
    start, end = (place.index(side).whole(edge[side], 0, count - 1) for side in (0, 1))
    return start, end


def _parameter(parameters: Mapping[str, Any], name: str) -> Any:
    """The value of a parameter, which is written as [type, value]."""
    found = parameters.get(name)
    return found[1] if isinstance(found, list) and len(found) == 2 else None


def _reference(building: Mapping[str, Any], levels: Mapping[str, Any]) -> str | None:
    named = building.get("reference_level_name")
    if isinstance(named, str) and named in levels:
        return named
    return next(iter(levels), None)


def _first_with_lanes(levels: Mapping[str, Any], reference: str | None) -> str | None:
    order = [reference, *levels] if reference is not None else []
    for level in order:
        content = levels[level]
        if isinstance(content, dict) and content.get("lanes"):
            return level
    return reference


def _to_metres(
    root: Place,
    building: Mapping[str, Any],
    reference: str | None,
    chosen: str,
    notes: Notes,
) -> tuple[_ToMetres, float]:
    """How the level's coordinates become metres, and the sign that turns its y up."""
    system = building.get("coordinate_system", "reference_image")
    if system == "cartesian_meters":
        return _ToMetres(), 1.0
    if system != "reference_image":
        raise root.key("coordinate_system").fault(
            f"must be reference_image or cartesian_meters, got {str(system)[:40]!r}",
            "convert the building to metres in the traffic editor",
        )
    if chosen != reference and reference is not None:
        aligned = _aligned(root, building, reference, chosen)
        if aligned is not None:
            return aligned, -1.0
        notes.guessed(
            "position of the level", "it shares no two fiducials with the reference level", chosen
        )
    scale = _scale(root, building, chosen)
    if scale is None:
        notes.guessed("scale", "no measurements: a pixel is taken to be a metre", chosen)
    return _ToMetres(scale or 1.0), -1.0


def _scale(root: Place, building: Mapping[str, Any], level: str) -> float | None:
    """Metres a pixel: the mean over the measurements, or None without any."""
    place = root.key(f"levels.{level}")
    content = place.mapping(building["levels"][level])
    vertices = place.key("vertices").sequence(content.get("vertices") or [])
    place = place.key("measurements")
    ratios = []
    for number, raw in enumerate(place.sequence(content.get("measurements") or [])):
        spot = place.index(number)
        ends = []
        for index in _ends(spot, raw, len(vertices)):
            vertex = spot.sequence(vertices[index], at_least=2)
            ends.append([spot.number(vertex[axis], -_LARGEST_PX, _LARGEST_PX) for axis in (0, 1)])
        distance = _parameter(spot.mapping(raw[2]) if len(raw) > 2 else {}, "distance")
        distance_m = spot.key("distance").number(distance, 0.0)
        length_px = math.dist(*ends)
        if length_px < 1e-6 or distance_m <= 0.0:
            raise spot.fault("must have two different ends and a distance above zero")
        ratios.append(distance_m / length_px)
    return sum(ratios) / len(ratios) if ratios else None


def _aligned(
    root: Place, building: Mapping[str, Any], reference: str, chosen: str
) -> _ToMetres | None:
    """How the level lies in the building, by the fiducials that it shares with the reference."""
    theirs, ours = (_fiducials(root, building, level) for level in (reference, chosen))
    shared = [(theirs[name], ours[name]) for name in theirs if name in ours][:_MOST_FIDUCIALS]
    scale = _scale(root, building, reference)
    pairs = [
        (there, here)
        for there, here in (
            (_vector(one[0], other[0]), _vector(one[1], other[1]))
            for one, other in combinations(shared, 2)
        )
        if min(math.hypot(*there), math.hypot(*here)) > 1e-6
    ]
    if scale is None or not pairs:
        return None
    turns = [math.atan2(*there[::-1]) - math.atan2(*here[::-1]) for there, here in pairs]
    rotation_rad = math.atan2(sum(map(math.sin, turns)), sum(map(math.cos, turns)))
    grown = sum(math.hypot(*here) / math.hypot(*there) for there, here in pairs) / len(pairs)
    unshifted = _ToMetres(scale / grown, rotation_rad)
    placed = [(there, unshifted(*here)) for there, here in shared]
    shift_m = tuple(
        sum(there[axis] * scale - at[axis] for there, at in placed) / len(placed)
        for axis in (0, 1)
    )
    return _ToMetres(scale / grown, rotation_rad, (shift_m[0], shift_m[1]))


def _fiducials(
    root: Place, building: Mapping[str, Any], level: str
) -> dict[str, tuple[float, float]]:
    place = root.key(f"levels.{level}")
    content = place.mapping(building["levels"][level])
    place = place.key("fiducials")
    found = {}
    for number, raw in enumerate(place.sequence(content.get("fiducials") or [])):
        spot = place.index(number)
        fiducial = spot.sequence(raw, at_least=3)
        x, y = (spot.number(fiducial[axis], -_LARGEST_PX, _LARGEST_PX) for axis in (0, 1))
        found[str(fiducial[2])[:200]] = (x, -y)
    return found


def _vector(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
    return end[0] - start[0], end[1] - start[1]
