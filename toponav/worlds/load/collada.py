"""COLLADA (.dae): triangles by node, materials, the unit and the axis that points up."""

from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError, shown
from toponav.core.xml_tree import parse_xml
from toponav.worlds.load._collada_faces import ColladaGeometry, geometry_of, numbers_of
from toponav.worlds.load._collada_materials import ColladaMaterials
from toponav.worlds.load.mesh_parts import MAX_FACES, MeshFile, MeshPart, Notes, move_part
from toponav.worlds.load.source_files import SourceFiles

__all__ = ["read_collada"]

_MAX_BYTES = 768 << 20
_MAX_INSTANCES = 100_000
_MAX_DEPTH = 100


def read_collada(
    files: SourceFiles, name: str, notes: Notes, *, max_texture_px: int = 512
) -> MeshFile:
    """One part for each geometry that the document's scene shows, in the document's frame.

    Args:
        files: Where the document and its pictures lie.
        name: The document.
        notes: Where repairs are written down.
        max_texture_px: Longest side of a texture; larger ones are shrunk.

    Raises:
        InputError: It is no COLLADA document, or is too large.

    Reference:
        Khronos COLLADA 1.4.1 specification.
    """
    where = f"{files.label}/{name}"
    root = parse_xml(files.read(name, max_bytes=_MAX_BYTES), where)
    if root.tag != "COLLADA":
        raise InputError(
            f"must be a COLLADA document, got <{root.tag[:60]}>",
            where=where,
            remedy="export the model as COLLADA (.dae)",
        )
    reader = _Reader(root, files, name, notes, max_texture_px)
    parts = list(reader.scene_parts())
    unit = root.find("asset/unit")
    meter = numbers_of(unit.get("meter", "1") if unit is not None else "1")
    unit_m = float(meter[0]) if len(meter) == 1 and 1e-6 < meter[0] < 1e4 else 1.0
    up = (root.findtext("asset/up_axis") or "Y_UP").strip()[:1].upper()
    return MeshFile(parts, unit_m, up if up in "XYZ" and up else "Y")


class _Reader:
    """Walks the nodes of a document's scene."""

    def __init__(
        self, root: Element, files: SourceFiles, name: str, notes: Notes, max_texture_px: int
    ) -> None:
        self._root, self._notes = root, notes
        self._where = f"{files.label}/{name}"
        self._materials = ColladaMaterials(root, files, name, notes, max_texture_px)
        self._geometry: dict[str, ColladaGeometry | None] = {}
        self._by_id = {
            kind: {
                element.get("id", ""): element for element in root.iterfind(f"library_{kind}/*")
            }
            for kind in ("geometries", "visual_scenes", "controllers")
        }
        self._nodes = {
            node.get("id", ""): node
            for library in ("library_nodes", "library_visual_scenes")
            for node in root.iterfind(f"{library}//node")
        }
        self._instances = self._faces = 0

    def scene_parts(self) -> Iterator[MeshPart]:
        """The parts of the scene, or of every geometry where the document shows none."""
        shown_scene = self._root.find("scene/instance_visual_scene")
        scenes = self._by_id["visual_scenes"]
        scene = scenes.get(_fragment(shown_scene)) if shown_scene is not None else None
        if scene is None and scenes:
            scene = next(iter(scenes.values()))
        if scene is None:
            for number, identity in enumerate(self._by_id["geometries"]):
                yield from self._instance(identity, f"geometry_{number}", np.eye(4), None)
            return
        for node in scene.iterfind("node"):
            yield from self._node(node, np.eye(4), 0)

    def _node(self, node: Element, frame: Float[np.ndarray, "4 4"], depth: int) -> Iterator[Any]:
        """The parts below a node."""
        self._instances += 1
        if self._instances > _MAX_INSTANCES or depth > _MAX_DEPTH:
            raise InputError(
                f"at most {_MAX_INSTANCES:,} nodes, {_MAX_DEPTH} inside one another, are read; "
                "a node may not hold itself",
                where=self._where,
                remedy="export the model again without instances of instances",
            )
        frame = frame @ _transform(node)
        name = node.get("name") or node.get("id") or ""
        for child in node:
            if child.tag == "instance_geometry":
                yield from self._instance(_fragment(child), name, frame, child)
            elif child.tag == "instance_controller":
                skin = self._by_id["controllers"].get(_fragment(child))
                source = skin.find("skin") if skin is not None else None
                if source is not None:
                    self._notes.add("skinned models are taken in their rest pose")
                    identity = (source.get("source") or "").lstrip("#")
                    yield from self._instance(identity, name, frame, child)
            elif child.tag == "instance_node":
                target = self._nodes.get(_fragment(child))
                if target is not None:
                    yield from self._node(target, frame, depth + 1)
            elif child.tag == "node":
                yield from self._node(child, frame, depth + 1)

    def _instance(
        self, identity: str, name: str, frame: Float[np.ndarray, "4 4"], bound: Element | None
    ) -> Iterator[MeshPart]:
        """A geometry where a node puts it, in the materials that it gives it."""
        if identity not in self._geometry:
            element = self._by_id["geometries"].get(identity)
            self._geometry[identity] = None
            if element is None:
                self._notes.add(f"geometry {shown(identity, 60)} is not there: left out")
            else:
                self._geometry[identity] = geometry_of(element, self._where, self._notes)
        geometry = self._geometry[identity]
        if geometry is None or not len(geometry.faces):
            return
        self._faces += len(geometry.faces)
        if self._faces > MAX_FACES:
            raise InputError(
                f"at most {MAX_FACES:,} triangles are read",
                where=self._where,
                remedy="simplify the model",
            )
        materials = tuple(self._materials.of(symbol, bound) for symbol in geometry.symbols)
        yield move_part(
            MeshPart(
                name or identity,
                geometry.vertices,
                geometry.faces,
                geometry.face_symbol,
                geometry.corner_uv,
                materials,
            ),
            frame,
        )


def _fragment(element: Element) -> str:
    """What an instance refers to in the same document."""
    return (element.get("url") or "").rpartition("#")[2]


def _transform(node: Element) -> Float[np.ndarray, "4 4"]:
    """A node's transforms, one after another."""
    frame = np.eye(4)
    for child in node:
        values = numbers_of(child.text or "") if child.tag in _TRANSFORMS else np.zeros(0)
        size = _TRANSFORMS.get(child.tag)
        if size is None or len(values) != size or not np.isfinite(values).all():
            continue
        step = np.eye(4)
        if child.tag == "matrix":
            step = values.reshape(4, 4)
        elif child.tag == "translate":
            step[:3, 3] = values
        elif child.tag == "scale":
            step = np.diag([*values, 1.0])
        else:
            step[:3, :3] = _turn(values[:3], np.radians(values[3]))
        frame = frame @ step
    return frame


_TRANSFORMS = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4}


def _turn(axis: Float[np.ndarray, " 3"], angle_rad: float) -> Float[np.ndarray, "3 3"]:
    """Rotation about an axis (Rodrigues)."""
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        return np.eye(3)
    x, y, z = axis / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: np.ndarray = np.eye(3) + np.sin(angle_rad) * cross
    turned += (1 - np.cos(angle_rad)) * (cross @ cross)
    return turned
