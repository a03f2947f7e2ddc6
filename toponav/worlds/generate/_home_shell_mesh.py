"""Walls with their windows, floors, ceilings, doors and trims as triangles."""

import math

import numpy as np
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.extrude import merge_rectangles
from toponav.worlds.generate._home_canvas import Canvas, footprint, turned_exactly
from toponav.worlds.generate._home_shell import CELL_M, Opening
from toponav.worlds.generate._home_style import Palette
from toponav.worlds.generate._home_walls import WallRun, Window
from toponav.worlds.generate.shapes import Shape, ShapeBuilder
from toponav.worlds.generate.surfaces import Surface, surface
from toponav.worlds.grid import SemanticClass

__all__ = ["build_shell"]

_S = SemanticClass
_FRAME_M = 0.06
_GLASS_M = 0.1
"""How far behind the inner face of a wall a window's pane is."""


def build_shell(canvas: Canvas, runs: list[WallRun], palettes: list[Palette]) -> None:
    """Adds everything that is not furniture, in each room's colours."""
    _floors(canvas, palettes)
    _walls(canvas, runs, palettes)
    for opening in canvas.shell.openings:
        _lintel(canvas, opening, palettes)
        _casing(canvas, opening, palettes[opening.inner])
        if opening.hinge:
            _leaf(canvas, opening, palettes[opening.inner])
    if canvas.shell.entrance is not None:
        _front_door(canvas, canvas.shell.entrance, palettes)
    _closure(canvas, palettes[0])


def wall_surface(kind: RoomKind, palette: Palette) -> str:
    """What a room's walls are covered with."""
    if kind is RoomKind.BATHROOM:
        return "wall_tiles"
    return "wallpaper" if palette["has_wallpaper"] else "paint"


def floor_surface(kind: RoomKind, palette: Palette) -> str:
    """What a room's floor is covered with."""
    if kind is RoomKind.BATHROOM or (kind is RoomKind.KITCHEN and palette["has_kitchen_tiles"]):
        return "floor_tiles"
    if kind is RoomKind.STORAGE:
        return "floor_tiles" if palette["has_kitchen_tiles"] else "planks"
    if kind in (RoomKind.BEDROOM, RoomKind.STUDY) and palette["has_carpet"]:
        return "carpet"
    return "parquet" if palette["has_parquet"] else "planks"


def _floors(canvas: Canvas, palettes: list[Palette]) -> None:
    """Each room's floor, run on under the walls so that no seam shows."""
    shell = canvas.shell
    lost = ndimage.distance_transform_edt(
        shell.room_index < 0, return_distances=False, return_indices=True
    )
    nearest = shell.room_index[tuple(lost)]
    for number, spec in enumerate(shell.specs):
        b = ShapeBuilder()
        kind = floor_surface(spec.kind, palettes[number])
        for row0, col0, row1, col1 in merge_rectangles(nearest == number).tolist():
            x0, x1, y0, y1 = (value * CELL_M for value in (col0, col1, row0, row1))
            points = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], float)
            b.quads(points[None], points[None, :, :2], kind)
        canvas.add_shape(b.finish(), (surface(kind, palettes[number][kind]),), _S.FLOOR, -1)


def _walls(canvas: Canvas, runs: list[WallRun], palettes: list[Palette]) -> None:
    instance = canvas.new_instance()
    high = canvas.shell.ceiling_m
    for run in runs:
        palette = palettes[run.room]
        kind = wall_surface(canvas.shell.specs[run.room].kind, palette)
        b = ShapeBuilder()
        at = run.start_m
        for window in sorted(run.windows, key=lambda one: one.start_m):
            _face(b, run, (at, window.start_m), (0.0, high), kind)
            _face(b, run, (window.start_m, window.stop_m), (0.0, window.sill_m), kind)
            _face(b, run, (window.start_m, window.stop_m), (window.head_m, high), kind)
            at = window.stop_m
        _face(b, run, (at, run.stop_m), (0.0, high), kind)
        shape = b.finish()
        canvas.add_shape(shape, (surface(kind, palette[kind]),), _S.WALL, instance)
        for window in run.windows:
            _window(canvas, run, window, palette)
        if run.length_m > 0.15 and kind != "wall_tiles":
            _baseboard(canvas, run, palette, instance)


