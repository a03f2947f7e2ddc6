"""Compiled colours: texture, light and the darkness of corners, a few hundred pixels at a time.

A panorama has 65,536 pixels and two milliseconds. So each step is a short loop over a batch that
stays in the processor's first cache, and loops are of two kinds: those that only calculate, which
compilers turn into vector instructions, and those that fetch. What they hand on lies in rows of
two flat arrays, `work` and `spot`: rows at fixed distances let the compiler see that writing one
does not change another. All numbers are float32.
"""

from typing import Any

import numpy as np
from numba import njit

__all__ = ["look_up", "shade_pixels"]

_LOOK: Any = {"cache": True, "nogil": True, "fastmath": True, "error_model": "numpy"}
_PART: Any = {"inline": "always", **_LOOK}
_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_BATCH = 512
# Rows of `work`: position, normal towards the camera, place in the texture, how much of it a pixel
# covers, place between eight cubes (later the lamp), its power, and light.
_X, _Y, _Z, _NX, _NY, _NZ, _S, _T, _COVERED, _FX, _FY, _FZ, _POWER, _LIGHT = (
    _BATCH * row for row in range(14)
)
_WORK_ROWS = 14
# Rows of `spot`: a cube, four of its distances and the four beyond; a cell; a copy of a texture,
# a texel of it, the texel below, and the weights of the right and lower texels in 64ths.
_CUBE, _NEAR, _BEYOND, _CELL, _COPY, _TEXEL, _BELOW, _RIGHT, _LOWER = (
    _BATCH * row for row in range(9)
)
_SPOT_ROWS = 9
# Columns of `Surfaces.face_data`, after the normal.
_TEXELS_M, _RED, _GREEN, _BLUE, _GLOW, _COPIES, _LAST_COPY = 3, 10, 11, 12, 13, 14, 15
_STEP_M, _TINY, _LEAST_COSINE = np.float32(0.06), np.float32(1e-6), np.float32(1e-3)
_NEARLY_ONE = np.float32(1.001)
_PER_BYTE, _LEVELS = np.float32(1 / 255), np.float32(4095)
_WEIGHTS = np.float32(64.0)
_LANE_1, _LANE_2, _LANE_3 = np.uint64(9), np.uint64(21 + 9), np.uint64(42 + 9)
_STEP_MASK = np.uint64((1 << 12) - 1)


@njit(cache=True, nogil=True)
def look_up(face, labels, nothing, image):  # type: ignore[no-untyped-def]
    """Writes the label of the face that each pixel shows, `nothing` where there is none."""
    for pixel in range(face.size):
        image[pixel] = labels[face[pixel]] if face[pixel] >= 0 else nothing


@njit(**_LOOK)
def shade_pixels(  # type: ignore[no-untyped-def]
    hits, view, faces, textures, openness, lamps, light, curves, image
):
    """Writes the colour of each pixel; `shading.py` says what the light is.

    Args:
        hits: Depth, face and barycentric coordinates per pixel.
        view: Optical centre, cosine and sine of yaw, [4, pixels] rays in the robot's frame and
            one over their length, pixel width at one metre.
        faces: `Surfaces.face_data`, and the same memory as whole numbers.
        textures: Texels and places of the copies.
        openness: Distances at the corners of cubes, size, origin, 1 / side of a cube, reach,
            slack.
        lamps: Places and powers, lamp of each cell, its size, grid origin, 1 / resolution.
        light: The numbers of `shading.Light`, in its order.
        curves: Eighths of an sRGB byte to linear, 4095ths of linear to sRGB bytes.
        image: uint8 [pixels, 3], written.
    """
    depth_m, face, uv = hits
    rays = view[3]
    work = np.zeros(_WORK_ROWS * _BATCH, np.float32)
    spot = np.zeros(_SPOT_ROWS * _BATCH, np.int32)
    for start in range(0, face.size, _BATCH):
        end = min(start + _BATCH, face.size)
        count = end - start
        f = face[start:end]
        _fetch_faces(f, depth_m[start:end], uv[start:end], faces[0], work)
        _place(
            view,
            rays[0, start:end],
            rays[1, start:end],
            rays[2, start:end],
            rays[3, start:end],
            work,
        )
        _find_cubes(openness, count, work, spot)
        _fetch_distances(openness[0], openness[1], count, spot)
        _darken_corners(openness[5], light, count, work, spot)
        _find_cells(lamps, count, work, spot)
        _fetch_lamps(lamps, count, work, spot)
        _shine(light, count, work)
        _find_copies(count, work, spot)
        _fetch_copies(f, faces[1], textures[1], spot)
        _find_texels(count, work, spot)
        _paint(f, faces[0], textures[0], work, spot, light[-1], curves, image[start:end])


