"""What shading needs to know of a building, worked out once when the first colour is asked for."""

import math
import weakref
from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, Int32, UInt8, UInt64
from PIL import Image
from scipy import ndimage

from toponav.sim.render.ambient_kernels import distance_within, mark_triangles
from toponav.worlds.materials import distinct_textures
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Scene

__all__ = ["REACH_M", "Lamps", "Surfaces", "surfaces_of"]

REACH_M = 0.35
"""How far from a corner it gets darker."""

_VOXEL_M = 0.07
_MOST_VOXELS = 8_000_000
_LARGEST_TEXTURE_PX = 1024
_LAMP_SPACING_M = 6.0
_LAMP_BELOW_CEILING_M = 0.3


class Textures(NamedTuple):
    """Every texture in smaller and smaller copies, in one piece of memory.

    Attributes:
        texels: sRGB colours of all copies, one image after another, each with a border of one
            texel that repeats those of the other side; red, green and blue from bits 42, 21 and
            0, which leaves room to multiply them by weights all at once.
        place: First texel of the border, and height and width without it, of each copy; the
            last copy is one white texel, for materials without a texture.
        of_material: First copy, and number of copies, of each material's texture; -1 and 0 for
            none.
    """

    texels: UInt64[np.ndarray, " texels"]
    place: Int32[np.ndarray, "copies 3"]
    of_material: Int32[np.ndarray, "materials 2"]


class Lamps(NamedTuple):
    """A lamp under the ceiling of each room, several in large ones.

    Attributes:
        place_m: Where each is, and its power: 1, or 0 for a building without rooms.
        of_cell: The lamp that lights each cell of the scene's grid.
    """

    place_m: Float32[np.ndarray, "lamps 4"]
    of_cell: Int32[np.ndarray, "rows cols"]


class Openness(NamedTuple):
    """Distance to the nearest surface on a grid of cubes.

    Attributes:
        distance: 255 stands for `REACH_M` and more.
        corners: The distances of each cube and of its neighbours in z, in y and in both, from
            the lowest byte up.
        origin_m: Centre of the first cube.
        voxel_m: Side of a cube.
    """

    distance: UInt8[np.ndarray, "x y z"]
    corners: Int32[np.ndarray, " cubes"]
    origin_m: Float32[np.ndarray, "3"]
    voxel_m: float


class Surfaces(NamedTuple):
    """All that shading reads of a scene.

    Attributes:
        face_data: Of each face: the unit normal, texels per metre in the largest copy of its
            texture, the place in the texture of the first corner as u and what the two
            barycentric coordinates add to it, the same as v, linear colour, glow; and, as whole
            numbers, the first copy of its texture and how many smaller ones there are. These 64
            bytes are one line of the processor's cache.
        textures: What is painted on them.
        openness: How far from corners a place is.
        lamps: Where light comes from.
    """

    face_data: Float32[np.ndarray, "faces 16"]
    textures: Textures
    openness: Openness
    lamps: Lamps


_KNOWN: "weakref.WeakKeyDictionary[Scene, Surfaces]" = weakref.WeakKeyDictionary()


def surfaces_of(scene: Scene) -> Surfaces:
    """The scene's surfaces; worked out once a scene, a tenth of a second to two seconds."""
    if scene not in _KNOWN:
        mesh = scene.mesh
        textures = _copies(mesh)
        _KNOWN[scene] = Surfaces(
            face_data=_face_data(mesh, textures),
            textures=textures,
            openness=_openness(mesh),
            lamps=_lamps(scene),
        )
    return _KNOWN[scene]


def _face_data(mesh: SceneMesh, textures: Textures) -> np.ndarray:
    """`Surfaces.face_data`; a face without area looks up."""
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice_area = np.linalg.norm(normal, axis=1)
    flat = twice_area < 1e-12
    normal[flat] = (0.0, 0.0, 1.0)
    normal /= np.where(flat, 1.0, twice_area)[:, None]
    uv = mesh.corner_uv.astype(np.float64)
    # Whole repeats make no difference, and small numbers are exact.
    uv -= np.floor(uv[:, :1])
    add_a, add_b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    twice_repeats = np.abs(add_a[:, 0] * add_b[:, 1] - add_b[:, 0] * add_a[:, 1])
    first = textures.of_material[mesh.face_material, 0]
    size = textures.place[first, 1].astype(np.float64) * textures.place[first, 2]
    texels_m = np.sqrt(twice_repeats * size / np.maximum(twice_area, 1e-12))
    data = _on_cache_lines(len(mesh.faces))
    data[:, :3] = normal
    data[:, 3] = np.where(first >= 0, texels_m, 0.0)
    data[:, 4:7] = np.stack([uv[:, 0, 0], add_a[:, 0], add_b[:, 0]], axis=1)
    data[:, 7:10] = np.stack([uv[:, 0, 1], add_a[:, 1], add_b[:, 1]], axis=1)
    color = np.array([(*each.color, each.emission) for each in mesh.materials], np.float32)
    data[:, 10:14] = color[mesh.face_material]
    white = len(textures.place) - 1
    smaller = np.maximum(textures.of_material[mesh.face_material, 1] - 1, 0)
    data.view(np.int32)[:, 14:] = np.stack([np.where(first < 0, white, first), smaller], axis=1)
    return data


