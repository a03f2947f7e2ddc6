"""What stands on the floor: things with a height, a class and room to drive around them."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float32, Int32, UInt8
from scipy import ndimage

from toponav.worlds.grid import SemanticClass

__all__ = ["Canvas", "Mask", "ragged", "scanned"]

Mask = Bool[np.ndarray, "piece_rows piece_cols"]


@dataclass
class Canvas:
    """Heights under construction; every thing put down has a number, so it can be taken away.

    Attributes:
        heights_m: Height of the obstacle per cell.
        semantics: Class of the obstacle per cell.
        things: Number of the thing per cell; 0 none or wall.
        keep_free: Cells that nothing may stand on.
    """

    heights_m: Float32[np.ndarray, "rows cols"]
    semantics: UInt8[np.ndarray, "rows cols"]
    things: Int32[np.ndarray, "rows cols"]
    keep_free: Bool[np.ndarray, "rows cols"]
    count: int = field(default=0)

    @classmethod
    def over(
        cls,
        wall: Bool[np.ndarray, "rows cols"],
        ceiling_m: float,
        keep_free: Bool[np.ndarray, "rows cols"],
    ) -> "Canvas":
        """A canvas with walls to the ceiling and nothing else."""
        heights = np.where(wall, np.float32(ceiling_m), np.float32(0.0)).astype(np.float32)
        semantics = np.where(wall, SemanticClass.WALL, SemanticClass.FLOOR).astype(np.uint8)
        shape = wall.shape
        return cls(heights, semantics, np.zeros(shape, dtype=np.int32), keep_free)

    def put(
        self,
        mask: Mask,
        row: int,
        col: int,
        height_m: float,
        semantic: SemanticClass,
        within: Bool[np.ndarray, "rows cols"],
    ) -> bool:
        """Whether the thing fitted: inside `within`, on free floor, off what stays free."""
        rows, cols = mask.shape
        if row < 0 or col < 0 or row + rows > within.shape[0] or col + cols > within.shape[1]:
            return False
        window = slice(row, row + rows), slice(col, col + cols)
        allowed = within[window] & ~self.keep_free[window] & (self.heights_m[window] == 0)
        if not mask.any() or not allowed[mask].all():
            return False
        self.count += 1
        self.heights_m[window][mask] = height_m
        self.semantics[window][mask] = semantic
        self.things[window][mask] = self.count
        return True

    def remove(self, numbers: list[int]) -> None:
        """Takes things away again."""
        gone = np.isin(self.things, numbers)
        self.heights_m[gone] = 0.0
        self.semantics[gone] = SemanticClass.FLOOR
        self.things[gone] = 0


def scanned(rng: np.random.Generator, shape: Mask, dropout: float) -> Mask:
    """The outline of a thing with pieces missing, as a scan from a few places sees it."""
    solid = np.pad(shape, 1)
    outline = (solid & ~ndimage.binary_erosion(solid))[1:-1, 1:-1]
    return ragged(rng, outline, dropout)


def ragged(rng: np.random.Generator, mask: Mask, dropout: float) -> Mask:
    """The mask without some round pieces; `dropout` is about the share that goes."""
    kept = mask.copy()
    cells = np.argwhere(mask)
    if len(cells) == 0:
        return kept
    rows, cols = np.indices(mask.shape)
    target = len(cells) * (1.0 - dropout)
    for _ in range(12):
        if kept.sum() <= target:
            break
        row, col = cells[int(rng.integers(len(cells)))]
        radius = rng.uniform(1.0, 5.0)
        kept &= (rows - row) ** 2 + (cols - col) ** 2 > radius**2
    return kept if kept.any() else mask
