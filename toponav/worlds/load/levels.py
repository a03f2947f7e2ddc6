"""Where the floor of a mesh is, and what stands on it: from triangles to cells."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int32, UInt64
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.worlds.grid import GridFrame
from toponav.worlds.load.level_kernels import fill_columns

__all__ = ["LAYER_M", "Columns", "columns_over", "find_floor_m", "flat_faces"]

LAYER_M, BOTTOM_M = 0.05, -0.15
"""A column is cut into 64 layers, from a little below the floor to about three metres."""

_STEP_M = 0.06
"""What is lower can be driven over: thresholds, rugs, the noise of a scan."""
_ROBOT_M, _HEAD_M, _FLOOR_M = 0.45, 1.8, 0.11
_PEAK_M, _WINDOW, _SLAB_BINS = 0.01, 5, 21
_COARSE_CELLS = 400_000
_LEVELS = 12


@dataclass(frozen=True, eq=False)
class Columns:
    """What is above each cell of a floor at z = 0.

    Attributes:
        grid: Where the cells lie.
        layers: Bit k: something between `BOTTOM_M + k * LAYER_M` and a layer higher.
        owner: Triangle in a robot's way that reaches highest; -1 none.
        over_m: Lowest thing above head height; infinite where there is none.
        floor: Whether there is floor.
    """

    grid: GridFrame
    layers: UInt64[np.ndarray, "rows cols"]
    owner: Int32[np.ndarray, "rows cols"]
    over_m: Float32[np.ndarray, "rows cols"]
    floor: Bool[np.ndarray, "rows cols"]

    @property
    def blocked(self) -> Bool[np.ndarray, "rows cols"]:
        """Cells where a robot would hit something."""
        return np.asarray(self.owner >= 0)

    def filled(self, low_m: float, high_m: float) -> Float32[np.ndarray, "rows cols"]:
        """Share of the layers between two heights that hold something."""
        first = round((low_m - BOTTOM_M) / LAYER_M)
        last = round((high_m - BOTTOM_M) / LAYER_M)
        count = np.zeros(self.layers.shape, np.uint8)
        for layer in range(first, last):
            count += ((self.layers >> np.uint64(layer)) & np.uint64(1)).astype(np.uint8)
        return count.astype(np.float32) / np.float32(max(last - first, 1))

    def stack_top_m(self, gap_m: float = 0.6) -> Float32[np.ndarray, "rows cols"]:
        """How high what stands on the floor reaches; a gap ends it (a lamp over a table)."""
        top = np.zeros(self.layers.shape, np.float32)
        for layer in range(round((_STEP_M - BOTTOM_M) / LAYER_M), 64):
            there = ((self.layers >> np.uint64(layer)) & np.uint64(1)).astype(bool)
            z_m = np.float32(BOTTOM_M + layer * LAYER_M)
            top = np.where(there & (z_m - top <= gap_m), z_m + np.float32(LAYER_M), top)
        return top


def flat_faces(
    vertices: Float32[np.ndarray, "vertices 3"], faces: Int32[np.ndarray, "faces 3"], axis: int
) -> tuple[Float[np.ndarray, " flat"], Float[np.ndarray, " flat"]]:
    """Area and height along an axis of each triangle that lies flat across it."""
    area, height = [], []
    for first in range(0, len(faces), 2_000_000):
        corners = vertices[faces[first : first + 2_000_000]].astype(np.float64)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1)
        flat = (np.abs(normal[:, axis]) > 0.95 * length) & (length > 0)
        area.append(0.5 * length[flat])
        height.append(corners[flat][:, :, axis].mean(axis=1))
    return np.concatenate(area or [np.zeros(0)]), np.concatenate(height or [np.zeros(0)])


def find_floor_m(
    vertices: Float32[np.ndarray, "vertices 3"],
    faces: Int32[np.ndarray, "faces 3"],
    where: str,
    *,
    floor_faces: Int32[np.ndarray, "labelled 3"] | None = None,
    near_m: float | None = None,
) -> float:
    """The height of the level with the most floor to drive on.

    A level is a height at which much lies flat. It counts by the area that is free to a
    robot's height above it, three times where a ceiling is over it.

    Args:
        vertices: Corners, z up.
        faces: All triangles.
        where: The file, for messages.
        floor_faces: Triangles that the file calls floor; then only their heights count.
        near_m: The level nearest to this height instead of the largest.

    Raises:
        InputError: Nothing lies flat.
    """
    area, height = flat_faces(vertices, faces if floor_faces is None else floor_faces, 2)
    if not len(area):
        raise InputError(
            "has no floor: nothing in it lies flat",
            where=where,
            remedy="check which axis points up (--up)",
        )
    levels = _levels(area, height)
    if near_m is not None:
        return min(levels, key=lambda level: abs(level - near_m))
    if len(levels) == 1:
        return levels[0]
    low, high = vertices[faces].min(axis=(0, 1)), vertices[faces].max(axis=(0, 1))
    cell_m = max(0.1, float(np.sqrt((high[0] - low[0]) * (high[1] - low[1]) / _COARSE_CELLS)))
    scores = []
    for level in levels:
        columns = columns_over(vertices, faces, level, low, high, min(cell_m, 10.0))
        clear = columns.floor & ~columns.blocked
        covered = clear & np.isfinite(columns.over_m) & (columns.over_m < 6.0)
        scores.append(int(clear.sum()) + 2 * int(covered.sum()))
    best = max(scores)
    return next(level for level, score in zip(levels, scores, strict=True) if score >= 0.95 * best)


def columns_over(
    vertices: Float32[np.ndarray, "vertices 3"],
    faces: Int32[np.ndarray, "faces 3"],
    floor_m: float,
    low: Float[np.ndarray, " axes"] | Float32[np.ndarray, " axes"],
    high: Float[np.ndarray, " axes"] | Float32[np.ndarray, " axes"],
    cell_m: float,
) -> Columns:
    """What is above each cell of a floor at this height, between two corners of the plan."""
    origin = (float(np.floor(low[0] / cell_m) * cell_m), float(np.floor(low[1] / cell_m) * cell_m))
    cols = max(int(np.ceil((float(high[0]) - origin[0]) / cell_m + 1e-6)), 1)
    rows = max(int(np.ceil((float(high[1]) - origin[1]) / cell_m + 1e-6)), 1)
    grid = GridFrame(cell_m, origin, rows, cols)
    layers = np.zeros(grid.shape, np.uint64)
    owner = np.full(grid.shape, -1, np.int32)
    owner_top = np.full(grid.shape, -np.inf, np.float32)
    over = np.full(grid.shape, np.inf, np.float32)
    floor = np.zeros(grid.shape, bool)
    standing = vertices
    if floor_m != 0:
        standing = vertices - np.array([0.0, 0.0, floor_m], np.float32)
    z = np.array([BOTTOM_M, LAYER_M, _STEP_M, _ROBOT_M, _HEAD_M, _FLOOR_M])
    fill_columns(standing, faces, *origin, cell_m, z, layers, owner, owner_top, over, floor)
    return Columns(grid, layers, owner, over, floor)


def _levels(area: Float[np.ndarray, " flat"], height: Float[np.ndarray, " flat"]) -> list[float]:
    """The heights at which the most lies flat, the lowest first."""
    lowest = float(height.min())
    bins = np.floor((height - lowest) / _PEAK_M).astype(np.int64)
    # A file in the wrong unit has heights without end; coarse bins will do for it.
    if bins.max() > 5_000_000:
        bins = np.floor(bins * (5_000_000 / bins.max())).astype(np.int64)
    window = np.ones(_WINDOW)
    total = np.convolve(np.bincount(bins, weights=area), window, "same")
    moment = np.convolve(np.bincount(bins, weights=area * height), window, "same")
    is_peak = (total >= ndimage.maximum_filter1d(total, 2 * _WINDOW + 1)) & (total > 0)
    found: list[float] = []
    for place in np.flatnonzero(is_peak)[np.argsort(-total[is_peak], kind="stable")].tolist():
        if total[place] < 0.1 * total.max() or len(found) >= _LEVELS:
            break
        # Of a slab's two sides, or of floor and ground below it, the upper one is stood on.
        above = np.arange(place, min(place + _SLAB_BINS, len(total)))
        above = above[is_peak[above] & (total[above] >= 0.5 * total[place])]
        upper = int(above[-1])
        level = float(moment[upper] / total[upper])
        if all(abs(level - other) > 0.3 for other in found):
            found.append(level)
    return sorted(found)