def _on_cache_lines(rows: int) -> Float32[np.ndarray, "rows 16"]:
    """Zeros in rows of 64 bytes that begin where the processor's cache lines do."""
    room = np.zeros(16 * rows + 16, np.float32)
    start = (-room.ctypes.data // 4) % 16
    return room[start : start + 16 * rows].reshape(rows, 16)


def _copies(mesh: SceneMesh) -> Textures:
    """Each texture at its own size, half, a quarter and so on (a mip map)."""
    textures, numbers = distinct_textures(mesh.materials)
    texels: list[np.ndarray] = []
    place: list[tuple[int, int, int]] = []
    starts, counts, at = [], [], 0
    for texture in textures:
        image = Image.fromarray(texture)
        if max(image.size) > _LARGEST_TEXTURE_PX:
            image.thumbnail((_LARGEST_TEXTURE_PX, _LARGEST_TEXTURE_PX), Image.Resampling.BOX)
        starts.append(len(place))
        while True:
            pixels = np.asarray(image)
            place.append((at, pixels.shape[0], pixels.shape[1]))
            bordered = np.pad(pixels, ((1, 1), (1, 1), (0, 0)), mode="wrap")
            texels.append(bordered.reshape(-1, 3))
            at += len(texels[-1])
            if max(image.size) == 1:
                break
            half = (max(1, image.width // 2), max(1, image.height // 2))
            image = image.resize(half, Image.Resampling.BOX)
        counts.append(len(place) - starts[-1])
    texels.append(np.full((9, 3), 255, np.uint8))
    place.append((at, 1, 1))
    pixels = np.concatenate(texels).astype(np.uint64)
    lanes = np.array([42, 21, 0], np.uint64)
    return Textures(
        np.bitwise_or.reduce(pixels << lanes, axis=1),
        np.array(place, np.int32),
        np.array([(-1, 0) if n is None else (starts[n], counts[n]) for n in numbers], np.int32),
    )


def _openness(mesh: SceneMesh) -> Openness:
    """Distance to the nearest surface, up to the reach, around the whole mesh."""
    used = mesh.vertices_m[mesh.faces.ravel()]
    lowest = used.min(axis=0).astype(np.float64) - REACH_M
    size_m = used.max(axis=0).astype(np.float64) + REACH_M - lowest
    voxel_m = max(_VOXEL_M, float(np.cbrt(np.prod(size_m) / _MOST_VOXELS)))
    marked = np.zeros(np.ceil(size_m / voxel_m).astype(int) + 1, np.uint8)
    mark_triangles(mesh.vertices_m[mesh.faces], lowest, voxel_m, marked)
    squared = distance_within(marked, math.ceil(REACH_M / voxel_m) + 1)
    distance_m = np.sqrt(np.arange(60001, dtype=np.float64)) * voxel_m
    as_byte = np.rint(np.minimum(distance_m / REACH_M, 1.0) * 255).astype(np.uint8)
    distance = as_byte[np.minimum(squared, 60000)]
    beside = np.pad(distance, ((0, 0), (0, 1), (0, 1)), mode="edge")
    four = np.stack(
        [beside[:, :-1, :-1], beside[:, :-1, 1:], beside[:, 1:, :-1], beside[:, 1:, 1:]], axis=-1
    )
    corners = np.ascontiguousarray(four).view("<i4").astype(np.int32, copy=False).reshape(-1)
    return Openness(distance, corners, (lowest + voxel_m / 2).astype(np.float32), voxel_m)


def _lamps(scene: Scene) -> Lamps:
    """Lamps at even distances in each room; a cell outside rooms has that of the nearest."""
    height_m = scene.ceiling_m - min(_LAMP_BELOW_CEILING_M, scene.ceiling_m / 4)
    room_index = scene.room_index.astype(np.int32)
    of_cell = np.full(scene.grid.shape, -1, np.int32)
    places: list[tuple[float, float, float, float]] = []
    spacing = _LAMP_SPACING_M / scene.grid.resolution_m
    for number, box in enumerate(ndimage.find_objects(room_index + 1)):
        if box is None:
            continue
        inside = room_index[box] == number
        tiles = [math.ceil(side / spacing) for side in inside.shape]
        row, col = np.nonzero(inside)
        tile = (row * tiles[0] // inside.shape[0]) * tiles[1] + col * tiles[1] // inside.shape[1]
        kinds, which = np.unique(tile, return_inverse=True)
        of_cell[box][inside] = len(places) + which
        for k in range(len(kinds)):
            x_m, y_m = scene.grid.center_of(0, 0)
            x_m += float(col[which == k].mean() + box[1].start) * scene.grid.resolution_m
            y_m += float(row[which == k].mean() + box[0].start) * scene.grid.resolution_m
            places.append((x_m, y_m, height_m, 1.0))
    if not places:
        return Lamps(np.zeros((1, 4), np.float32), np.zeros_like(of_cell))
    nowhere = of_cell < 0
    nearest = ndimage.distance_transform_edt(nowhere, return_distances=False, return_indices=True)
    return Lamps(
        np.array(places, np.float32),
        np.ascontiguousarray(of_cell[tuple(nearest)]),
    )
