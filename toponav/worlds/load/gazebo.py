"""Gazebo worlds (SDF): models, includes, poses and shapes become one building."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError, shown
from toponav.core.files import read_bytes
from toponav.core.xml_tree import parse_xml
from toponav.worlds.furniture_names import semantic_of_name
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load._sdf_frames import Frame, frames_of, pose_of
from toponav.worlds.load._sdf_models import ModelFolders
from toponav.worlds.load._sdf_shapes import Plane, SdfShapes
from toponav.worlds.load.mesh_parts import MAX_FACES, MeshPart, Notes, clean_part, move_part

__all__ = ["read_gazebo"]

_MAX_BYTES = 64_000_000
_MAX_DEPTH = 24
_MAX_MODELS = 50_000
_GROUND_MARGIN_M = 1.0


def read_gazebo(path: Path, models: Sequence[Path], notes: Notes) -> list[MeshPart]:
    """The parts of a Gazebo world or model, in metres, z up.

    Args:
        path: The `.world` or `.sdf` file.
        models: Folders in which `model://` is looked up, before those beside the world.
        notes: Where repairs are written down.

    Raises:
        InputError: It is no SDF, an include cannot be found or includes itself, or there is
            nothing in it.

    Reference:
        SDFormat specification 1.6 to 1.11, http://sdformat.org.
    """
    root = parse_xml(read_bytes(path, max_bytes=_MAX_BYTES), str(path))
    if root.tag != "sdf":
        raise InputError(
            f"must be an SDF document, got <{root.tag[:60]}>",
            where=str(path),
            remedy="give a Gazebo .world or .sdf file",
        )
    folders = ModelFolders.beside(path, models)
    reader = _Reader(folders, notes)
    world = root.find("world")
    holder = root if world is None else world
    state = _states(world)
    file = path.resolve()
    for element in holder:
        if element.tag in ("model", "include"):
            reader.add(element, np.eye(4), (file,), (), state)
    parts = [*reader.parts]
    parts += _ground(reader.planes, parts, notes)
    if not parts:
        raise InputError(
            "holds no shapes", where=str(path), remedy="check the models that it includes"
        )
    return parts


class _Reader:
    """Collects the shapes of models and of what they include."""

    def __init__(self, folders: ModelFolders, notes: Notes) -> None:
        self._folders, self._notes = folders, notes
        self._shapes = SdfShapes(folders, notes)
        self._models = self._faces = 0
        self.parts: list[MeshPart] = []
        self.planes: list[Plane] = []

    def add(
        self,
        element: Element,
        frame: Frame,
        files: tuple[Path, ...],
        names: tuple[str, ...],
        state: dict[str, Frame] | None = None,
    ) -> None:
        """The shapes of a model or an include, in the frame that holds it."""
        self._models += 1
        where = str(files[-1])
        if self._models > _MAX_MODELS or len(names) > _MAX_DEPTH:
            raise InputError(
                f"at most {_MAX_MODELS:,} models, {_MAX_DEPTH} inside one another, are read",
                where=where,
                remedy="check that no model includes itself",
            )
        name = element.findtext("name") or element.get("name") or ""
        if element.tag == "include":
            self._include(element, frame, files, (*names, name.strip()), state)
            return
        own = pose_of(element.find("pose"), where)
        if not names and state and name in state:
            own = state[name]
        self._model(element, frame @ own, files, (*names, name.strip()))

    def _include(
        self,
        element: Element,
        frame: Frame,
        files: tuple[Path, ...],
        names: tuple[str, ...],
        state: dict[str, Frame] | None,
    ) -> None:
        where = str(files[-1])
        uri = (element.findtext("uri") or "").strip()
        file = self._folders.model_file(uri, files[-1], self._notes)
        if file is None:
            return
        if file in files:
            chain = " > ".join(one.parent.name for one in (*files[files.index(file) :], file))
            raise InputError(
                f"a model includes itself: {chain[:200]}",
                where=where,
                remedy="remove one of these includes",
            )
        root = parse_xml(read_bytes(file, max_bytes=_MAX_BYTES), str(file))
        model = root.find("model")
        if model is None:
            self._notes.add(f"{shown(uri, 60)} holds no model: left out")
            return
        placed = element.find("pose")
        own = pose_of(model.find("pose") if placed is None else placed, where)
        if len(names) == 1 and state and names[0] in state:
            own = state[names[0]]
        called = names if names[-1] else (*names[:-1], model.get("name") or "")
        self._model(model, frame @ own, (*files, file), (*called, uri.rpartition("/")[2]))

    def _model(
        self, model: Element, frame: Frame, files: tuple[Path, ...], names: tuple[str, ...]
    ) -> None:
        frames = frames_of(model, str(files[-1]), self._notes)
        for link in model.iterfind("link"):
            at = frame @ frames[link.get("name") or ""]
            visuals = list(link.iterfind("visual")) or list(link.iterfind("collision"))
            for visual in visuals:
                self._visual(visual, at, files, (*names, link.get("name") or ""))
        for child in model:
            if child.tag in ("model", "include"):
                self.add(child, frame, files, names)

    def _visual(
        self, visual: Element, frame: Frame, files: tuple[Path, ...], names: tuple[str, ...]
    ) -> None:
        at = frame @ pose_of(visual.find("pose"), str(files[-1]))
        words = (*names, visual.get("name") or "")
        # The outermost name that says something counts: `sofa_1` before `link`.
        found = (semantic_of_name(word) for word in words)
        semantic = next((kind for kind in found if kind is not None), None)
        group = None if semantic in (None, SemanticClass.WALL) else "/".join(names[:1])
        for shape in self._shapes.of(visual, files[-1]):
            if isinstance(shape, Plane):
                self.planes.append(replace(shape, frame=at @ shape.frame))
                continue
            self._faces += len(shape.faces)
            if self._faces > MAX_FACES:
                raise InputError(
                    f"at most {MAX_FACES:,} triangles are read",
                    where=str(files[0]),
                    remedy="simplify the models",
                )
            name = next((word for word in words if word), shape.name)
            placed = replace(shape, name=name, semantic=semantic, group=group)
            self.parts.append(move_part(placed, at))


def _states(world: Element | None) -> dict[str, Frame]:
    """Where a saved world says that its models stood."""
    found = {}
    if world is not None:
        for model in world.iterfind("state/model"):
            pose = model.find("pose")
            if pose is not None and model.get("name"):
                found[model.get("name") or ""] = pose_of(pose, "state")
    return found


def _ground(planes: Sequence[Plane], parts: Sequence[MeshPart], notes: Notes) -> list[MeshPart]:
    """Level planes as floor, as far as the rest of the world reaches and a metre more."""
    level = [plane for plane in planes if abs(plane.frame[2, 2]) > 0.9]
    if len(level) < len(planes):
        notes.add("planes that are not level left out", len(planes) - len(level))
    solid = [part for part in (clean_part(one, notes) for one in parts) if len(part.faces)]
    if not level or not solid:
        return []
    low, high = _bounds(solid)
    floors = [part for part in solid if part.semantic == SemanticClass.FLOOR]
    if floors:
        floor_low, floor_high = _bounds(floors)
        covered = np.prod((floor_high - floor_low)[:2]) / max(np.prod((high - low)[:2]), 1e-9)
        if covered > 0.5:
            notes.add("ground plane left out: the building has a floor")
            return []
    grounds = []
    for plane in level:
        x0, y0 = low[:2] - _GROUND_MARGIN_M
        x1, y1 = high[:2] + _GROUND_MARGIN_M
        z = plane.frame[2, 3]
        half = np.array(plane.size_m) / 2
        x0, x1 = np.clip([x0, x1], plane.frame[0, 3] - half[0], plane.frame[0, 3] + half[0])
        y0, y1 = np.clip([y0, y1], plane.frame[1, 3] - half[1], plane.frame[1, 3] + half[1])
        corners = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], np.float32)
        faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
        grounds.append(
            MeshPart(
                "ground_plane",
                corners,
                faces,
                materials=(plane.material,),
                semantic=SemanticClass.FLOOR,
            )
        )
    return grounds


def _bounds(
    parts: Sequence[MeshPart],
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    corners = [part.vertices[np.unique(part.faces)] for part in parts]
    low = np.min([one.min(axis=0) for one in corners], axis=0)
    high = np.max([one.max(axis=0) for one in corners], axis=0)
    return low.astype(np.float64), high.astype(np.float64)
