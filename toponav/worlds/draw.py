"""Floor plans for figures: rooms tinted by kind, walls dark, furniture by height."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, UInt8
from scipy import ndimage

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import SemanticClass
from toponav.worlds.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["ROOM_COLORS", "draw_plan", "plan_image", "room_anchors_m"]

# Light and close to grey, so that paths and maps drawn on top stand out.
ROOM_COLORS: dict[RoomKind, str] = {
    RoomKind.OFFICE: "#eef1f5",
    RoomKind.CONFERENCE_ROOM: "#e3ebf6",
    RoomKind.AUDITORIUM: "#dde6f2",
    RoomKind.STUDY: "#eaeef6",
    RoomKind.HALLWAY: "#f7f3e6",
    RoomKind.LOBBY: "#f7f0dc",
    RoomKind.OPEN_SPACE: "#edf4e8",
    RoomKind.LOUNGE: "#e6f1e4",
    RoomKind.LIVING_ROOM: "#e9f2e4",
    RoomKind.WC: "#e2f1f3",
    RoomKind.BATHROOM: "#e2f1f3",
    RoomKind.STORAGE: "#ececec",
    RoomKind.COPY_ROOM: "#efeaf4",
    RoomKind.PANTRY: "#f6eae2",
    RoomKind.KITCHEN: "#f6eae2",
    RoomKind.DINING_ROOM: "#f5eee4",
    RoomKind.BEDROOM: "#f3e9ef",
}
_NOWHERE = "#ffffff"
_WALL = "#2f3437"
_DOOR = "#a6703c"
_LOW, _HIGH = "#cdbb9f", "#7b6a52"
_TALL_M = 2.0


def plan_image(scene: Scene) -> UInt8[np.ndarray, "rows cols 3"]:
    """The plan as colours, a pixel per cell, row 0 at the lowest y."""
    palette = np.array([_rgb(ROOM_COLORS[room.kind]) for room in scene.rooms] + [_rgb(_NOWHERE)])
    image = palette[scene.room_index]
    solid = scene.occupied
    share = np.clip(scene.heights_m[solid, None] / _TALL_M, 0.0, 1.0)
    image[solid] = _rgb(_LOW) + share * (_rgb(_HIGH) - _rgb(_LOW))
    for kind, color in (
        (SemanticClass.DOOR, _DOOR),
        (SemanticClass.WALL, _WALL),
        (SemanticClass.COLUMN, _WALL),
        (SemanticClass.WINDOW, _WALL),
    ):
        image[solid & (scene.semantics == kind)] = _rgb(color)
    return np.asarray(np.rint(image), dtype=np.uint8)


def draw_plan(ax: "Axes", scene: Scene, *, names: bool = True, name_size_pt: float = 5.0) -> None:
    """Draws the scene's plan in metres of the map frame, and frames the building.

    Args:
        ax: Axes to draw on; lines and markers drawn later lie on top.
        scene: The building.
        names: Whether to write the rooms' names.
        name_size_pt: Size of the names.

    Example:
        >>> import matplotlib.pyplot as plt
        >>> figure, ax = plt.subplots()
        >>> draw_plan(ax, scene)
        >>> plt.close(figure)
    """
    ax.imshow(
        plan_image(scene),
        origin="lower",
        extent=scene.grid.extent_m,
        interpolation="none",
        zorder=0,
    )
    used = np.argwhere(scene.occupied | (scene.room_index >= 0))
    if len(used):
        (row0, col0), (row1, col1) = used.min(axis=0), used.max(axis=0)
        margin = round(0.5 / scene.grid.resolution_m)
        left, low = scene.grid.center_of(int(row0) - margin, int(col0) - margin)
        right, high = scene.grid.center_of(int(row1) + margin, int(col1) + margin)
        ax.set_xlim(left, right)
        ax.set_ylim(low, high)
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    if names:
        for room, (x_m, y_m) in zip(scene.rooms, room_anchors_m(scene), strict=True):
            if np.isfinite(x_m):
                ax.text(
                    x_m,
                    y_m,
                    room.name,
                    fontsize=name_size_pt,
                    color="#5a6570",
                    ha="center",
                    va="center",
                    zorder=1,
                    clip_on=True,
                )


def room_anchors_m(scene: Scene) -> Float[np.ndarray, "rooms 2"]:
    """A point well inside each room, for its name; NaN where a room has no cell.

    It is the centre of the largest circle in the room, of several the one in the middle.
    """
    anchors = np.full((len(scene.rooms), 2), np.nan)
    for number, box in enumerate(ndimage.find_objects(scene.room_index.astype(np.int32) + 1)):
        if box is None:
            continue
        inside = np.pad(scene.room_index[box] == number, 1)
        depth = ndimage.distance_transform_edt(inside)[1:-1, 1:-1]
        best = np.argwhere(depth >= 0.9 * depth.max())
        middle = best[np.square(best - best.mean(axis=0)).sum(axis=1).argmin()]
        row, col = int(middle[0]) + box[0].start, int(middle[1]) + box[1].start
        anchors[number] = scene.grid.center_of(row, col)
    return anchors


def _rgb(color: str) -> np.ndarray:
    """A #rrggbb colour as three numbers from 0 to 255."""
    return np.array([int(color[at : at + 2], 16) for at in (1, 3, 5)], dtype=float)
