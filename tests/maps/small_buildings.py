"""Buildings drawn with letters: a cell is 10 cm, a letter is a room, # is wall."""

import numpy as np

from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Room, Scene, scene_from_heights

_KINDS = {"H": RoomKind.HALLWAY, "L": RoomKind.LOUNGE}
Rectangle = tuple[str, float, float, float, float]
CELL_M = 0.1


def building(size_m: tuple[float, float], *rectangles: Rectangle) -> Scene:
    """Solid wall with rectangles cut out: letter, x0, y0, x1, y1 in metres; ' ' is a doorway.

    H is a hallway, L a lounge, every other letter an office of that name.
    """
    cols, rows = (round(length / CELL_M) for length in size_m)
    heights = np.full((rows, cols), 2.7, np.float32)
    index = np.full((rows, cols), -1, np.int16)
    letters = sorted({rectangle[0] for rectangle in rectangles} - {" "})
    for letter, *corners in rectangles:
        x0, y0, x1, y1 = (round(value / CELL_M) for value in corners)
        heights[y0:y1, x0:x1] = 0.0
        index[y0:y1, x0:x1] = letters.index(letter) if letter != " " else -1
    rooms = [Room(letter, _KINDS.get(letter, RoomKind.OFFICE)) for letter in letters]
    grid = GridFrame(CELL_M, (0.0, 0.0), rows, cols)
    return scene_from_heights("small", grid, heights, room_index=index, rooms=rooms)


def corridor(*doors: tuple[str, float, str]) -> Scene:
    """A hallway 20 m long along x with offices: letter, x of the door, side n or s."""
    shapes: list[Rectangle] = [("H", 1.0, 5.0, 21.0, 6.6)]
    for letter, x_m, side in doors:
        if side == "n":
            shapes.append((letter, x_m - 0.9, 6.9, x_m + 0.9, 10.0))
            shapes.append((" ", x_m - 0.4, 6.6, x_m + 0.4, 6.9))
        else:
            shapes.append((letter, x_m - 0.9, 1.0, x_m + 0.9, 4.7))
            shapes.append((" ", x_m - 0.4, 4.7, x_m + 0.4, 5.0))
    return building((22.0, 11.0), *shapes)