def _face(
    b: ShapeBuilder,
    run: WallRun,
    span: tuple[float, float],
    heights: tuple[float, float],
    kind: str,
    depth: float = 0.0,
) -> None:
    """An upright rectangle that looks into the room."""
    if span[1] - span[0] < 1e-6:
        return
    # Seen from the room, a wall whose normal is +y runs from right to left along x.
    forward = run.horizontal == (run.normal < 0)
    ends = span if forward else (span[1], span[0])
    p0, p1 = run.point(ends[0], depth), run.point(ends[1], depth)
    (z0, z1) = heights
    points = np.array([(*p0, z0), (*p1, z0), (*p1, z1), (*p0, z1)])
    uv = np.array([(ends[0], z0), (ends[1], z0), (ends[1], z1), (ends[0], z1)])
    if not forward:
        uv[:, 0] = -uv[:, 0]
    b.quads(points[None], uv[None], kind)


def _block(
    b: ShapeBuilder,
    run: WallRun,
    span: tuple[float, float],
    depth: tuple[float, float],
    heights: tuple[float, float],
    kind: str,
) -> None:
    """A box given by bounds along a wall and in front of it."""
    p, q = run.point(span[0], depth[0]), run.point(span[1], depth[1])
    x, y = sorted((p[0], q[0])), sorted((p[1], q[1]))
    b.box((x[0], x[1]), (y[0], y[1]), heights, kind)


def _baseboard(canvas: Canvas, run: WallRun, palette: Palette, instance: int) -> None:
    b = ShapeBuilder()
    _face(b, run, (run.start_m, run.stop_m), (0.0, 0.08), "trim", 0.012)
    p, q = run.point(run.start_m, 0.0), run.point(run.stop_m, 0.012)
    (x0, x1), (y0, y1) = sorted((p[0], q[0])), sorted((p[1], q[1]))
    top = np.array([(x0, y0, 0.08), (x1, y0, 0.08), (x1, y1, 0.08), (x0, y1, 0.08)])
    b.quads(top[None], top[None, :, :2], "trim")
    canvas.add_shape(b.finish(), (_trim(palette),), _S.WALL, instance)


def _trim(palette: Palette) -> Surface:
    return (
        surface("wood", palette["wood"])
        if palette["has_wooden_trim"]
        else surface("white", palette["white"])
    )


def _window(canvas: Canvas, run: WallRun, window: Window, palette: Palette) -> None:
    """Reveals, a frame with bars, and a bright pane that shows what is outside."""
    (low, high), (z0, z1) = (window.start_m, window.stop_m), (window.sill_m, window.head_m)
    instance = canvas.new_instance()
    b = ShapeBuilder()
    deep = -_GLASS_M
    # The reveal's four sides look inwards: boxes that lie in the wall.
    edge = 0.02
    _block(b, run, (low - edge, low), (deep - edge, 0.0), (z0 - edge, z1 + edge), "frame")
    _block(b, run, (high, high + edge), (deep - edge, 0.0), (z0 - edge, z1 + edge), "frame")
    _block(b, run, (low, high), (deep - edge, 0.0), (z1, z1 + edge), "frame")
    _block(b, run, (low - 0.04, high + 0.04), (deep - edge, 0.05), (z0 - 0.03, z0), "frame")
    bars = max(1, round((high - low) / 0.7))
    for at in np.linspace(low, high - _FRAME_M, bars + 1):
        _block(b, run, (float(at), float(at) + _FRAME_M), (deep, deep + 0.04), (z0, z1), "frame")
    for z in (z0, z1 - _FRAME_M):
        _block(b, run, (low, high), (deep, deep + 0.04), (z, z + _FRAME_M), "frame")
    canvas.add_shape(b.finish(), (_trim(palette),), _S.WINDOW, instance)
    pane = ShapeBuilder()
    forward = run.horizontal == (run.normal < 0)
    ends = (low, high) if forward else (high, low)
    p0, p1 = run.point(ends[0], deep), run.point(ends[1], deep)
    points = np.array([(*p0, z0), (*p1, z0), (*p1, z1), (*p0, z1)])
    wide = (high - low) / 2.0
    uv = np.array([(0, z0 / 2.4), (wide, z0 / 2.4), (wide, z1 / 2.4), (0, z1 / 2.4)])
    pane.quads(points[None], uv[None], "outdoors")
    view = surface("outdoors", palette["outdoors"])
    canvas.add_shape(pane.finish(), (view,), _S.WINDOW, instance)


def _extent(opening: Opening, before: int, after: int) -> tuple[float, float, float, float]:
    """Bounds x0, x1, y0, y1 of cells about an opening, in metres."""
    rows, cols = opening.box(before, after)
    x0, x1, y0, y1 = (v * CELL_M for v in (cols.start, cols.stop, rows.start, rows.stop))
    return x0, x1, y0, y1