@njit(**_LOOK)
def _fetch_faces(face, depth_m, uv, face_data, work):  # type: ignore[no-untyped-def]
    """Writes depth, normal and texture coordinates of what each pixel shows."""
    for k in range(face.size):
        f = np.uint32(max(face[k], 0))
        a, b = uv[k, 0], uv[k, 1]
        work[_Z + k] = depth_m[k] if face[k] >= 0 else _ZERO
        work[_NX + k], work[_NY + k] = face_data[f, 0], face_data[f, 1]
        work[_NZ + k] = face_data[f, 2]
        work[_S + k] = face_data[f, 4] + a * face_data[f, 5] + b * face_data[f, 6]
        work[_T + k] = face_data[f, 7] + a * face_data[f, 8] + b * face_data[f, 9]
        work[_COVERED + k] = face_data[f, _TEXELS_M]


@njit(**_LOOK)
def _place(view, forward, left, up, per_length, work):  # type: ignore[no-untyped-def]
    """Writes positions, normals towards the camera, places in repeats and texels per pixel."""
    origin, cosine, sine, _, pixel_m = view
    ox, oy, oz = origin[0], origin[1], origin[2]
    for k in range(forward.size):
        depth = work[_Z + k]
        dx, dy = cosine * forward[k] - sine * left[k], sine * forward[k] + cosine * left[k]
        dz = up[k]
        nx, ny, nz = work[_NX + k], work[_NY + k], work[_NZ + k]
        facing = (nx * dx + ny * dy + nz * dz) * per_length[k]
        side = _ONE if facing <= _ZERO else -_ONE  # a surface has two sides
        work[_X + k], work[_Y + k], work[_Z + k] = (
            ox + depth * dx,
            oy + depth * dy,
            oz + depth * dz,
        )
        work[_NX + k], work[_NY + k], work[_NZ + k] = side * nx, side * ny, side * nz
        covered = depth * pixel_m * work[_COVERED + k]
        work[_COVERED + k] = covered * covered / max(abs(facing), _LEAST_COSINE)
        s, t = work[_S + k], work[_T + k]
        work[_S + k], work[_T + k] = s - np.floor(s), _ONE - (t - np.floor(t))


@njit(**_LOOK)
def _find_cubes(openness, count, work, spot):  # type: ignore[no-untyped-def]
    """Writes which eight cubes the place a reach before each surface lies between, and where."""
    _, size, origin, per_voxel, reach, _ = openness
    ox, oy, oz = origin[0], origin[1], origin[2]
    last_x, last_y = np.float32(size[0]) - _NEARLY_ONE, np.float32(size[1]) - _NEARLY_ONE
    last_z = np.float32(size[2]) - _NEARLY_ONE
    # Exact: there are fewer cubes than float32 has whole numbers.
    per_y, per_x = np.float32(size[2]), np.float32(size[1] * size[2])
    for k in range(count):
        x = min(max((work[_X + k] + reach * work[_NX + k] - ox) * per_voxel, _ZERO), last_x)
        y = min(max((work[_Y + k] + reach * work[_NY + k] - oy) * per_voxel, _ZERO), last_y)
        z = min(max((work[_Z + k] + reach * work[_NZ + k] - oz) * per_voxel, _ZERO), last_z)
        i, j, low = np.floor(x), np.floor(y), np.floor(z)
        spot[_CUBE + k] = np.int32(i * per_x + j * per_y + low)
        work[_FX + k], work[_FY + k], work[_FZ + k] = x - i, y - j, z - low


