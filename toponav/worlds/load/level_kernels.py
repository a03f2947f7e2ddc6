"""Compiled loops that stand a mesh on a grid: what is in the column above each cell."""

import numpy as np
from numba import njit

__all__ = ["fill_columns"]


@njit(cache=True)
def fill_columns(  # type: ignore[no-untyped-def]
    vertices, faces, origin_x, origin_y, cell_m, z, layers, owner, owner_top, over, floor
):
    """Marks in every column which layers its triangles cross, exactly.

    Args:
        vertices: float32[n, 3] in the building's frame, z up.
        faces: int32[m, 3].
        origin_x: Left edge of the grid.
        origin_y: Lower edge.
        cell_m: Side of a cell.
        z: float64[6]: bottom of the lowest layer, thickness of a layer, lowest and highest z
            of what stands in a robot's way, lowest z of what hangs overhead, and the most that
            floor lies from z = 0.
        layers: uint64[rows, cols], bit k for layer k; written.
        owner: int32[rows, cols]: of the triangles in the way, the one that reaches highest;
            written.
        owner_top: float32[rows, cols], how high it reaches; written.
        over: float32[rows, cols], lowest z of what hangs overhead; written.
        floor: bool[rows, cols], whether a flat triangle lies at z = 0; written.
    """
    rows, cols = layers.shape
    bottom, step, low, high, head, flat_m = z[0], z[1], z[2], z[3], z[4], z[5]
    top = bottom + 64 * step
    one = np.uint64(1)
    strip = np.empty((16, 3))
    piece = np.empty((16, 3))
    spare = np.empty((16, 3))
    corner = np.empty((3, 3))
    for face in range(len(faces)):
        for k in range(3):
            v = faces[face, k]
            corner[k, 0] = (vertices[v, 0] - origin_x) / cell_m
            corner[k, 1] = (vertices[v, 1] - origin_y) / cell_m
            corner[k, 2] = vertices[v, 2]
        z_max = max(corner[0, 2], corner[1, 2], corner[2, 2])
        if z_max < bottom:
            continue
        # Twice the area seen from above, in square metres, against twice the area.
        ax, ay, az = (
            corner[1, 0] - corner[0, 0],
            corner[1, 1] - corner[0, 1],
            corner[1, 2] - corner[0, 2],
        )
        bx, by, bz = (
            corner[2, 0] - corner[0, 0],
            corner[2, 1] - corner[0, 1],
            corner[2, 2] - corner[0, 2],
        )
        nz = (ax * by - ay * bx) * cell_m * cell_m
        nx = (ay * bz - az * by) * cell_m
        ny = (az * bx - ax * bz) * cell_m
        is_flat = abs(nz) > 0.8 * np.sqrt(nx * nx + ny * ny + nz * nz)
        y_min = min(corner[0, 1], corner[1, 1], corner[2, 1])
        y_max = max(corner[0, 1], corner[1, 1], corner[2, 1])
        x_min = min(corner[0, 0], corner[1, 0], corner[2, 0])
        x_max = max(corner[0, 0], corner[1, 0], corner[2, 0])
        if y_max < 0 or x_max < 0 or y_min >= rows or x_min >= cols:
            continue
        row0 = int(max(np.floor(y_min), 0.0))
        row1 = int(min(max(np.ceil(y_max) - 1, row0), rows - 1.0))
        for row in range(row0, row1 + 1):
            count = 3
            for k in range(3):
                for axis in range(3):
                    strip[k, axis] = corner[k, axis]
            if row0 != row1 or y_min < 0 or y_max > rows:
                count = _clip(strip, count, spare, 1, row, True)
                count = _clip(spare, count, strip, 1, row + 1, False)
            if count == 0:
                continue
            left, right = strip[0, 0], strip[0, 0]
            for k in range(1, count):
                left = min(left, strip[k, 0])
                right = max(right, strip[k, 0])
            if right < 0 or left >= cols:
                continue
            col0 = int(max(np.floor(left), 0.0))
            col1 = int(min(max(np.ceil(right) - 1, col0), cols - 1.0))
            for col in range(col0, col1 + 1):
                here = count
                z0, z1 = np.inf, -np.inf
                if col0 != col1 or left < 0 or right > cols:
                    here = _clip(strip, count, spare, 0, col, True)
                    here = _clip(spare, here, piece, 0, col + 1, False)
                    for k in range(here):
                        z0 = min(z0, piece[k, 2])
                        z1 = max(z1, piece[k, 2])
                else:
                    for k in range(here):
                        z0 = min(z0, strip[k, 2])
                        z1 = max(z1, strip[k, 2])
                if here == 0:
                    continue
                if z1 >= bottom and z0 < top:
                    first = int(max((z0 - bottom) / step, 0.0))
                    last = int(min((z1 - bottom) / step, 63.0))
                    bits = layers[row, col]
                    for layer in range(first, last + 1):
                        bits |= one << np.uint64(layer)
                    layers[row, col] = bits
                if z1 > low and z0 < high and z1 > owner_top[row, col]:
                    owner_top[row, col] = z1
                    owner[row, col] = face
                if z0 > head and z0 < over[row, col]:
                    over[row, col] = z0
                if is_flat and z0 < flat_m and z1 > -flat_m:
                    floor[row, col] = True


@njit(cache=True)
def _clip(polygon, count, out, axis, bound, keep_above):  # type: ignore[no-untyped-def]
    """The part of a convex polygon on one side of a line; its number of corners."""
    made = 0
    for k in range(count):
        after = k + 1 if k + 1 < count else 0
        here = polygon[k, axis] - bound
        there = polygon[after, axis] - bound
        if not keep_above:
            here, there = -here, -there
        if here >= 0:
            for c in range(3):
                out[made, c] = polygon[k, c]
            made += 1
        if (here > 0 and there < 0) or (here < 0 and there > 0):
            share = here / (here - there)
            for c in range(3):
                out[made, c] = polygon[k, c] + share * (polygon[after, c] - polygon[k, c])
            made += 1
    return made
