"""What the robot has seen around it lately, in its own frame: a rolling evidence grid."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from toponav.models.graphnav.metric import local_map_kernels as kernels
from toponav.models.graphnav.metric.profile import bin_azimuths_rad
from toponav.models.graphnav.presets import ImageSpec

__all__ = ["LocalMap", "LocalMapConfig"]


@dataclass(frozen=True)
class LocalMapConfig:
    """Sizes of the grid and of the two views of it."""

    cell_m: float = 0.1
    """Side of a cell of the grid."""
    cells: int = 160
    """Cells along a side: what lies more than half of that away is forgotten."""
    reach_m: float = 5.0
    """Rays are followed this far."""
    view_cells: int = 64
    """Cells along a side of a view."""
    near_cell_m: float = 0.1
    """Side of a cell of the view that steers."""
    far_cell_m: float = 0.16
    """Side of a cell of the view that is compared with the topological map."""


class LocalMap:
    """Adds profiles up along the robot's dead-reckoned way.

    Two bands of heights are kept apart: what the robot may touch, and walls.

    Args:
        image: What a profile covers.
        config: Sizes.
    """

    def __init__(self, image: ImageSpec, config: LocalMapConfig) -> None:
        self.config, self._image = config, image
        self._azimuth = bin_azimuths_rad(image).astype(np.float64)
        self._grid = np.zeros((2, config.cells, config.cells), np.float32)
        self._pose = np.zeros(3)

    def clear(self) -> None:
        """Forget everything: an episode begins."""
        self._grid[:] = 0.0
        self._pose[:] = 0.0

    def advance(self, step: Float[np.ndarray, " 3"]) -> None:
        """The robot moved by this: metres forward and left, radians turned."""
        kernels.move(self._grid, self.config.cell_m, self._pose, step)

    def insert(self, profile: UInt8[np.ndarray, "bands bins"]) -> None:
        """Take in what the robot sees here."""
        kernels.insert(
            self._grid,
            self.config.cell_m,
            self._pose,
            profile,
            self._azimuth,
            self._image.max_depth_m,
            self.config.reach_m,
        )

    def view(self, cell_m: float, cells: int | None = None) -> UInt8[np.ndarray, "forward left"]:
        """The surroundings: rows go forward, columns to the left, the robot in the middle.

        The high four bits of a byte are the lower band's, the low four the walls': 0 is free,
        7 unknown, 15 occupied.

        Args:
            cell_m: Side of a cell.
            cells: Along a side of the view; the configuration's when None.
        """
        side = cells or self.config.view_cells
        out = np.empty((side, side), np.uint8)
        kernels.view(self._grid, self.config.cell_m, self._pose, cell_m, out)
        return out