@njit(**_LOOK)
def _fetch_distances(corners, size, count, spot):  # type: ignore[no-untyped-def]
    """Writes the distances of a cube and its seven neighbours, four to a number."""
    per_x = np.uint32(size[1] * size[2])
    for k in range(count):
        cube = np.uint32(spot[_CUBE + k])
        spot[_NEAR + k], spot[_BEYOND + k] = corners[cube], corners[cube + per_x]


@njit(**_PART)
def _between(four, fy, fz):  # type: ignore[no-untyped-def]
    """The distance between four cubes whose distances are bytes of one number."""
    a, b = np.float32(four & 255), np.float32((four >> 8) & 255)
    c, d = np.float32((four >> 16) & 255), np.float32((four >> 24) & 255)
    a, c = a + fz * (b - a), c + fz * (d - c)
    return a + fy * (c - a)


@njit(**_LOOK)
def _darken_corners(slack, light, count, work, spot):  # type: ignore[no-untyped-def]
    """Writes what corners leave of the light, as a share."""
    corner = light[4]
    for k in range(count):
        fx, fy, fz = work[_FX + k], work[_FY + k], work[_FZ + k]
        near = _between(np.int32(spot[_NEAR + k]), fy, fz)
        free = near + fx * (_between(np.int32(spot[_BEYOND + k]), fy, fz) - near)
        work[_LIGHT + k] = corner + (_ONE - corner) * min(_ONE, free * _PER_BYTE + slack)


@njit(**_LOOK)
def _find_cells(lamps, count, work, spot):  # type: ignore[no-untyped-def]
    """Writes the cell a step before each surface: the room is the one in front of it."""
    _, _, shape, grid_origin, per_cell = lamps
    last_row, last_col = np.float32(shape[0]) - _ONE, np.float32(shape[1]) - _ONE
    left, low, cols = grid_origin[0], grid_origin[1], np.int32(shape[1])
    for k in range(count):
        row = (work[_Y + k] + _STEP_M * work[_NY + k] - low) * per_cell
        col = (work[_X + k] + _STEP_M * work[_NX + k] - left) * per_cell
        row, col = min(max(row, _ZERO), last_row), min(max(col, _ZERO), last_col)
        spot[_CELL + k] = np.int32(row) * cols + np.int32(col)


@njit(**_LOOK)
def _fetch_lamps(lamps, count, work, spot):  # type: ignore[no-untyped-def]
    """Writes where the lamp of each cell is, and its power."""
    places, of_cell = lamps[0], lamps[1]
    for k in range(count):
        lamp = np.uint32(of_cell[np.uint32(spot[_CELL + k])])
        work[_FX + k], work[_FY + k] = places[lamp, 0], places[lamp, 1]
        work[_FZ + k], work[_POWER + k] = places[lamp, 2], places[lamp, 3]


@njit(**_LOOK)
def _shine(light, count, work):  # type: ignore[no-untyped-def]
    """Multiplies what corners leave by the light from above and of the lamp."""
    ambient, lamp_share, wrap, spread, _, below, tint, _ = light
    most = lamp_share / (_ONE + wrap)
    for k in range(count):
        x, y = work[_FX + k] - work[_X + k], work[_FY + k] - work[_Y + k]
        z = work[_FZ + k] - work[_Z + k]
        nx, ny, nz = work[_NX + k], work[_NY + k], work[_NZ + k]
        square = x * x + y * y + z * z
        along = (x * nx + y * ny + z * nz) / np.sqrt(square + _TINY)
        direct = max(_ZERO, along + wrap) * work[_POWER + k] * most / (_ONE + square * spread)
        sky = ambient * (below + (_ONE - below) * _HALF * (nz + _ONE))
        sky *= _ONE + tint * (nx + _HALF * ny)
        work[_LIGHT + k] *= sky + direct


