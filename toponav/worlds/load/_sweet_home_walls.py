"""Walls with holes, floors and ceilings from the drawing of a home."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Float

from toponav.core.errors import InputError
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.mesh_parts import MeshPart, Notes
from toponav.worlds.materials import Material, linear_rgb

__all__ = ["Hole", "Wall", "building_parts", "numbers_of"]

_ARC_STEP_RAD = 0.2
_FLOOR = Material("floor", linear_rgb("#b8a68c"))
_CEILING = Material("ceiling", linear_rgb("#f2f2f0"))


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall between two points; `arc_rad` bends it to the left."""

    start: Float[np.ndarray, " 2"]
    end: Float[np.ndarray, " 2"]
    thickness_m: float
    height_m: float
    arc_rad: float
    joined_start: bool
    joined_end: bool
    material: Material


@dataclass(frozen=True, eq=False)
class Hole:
    """A door or window: a box cut out of the walls."""

    middle: Float[np.ndarray, " 2"]
    along: Float[np.ndarray, " 2"]
    width_m: float
    depth_m: float
    low_m: float
    high_m: float


def numbers_of(text: str) -> Float[np.ndarray, " numbers"]:
    """The numbers in a text; none where a word is no finite number."""
    try:
        values = np.array([float(word) for word in text.split()[:64]], np.float64)
    except ValueError:
        return np.zeros(0)
    return values if np.isfinite(values).all() else np.zeros(0)


def building_parts(
    walls: Sequence[Wall],
    holes: Sequence[Hole],
    rooms: Sequence[Float[np.ndarray, "corners 2"]],
    ceiling_m: float,
    notes: Notes,
    where: str,
) -> list[MeshPart]:
    """Walls cut by doors and windows, the floor, and the ceiling over it.

    Raises:
        InputError: The drawing has neither walls nor rooms.
    """
    shapes = [_outline(wall) for wall in walls]
    cuts = [_cut(hole) for hole in holes]
    parts: list[MeshPart] = []
    for wall, shape in zip(walls, shapes, strict=True):
        touching = [
            (hole, cut) for hole, cut in zip(holes, cuts, strict=True) if cut.intersects(shape)
        ]
        whole = shape.difference(shapely.union_all([cut for _, cut in touching]))
        pieces = [(whole, 0.0, wall.height_m)]
        for hole, cut in touching:
            inside = shape.intersection(cut)
            pieces.append((inside, 0.0, min(hole.low_m, wall.height_m)))
            pieces.append((inside, hole.high_m, wall.height_m))
        for piece, low_m, high_m in pieces:
            if high_m - low_m > 0.01:
                part = _extruded(piece, low_m, high_m, wall.material)
                if part is not None:
                    parts.append(part)
    solid = shapely.union_all(shapes) if shapes else shapely.Polygon()
    grounds = [_valid(shapely.Polygon(corners)) for corners in rooms]
    grounds += [shapely.Polygon(one.exterior) for one in _polygons(solid)]
    ground = shapely.union_all(grounds) if grounds else shapely.Polygon()
    if ground.is_empty:
        raise InputError(
            "has neither walls nor rooms", where=where, remedy="check that it is a whole home"
        )
    if not rooms:
        notes.add("no rooms drawn: the floor is what the walls enclose")
    for name, height_m, kind, material in (
        ("floor", 0.0, SemanticClass.FLOOR, _FLOOR),
        ("ceiling", ceiling_m, SemanticClass.CEILING, _CEILING),
    ):
        corners, faces = _triangles(ground)
        if len(faces):
            flat = np.c_[corners, np.full(len(corners), height_m)].astype(np.float32)
            faces = faces if kind == SemanticClass.FLOOR else faces[:, ::-1]
            parts.append(MeshPart(name, flat, faces.copy(), materials=(material,), semantic=kind))
    return parts


def _outline(wall: Wall) -> shapely.Geometry:
    """The area that a wall stands on; joined ends run on by half its thickness."""
    line = _centre_line(wall)
    half = wall.thickness_m / 2
    ends = line.copy()
    for joined, at, before in ((wall.joined_start, 0, 1), (wall.joined_end, -1, -2)):
        way = line[at] - line[before]
        length = float(np.hypot(*way))
        if joined and length > 1e-9:
            ends[at] = line[at] + way / length * half
    return shapely.LineString(ends).buffer(half, cap_style="flat", join_style="mitre")