def _lintel(canvas: Canvas, opening: Opening, palettes: list[Palette]) -> None:
    """The wall above an opening, in the colours of the room on each side."""
    x0, x1, y0, y1 = _extent(opening, 1, 1)
    shell = canvas.shell
    z = (opening.top_m, shell.ceiling_m)
    kinds = {
        number: wall_surface(shell.specs[number].kind, palettes[number])
        for number in (opening.outer, opening.inner)
    }
    for number, keep in ((opening.inner, True), (opening.outer, False)):
        inner_is_high = opening.side > 0
        high_side = inner_is_high == keep
        kind = kinds[number]
        b = ShapeBuilder()
        run = WallRun(
            number,
            opening.horizontal,
            (y1 if high_side else y0) if opening.horizontal else (x1 if high_side else x0),
            x0 if opening.horizontal else y0,
            x1 if opening.horizontal else y1,
            1 if high_side else -1,
            [],
        )
        _face(b, run, (run.start_m, run.stop_m), z, kind)
        canvas.add_shape(b.finish(), (surface(kind, palettes[number][kind]),), _S.WALL, 0)
    under = ShapeBuilder()
    low = np.array([(x0, y0, z[0]), (x0, y1, z[0]), (x1, y1, z[0]), (x1, y0, z[0])])
    under.quads(low[None], low[None, :, :2], "trim")
    canvas.add_shape(under.finish(), (_trim(palettes[opening.inner]),), _S.DOOR, 0)


def _casing(canvas: Canvas, opening: Opening, palette: Palette) -> None:
    """Boards around an opening, on both faces of the wall and not in the way."""
    wide, thick = 0.07, 0.015
    a0, a1 = opening.start * CELL_M, opening.stop * CELL_M
    b = ShapeBuilder()
    for face in (-1, 1):
        line = (opening.line + face) * CELL_M
        run = WallRun(0, opening.horizontal, line, a0, a1, face, [])
        _block(b, run, (a0 - wide, a0), (0.0, thick), (0.0, opening.top_m + wide), "trim")
        _block(b, run, (a1, a1 + wide), (0.0, thick), (0.0, opening.top_m + wide), "trim")
        _block(b, run, (a0, a1), (0.0, thick), (opening.top_m, opening.top_m + wide), "trim")
    canvas.add_shape(b.finish(), (_trim(palette),), _S.DOOR, canvas.new_instance())


def _panels(b: ShapeBuilder, width: float, height: float, kind: str) -> None:
    """A door leaf along x from its hinge at 0, 4 cm thick behind y = 0, with two fillings."""
    b.box((0.0, width), (-0.04, 0.0), (0.008, height), kind)
    for z0, z1 in ((0.15, height * 0.45), (height * 0.5, height - 0.15)):
        for y in (-0.046, 0.0):
            b.box((0.12, width - 0.12), (y, y + 0.006), (z0, z1), kind)
    for y in (-0.09, 0.05):
        b.box((width - 0.16, width - 0.05), (y, y + 0.02), (1.0, 1.02), "metal")
    b.box((width - 0.07, width - 0.05), (-0.09, 0.07), (1.0, 1.02), "metal")


def _leaf(canvas: Canvas, opening: Opening, palette: Palette) -> None:
    """The open leaf in the inner room, at the widest of some angles that walls allow."""
    for angle in (opening.open_rad, math.radians(97.0), math.pi / 2):
        for hinge in (opening.hinge, -opening.hinge):
            shape, at, yaw = _open_leaf(opening, hinge, angle, palette)
            cells = footprint(shape, at, yaw, canvas.blocked.shape)
            if cells is None or _hits_wall(canvas, opening, cells):
                continue
            colors = tuple(surface(slot, palette[slot]) for slot in shape.slots)
            instance = canvas.new_instance()
            canvas.add_shape(shape, colors, _S.DOOR, instance, turned_exactly(yaw), at)
            window, mask = cells
            # Its handle must not count as a part of the opening.
            free = np.zeros(canvas.blocked.shape, bool)
            free[opening.box(14, 16)] = True
            mask &= ~free[window] & ~canvas.shell.wall[window]
            canvas.heights_m[window][mask] = np.float32(opening.top_m - 0.01)
            canvas.semantics[window][mask] = _S.DOOR
            canvas.blocked[window] |= mask
            return


