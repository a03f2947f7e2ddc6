"""The GraphNav authors' hand-drawn maps: a canvas's JSON beside the yaml of its area.

Ovals are nodes, lines with an arrow are directed edges, and texts with the same tags hold the
names of nodes and the behaviours of edges. Coordinates are pixels of the area's floor plan,
y down. Names say the rest: `office_4_door` is the door of `office_4`, `hallway_1-3u` lies in
`hallway_1`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from PIL import Image, UnidentifiedImageError

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.schema import read_json
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, edge_along

__all__ = [
    "BEHAVIOR_CODES",
    "AreaDrawing",
    "load_area_map",
    "map_from_canvas",
    "node_kind_of_name",
    "read_area_drawing",
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
_MAX_YAML_BYTES = 1_000_000
_DRAW_AGAIN = "correct it in the drawing tool and save again"


@dataclass(frozen=True)
class AreaDrawing:
    """What an area's yaml says about its map.

    Attributes:
        yaml_path: The yaml itself.
        canvas_path: JSON of the drawing.
        image_path: Floor plan that was drawn upon.
        rows: Height of the floor plan in pixels.
        resolution_m: Side of a pixel.
        origin_m: Position of the plan's lower-left corner.
        node_sizes: Sizes of the nodes whose size is not one.
    """

    yaml_path: Path
    canvas_path: Path
    image_path: Path
    rows: int
    resolution_m: float
    origin_m: tuple[float, float]
    node_sizes: Mapping[str, float]

    def point_of_pixel(self, x_px: float, y_px: float) -> tuple[float, float]:
        """The place in metres at a canvas position; whole numbers are centres of pixels."""
        return (
            self.origin_m[0] + (x_px + 0.5) * self.resolution_m,
            self.origin_m[1] + (self.rows - 0.5 - y_px) * self.resolution_m,
        )


def load_area_map(area_yaml: str | Path) -> TopologicalMap:
    """The authors' map of an area, in metres in the frame of its floor plan.

    Sizes given for nodes that were not drawn are ignored, as the authors' program does.

    Args:
        area_yaml: The area's yaml; it names the drawing and the floor plan beside it.

    Raises:
        InputError: If a file is missing or broken; names the file, the element and the remedy.
    """
    area = read_area_drawing(area_yaml)
    return map_from_canvas(read_json(area.canvas_path), area)


def read_area_drawing(area_yaml: str | Path) -> AreaDrawing:
    """What an area's yaml says about its map.

    Raises:
        InputError: If the yaml or the floor plan cannot be read, or a value is wrong.
    """
    path = Path(area_yaml)
    document = _read_yaml(path)
    resolution = _number(document.get("resolution"), "resolution", path)
    origin = document.get("origin")
    if not isinstance(origin, list) or len(origin) < 2:
        raise InputError(
            f"origin must be [x, y, yaw] in metres, got {origin!r}",
            where=str(path),
            remedy="give the position of the plan's lower-left corner",
        )
    sizes = document.get("node_sizes") or {}
    if not isinstance(sizes, dict):
        raise InputError(
            f"node_sizes must map node names to numbers, got {type(sizes).__name__}",
            where=str(path),
            remedy="write lines like 'office_4: 1.1' under node_sizes",
        )
    if resolution <= 0:
        raise InputError(
            f"resolution must be positive, got {resolution}",
            where=str(path),
            remedy="give the side of a pixel in metres",
        )
    image_path = _beside(path, document, "image")
    return AreaDrawing(
        yaml_path=path,
        canvas_path=_beside(path, document, "graph_filepath"),
        image_path=image_path,
        rows=_image_rows(image_path),
        resolution_m=resolution,
        origin_m=(_number(origin[0], "origin", path), _number(origin[1], "origin", path)),
        node_sizes={str(name): _number(size, f"size of {name}", path) for name, size in sizes.items()},
    )


def map_from_canvas(canvas: Any, area: AreaDrawing) -> TopologicalMap:
    """The map that a canvas's JSON draws on an area's floor plan.

    Raises:
        InputError: If an element is broken; names it by its tags.
    """
    where = str(area.canvas_path)
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
    nodes = _nodes(canvas["oval"], texts, area)
    edges = _edges(canvas["line"], texts, nodes, where)
    frame = MapFrame("map", area.yaml_path.name)
    try:
        return TopologicalMap(area.yaml_path.stem, frame, tuple(nodes.values()), tuple(edges))
    except InputError as error:
        raise InputError(error.rule, where=where, remedy=error.remedy) from None


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


def _nodes(ovals: list[Any], texts: Mapping[str, str], area: AreaDrawing) -> dict[str, Node]:
    """Nodes by their tag."""
    nodes: dict[str, Node] = {}
    for position, raw in enumerate(ovals):
        place = f"{area.canvas_path}: oval[{position}]"
        (x0, y0, x1, y1), options = _element(raw, 4, place)
        tag = _string(options, "tags", place)
        if tag not in texts:
            raise InputError(f"node '{tag}' has no name", where=place, remedy=_DRAW_AGAIN)
        if tag in nodes:
            raise InputError(f"two nodes are tagged '{tag}'", where=place, remedy=_DRAW_AGAIN)
        name = texts[tag]
        x_m, y_m = area.point_of_pixel((x0 + x1) / 2, (y0 + y1) / 2)
        size = area.node_sizes.get(name, 1.0)
        nodes[tag] = Node(name, node_kind_of_name(name), x_m, y_m, room_of_name(name), size)
    return nodes


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
        if code not in BEHAVIOR_CODES:
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


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > _MAX_YAML_BYTES:
            raise InputError(
                f"an area's yaml has at most {_MAX_YAML_BYTES} bytes",
                where=str(path),
                remedy="check that this is the right file",
            )
        document = yaml.safe_load(path.read_text("utf-8"))
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror or error}",
            where=str(path),
            remedy="check the path and its permissions",
        ) from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        mark = getattr(error, "problem_mark", None)
        line = f" at line {mark.line + 1}" if mark else ""
        raise InputError(
            f"not yaml{line}", where=str(path), remedy="repair that place"
        ) from None
    if not isinstance(document, dict):
        raise InputError(
            "an area's yaml holds keys and values",
            where=str(path),
            remedy="name the yaml of a floor plan, such as area_1.yaml",
        )
    return document


def _beside(path: Path, document: Mapping[str, Any], key: str) -> Path:
    value = document.get(key)
    if not isinstance(value, str) or not value:
        raise InputError(
            f"must name a file under '{key}'",
            where=str(path),
            remedy="name the yaml of an area that has a drawn map",
        )
    found = path.parent / value
    if not found.is_file():
        raise InputError(
            f"'{key}' names {value}, which is not there",
            where=str(path),
            remedy="put the file beside the yaml",
        )
    return found


def _image_rows(path: Path) -> int:
    try:
        with Image.open(path) as image:
            return int(image.height)
    except (OSError, UnidentifiedImageError, ValueError, Image.DecompressionBombError):
        raise InputError(
            "not an image", where=str(path), remedy="restore the floor plan's PNG"
        ) from None


def _number(value: Any, what: str, path: Path) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
        raise InputError(
            f"{what} must be a finite number, got {value!r}"[:200],
            where=str(path),
            remedy="write a number in metres",
        )
    return float(value)
