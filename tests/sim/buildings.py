"""Small buildings whose every surface can be checked by hand."""

import numpy as np

from toponav.worlds.scene import GridFrame, Scene, SemanticClass, scene_from_heights

CELL_M = 0.1
CEILING_M = 2.5


def room(rows: int = 40, cols: int = 60, **obstacles_m: tuple[slice, slice, float]) -> Scene:
    """A walled room, lower-left inner corner at (0.1, 0.1), with the given obstacles."""
    heights_m = np.zeros((rows, cols))
    heights_m[[0, -1]] = CEILING_M
    heights_m[:, [0, -1]] = CEILING_M
    for where_rows, where_cols, height_m in obstacles_m.values():
        heights_m[where_rows, where_cols] = height_m
    semantics = np.where(heights_m > 0, SemanticClass.FURNITURE, SemanticClass.FLOOR)
    semantics[heights_m == CEILING_M] = SemanticClass.WALL
    return scene_from_heights(
        "room",
        GridFrame(CELL_M, (0.0, 0.0), rows, cols),
        heights_m,
        ceiling_m=CEILING_M,
        semantics=semantics,
    )


def furnished_room() -> Scene:
    """A room with a pillar, a cupboard as high as the camera, a bench and a step."""
    return room(
        pillar=(slice(20, 23), slice(30, 34), CEILING_M),
        shelf=(slice(5, 8), slice(20, 40), 1.8),
        cupboard=(slice(28, 32), slice(12, 16), 0.6),
        bench=(slice(10, 14), slice(45, 52), 0.4),
        step=(slice(30, 36), slice(40, 55), 0.15),
    )