def _hits_wall(
    canvas: Canvas, opening: Opening, cells: tuple[tuple[slice, slice], np.ndarray]
) -> bool:
    """Whether a leaf leaves its room or is in the way of another opening."""
    window, mask = cells
    index = canvas.shell.room_index[window]
    # A knob may touch the wall beside the jamb.
    outside = int((mask & (index != opening.inner)).sum())
    ways = np.zeros(canvas.blocked.shape, bool)
    for other in canvas.shell.openings:
        if other is not opening:
            ways[other.box(10, 10)] = True
    return outside > 0 or bool((mask & ways[window]).any())


def _open_leaf(
    opening: Opening, hinge: int, angle_rad: float, palette: Palette
) -> tuple[Shape, tuple[float, float, float], float]:
    """The leaf, where its hinge is, and how it is turned."""
    along = opening.stop if hinge > 0 else opening.start
    at = opening.point_m(along, 1.02)
    b = ShapeBuilder()
    body = "wood" if palette["has_wooden_doors"] else "white"
    _panels(b, opening.width_m - 0.01, opening.top_m - 0.01, body)
    shape = b.finish()
    # Directions in the plan: along the wall into the opening, and into the inner room.
    dx, dy = -math.cos(angle_rad) * hinge, math.sin(angle_rad) * opening.side
    direction = np.array([dx, dy] if opening.horizontal else [dy, dx])
    toward = np.array([-hinge, 0.0] if opening.horizontal else [0.0, -hinge])
    left = np.array([-direction[1], direction[0]])
    if float(left @ toward) < 0:  # its thickness must lie away from the opening
        corners = np.ascontiguousarray((shape.corners_m * np.array([1.0, -1.0, 1.0]))[:, ::-1])
        shape = Shape(corners, shape.corner_uv[:, ::-1], shape.slot, shape.slots)
    return shape, (*at, 0.0), math.atan2(direction[1], direction[0])


def _front_door(canvas: Canvas, door: Opening, palettes: list[Palette]) -> None:
    """The closed front door, set a little into the outer wall."""
    palette = palettes[door.inner]
    face = door.line + door.side
    run = WallRun(door.inner, door.horizontal, face * CELL_M, 0.0, 0.0, door.side, [])
    b = ShapeBuilder()
    a0, a1 = door.start * CELL_M, door.stop * CELL_M
    _block(b, run, (a0, a1), (0.0, 0.012), (0.0, door.top_m), "wood")
    for z in ((0.2, 0.9), (1.05, door.top_m - 0.15)):
        _block(b, run, (a0 + 0.14, a1 - 0.14), (0.012, 0.02), z, "wood")
    for span in ((a0 - 0.08, a0), (a1, a1 + 0.08)):
        _block(b, run, span, (0.0, 0.025), (0.0, door.top_m + 0.08), "white")
    _block(b, run, (a0, a1), (0.0, 0.025), (door.top_m, door.top_m + 0.08), "white")
    _block(b, run, (a1 - 0.13, a1 - 0.05), (0.02, 0.05), (1.0, 1.03), "metal")
    shape = b.finish()
    colors = tuple(surface(slot, palette[slot]) for slot in shape.slots)
    canvas.add_shape(shape, colors, _S.DOOR, canvas.new_instance())


def _closure(canvas: Canvas, palette: Palette) -> None:
    """The ceiling, and walls around everything: no ray leaves even through a seam."""
    rows, cols = canvas.blocked.shape
    x, y, z = cols * CELL_M, rows * CELL_M, canvas.shell.ceiling_m
    b = ShapeBuilder()
    top = np.array([(0, 0, z), (0, y, z), (x, y, z), (x, 0, z)], float)
    b.quads(top[None], top[None, :, :2], "white")
    canvas.add_shape(b.finish(), (surface("white", palette["white"]),), _S.CEILING, -1)
    around = ShapeBuilder()
    ring = np.array([(0, 0), (0, y), (x, y), (x, 0)], float)
    after = np.roll(ring, -1, axis=0)
    points = np.stack(
        [
            np.column_stack([ring, np.zeros(4)]),
            np.column_stack([after, np.zeros(4)]),
            np.column_stack([after, np.full(4, z)]),
            np.column_stack([ring, np.full(4, z)]),
        ],
        axis=1,
    )
    around.quads(points, np.zeros((4, 4, 2)), "white")
    canvas.add_shape(around.finish(), (surface("white", palette["white"]),), _S.WALL, 0)
