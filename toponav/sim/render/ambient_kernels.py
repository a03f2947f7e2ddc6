"""Compiled distances to the nearest surface, on a grid of small cubes around a building."""

import numpy as np
from numba import njit

__all__ = ["distance_within", "mark_triangles"]


@njit(cache=True, nogil=True)
def mark_triangles(corners, origin, voxel, marked):  # type: ignore[no-untyped-def]
    """Marks the cubes that triangles pass through, by points half a cube apart.

    Args:
        corners: float32 [triangles, 3, 3].
        origin: Lowest corner of the grid, three numbers.
        voxel: Side of a cube.
        marked: uint8 [x, y, z], written.
    """
    nx, ny, nz = marked.shape
    for t in range(corners.shape[0]):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        along = 0.0
        across = 0.0
        for axis in range(3):
            along += (b[axis] - a[axis]) ** 2
            across += (c[axis] - a[axis]) ** 2
        third = 0.0
        for axis in range(3):
            third += (c[axis] - b[axis]) ** 2
        longest = np.sqrt(max(along, across, third))
        steps = int(np.ceil(longest / (0.5 * voxel))) + 1
        for i in range(steps + 1):
            u = i / steps
            rest = 1.0 - u
            more = int(np.ceil(steps * rest))
            for j in range(more + 1):
                v = rest * j / more if more > 0 else 0.0
                w = 1.0 - u - v
                x = int((w * a[0] + u * b[0] + v * c[0] - origin[0]) / voxel)
                y = int((w * a[1] + u * b[1] + v * c[1] - origin[1]) / voxel)
                z = int((w * a[2] + u * b[2] + v * c[2] - origin[2]) / voxel)
                if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
                    marked[x, y, z] = 1


@njit(cache=True, nogil=True)
def distance_within(marked, reach):  # type: ignore[no-untyped-def]
    """Squared distance in cubes to the nearest marked cube, exact up to `reach`, else more.

    One pass per axis, each over a window of the reach (Felzenszwalb and Huttenlocher's
    separation of the distance transform, without their envelope).
    """
    nx, ny, nz = marked.shape
    far = np.uint16(60000)
    first = np.full((nx, ny, nz), far, np.uint16)
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                if marked[x, y, z]:
                    for k in range(max(0, z - reach), min(nz, z + reach + 1)):
                        gap = np.uint16((k - z) * (k - z))
                        if gap < first[x, y, k]:
                            first[x, y, k] = gap
    second = np.full((nx, ny, nz), far, np.uint16)
    for x in range(nx):
        for y in range(ny):
            for k in range(max(0, y - reach), min(ny, y + reach + 1)):
                gap = np.uint16((k - y) * (k - y))
                for z in range(nz):
                    value = first[x, k, z] + gap
                    if value < second[x, y, z]:
                        second[x, y, z] = value
    first[:] = far
    for x in range(nx):
        for k in range(max(0, x - reach), min(nx, x + reach + 1)):
            gap = np.uint16((k - x) * (k - x))
            for y in range(ny):
                for z in range(nz):
                    value = second[k, y, z] + gap
                    if value < first[x, y, z]:
                        first[x, y, z] = value
    return first
