"""The GraphNav authors' hand-drawn maps: a canvas's JSON beside the yaml of its area.

Ovals are nodes, lines with an arrow are directed edges, and texts with the same tags hold the
names of nodes and the behaviours of edges. Coordinates are pixels of the area's floor plan,
y down. Names say the rest: `office_4_door` is the door of `office_4`, `hallway_1-3u` lies in
`hallway_1`.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.faults import Fault, Rule, Severity
from toponav.maps.formats._draft import checked
from toponav.maps.formats._values import Place
from toponav.maps.schema import read_json
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, edge_along
from toponav.worlds.grid import GridFrame
from toponav.worlds.load.ros_map import read_ros_map
from toponav.worlds.load.stanford import AreaFiles

__all__ = [
    "BEHAVIOR_CODES",
    "area_of_drawing",
    "drawing_faults",
    "load_area_map",
    "map_from_canvas",
    "node_kind_of_name",
    "room_of_name",
]

BEHAVIOR_CODES: Mapping[str, Behavior] = {
    "cf": Behavior.CORRIDOR_FOLLOW,
    "fd": Behavior.FIND_DOOR,
    "fd_l": Behavior.FIND_DOOR,
    "fd_r": Behavior.FIND_DOOR,
    "lio": Behavior.TURN_LEFT,
    "rio": Behavior.TURN_RIGHT,
    "s": Behavior.STRAIGHT,
    "s_l": Behavior.STRAIGHT,
    "s_r": Behavior.STRAIGHT,
    "tl": Behavior.TURN_LEFT,
    "tr": Behavior.TURN_RIGHT,
}
"""The authors' behaviour ids; `lio` and `rio` are left and right into an office."""

_ROOM_OF_NAME = re.compile(r"[A-Za-z]+_\d+")
_KIND_OF_PREFIX = {
    "hallway": NodeKind.HALLWAY,
    "lobby": NodeKind.HALLWAY,
    "lounge": NodeKind.OPEN_SPACE,
    "openspace": NodeKind.OPEN_SPACE,
}
_DRAW_AGAIN = "correct it in the drawing tool and save again"


def load_area_map(area_yaml: str | Path) -> TopologicalMap:
    """The authors' map of an area, in metres in the frame of its floor plan.

    Sizes given for nodes that were not drawn are ignored, as the authors' program does;
    `drawing_faults` names them.

    Args:
        area_yaml: The area's yaml; it names the drawing and the floor plan beside it.

    Raises:
        InputError: If a file is missing or broken; names the file, the element and the remedy.

    Example:
        >>> len(load_area_map("graphnav_areas/area_3.yaml").nodes)
        81
    """
    files = AreaFiles.read(area_yaml)
    if files.graph is None:
        raise InputError(
            "the area has no drawn map",
            where=str(files.yaml),
            remedy="name the drawing under graph_filepath",
        )
    canvas = read_json(files.graph)
    return map_from_canvas(
        canvas,
        read_ros_map(files.yaml).grid,
        name=files.name,
        node_sizes=files.node_sizes,
        plan=files.yaml.name,
        where=str(files.graph),
    )


def drawing_faults(files: AreaFiles, topological_map: TopologicalMap) -> tuple[Fault, ...]:
    """What an area's yaml says about nodes that its drawing does not have."""
    return tuple(
        Fault(
            Rule.SIZE_HAS_NODE,
            Severity.WARNING,
            f"node_sizes {name}",
            None,
            f"{files.yaml.name} gives a size to {name}, which was not drawn",
            f"correct the name: {did_you_mean(name, topological_map.node_index)}",
        )
        for name in sorted(files.node_sizes)
        if name not in topological_map
    )


def area_of_drawing(canvas_json: str | Path) -> Path:
    """The area's yaml beside a drawing that names the drawing.

    Raises:
        InputError: If there is none: a drawing alone has no scale.
    """
    path = Path(canvas_json)
    for candidate in sorted(path.parent.glob("*.yaml")):
        try:
            graph = AreaFiles.read(candidate).graph
        except InputError:
            continue
        if graph is not None and graph.name == path.name:
            return candidate
    raise InputError(
        "no yaml beside this drawing names it, and pixels alone have no scale",
        where=str(path),
        remedy="put the area's yaml (resolution, origin, graph_filepath) and PNG beside it",
    )


