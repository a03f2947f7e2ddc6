"""Vector drawings for the page: floor plans with maps and paths. Colours come from its CSS."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from toponav.core.vocabulary import NodeKind, RoomKind
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.worlds.draw import room_anchors_m
from toponav.worlds.extrude import merge_rectangles
from toponav.worlds.grid import SemanticClass
from toponav.worlds.scene import Scene

__all__ = ["Canvas", "floor_defs", "map_layer", "path_layer", "plan_layer", "room_names"]

_PX_PER_M = 24.0
_MARGIN_M = 0.6
_NAME_PX = 7.5
_CLASS_OF_ROOM = {
    RoomKind.OFFICE: "office",
    RoomKind.STUDY: "office",
    RoomKind.CONFERENCE_ROOM: "meeting",
    RoomKind.AUDITORIUM: "meeting",
    RoomKind.HALLWAY: "passage",
    RoomKind.LOBBY: "passage",
    RoomKind.OPEN_SPACE: "open",
    RoomKind.LOUNGE: "open",
}


@dataclass(frozen=True)
class Canvas:
    """Pixels of a drawing: x right, y down; metres come from the map frame.

    Attributes:
        left_m: x of the left edge.
        top_m: y of the upper edge.
        width_px: Width of the drawing.
        height_px: Height of the drawing.
    """

    left_m: float
    top_m: float
    width_px: float
    height_px: float

    @staticmethod
    def around(scene: Scene) -> "Canvas":
        """A canvas that holds the building."""
        used = np.argwhere(scene.occupied | (scene.room_index >= 0))
        (row0, col0), (row1, col1) = used.min(axis=0), used.max(axis=0)
        left_m, bottom_m = scene.grid.center_of(int(row0), int(col0))
        right_m, top_m = scene.grid.center_of(int(row1), int(col1))
        return Canvas(
            left_m - _MARGIN_M,
            top_m + _MARGIN_M,
            (right_m - left_m + 2 * _MARGIN_M) * _PX_PER_M,
            (top_m - bottom_m + 2 * _MARGIN_M) * _PX_PER_M,
        )

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Where a point of the map frame is drawn."""
        return round((x_m - self.left_m) * _PX_PER_M, 1), round((self.top_m - y_m) * _PX_PER_M, 1)

    @property
    def view_box(self) -> str:
        """The attribute of that name."""
        return f"0 0 {self.width_px:.0f} {self.height_px:.0f}"


def floor_defs(canvas: Canvas, scene: Scene, name: str = "floor") -> str:
    """The building as a group to be used by `<use href="#floor">`: rooms, furniture, walls."""
    kinds = [_CLASS_OF_ROOM.get(room.kind, "service") for room in scene.rooms]
    parts = [f'<g id="{name}">']
    for kind in sorted(set(kinds)):
        numbers = [number for number, found in enumerate(kinds) if found == kind]
        mask = np.isin(scene.room_index, numbers) & ~_is_wall(scene)
        parts.append(f'<path class="room {kind}" d="{_area(canvas, scene, mask)}"/>')
    doors = scene.occupied & (scene.semantics == SemanticClass.DOOR)
    furniture = scene.occupied & ~_is_wall(scene) & ~doors
    parts.append(f'<path class="furniture" d="{_area(canvas, scene, furniture)}"/>')
    parts.append(f'<path class="door" d="{_area(canvas, scene, doors)}"/>')
    parts.append(f'<path class="wall" d="{_area(canvas, scene, _is_wall(scene))}"/>')
    return "".join([*parts, "</g>"])


def _is_wall(scene: Scene) -> np.ndarray:
    structure = (SemanticClass.WALL, SemanticClass.COLUMN, SemanticClass.WINDOW)
    return np.asarray(scene.occupied & np.isin(scene.semantics, structure))


def _area(canvas: Canvas, scene: Scene, mask: np.ndarray) -> str:
    size = scene.grid.resolution_m * _PX_PER_M
    pieces = []
    for row0, col0, row1, col1 in merge_rectangles(np.ascontiguousarray(mask)).tolist():
        x_m = scene.grid.origin_m[0] + col0 * scene.grid.resolution_m
        y_m = scene.grid.origin_m[1] + row1 * scene.grid.resolution_m
        x, y = canvas.at(x_m, y_m)
        pieces.append(f"M{x:g} {y:g}h{(col1 - col0) * size:g}v{(row1 - row0) * size:g}H{x:g}z")
    return "".join(pieces)


