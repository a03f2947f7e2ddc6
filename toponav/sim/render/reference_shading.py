"""The slow and obvious colour of one pixel, to test the compiled one against.

It shares what was worked out once for the scene (`surfaces.py`) and nothing else.
"""

import math

import numpy as np
from jaxtyping import Float

from toponav.sim.render.shading import LIGHT
from toponav.sim.render.surfaces import REACH_M, Surfaces, surfaces_of
from toponav.worlds.scene import Scene

__all__ = ["color_of"]

_STEP_M = 0.06


def color_of(
    scene: Scene,
    face: int,
    uv: tuple[float, float],
    place_m: Float[np.ndarray, "3"],
    ray: Float[np.ndarray, "3"],
    pixel_width_m: float,
) -> np.ndarray:
    """The sRGB bytes of a pixel.

    Args:
        scene: The building.
        face: The face that it shows, or -1.
        uv: Barycentric coordinates of the place on the face.
        place_m: The place.
        ray: Direction from the camera.
        pixel_width_m: What a pixel covers at that depth, seen face on.
    """
    if face < 0:
        return np.full(3, LIGHT.escape, np.uint8)
    surfaces = surfaces_of(scene)
    normal = surfaces.face_data[face, :3].astype(np.float64)
    cosine = -float(normal @ ray) / float(np.linalg.norm(ray))
    if cosine < 0:
        normal, cosine = -normal, -cosine
    number = int(scene.mesh.face_material[face])
    material = scene.mesh.materials[number]
    shine = _light(surfaces, scene, place_m, normal) + material.emission
    albedo = np.array(material.color)
    if material.texture is not None:
        a, b = uv
        weights = np.array([1 - a - b, a, b])
        s, t = weights @ scene.mesh.corner_uv[face].astype(np.float64)
        covered = pixel_width_m * float(surfaces.face_data[face, 3])
        covered /= math.sqrt(max(cosine, 1e-3))
        albedo = albedo * _linear(_texture(surfaces, number, s, t, covered) / 255)
    return np.asarray(np.rint(_srgb(np.minimum(albedo * shine, 1.0)) * 255), np.uint8)


def _light(surfaces: Surfaces, scene: Scene, place: np.ndarray, normal: np.ndarray) -> float:
    """Light that arrives at a place on a surface."""
    openness, lamps = surfaces.openness, surfaces.lamps
    off = (place + REACH_M * normal - openness.origin_m) / openness.voxel_m
    off = np.clip(off, 0, np.array(openness.distance.shape) - 1.001)
    low = off.astype(int)
    free = 0.0
    for corner in np.ndindex(2, 2, 2):
        share = np.where(corner, off - low, 1 - (off - low)).prod()
        free += share * float(openness.distance[tuple(low + corner)])
    free = min(1.0, free / 255 + openness.voxel_m / REACH_M)
    front = place[:2] + _STEP_M * normal[:2]
    row, col = scene.grid.cell_of(float(front[0]), float(front[1]))
    row, col = np.clip(row, 0, scene.grid.rows - 1), np.clip(col, 0, scene.grid.cols - 1)
    lamp = lamps.of_cell[row, col]
    to_lamp = lamps.place_m[lamp, :3] - place
    square = float(to_lamp @ to_lamp)
    facing = float(to_lamp @ normal) / math.sqrt(square + 1e-6)
    direct = max(0.0, (facing + LIGHT.wrap) / (1 + LIGHT.wrap))
    direct *= float(lamps.place_m[lamp, 3]) * LIGHT.lamp / (1 + square * LIGHT.spread_m2)
    sky = LIGHT.ambient * (LIGHT.below + (1 - LIGHT.below) * (normal[2] + 1) / 2)
    sky *= 1 + LIGHT.tint * (normal[0] + normal[1] / 2)
    return float((sky + direct) * (LIGHT.corner + (1 - LIGHT.corner) * free))


def _texture(surfaces: Surfaces, material: int, s: float, t: float, covered: float) -> np.ndarray:
    """Bytes of a texture between its four nearest texels, in the copy that fits the pixel."""
    textures = surfaces.textures
    first, count = textures.of_material[material]
    copy = max(0, math.ceil(math.log2(max(covered, 1e-9) / math.sqrt(2))))
    start, height, width = textures.place[first + min(copy, count - 1, 8)]
    bordered = textures.texels[start : start + (height + 2) * (width + 2)]
    texels = bordered.reshape(height + 2, width + 2, 1)[1:-1, 1:-1]
    image = (texels >> np.array([42, 21, 0], np.uint64) & np.uint64(255)).astype(float)
    x, y = (s % 1.0) * width - 0.5, (1.0 - t % 1.0) * height - 0.5
    left, top = math.floor(x), math.floor(y)
    color = np.zeros(3)
    for down, right in np.ndindex(2, 2):
        share = (x - left if right else left + 1 - x) * (y - top if down else top + 1 - y)
        color += share * image[(top + down) % height, (left + right) % width]
    return color


def _linear(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _srgb(linear: np.ndarray) -> np.ndarray:
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