def map_from_canvas(
    canvas: Any,
    grid: GridFrame,
    *,
    name: str,
    node_sizes: Mapping[str, float] | None = None,
    plan: str | None = None,
    where: str = "canvas",
) -> TopologicalMap:
    """The map that a canvas's JSON draws on a floor plan.

    Args:
        canvas: The JSON document.
        grid: Pixels of the floor plan that was drawn upon.
        name: Name of the map.
        node_sizes: Sizes of the nodes whose size is not one.
        plan: Yaml of the floor plan, for the map's frame.
        where: The drawing's file, for messages.

    Raises:
        InputError: If an element is broken; names it by its place in the file.
    """
    if not isinstance(canvas, dict) or not all(
        isinstance(canvas.get(key), list) for key in ("oval", "line", "text")
    ):
        raise InputError(
            "a drawing is a JSON object with the lists oval, line and text",
            where=where,
            remedy="name the JSON that the authors' drawing tool saved",
        )
    texts: dict[str, str] = {}
    for position, raw in enumerate(canvas["text"]):
        _, options = _element(raw, 2, f"{where}: text[{position}]")
        texts[_string(options, "tags", f"{where}: text[{position}]")] = _string(
            options, "text", f"{where}: text[{position}]"
        )
    nodes = _nodes(canvas["oval"], texts, grid, node_sizes or {}, where)
    edges = _edges(canvas["line"], texts, nodes, where)
    try:
        made = TopologicalMap(name, MapFrame("map", plan), tuple(nodes.values()), tuple(edges))
    except InputError as error:
        raise InputError(error.rule, where=where, remedy=error.remedy) from None
    return checked(made, Place(where))


def room_of_name(name: str) -> str | None:
    """The room that a node's name starts with, or None.

    Example:
        >>> room_of_name("office_29_door-l")
        'office_29'
    """
    match = _ROOM_OF_NAME.match(name)
    return match.group() if match else None


def node_kind_of_name(name: str) -> NodeKind:
    """The kind that a node's name stands for, as the authors categorise rooms.

    Example:
        >>> node_kind_of_name("lobby_1-2u")
        <NodeKind.HALLWAY: 'hallway'>
    """
    if "_door" in name:
        return NodeKind.DOOR
    for prefix, kind in _KIND_OF_PREFIX.items():
        if name.startswith(prefix):
            return kind
    return NodeKind.ROOM


def _nodes(
    ovals: list[Any],
    texts: Mapping[str, str],
    grid: GridFrame,
    node_sizes: Mapping[str, float],
    where: str,
) -> dict[str, Node]:
    """Nodes by their tag."""
    nodes: dict[str, Node] = {}
    for position, raw in enumerate(ovals):
        place = f"{where}: oval[{position}]"
        (x0, y0, x1, y1), options = _element(raw, 4, place)
        tag = _string(options, "tags", place)
        if tag not in texts:
            raise InputError(f"node '{tag}' has no name", where=place, remedy=_DRAW_AGAIN)
        if tag in nodes:
            raise InputError(f"two nodes are tagged '{tag}'", where=place, remedy=_DRAW_AGAIN)
        name = texts[tag]
        x_m, y_m = _point((x0 + x1) / 2, (y0 + y1) / 2, grid)
        size = node_sizes.get(name, 1.0)
        nodes[tag] = Node(name, node_kind_of_name(name), x_m, y_m, room_of_name(name), size)
    return nodes


def _point(x_px: float, y_px: float, grid: GridFrame) -> tuple[float, float]:
    """The place in metres at a canvas position; whole numbers are centres of pixels."""
    return (
        grid.origin_m[0] + (x_px + 0.5) * grid.resolution_m,
        grid.origin_m[1] + (grid.rows - 0.5 - y_px) * grid.resolution_m,
    )


def _edges(
    lines: list[Any], texts: Mapping[str, str], nodes: Mapping[str, Node], where: str
) -> list[Edge]:
    edges = []
    for position, raw in enumerate(lines):
        place = f"{where}: line[{position}]"
        _, options = _element(raw, 4, place)
        tags = _string(options, "tags", place)
        ends = tags.split()
        if len(ends) != 3 or ends[1] not in nodes or ends[2] not in nodes:
            raise InputError(
                f"an edge is tagged 'edge source target' with two drawn nodes, got '{tags[:80]}'",
                where=place,
                remedy=_DRAW_AGAIN,
            )
        source, target = nodes[ends[1]], nodes[ends[2]]
        code = texts.get(tags)
        if code is None or code not in BEHAVIOR_CODES:
            raise InputError(
                f"edge {source.id} -> {target.id} has "
                + ("no behaviour" if code is None else f"the unknown behaviour '{code[:40]}'"),
                where=place,
                remedy=did_you_mean(code or "", BEHAVIOR_CODES),
            )
        edges.append(edge_along(source, target, BEHAVIOR_CODES[code]))
    return edges


def _element(raw: Any, count: int, place: str) -> tuple[list[float], dict[str, Any]]:
    """The coordinates and the options of an oval, a line or a text."""
    if not isinstance(raw, list) or len(raw) != count + 1 or not isinstance(raw[-1], dict):
        raise InputError(
            f"must be a list of {count} coordinates and an object",
            where=place,
            remedy=_DRAW_AGAIN,
        )
    numbers = raw[:-1]
    if not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers) or not all(
        abs(n) < 1e6 for n in numbers
    ):
        raise InputError(
            f"coordinates must be pixels below 1000000, got {str(numbers)[:80]}",
            where=place,
            remedy=_DRAW_AGAIN,
        )
    return [float(number) for number in numbers], raw[-1]


def _string(options: Mapping[str, Any], key: str, place: str) -> str:
    value = options.get(key)
    if not isinstance(value, str) or not value:
        raise InputError(f"must have a text '{key}'", where=place, remedy=_DRAW_AGAIN)
    return value