def room_names(canvas: Canvas, scene: Scene) -> str:
    """The names of the rooms that are large enough to hold them."""
    parts = ['<g class="names">']
    cells = np.bincount(scene.room_index[scene.room_index >= 0], minlength=len(scene.rooms))
    areas_m2 = cells * scene.grid.resolution_m**2
    anchors = room_anchors_m(scene)
    for room, (x_m, y_m), area_m2 in zip(scene.rooms, anchors, areas_m2, strict=True):
        name = room.name.replace("_", " ")
        fits = len(name) * _NAME_PX < 0.92 * math.sqrt(area_m2) * _PX_PER_M
        if np.isfinite(x_m) and fits and room.kind.is_enclosed:
            x, y = canvas.at(x_m, y_m)
            parts.append(f'<text x="{x}" y="{y}">{escape(name)}</text>')
    return "".join([*parts, "</g>"])


def map_layer(canvas: Canvas, map_: TopologicalMap, plan: Plan | None = None) -> str:
    """All edges thin and grey, the plan's in their behaviour's colour; the plan's nodes on top.

    Edges carry `data-edge` so that the page can light up what the robot believes.
    """
    on_plan = set(plan.edges) if plan else set()
    parts = ['<g class="map">']
    for edge in sorted(map_.edges, key=lambda edge: edge.id in on_plan):
        source, target = map_.node(edge.source), map_.node(edge.target)
        x1, y1 = canvas.at(source.x_m, source.y_m)
        x2, y2 = canvas.at(target.x_m, target.y_m)
        kind = f"edge plan {edge.behavior}" if edge.id in on_plan else "edge"
        parts.append(
            f'<path class="{kind}" data-edge="{escape(edge.id)}" d="M{x1} {y1}L{x2} {y2}"/>'
        )
        if edge.id in on_plan:
            parts.append(_arrow(x1, y1, x2, y2, f"arrow {edge.behavior}"))
    for node in map_.nodes:
        on = plan is not None and node.id in plan
        x, y = canvas.at(node.x_m, node.y_m)
        radius = 5.5 if node.kind is NodeKind.ROOM else 3.5
        label = escape(node.id)
        parts.append(
            f'<circle class="node{" plan" if on else ""}" cx="{x}" cy="{y}" r="{radius}">'
            f"<title>{label}</title></circle>"
        )
    return "".join([*parts, "</g>"])


def _arrow(x1: float, y1: float, x2: float, y2: float, kind: str) -> str:
    length = math.hypot(x2 - x1, y2 - y1)
    if length < 14.0:
        return ""
    dx, dy = (x2 - x1) / length, (y2 - y1) / length
    tip_x, tip_y = x1 + 0.62 * (x2 - x1), y1 + 0.62 * (y2 - y1)
    back_x, back_y = tip_x - 9 * dx, tip_y - 9 * dy
    return (
        f'<path class="{kind}" d="M{tip_x:.1f} {tip_y:.1f}'
        f"L{back_x - 4.5 * dy:.1f} {back_y + 4.5 * dx:.1f}"
        f'L{back_x + 4.5 * dy:.1f} {back_y - 4.5 * dx:.1f}z"/>'
    )


def plan_layer(canvas: Canvas, map_: TopologicalMap, plan: Plan) -> str:
    """The plan as one wide band, with a ring around its goal."""
    points = [canvas.at(map_.node(node).x_m, map_.node(node).y_m) for node in plan.nodes]
    goal_x, goal_y = points[-1]
    return (
        f'<polyline class="band" points="{_points(points)}"/>'
        f'<g class="goal" transform="translate({goal_x} {goal_y})">'
        '<circle r="13"/><circle r="6.5"/></g>'
    )


def path_layer(
    canvas: Canvas,
    xy_m: Iterable[Sequence[float]],
    kind: str,
    label: str = "",
    ended_badly: bool = False,
) -> str:
    """A driven path; a cross marks where a failed run ended."""
    points = [canvas.at(point[0], point[1]) for point in xy_m]
    if not points:
        return ""
    title = f"<title>{escape(label)}</title>" if label else ""
    parts = [f'<polyline class="path {kind}" points="{_points(points)}">{title}</polyline>']
    if ended_badly:
        x, y = points[-1]
        parts.append(f'<path class="cross {kind}" d="M{x - 7} {y - 7}l14 14m0-14l-14 14"/>')
    return "".join(parts)


def _points(points: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in points)
