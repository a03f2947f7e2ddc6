"""Homes drawn in Sweet Home 3D (`.sh3d`): walls, rooms, doors, windows and furniture."""

from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import shapely
from jaxtyping import Float

from toponav.core.errors import InputError, shown
from toponav.core.vocabulary import RoomKind
from toponav.core.xml_tree import parse_xml
from toponav.worlds.furniture_names import CLASS_OF, furniture_class
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load._sweet_home_walls import Hole, Wall, building_parts, numbers_of
from toponav.worlds.load.mesh_parts import MeshPart, Notes, move_part
from toponav.worlds.load.room_labels import PolygonRooms, kind_of_words
from toponav.worlds.load.source_files import ZipFiles
from toponav.worlds.load.sweet_home_model import read_model
from toponav.worlds.materials import Attribution, Material, linear_rgb
from toponav.worlds.scene import Door

__all__ = ["SweetHome", "read_sweet_home"]

_MAX_XML_BYTES = 64_000_000
_MAX_PIECES, _MAX_WALLS, _MAX_POINTS = 20_000, 20_000, 200_000
_MAX_MODEL_FACES = 4000
_PIECES = ("pieceOfFurniture", "doorOrWindow", "light", "shelfUnit")


@dataclass(frozen=True, eq=False)
class SweetHome:
    """One level of a home, in metres, z up.

    Attributes:
        parts: Walls, floors, ceilings and furniture.
        rooms: Rooms as they were drawn, or None where none was.
        doors: Doors that were drawn, by the names of the rooms beside them.
        attribution: Whose furniture is in it.
    """

    parts: list[MeshPart]
    rooms: PolygonRooms | None
    doors: tuple[Door, ...]
    attribution: tuple[Attribution, ...]


def read_sweet_home(path: Path, notes: Notes, *, floor_height_m: float | None = None) -> SweetHome:
    """The largest level of a home, or the one nearest to a height.

    Files of old versions, which hold a serialised Java object alone, are refused: reading one
    could run anything.

    Raises:
        InputError: It is no such file, or its drawing is broken.
    """
    files = ZipFiles(path)
    if "Home.xml" not in files:
        old = "Home" in files
        raise InputError(
            "holds a serialised Java object alone, which is never read"
            if old
            else "must be a home of Sweet Home 3D: a zip archive with Home.xml",
            where=str(path),
            remedy="open it in a recent Sweet Home 3D and save it again" if old else "check it",
        )
    where = f"{path}:Home.xml"
    root = parse_xml(files.read("Home.xml", max_bytes=_MAX_XML_BYTES), where)
    if root.tag != "home":
        raise InputError(
            f"must be a <home>, got <{root.tag[:60]}>", where=where, remedy="save it again"
        )
    return _Reader(root, files, where, notes).level(floor_height_m)


