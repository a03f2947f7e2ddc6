"""Compiled colours: texture, light and the darkness of corners, one pixel after another.

All numbers are float32 and most data lies in flat arrays, because a panorama has 65,536 pixels
and five milliseconds.
"""

from typing import Any

import numpy as np
from numba import njit

__all__ = ["look_up", "shade_pixels"]

_LOOK: Any = {"cache": True, "nogil": True, "fastmath": True, "error_model": "numpy"}
# Numba calls functions that it does not inline itself at twenty nanoseconds an array.
_PART: Any = {"inline": "always", **_LOOK}
_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_BATCH = 512
_STEP_M, _TINY, _LEAST_COSINE = np.float32(0.06), np.float32(1e-6), np.float32(1e-3)
_NEARLY_ONE = np.float32(1.001)
_PER_BYTE, _LEVELS = np.float32(1 / 255), np.float32(4095)
_WEIGHTS = np.float32(64.0)
_LANE = np.uint64((1 << 21) - 1)
_LANE_1, _LANE_2, _LANE_3 = np.uint64(9), np.uint64(21 + 9), np.uint64(42 + 9)
_STEP_MASK = np.uint64((1 << 12) - 1)


@njit(cache=True, nogil=True)
def look_up(face, labels, nothing, image):  # type: ignore[no-untyped-def]
    """Writes the label of the face that each pixel shows, `nothing` where there is none."""
    for pixel in range(face.size):
        image[pixel] = labels[face[pixel]] if face[pixel] >= 0 else nothing


@njit(**_LOOK)
def shade_pixels(  # type: ignore[no-untyped-def]
    hits, view, faces, materials, textures, openness, lamps, light, curves, image
):
    """Writes the colour of each pixel; `shading.py` says what the light is.

    A few hundred pixels at a time go through four short loops: more of a short loop's turns
    overlap in the processor than of a long one's, which halves the time.

    Args:
        hits: Depth, face and barycentric coordinates per pixel.
        view: Optical centre, cosine and sine of yaw, [pixels, 4] rays in the robot's frame and
            one over their length, pixel width at one metre.
        faces: Material of each, and `Surfaces.face_data`.
        materials: Colour and glow, first and number of the copies of its texture.
        textures: Texels and places of the copies.
        openness: Distances, size, origin, 1 / side of a cube, reach, slack.
        lamps: Places and powers, lamp of each cell, its size, grid origin, 1 / resolution.
        light: The numbers of `shading.Light`, in its order.
        curves: Eighths of an sRGB byte to linear, 4095ths of linear to sRGB bytes.
        image: uint8 [pixels, 3], written.
    """
    depth_m, face, uv = hits
    rays = view[3]
    # Of each pixel of a batch: position (later the way to the lamp), normal, light, cosine to the
    # ray, power of the lamp.
    work = np.zeros((9, _BATCH), np.float32)
    # And four texels and two weights in 64ths.
    spot = np.zeros((6, _BATCH), np.int32)
    for start in range(0, face.size, _BATCH):
        end = min(start + _BATCH, face.size)
        f = face[start:end]
        _place(view, rays[start:end], depth_m[start:end], f, faces[1], work)
        _ambient(openness, light, end - start, work)
        _find_lamp(lamps, end - start, work)
        _shine(light, work[0], work[1], work[2], work[3], work[4], work[5], work[8], work[6])
        _find_texels(
            depth_m[start:end],
            f,
            uv[start:end],
            view[4],
            faces,
            materials[1],
            textures[1],
            work[7],
            spot,
        )
        _paint(
            f,
            faces[0],
            materials[0],
            textures[0],
            work[6],
            spot,
            light[-1],
            curves,
            image[start:end],
        )


@njit(**_LOOK)
def _place(view, rays, depth_m, face, face_data, work):  # type: ignore[no-untyped-def]
    """Writes where each pixel's surface is, its normal, and its cosine to the ray."""
    origin, cosine, sine = view[0], view[1], view[2]
    ox, oy, oz = origin[0], origin[1], origin[2]
    for k in range(face.size):
        f = np.uint32(max(face[k], 0))
        depth = depth_m[k] if face[k] >= 0 else _ZERO
        forward, left, up = rays[k, 0], rays[k, 1], rays[k, 2]
        dx, dy = cosine * forward - sine * left, sine * forward + cosine * left
        nx, ny, nz = face_data[f, 0], face_data[f, 1], face_data[f, 2]
        facing = (nx * dx + ny * dy + nz * up) * rays[k, 3]
        side = _ONE if facing <= _ZERO else -_ONE  # a surface has two sides
        work[0, k], work[1, k], work[2, k] = ox + depth * dx, oy + depth * dy, oz + depth * up
        work[3, k], work[4, k], work[5, k] = side * nx, side * ny, side * nz
        work[7, k] = abs(facing)