def _centre_line(wall: Wall) -> Float[np.ndarray, "points 2"]:
    """The points along a wall; an arc in small steps."""
    chord = wall.end - wall.start
    length = float(np.hypot(*chord))
    if length < 1e-6:
        return np.stack([wall.start, wall.start + np.array([1e-3, 0.0])])
    if abs(wall.arc_rad) < 1e-3:
        return np.stack([wall.start, wall.end])
    half = wall.arc_rad / 2
    normal = np.array([-chord[1], chord[0]]) / length
    centre = (wall.start + wall.end) / 2 + normal * (length / 2) / np.tan(half)
    first = wall.start - centre
    steps = max(int(np.ceil(abs(wall.arc_rad) / _ARC_STEP_RAD)), 2)
    angles = np.linspace(0.0, wall.arc_rad, steps + 1)
    cos, sin = np.cos(angles), np.sin(angles)
    turned = np.c_[cos * first[0] - sin * first[1], sin * first[0] + cos * first[1]]
    return np.asarray(centre + turned)


def _cut(hole: Hole) -> shapely.Geometry:
    """The area of a hole, deep enough to go through any wall that it stands in."""
    across = np.array([-hole.along[1], hole.along[0]])
    wide, deep = hole.along * hole.width_m / 2, across * (hole.depth_m / 2 + 0.1)
    corners = [hole.middle + a * wide + b * deep for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return shapely.Polygon(corners)


def _extruded(
    area: shapely.Geometry, low_m: float, high_m: float, material: Material
) -> MeshPart | None:
    """The sides, the top and, where it hangs, the underside of a solid over an area."""
    vertices: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    before = 0
    for polygon in _polygons(area):
        for ring in (polygon.exterior, *polygon.interiors):
            at = shapely.get_coordinates(ring)[:-1]
            inward = ring is not polygon.exterior
            if shapely.is_ccw(ring) == inward:
                at = at[::-1]
            count = len(at)
            here, after = np.arange(count), (np.arange(count) + 1) % count
            vertices += [np.c_[at, np.full(count, low_m)], np.c_[at, np.full(count, high_m)]]
            sides = np.r_[
                np.c_[here, after, after + count], np.c_[here, after + count, here + count]
            ]
            faces.append(sides + before)
            before += 2 * count
    corners, flat = _triangles(area)
    for height_m, turned in ((high_m, False), (low_m, True)):
        if len(flat) and not (turned and low_m <= 0):
            vertices.append(np.c_[corners, np.full(len(corners), height_m)])
            faces.append((flat[:, ::-1] if turned else flat) + before)
            before += len(corners)
    if not faces:
        return None
    return MeshPart(
        "wall",
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(faces).astype(np.int32),
        materials=(material,),
        semantic=SemanticClass.WALL,
        group="walls",
    )


def _triangles(area: shapely.Geometry) -> tuple[np.ndarray, np.ndarray]:
    """An area as triangles, counter-clockwise."""
    found = []
    for polygon in _polygons(area):
        made = shapely.constrained_delaunay_triangles(polygon)
        found.append(shapely.get_coordinates(made).reshape(-1, 4, 2)[:, :3])
    if not found:
        return np.zeros((0, 2)), np.zeros((0, 3), np.int32)
    corners = np.concatenate(found)
    (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    corners[ax * by < ay * bx] = corners[ax * by < ay * bx][:, ::-1]
    return corners.reshape(-1, 2), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)


def _polygons(area: shapely.Geometry) -> list[shapely.Polygon]:
    """The polygons of an area, without slivers."""
    parts = shapely.get_parts(area).tolist() if not area.is_empty else []
    flat: list[shapely.Polygon] = []
    for part in parts:
        if isinstance(part, shapely.Polygon):
            if part.area > 1e-6:
                flat.append(part)
        elif hasattr(part, "geoms"):
            flat += _polygons(part)
    return flat


def _valid(polygon: shapely.Polygon) -> shapely.Geometry:
    return polygon if polygon.is_valid else shapely.make_valid(polygon)