class _Reader:
    """Reads one home."""

    def __init__(self, root: Element, files: ZipFiles, where: str, notes: Notes) -> None:
        self._root, self._files, self._where, self._notes = root, files, where, notes
        self._credits: dict[Attribution, None] = {}

    def level(self, floor_height_m: float | None) -> SweetHome:
        """The home's largest level, or the one nearest to a height."""
        chosen = self._choose(floor_height_m)
        level = next(
            (one for one in self._root.iterfind("level") if one.get("id") == chosen), None
        )
        height_m = self._m(self._root, "wallHeight", 2.5)
        if level is not None:
            height_m = self._m(level, "height", height_m)
        height_m = float(np.clip(height_m, 1.0, 20.0))

        def here(element: Element) -> bool:
            return chosen is None or element.get("level") in (chosen, None)

        walls = [self._wall(one, height_m) for one in self._root.iterfind("wall") if here(one)]
        drawn = [one for one in self._root.iterfind("room") if here(one)]
        rooms = self._rooms(drawn)
        pieces = [
            piece
            for piece in self._root.iter()
            if piece.tag in _PIECES and here(piece) and piece.get("visible") != "false"
        ]
        if len(walls) > _MAX_WALLS or len(pieces) > _MAX_PIECES:
            raise self._broken(f"at most {_MAX_WALLS:,} walls and {_MAX_PIECES:,} pieces are read")
        holes, doors, parts = self._openings(pieces, rooms)
        openings = {id(piece) for piece in pieces if piece.tag == "doorOrWindow"}
        for number, piece in enumerate(pieces):
            if id(piece) not in openings:
                parts += self._piece(piece, number)
        polygons = [] if rooms is None else [*rooms.polygons_m]
        parts += building_parts(walls, holes, polygons, height_m, self._notes, self._where)
        return SweetHome(parts, rooms, doors, tuple(self._credits))

    def _choose(self, floor_height_m: float | None) -> str | None:
        """The id of the level to take; None where the home has a single one."""
        levels = {
            one.get("id") or "": self._m(one, "elevation", 0.0)
            for one in self._root.iterfind("level")
            if one.get("viewable") != "false"
        }
        if not levels:
            return None
        if floor_height_m is not None:
            return min(levels, key=lambda name: abs(levels[name] - floor_height_m))
        size = dict.fromkeys(levels, 0.0)
        for wall in self._root.iterfind("wall"):
            if wall.get("level") in size:
                ends = [self._m(wall, key, 0.0) for key in ("xStart", "yStart", "xEnd", "yEnd")]
                size[wall.get("level") or ""] += float(
                    np.hypot(ends[2] - ends[0], ends[3] - ends[1])
                )
        best = max(size, key=lambda name: size[name])
        if len(levels) > 1:
            self._notes.add(f"level at {levels[best]:.2f} m taken of {len(levels)}")
        return best

    def _wall(self, element: Element, height_m: float) -> Wall:
        start, end = (
            np.array([self._m(element, f"x{end}"), -self._m(element, f"y{end}")])
            for end in ("Start", "End")
        )
        thickness_m = float(np.clip(self._m(element, "thickness", 0.1), 0.005, 5.0))
        colour = element.get("leftSideColor") or element.get("rightSideColor")
        return Wall(
            start,
            end,
            thickness_m,
            float(np.clip(self._m(element, "height", height_m), 0.01, 20.0)),
            -float(np.clip(self._number(element, "arcExtent", 0.0), -6.2, 6.2)),
            element.get("wallAtStart") is not None,
            element.get("wallAtEnd") is not None,
            _color(colour, "#e8e4dc"),
        )

    def _rooms(self, drawn: list[Element]) -> PolygonRooms | None:
        names: list[tuple[str, RoomKind]] = []
        polygons = []
        for number, room in enumerate(drawn, start=1):
            points = [
                (self._m(point, "x"), -self._m(point, "y")) for point in room.iterfind("point")
            ]
            if len(points) < 3 or len(points) > _MAX_POINTS:
                self._notes.add("rooms of fewer than three corners left out")
                continue
            name = " ".join((room.get("name") or f"room {number}").split())[:100]
            names.append((name, kind_of_words(name) or RoomKind.OFFICE))
            polygons.append(np.array(points))
        return PolygonRooms(names, polygons) if names else None

    def _openings(
        self, pieces: list[Element], rooms: PolygonRooms | None
    ) -> tuple[list[Hole], tuple[Door, ...], list[MeshPart]]:
        """Holes in walls, doors between rooms, and what stands in those that stay closed."""
        holes: list[Hole] = []
        doors: list[Door] = []
        parts: list[MeshPart] = []
        for number, piece in enumerate(pieces):
            if piece.tag != "doorOrWindow":
                continue
            middle, size, low_m, angle = self._place(piece)
            along = np.array([np.cos(angle), np.sin(angle)])
            across = np.array([-along[1], along[0]])
            holes.append(Hole(middle, along, size[0], size[1], low_m, low_m + size[2]))
            is_door = low_m < 0.25 and size[2] > 1.5
            sides = [
                _room_at(rooms, middle + sign * (size[1] / 2 + 0.3) * across) for sign in (1, -1)
            ]
            if is_door and rooms is not None and sides[0] != sides[1] and None not in sides:
                jambs = np.stack([middle - along * size[0] / 2, middle + along * size[0] / 2])
                names = (rooms.rooms[sides[0] or 0][0], rooms.rooms[sides[1] or 0][0])
                doors.append(Door(f"door_{len(doors) + 1}", jambs, float(size[0]), names))
                continue
            if is_door and rooms is None:
                continue
            kind = SemanticClass.DOOR if is_door else SemanticClass.WINDOW
            parts += self._piece(piece, number, kind)
        if doors:
            self._notes.add("doors between rooms stand open: their leaves left out", len(doors))
        return holes, tuple(doors), parts

    def _place(
        self, piece: Element
    ) -> tuple[Float[np.ndarray, " 2"], tuple[float, float, float], float, float]:
        """Middle, size (wide, deep, high), lower edge and angle of a piece."""
        middle = np.array([self._m(piece, "x"), -self._m(piece, "y")])
        size = tuple(self._m(piece, key) for key in ("width", "depth", "height"))
        if not all(1e-4 <= side <= 50 for side in size):
            raise self._broken(
                f"a piece is up to 50 m large, got {shown(piece.get('name'), 40)} of "
                f"{[round(side, 3) for side in size]} m"
            )
        low_m = self._m(piece, "elevation", 0.0)
        return middle, (size[0], size[1], size[2]), low_m, -self._number(piece, "angle", 0.0)

    def _piece(
        self, piece: Element, number: int, kind: SemanticClass | None = None
    ) -> list[MeshPart]:
        """The triangles of a piece of furniture; a box where its model cannot be read."""
        middle, size, low_m, angle = self._place(piece)
        name = piece.get("name") or piece.get("catalogId") or "furniture"
        category = furniture_class(name) or furniture_class(piece.get("catalogId") or "")
        semantic = kind or (CLASS_OF[category] if category else SemanticClass.FURNITURE)
        part = self._model(piece, size, semantic) or _box(size)
        frame = np.eye(4)
        frame[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        if piece.get("modelMirrored") == "true":
            frame = frame @ np.diag([-1.0, 1.0, 1.0, 1.0])
        frame[:3, 3] = [*middle, low_m]
        if piece.get("color"):
            painted = _color(piece.get("color"), "#b0a090")
            part = replace(part, materials=(painted,) * len(part.materials))
        if piece.get("creator"):
            work, creator, licence = (
                "".join(c if c.isprintable() else " " for c in piece.get(key) or "unknown")[:300]
                for key in ("name", "creator", "license")
            )
            self._credits[Attribution(work, creator, licence, self._files.path.name)] = None
        return [move_part(replace(part, name=name, semantic=semantic, group=f"{number}"), frame)]

    def _model(
        self, piece: Element, size: tuple[float, float, float], semantic: SemanticClass
    ) -> MeshPart | None:
        model = piece.get("model")
        if not model:
            return None
        turn = numbers_of(piece.get("modelRotation") or "")
        matrix = turn.reshape(3, 3) if len(turn) == 9 else np.eye(3)
        try:
            if not model.lower().endswith(".obj"):
                raise InputError("only OBJ models are read", where=model, remedy="")
            if abs(np.linalg.det(matrix)) < 1e-3:
                matrix = np.eye(3)
            mesh = read_model(
                self._files, model, size, matrix, semantic, _MAX_MODEL_FACES, 256, self._notes
            )
        except InputError as error:
            self._notes.add(f"model {shown(model, 60)} replaced by a box: {error.rule[:100]}")
            return None
        return MeshPart(
            model, mesh.vertices_m, mesh.faces, mesh.face_material, mesh.corner_uv, mesh.materials
        )

    def _number(self, element: Element, key: str, default: float | None = None) -> float:
        text = element.get(key)
        if text is None and default is not None:
            return default
        values = numbers_of(text or "")
        if len(values) != 1 or not abs(values[0]) < 1e7:
            raise self._broken(f"{element.tag} {key} must be a number, got {shown(text, 40)}")
        return float(values[0])

    def _m(self, element: Element, key: str, default_m: float | None = None) -> float:
        """A length, given in centimetres."""
        if element.get(key) is None and default_m is not None:
            return default_m
        return self._number(element, key) / 100

    def _broken(self, rule: str) -> InputError:
        return InputError(rule, where=self._where, remedy="repair the home and save it again")


def _room_at(rooms: PolygonRooms | None, point: Float[np.ndarray, " 2"]) -> int | None:
    """The number of the room at a point, the smallest where several overlap."""
    if rooms is None:
        return None
    found = []
    for number, corners in enumerate(rooms.polygons_m):
        shape = shapely.Polygon(corners)
        if not shape.is_valid:
            shape = shapely.make_valid(shape)
        if shape.contains(shapely.Point(point)):
            found.append((shape.area, number))
    return min(found)[1] if found else None


def _box(size: tuple[float, float, float]) -> MeshPart:
    import trimesh

    box = trimesh.creation.box(size)
    vertices = np.asarray(box.vertices, np.float32) + np.array([0, 0, size[2] / 2], np.float32)
    return MeshPart("box", vertices.astype(np.float32), np.asarray(box.faces, np.int32))


def _color(text: str | None, default: str) -> Material:
    """A colour written as AARRGGBB."""
    plain = (text or "").strip()[-6:]
    good = len(plain) == 6 and all(c in "0123456789abcdefABCDEF" for c in plain)
    return Material("paint", linear_rgb(f"#{plain}" if good else default))
