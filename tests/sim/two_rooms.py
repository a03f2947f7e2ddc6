"""Two rooms of 5 x 6 m with a doorway of 1 m between them, drawn by hand."""

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Room, Scene, scene_from_heights

CELL_M = 0.1


def two_rooms() -> Scene:
    """x 0..5 and 5..10, y 0..6; the doorway is at x 5, y 2.5..3.5; the wall has 0.2 m."""
    heights_m = np.zeros((60, 100))
    heights_m[[0, -1], :] = 2.7
    heights_m[:, [0, -1]] = 2.7
    heights_m[:, 49:51] = 2.7
    heights_m[25:35, 49:51] = 0.0
    room_index = np.full(heights_m.shape, -1)
    room_index[1:-1, 1:49] = 0
    room_index[1:-1, 51:-1] = 1
    return scene_from_heights(
        "two-rooms",
        GridFrame(CELL_M, (0.0, 0.0), 60, 100),
        heights_m,
        room_index=room_index,
        rooms=[Room("living", RoomKind.LIVING_ROOM), Room("bed", RoomKind.BEDROOM)],
    )
