"""Shapes of SDF documents as triangles."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from toponav.core.errors import InputError, shown
from toponav.worlds.load._sdf_frames import Frame, numbers_in
from toponav.worlds.load._sdf_models import ModelFolders
from toponav.worlds.load.mesh_files import read_mesh
from toponav.worlds.load.mesh_parts import MeshPart, Notes, move_part
from toponav.worlds.materials import GREY, Material, linear_rgb

__all__ = ["Plane", "SdfShapes"]

_SCRIPTS = {
    "white": "#ffffff",
    "black": "#101010",
    "grey": "#b0b0b0",
    "darkgrey": "#606060",
    "red": "#c02020",
    "green": "#20a020",
    "blue": "#2040c0",
    "yellow": "#e0d020",
    "orange": "#e08020",
    "purple": "#8030a0",
    "turquoise": "#20b0b0",
    "wood": "#a07850",
    "bricks": "#a05040",
}
_LEAST_M, _MOST_M = 1e-4, 1e4


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane, which Gazebo draws at its size and lets robots drive on without end."""

    size_m: tuple[float, float]
    material: Material
    frame: Frame = field(default_factory=lambda: np.eye(4))


class SdfShapes:
    """Makes triangles of `<geometry>` elements; a mesh is read once."""

    def __init__(self, folders: ModelFolders, notes: Notes) -> None:
        self._folders, self._notes = folders, notes
        self._meshes: dict[tuple[Path, str], list[MeshPart]] = {}

    def of(self, visual: Element, document: Path) -> list[MeshPart | Plane]:
        """The shapes of a visual in its own frame.

        Raises:
            InputError: A size is none, or a mesh cannot be read.
        """
        geometry = visual.find("geometry")
        if geometry is None or not len(geometry):
            return []
        shape = geometry[0]
        where = f"{document} {shown(visual.get('name') or shape.tag, 40)}"
        material = _material(visual.find("material"))
        if shape.tag == "plane":
            return [_plane(shape, material or GREY, where)]
        if shape.tag == "mesh":
            parts = self._mesh(shape, document, where)
            if material is not None:
                parts = [replace(part, materials=_painted(part, material)) for part in parts]
            return [*parts]
        made = _primitive(shape, where)
        if made is None:
            self._notes.add(f"shapes of the kind <{shape.tag[:30]}> left out")
            return []
        return [replace(made, materials=(material or GREY,))]

    def _mesh(self, shape: Element, document: Path, where: str) -> list[MeshPart]:
        uri = (shape.findtext("uri") or "").strip()
        if "://" in uri and not uri.startswith(("model://", "package://", "file://")):
            self._notes.add(f"mesh {shown(uri, 80)} left out: nothing is fetched from the network")
            return []
        files, name = self._folders.locate(uri, document)
        key = (files.root, name)
        if key not in self._meshes:
            read = read_mesh(files, name, self._notes)
            matrix = np.eye(4) * (read.unit_m or 1.0)
            matrix[3, 3] = 1.0
            if name.lower().endswith((".glb", ".gltf")):
                turn = np.eye(4)
                turn[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
                matrix = turn @ matrix
            elif read.up not in (None, "Z"):
                # Gazebo reads no up_axis (gazebo-classic issue 1305); worlds rely on that.
                self._notes.add("COLLADA up_axis not heeded, as in Gazebo")
            self._meshes[key] = [move_part(part, matrix) for part in read.parts]
        parts = self._meshes[key]
        wanted = shape.findtext("submesh/name")
        if wanted:
            chosen = [part for part in parts if part.name == wanted.strip()]
            if not chosen:
                self._notes.add(f"no submesh {shown(wanted, 40)}: the whole mesh instead")
            parts = chosen or parts
        scale = shape.find("scale")
        if scale is None or not (scale.text or "").strip():
            return parts
        factors = numbers_in(scale, 3, where)
        if not (np.abs(factors) > 1e-9).all():
            raise InputError("<scale> must not be zero", where=where, remedy="repair the SDF")
        return [move_part(part, np.diag([*factors, 1.0])) for part in parts]


def _plane(shape: Element, material: Material, where: str) -> Plane:
    size = shape.find("size")
    length = numbers_in(size, 2, where) if size is not None else np.array([100.0, 100.0])
    plane = Plane((abs(float(length[0])), abs(float(length[1]))), material)
    normal = shape.find("normal")
    if normal is not None and abs(numbers_in(normal, 3, where)[2]) < 0.9:
        plane.frame[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    return plane


def _primitive(shape: Element, where: str) -> MeshPart | None:
    """A box, cylinder, sphere or other plain solid; None for what is no such thing."""
    import trimesh

    solid = None
    if shape.tag == "box":
        solid = trimesh.creation.box(_sizes(shape, "size", 3, where))
    elif shape.tag in ("cylinder", "capsule", "cone"):
        radius = float(_sizes(shape, "radius", 1, where)[0])
        length = float(_sizes(shape, "length", 1, where)[0])
        if shape.tag == "cone":
            solid = trimesh.creation.cone(radius, length, sections=32)
            solid.apply_translation([0, 0, -length / 2])
        else:
            height = length + (2 * radius if shape.tag == "capsule" else 0)
            solid = trimesh.creation.cylinder(radius, height, sections=32)
    elif shape.tag == "sphere":
        solid = trimesh.creation.icosphere(2, float(_sizes(shape, "radius", 1, where)[0]))
    elif shape.tag == "ellipsoid":
        solid = trimesh.creation.icosphere(2, 1.0)
        solid.apply_scale(_sizes(shape, "radii", 3, where))
    elif shape.tag == "polyline":
        return _polyline(shape, where)
    if solid is None:
        return None
    return MeshPart(
        shape.tag, np.asarray(solid.vertices, np.float32), np.asarray(solid.faces, np.int32)
    )


def _sizes(shape: Element, tag: str, count: int, where: str) -> np.ndarray:
    """Lengths, all larger than nothing."""
    values = numbers_in(shape.find(tag), count, where)
    if not ((values >= _LEAST_M) & (values <= _MOST_M)).all():
        raise InputError(
            f"<{tag}> must lie in {_LEAST_M:g}..{_MOST_M:g} m, got {values.tolist()}",
            where=where,
            remedy="repair the SDF",
        )
    return values


def _polyline(shape: Element, where: str) -> MeshPart | None:
    """A polygon pulled up to a height: its sides, and a lid where it is simple."""
    import shapely
    import trimesh

    points = [numbers_in(point, 2, where) for point in list(shape.iterfind("point"))[:10_000]]
    height = float(_sizes(shape, "height", 1, where)[0])
    outline = shapely.Polygon(points) if len(points) >= 3 else shapely.Polygon()
    if outline.is_empty or not outline.is_valid:
        return None
    at = np.asarray(shapely.get_coordinates(outline.exterior)[:-1], np.float64)
    count = len(at)
    vertices = np.concatenate(
        [np.c_[at, np.zeros(count)], np.c_[at, np.full(count, height)]]
    ).astype(np.float32)
    here, after = np.arange(count), (np.arange(count) + 1) % count
    sides = np.concatenate(
        [np.c_[here, after, after + count], np.c_[here, after + count, here + count]]
    )
    lid = shapely.constrained_delaunay_triangles(outline)
    corners = shapely.get_coordinates(lid).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    flat = np.c_[corners, np.full(len(corners), height)].astype(np.float32)
    faces = np.concatenate([sides, np.arange(len(flat)).reshape(-1, 3) + 2 * count])
    solid = trimesh.Trimesh(np.concatenate([vertices, flat]), faces, process=False)
    return MeshPart(
        "polyline", np.asarray(solid.vertices, np.float32), np.asarray(solid.faces, np.int32)
    )


def _material(element: Element | None) -> Material | None:
    """The colour that a visual gives its shape, or None."""
    if element is None:
        return None
    for tag in ("diffuse", "ambient"):
        words = (element.findtext(tag) or "").split()
        try:
            rgb = [min(max(float(word), 0.0), 1.0) for word in words[:3]]
        except ValueError:
            continue
        if len(rgb) == 3 and all(value == value for value in rgb):
            return Material("painted", linear_rgb(rgb))
    script = (element.findtext("script/name") or "").rpartition("/")[2].lower()
    for name, color in _SCRIPTS.items():
        if script.startswith(name):
            return Material(name, linear_rgb(color))
    return None


def _painted(part: MeshPart, material: Material) -> tuple[Material, ...]:
    """A mesh's own materials where it has textures, else the visual's colour."""
    if any(one.texture is not None for one in part.materials):
        return part.materials
    return (material,) * len(part.materials)
