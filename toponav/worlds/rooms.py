"""Outlines of rooms known by their cells."""

import numpy as np
from jaxtyping import Bool, Float
from skimage.measure import approximate_polygon, find_contours

from toponav.worlds.grid import GridFrame

__all__ = ["outline_m"]


def outline_m(
    cells: Bool[np.ndarray, "rows cols"], grid: GridFrame
) -> Float[np.ndarray, "corners 2"] | None:
    """The longest outline of the cells in metres, counter-clockwise; None where there is none.

    Corners are dropped where that moves the outline by less than a cell.
    """
    rows, cols = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    if not len(rows):
        return None
    window = np.pad(cells[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1], 1)
    contours = find_contours(window.astype(np.float32), 0.5)  # type: ignore[no-untyped-call]
    longest = max(contours, key=len)
    outline = approximate_polygon(longest, tolerance=1.0)[:-1]  # type: ignore[no-untyped-call]
    if len(outline) < 3:
        return None
    # Contour points lie on cell centres of the padded window, as (row, col).
    xy_m = (outline[:, ::-1] - 0.5 + (cols[0], rows[0])) * grid.resolution_m + grid.origin_m
    x_m, y_m = xy_m.T
    area = np.dot(x_m, np.roll(y_m, -1)) - np.dot(y_m, np.roll(x_m, -1))
    return np.asarray(np.round(xy_m if area > 0 else xy_m[::-1], 6))
