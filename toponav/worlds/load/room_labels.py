"""Rooms that a file names: by polygons, or by the room of each object."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int16, Int32
from skimage.draw import polygon as polygon_cells

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame
from toponav.worlds.load.levels import columns_over

__all__ = ["FaceRooms", "PolygonRooms", "kind_of_words"]

_WORDS: tuple[tuple[str, RoomKind], ...] = (
    ("conference", RoomKind.CONFERENCE_ROOM),
    ("meeting", RoomKind.CONFERENCE_ROOM),
    ("auditorium", RoomKind.AUDITORIUM),
    ("copy", RoomKind.COPY_ROOM),
    ("hall", RoomKind.HALLWAY),
    ("corridor", RoomKind.HALLWAY),
    ("lobby", RoomKind.HALLWAY),
    ("entrance", RoomKind.HALLWAY),
    ("entry", RoomKind.HALLWAY),
    ("kitchen", RoomKind.KITCHEN),
    ("dining", RoomKind.DINING_ROOM),
    ("living", RoomKind.LIVING_ROOM),
    ("lounge", RoomKind.LOUNGE),
    ("bath", RoomKind.BATHROOM),
    ("shower", RoomKind.BATHROOM),
    ("bed", RoomKind.BEDROOM),
    ("kid", RoomKind.BEDROOM),
    ("child", RoomKind.BEDROOM),
    ("study", RoomKind.STUDY),
    ("open", RoomKind.OPEN_SPACE),
    ("office", RoomKind.OFFICE),
    ("pantry", RoomKind.PANTRY),
    ("storage", RoomKind.STORAGE),
    ("closet", RoomKind.STORAGE),
    ("garage", RoomKind.STORAGE),
    ("cellar", RoomKind.STORAGE),
    ("toilet", RoomKind.WC),
    ("wc", RoomKind.WC),
)


def kind_of_words(name: str) -> RoomKind | None:
    """What a room is used for by its name, or None.

    Example:
        >>> kind_of_words("Kids' bedroom 2"), kind_of_words("conferenceRoom_1")
        (<RoomKind.BEDROOM: 'bedroom'>, <RoomKind.CONFERENCE_ROOM: 'conference_room'>)
    """
    words = name.lower()
    return next((kind for word, kind in _WORDS if word in words), None)


@dataclass(frozen=True, eq=False)
class PolygonRooms:
    """Rooms drawn as polygons; where two overlap, the smaller counts.

    Attributes:
        rooms: Name and kind of each.
        polygons_m: Corners of each, in the scene's frame.
    """

    rooms: Sequence[tuple[str, RoomKind]]
    polygons_m: Sequence[Float[np.ndarray, "corners 2"]]

    def cells(
        self,
        grid: GridFrame,
        vertices_m: Float32[np.ndarray, "vertices 3"],
        faces: Int32[np.ndarray, "faces 3"],
    ) -> Int16[np.ndarray, "rows cols"]:
        """The room of each cell; -1 nowhere."""
        labels = np.full(grid.shape, -1, np.int16)
        shapes = []
        for number, corners in enumerate(self.polygons_m):
            at = (np.asarray(corners) - grid.origin_m) / grid.resolution_m - 0.5
            rows, cols = polygon_cells(  # type: ignore[no-untyped-call]
                at[:, 1], at[:, 0], grid.shape
            )
            shapes.append((len(rows), number, rows, cols))
        for _, number, rows, cols in sorted(shapes, key=lambda shape: (-shape[0], shape[1])):
            labels[rows, cols] = number
        return labels


@dataclass(frozen=True, eq=False)
class FaceRooms:
    """Rooms known by the triangles of their floors.

    Attributes:
        rooms: Name and kind of each.
        face_room: Room of each triangle; -1 for what is no floor or in no room.
    """

    rooms: Sequence[tuple[str, RoomKind]]
    face_room: Int32[np.ndarray, " faces"]

    def cells(
        self,
        grid: GridFrame,
        vertices_m: Float32[np.ndarray, "vertices 3"],
        faces: Int32[np.ndarray, "faces 3"],
    ) -> Int16[np.ndarray, "rows cols"]:
        """The room of each cell; -1 nowhere."""
        chosen = np.flatnonzero(self.face_room >= 0)
        # Raised into a robot's way, the floor is what `columns_over` finds there.
        raised = vertices_m.copy()
        raised[:, 2] = 0.25
        x, y = grid.origin_m
        far = (x + grid.cols * grid.resolution_m, y + grid.rows * grid.resolution_m)
        low, high = np.array([x, y]) + 1e-6, np.array(far) - 1e-6
        found = columns_over(raised, faces[chosen], 0.0, low, high, grid.resolution_m)
        owner = np.full(grid.shape, -1, np.int32)
        rows, cols = min(grid.rows, found.grid.rows), min(grid.cols, found.grid.cols)
        owner[:rows, :cols] = found.owner[:rows, :cols]
        of = np.append(self.face_room[chosen], -1)
        return of[owner].astype(np.int16)