@njit(**_LOOK)
def _ambient(openness, light, count, work):  # type: ignore[no-untyped-def]
    """Writes what corners leave of the light, as a share."""
    distance, size, origin, per_voxel, reach, slack = openness
    ox, oy, oz = origin[0], origin[1], origin[2]
    corner = light[4]
    for k in range(count):
        free = _sample(
            distance,
            size,
            (work[0, k] + reach * work[3, k] - ox) * per_voxel,
            (work[1, k] + reach * work[4, k] - oy) * per_voxel,
            (work[2, k] + reach * work[5, k] - oz) * per_voxel,
        )
        work[6, k] = corner + (_ONE - corner) * min(_ONE, free * _PER_BYTE + slack)


@njit(**_LOOK)
def _find_lamp(lamps, count, work):  # type: ignore[no-untyped-def]
    """Writes where the lamp is from each place, and its power."""
    places, of_cell, shape, grid_origin, per_cell = lamps
    last_row, last_col = np.float32(shape[0]) - _ONE, np.float32(shape[1]) - _ONE
    left, low, cols = grid_origin[0], grid_origin[1], np.uint32(shape[1])
    for k in range(count):
        x, y, z = work[0, k], work[1, k], work[2, k]
        # A step off the surface: the room is the one in front of it.
        row = min(max((y + _STEP_M * work[4, k] - low) * per_cell, _ZERO), last_row)
        col = min(max((x + _STEP_M * work[3, k] - left) * per_cell, _ZERO), last_col)
        lamp = np.uint32(of_cell[np.uint32(row) * cols + np.uint32(col)])
        work[0, k], work[1, k] = places[lamp, 0] - x, places[lamp, 1] - y
        work[2, k], work[8, k] = places[lamp, 2] - z, places[lamp, 3]


@njit(**_LOOK)
def _shine(light, x, y, z, nx, ny, nz, power, shine):  # type: ignore[no-untyped-def]
    """Multiplies what corners leave by the light from above and of a lamp in that direction.

    Only arithmetic on whole rows, which compilers turn into vector instructions.
    """
    ambient, lamp_share, wrap, spread, _, below, tint, _ = light
    most = lamp_share / (_ONE + wrap)
    for k in range(x.size):
        square = x[k] * x[k] + y[k] * y[k] + z[k] * z[k]
        along = (x[k] * nx[k] + y[k] * ny[k] + z[k] * nz[k]) / np.sqrt(square + _TINY)
        direct = max(_ZERO, along + wrap) * power[k] * most / (_ONE + square * spread)
        sky = ambient * (below + (_ONE - below) * _HALF * (nz[k] + _ONE))
        sky *= _ONE + tint * (nx[k] + _HALF * ny[k])
        shine[k] *= sky + direct


@njit(**_LOOK)
def _find_texels(  # type: ignore[no-untyped-def]
    depth_m, face, uv, pixel_m, faces, copies, places, cosines, spot
):
    """Writes which four texels each pixel lies between and how near to them, -1 for no texture."""
    face_material, face_data = faces
    for k in range(face.size):
        f = np.uint32(max(face[k], 0))
        material = np.uint32(face_material[f])
        if copies[material, 0] < 0:
            spot[0, k] = -1
            continue
        a, b = uv[k, 0], uv[k, 1]
        s = face_data[f, 4] + a * face_data[f, 5] + b * face_data[f, 6]
        t = face_data[f, 7] + a * face_data[f, 8] + b * face_data[f, 9]
        covered = depth_m[k] * pixel_m * face_data[f, 3]
        square = covered * covered / max(cosines[k], _LEAST_COSINE)
        copy = np.uint32(copies[material, 0] + min(_smaller(square), copies[material, 1] - 1))
        start, height, width = places[copy, 0], places[copy, 1], places[copy, 2]
        # Half a texel on: positive numbers are rounded down by cutting off what follows the point.
        x = (s - np.floor(s)) * np.float32(width) + _HALF
        y = (_ONE - (t - np.floor(t))) * np.float32(height) + _HALF
        right, low = np.int32(x), np.int32(y)
        spot[4, k] = np.int32((x - np.float32(right)) * _WEIGHTS)
        spot[5, k] = np.int32((y - np.float32(low)) * _WEIGHTS)
        left = right - 1 if right > 0 else width - 1
        top = low - 1 if low > 0 else height - 1
        right = right if right < width else np.int32(0)
        low = low if low < height else np.int32(0)
        upper, lower = start + top * width, start + low * width
        spot[0, k], spot[1, k] = upper + left, upper + right
        spot[2, k], spot[3, k] = lower + left, lower + right


