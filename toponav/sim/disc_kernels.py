"""Compiled motion of a round robot among the solid cells of a grid."""

import numpy as np
from numba import njit

__all__ = ["clearance_of_point", "drive_disc"]

_STEP = 0.005
"""Cells that a motion along a surface is followed by."""
_GAP = 1e-3
"""Cells that are left between the robot and what stopped it, so that it is never inside."""


@njit(cache=True)
def clearance_of_point(solid, row, col, reach):  # type: ignore[no-untyped-def]
    """Distance from a point to the nearest solid square, and the direction away from it.

    Everything is in cells. Beyond `reach` the distance reads as that and the direction as zero.
    What lies outside the grid is solid.
    """
    rows, cols = solid.shape
    nearest, away_row, away_col = reach, 0.0, 0.0
    edges = (row, rows - row, col, cols - col)
    for side in range(4):
        if edges[side] < nearest:
            nearest = max(edges[side], 0.0)
            away_row = (1.0, -1.0, 0.0, 0.0)[side]
            away_col = (0.0, 0.0, 1.0, -1.0)[side]
    for at_row in range(max(int(row - reach), 0), min(int(row + reach) + 1, rows)):
        for at_col in range(max(int(col - reach), 0), min(int(col + reach) + 1, cols)):
            if not solid[at_row, at_col]:
                continue
            down = row - min(max(row, at_row), at_row + 1.0)
            right = col - min(max(col, at_col), at_col + 1.0)
            distance = np.sqrt(down * down + right * right)
            if distance < nearest:
                nearest = distance
                if distance > 0:
                    away_row, away_col = down / distance, right / distance
                else:
                    away_row, away_col = 0.0, 0.0
    return nearest, away_row, away_col


@njit(cache=True)
def drive_disc(solid, row, col, down, right, radius, sliding):  # type: ignore[no-untyped-def]
    """Where a disc that drives straight ends, and whether it touched something.

    Without sliding it stops at the first contact. With it, what is left of the motion goes on
    along the surface, three times at most, as a robot's does in Habitat.

    Args:
        solid: bool[rows, cols].
        row: Start, in cells.
        col: Start, in cells.
        down: Motion along rows, in cells.
        right: Motion along columns, in cells.
        radius: The disc's radius in cells.
        sliding: Whether it slides along what it touches.

    Returns:
        Row and column of its end, and whether it touched anything.
    """
    reach = radius + 1.0
    touched = False
    for _ in range(4 if sliding else 1):
        length = np.sqrt(down * down + right * right)
        if length < 1e-9:
            break
        gone, blocked = _free_part(solid, row, col, down, right, radius)
        row += down * gone
        col += right * gone
        if not blocked:
            break
        touched = True
        _, away_row, away_col = clearance_of_point(solid, row, col, reach)
        down *= 1.0 - gone
        right *= 1.0 - gone
        into = down * away_row + right * away_col
        if into >= 0:
            break
        down -= into * away_row
        right -= into * away_col
    return row, col, touched


@njit(cache=True)
def _free_part(solid, row, col, down, right, radius):  # type: ignore[no-untyped-def]
    """The fraction of a straight motion before the first contact, and whether there is one.

    Conservative advancement: the disc can always go as far as it is clear, so nothing is jumped
    over. A disc that touches something may drive along it or away.
    """
    length = np.sqrt(down * down + right * right)
    at = 0.0
    while at < length:
        here, away_row, away_col = clearance_of_point(
            solid, row + down * at / length, col + right * at / length, radius + 1.0
        )
        spare = here - radius
        towards = down * away_row + right * away_col < -1e-9 * length
        if towards and spare < 2 * _GAP:
            return at / length, True
        ahead = spare - _GAP if towards else max(spare - _GAP, _STEP)
        if spare < 2 * _GAP:
            # Along one surface, perhaps into another: in a corner no step may lead deeper.
            after, _, _ = clearance_of_point(
                solid,
                row + down * (at + ahead) / length,
                col + right * (at + ahead) / length,
                radius + 1.0,
            )
            if after < radius and after < here - 1e-9:
                return at / length, True
        at += ahead
    return 1.0, False