@njit(**_LOOK)
def _find_copies(count, work, spot):  # type: ignore[no-untyped-def]
    """Writes how often to halve a texture so that a pixel covers 2 texels or less.

    Comparisons that are added need no guess about which way a branch goes.
    """
    for k in range(count):
        square = work[_COVERED + k]
        spot[_COPY + k] = (
            np.int32(square > np.float32(2.0))
            + np.int32(square > np.float32(8.0))
            + np.int32(square > np.float32(32.0))
            + np.int32(square > np.float32(128.0))
            + np.int32(square > np.float32(512.0))
            + np.int32(square > np.float32(2048.0))
            + np.int32(square > np.float32(8192.0))
            + np.int32(square > np.float32(32768.0))
        )


@njit(**_LOOK)
def _fetch_copies(face, face_numbers, places, spot):  # type: ignore[no-untyped-def]
    """Writes the first texel, height and width of the copy that fits."""
    for k in range(face.size):
        f = np.uint32(max(face[k], 0))
        halved = min(spot[_COPY + k], face_numbers[f, _LAST_COPY])
        copy = np.uint32(face_numbers[f, _COPIES] + halved)
        spot[_TEXEL + k], spot[_LOWER + k] = places[copy, 0], places[copy, 1]
        spot[_RIGHT + k] = places[copy, 2]


@njit(**_LOOK)
def _find_texels(count, work, spot):  # type: ignore[no-untyped-def]
    """Writes which four texels each pixel lies between and how near to them."""
    for k in range(count):
        width = spot[_RIGHT + k]
        # Half a texel on: positive numbers are rounded down by cutting off what follows the point.
        # A border of one texel on each side repeats those of the other.
        x = work[_S + k] * np.float32(width) + _HALF
        y = work[_T + k] * np.float32(spot[_LOWER + k]) + _HALF
        right, low = np.int32(x), np.int32(y)
        spot[_RIGHT + k] = np.int32((x - np.float32(right)) * _WEIGHTS)
        spot[_LOWER + k] = np.int32((y - np.float32(low)) * _WEIGHTS)
        texel = np.int32(spot[_TEXEL + k] + low * (width + 2) + right)
        spot[_TEXEL + k], spot[_BELOW + k] = texel, np.int32(texel + width + 2)


@njit(**_LOOK)
def _paint(face, face_data, texels, work, spot, escape, curves, image):  # type: ignore[no-untyped-def]
    """Writes colours: material times texture times light."""
    to_linear, to_srgb = curves
    for k in range(face.size):
        f = np.uint32(max(face[k], 0))
        light = work[_LIGHT + k] + face_data[f, _GLOW]
        color = _texel(texels, spot, k)
        red = light * face_data[f, _RED] * to_linear[(color >> _LANE_3) & _STEP_MASK]
        green = light * face_data[f, _GREEN] * to_linear[(color >> _LANE_2) & _STEP_MASK]
        blue = light * face_data[f, _BLUE] * to_linear[(color >> _LANE_1) & _STEP_MASK]
        image[k, 0] = to_srgb[np.uint32(min(_ONE, red) * _LEVELS)]
        image[k, 1] = to_srgb[np.uint32(min(_ONE, green) * _LEVELS)]
        image[k, 2] = to_srgb[np.uint32(min(_ONE, blue) * _LEVELS)]
        if face[k] < 0:
            image[k, 0] = image[k, 1] = image[k, 2] = escape


@njit(**_PART)
def _texel(texels, spot, k):  # type: ignore[no-untyped-def]
    """The texture's colour between four texels: three lanes of 21 bits, in 4096ths of a byte.

    Colours and weights are whole numbers, so that three channels cost one multiplication a texel.
    """
    one = np.uint32(1)
    above, below = np.uint32(spot[_TEXEL + k]), np.uint32(spot[_BELOW + k])
    fx, fy = np.uint64(spot[_RIGHT + k]), np.uint64(spot[_LOWER + k])
    gx, gy = np.uint64(64) - fx, np.uint64(64) - fy
    return gy * (gx * texels[above] + fx * texels[above + one]) + fy * (
        gx * texels[below] + fx * texels[below + one]
    )