@njit(**_LOOK)
def _paint(face, face_material, colors, texels, shine, spot, escape, curves, image):  # type: ignore[no-untyped-def]
    """Writes colours: material times texture times light."""
    to_linear, to_srgb = curves
    for k in range(face.size):
        if face[k] < 0:
            image[k, 0] = image[k, 1] = image[k, 2] = escape
            continue
        material = np.uint32(face_material[np.uint32(face[k])])
        light = shine[k] + colors[material, 3]
        red, green, blue = colors[material, 0], colors[material, 1], colors[material, 2]
        if spot[0, k] >= 0:
            color = _texel(texels, spot, k)
            red *= to_linear[(color >> _LANE_3) & _STEP_MASK]
            green *= to_linear[(color >> _LANE_2) & _STEP_MASK]
            blue *= to_linear[(color >> _LANE_1) & _STEP_MASK]
        image[k, 0] = to_srgb[np.uint32(min(_ONE, red * light) * _LEVELS)]
        image[k, 1] = to_srgb[np.uint32(min(_ONE, green * light) * _LEVELS)]
        image[k, 2] = to_srgb[np.uint32(min(_ONE, blue * light) * _LEVELS)]


@njit(**_PART)
def _smaller(square):  # type: ignore[no-untyped-def]
    """How often to halve a texture of which a pixel covers so many texels, until 2 or less.

    Comparisons that are added need no guess about which way a branch goes.
    """
    return (
        int(square > np.float32(2.0))
        + int(square > np.float32(8.0))
        + int(square > np.float32(32.0))
        + int(square > np.float32(128.0))
        + int(square > np.float32(512.0))
        + int(square > np.float32(2048.0))
        + int(square > np.float32(8192.0))
        + int(square > np.float32(32768.0))
    )


@njit(**_PART)
def _sample(distance, size, x, y, z):  # type: ignore[no-untyped-def]
    """The distance at a place between eight cubes, given in cubes from the first one's centre."""
    x = min(max(x, _ZERO), np.float32(size[0]) - _NEARLY_ONE)
    y = min(max(y, _ZERO), np.float32(size[1]) - _NEARLY_ONE)
    z = min(max(z, _ZERO), np.float32(size[2]) - _NEARLY_ONE)
    # Unsigned numbers cannot count from an array's end, which saves asking whether they do.
    i, j, k = np.uint32(x), np.uint32(y), np.uint32(z)
    fx, fy, fz = x - np.float32(i), y - np.float32(j), z - np.float32(k)
    per_y, per_x = np.uint32(size[2]), np.uint32(size[1] * size[2])
    a = i * per_x + j * per_y + k
    b, c, d = a + per_y, a + per_x, a + per_x + per_y
    one = np.uint32(1)
    aa, ab = np.float32(distance[a]), np.float32(distance[a + one])
    ba, bb = np.float32(distance[b]), np.float32(distance[b + one])
    ca, cb = np.float32(distance[c]), np.float32(distance[c + one])
    da, db = np.float32(distance[d]), np.float32(distance[d + one])
    aa, ba, ca, da = (
        aa + fz * (ab - aa),
        ba + fz * (bb - ba),
        ca + fz * (cb - ca),
        da + fz * (db - da),
    )
    aa, ca = aa + fy * (ba - aa), ca + fy * (da - ca)
    return aa + fx * (ca - aa)


@njit(**_PART)
def _texel(texels, spot, k):  # type: ignore[no-untyped-def]
    """The texture's colour between four texels: three lanes of 21 bits, in 4096ths of a byte.

    Colours and weights are whole numbers, so that three channels cost one multiplication a texel.
    """
    fx, fy = np.uint64(spot[4, k]), np.uint64(spot[5, k])
    gx, gy = np.uint64(64) - fx, np.uint64(64) - fy
    return (
        gx * gy * texels[np.uint32(spot[0, k])]
        + fx * gy * texels[np.uint32(spot[1, k])]
        + gx * fy * texels[np.uint32(spot[2, k])]
        + fx * fy * texels[np.uint32(spot[3, k])]
    )
