"""What the labels of panoramas are made from: where one can stand and what one can see over."""

import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Int16, Int32
from scipy import ndimage

from toponav.core.arrays import read_npz
from toponav.core.files import write_atomically
from toponav.core.imagenav import IMAGE_NAV_ROBOT_RADIUS_M
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Scene

__all__ = ["CAMERA_HEIGHT_M", "Ground"]

CAMERA_HEIGHT_M = 0.6
"""Height of the panoramic camera: what is taller hides what lies behind it."""

_REMEDY = "delete the home's folder and run the collection again"


@dataclass(frozen=True, eq=False)
class Ground:
    """The part of a building that labels need.

    Attributes:
        grid: Where the cells lie.
        free: Cells in which the robot's centre can be, of the largest connected piece.
        opaque: Cells that the camera cannot look over.
        room_index: Number of the room of each cell, -1 in none.
    """

    grid: GridFrame
    free: Bool[np.ndarray, "rows cols"]
    opaque: Bool[np.ndarray, "rows cols"]
    room_index: Int16[np.ndarray, "rows cols"]

    @staticmethod
    def of(
        scene: Scene,
        radius_m: float = IMAGE_NAV_ROBOT_RADIUS_M,
        camera_height_m: float = CAMERA_HEIGHT_M,
    ) -> "Ground":
        """The ground of a building for a robot of this radius with a camera of this height."""
        space = FreeSpace.of(scene, radius_m)
        return Ground(
            scene.grid,
            space.component == 1,
            scene.heights_m > camera_height_m,
            scene.room_index.astype(np.int16),
        )

    @cached_property
    def cells(self) -> Int32[np.ndarray, "cells 2"]:
        """Rows and columns of the free cells."""
        return np.argwhere(self.free).astype(np.int32)

    @cached_property
    def _nearest(self) -> Int32[np.ndarray, "2 rows cols"]:
        """Row and column of the free cell nearest to each cell."""
        nearest = ndimage.distance_transform_edt(
            ~self.free, return_distances=False, return_indices=True
        )
        return np.asarray(nearest, np.int32)

    def nearest_free(self, cells: Int32[np.ndarray, "cells 2"]) -> Int32[np.ndarray, "cells 2"]:
        """The free cells nearest to cells of the grid."""
        nearest: np.ndarray = self._nearest[:, cells[:, 0], cells[:, 1]].T
        return nearest

    def cells_of(self, xy_m: np.ndarray) -> Int32[np.ndarray, "points 2"]:
        """Row and column of the cells that hold points, the nearest on the grid's edge outside."""
        col_row = np.floor((xy_m - np.asarray(self.grid.origin_m)) / self.grid.resolution_m)
        most = np.array([self.grid.cols - 1, self.grid.rows - 1])
        cells: np.ndarray = np.clip(col_row, 0, most)[:, ::-1].astype(np.int32)
        return cells

    def centers_of(self, cells: Int32[np.ndarray, "cells 2"]) -> Float32[np.ndarray, "cells 2"]:
        """Centres of cells, x and y in metres."""
        centers = (cells[:, ::-1] + 0.5) * self.grid.resolution_m + np.asarray(self.grid.origin_m)
        return np.asarray(centers, np.float32)

    def save(self, path: Path) -> None:
        """Writes it as a NumPy archive."""
        content = io.BytesIO()
        np.savez_compressed(
            content,
            free=self.free,
            opaque=self.opaque,
            room_index=self.room_index,
            frame=np.array([self.grid.resolution_m, *self.grid.origin_m]),
        )
        write_atomically(path, content.getvalue())

    @staticmethod
    def load(path: Path) -> "Ground":
        """What `save` wrote.

        Raises:
            InputError: When it is missing or damaged.
        """
        found = read_npz(
            path,
            {
                "free": ("bool", (None, None)),
                "opaque": ("bool", (None, None)),
                "room_index": ("int16", (None, None)),
                "frame": ("float64", (3,)),
            },
            remedy=_REMEDY,
            max_items=1 << 26,
        )
        resolution_m, x_m, y_m = found["frame"].tolist()
        rows, cols = found["free"].shape
        grid = GridFrame(resolution_m, (x_m, y_m), rows, cols)
        return Ground(grid, found["free"], found["opaque"], found["room_index"])
