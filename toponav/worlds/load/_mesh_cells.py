"""What the columns over a mesh's floor say about each cell."""

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.worlds.grid import GridFrame, SemanticClass
from toponav.worlds.grid_kernels import distance_to_solid
from toponav.worlds.load.levels import Columns, columns_over
from toponav.worlds.load.mesh_parts import Notes
from toponav.worlds.mesh import SceneMesh

__all__ = ["ceiling_over", "classify_faces", "floor_bounds", "obstacle_heights", "open_floor"]

_EIGHT = np.ones((3, 3), bool)
_MARGIN_M = 0.3
_HOLE_M = 0.25
_LEAST_FLOOR_M2, _ROBOT_RADIUS_M = 0.4, 0.18
_COARSE_CELLS = 1_000_000
_UNKNOWN_CHUNK = 1_000_000


def floor_bounds(
    mesh: SceneMesh, where: str
) -> tuple[Float[np.ndarray, " 2"], Float[np.ndarray, " 2"]]:
    """The corners of the plan: where the floor at z = 0 is, without scattered fragments."""
    z = mesh.vertices_m[:, 2][mesh.faces]
    near = mesh.faces[(z.max(axis=1) > -0.2) & (z.min(axis=1) < 3.0)]
    corners = mesh.vertices_m[np.unique(near), :2].astype(np.float64)
    if not len(corners):
        raise InputError(
            "has nothing at the height of its floor", where=where, remedy="check --floor-height"
        )
    low, high = corners.min(axis=0), corners.max(axis=0)
    cell_m = max(0.2, float(np.sqrt(np.prod(high - low + 1e-9) / _COARSE_CELLS)))
    cell_m = max(cell_m, float((high - low).max()) / 5000)
    if cell_m > 10:
        return low, high  # No building: the caller says so.
    coarse = columns_over(mesh.vertices_m, near, 0.0, low, high, cell_m)
    pieces, count = ndimage.label(coarse.floor | coarse.blocked, structure=_EIGHT)
    if not count:
        return low, high
    floor_cells = np.bincount(pieces[coarse.floor], minlength=count + 1)
    floor_cells[0] = 0
    kept = floor_cells >= max(0.02 * floor_cells.max(), 1)
    kept[0] = False
    rows, cols = np.nonzero(kept[pieces])
    if not len(rows):
        return low, high
    origin = np.array(coarse.grid.origin_m)
    first = origin + np.array([cols.min(), rows.min()]) * cell_m - _MARGIN_M
    last = origin + np.array([cols.max() + 1, rows.max() + 1]) * cell_m + _MARGIN_M
    return np.maximum(first, low - 0.05), np.minimum(last, high + 0.05)


def open_floor(
    columns: Columns, structure: Bool[np.ndarray, "rows cols"], notes: Notes
) -> tuple[Bool[np.ndarray, "rows cols"], Bool[np.ndarray, "rows cols"]]:
    """Cells that a robot can use, and cells that belong to the building's inside.

    Small holes in the floor of a scan are closed. Floor with something solid just above it,
    walled in all round, is the inside of a piece of furniture or of a wall; so is floor on which
    no robot has room.
    """
    grid = columns.grid
    reach = max(round(_HOLE_M / grid.resolution_m), 1)
    covered = columns.floor | columns.blocked
    closed = _close(covered, reach)
    if closed.sum() > covered.sum() + 20:
        notes.add("small holes in the floor closed")
    inside = closed
    free = inside & ~columns.blocked
    low_roof = columns.filled(0.1, 1.5) > 0
    pieces, count = ndimage.label(free)
    area_m2 = np.bincount(pieces.ravel(), minlength=count + 1) * grid.resolution_m**2
    roofed = np.bincount(pieces.ravel(), weights=low_roof.ravel(), minlength=count + 1)
    share = roofed * grid.resolution_m**2 / np.maximum(area_m2, 1e-9)
    half_m = np.zeros(count + 1)
    np.maximum.at(half_m, pieces.ravel(), distance_to_solid(~free).ravel())
    wide = half_m * grid.resolution_m > _ROBOT_RADIUS_M
    good = (area_m2 >= _LEAST_FLOOR_M2) & (share < 0.5) & wide
    good[0] = False
    return good[pieces], inside


def _close(mask: np.ndarray, reach: int) -> np.ndarray:
    """The mask with gaps of up to twice the reach closed, without growing outwards."""
    padded = np.pad(mask, reach + 1)
    near = ndimage.distance_transform_edt(~padded) <= reach
    closed = ndimage.distance_transform_edt(near) > reach
    inner: np.ndarray = (closed | padded)[reach + 1 : -reach - 1, reach + 1 : -reach - 1]
    return inner


def ceiling_over(
    columns: Columns, free: Bool[np.ndarray, "rows cols"], structure: Bool[np.ndarray, "rows cols"]
) -> float:
    """The height of the ceiling: over most of the floor, or else of the walls."""
    over = columns.over_m[free]
    seen = over[np.isfinite(over)]
    if len(seen) >= 0.3 * max(len(over), 1):
        height = float(np.percentile(seen, 60))
    else:
        tops = columns.stack_top_m()[structure]
        height = float(np.percentile(tops, 90)) if len(tops) else 2.5
    return round(float(np.clip(height, 1.9, 50.0)), 2)


def obstacle_heights(
    columns: Columns,
    mesh: SceneMesh,
    free: Bool[np.ndarray, "rows cols"],
    inside: Bool[np.ndarray, "rows cols"],
    ceiling_m: float,
) -> tuple[Float32[np.ndarray, "rows cols"], UInt8[np.ndarray, "rows cols"]]:
    """Height and class of what stands in each cell; outside all is solid."""
    top = np.maximum(columns.stack_top_m(), np.float32(0.1))
    top = np.where(top > ceiling_m - 0.25, np.float32(ceiling_m), top)
    kinds = np.append(mesh.face_semantic, np.uint8(SemanticClass.FURNITURE))[columns.owner]
    # A rug that a robot would bump into is an obstacle all the same.
    flat = (kinds == SemanticClass.FLOOR) | (kinds == SemanticClass.CEILING)
    kinds = np.where(flat, np.uint8(SemanticClass.FURNITURE), kinds)
    hollow = inside & ~free & ~columns.blocked
    if hollow.any() and columns.blocked.any():
        row, col = ndimage.distance_transform_edt(
            ~columns.blocked, return_distances=False, return_indices=True
        )
        kinds = np.where(hollow, kinds[row, col], kinds)
        top = np.where(hollow, np.maximum(top, top[row, col]), top)
    kinds = np.where(inside, kinds, np.uint8(SemanticClass.WALL))
    top = np.where(inside, top, np.float32(ceiling_m))
    heights_m = np.where(free, np.float32(0), np.minimum(top, np.float32(ceiling_m)))
    semantics = np.where(free, np.uint8(SemanticClass.FLOOR), kinds)
    return heights_m.astype(np.float32), semantics.astype(np.uint8)


def classify_faces(
    mesh: SceneMesh,
    known: Bool[np.ndarray, " faces"],
    grid: GridFrame,
    structure: Bool[np.ndarray, "rows cols"],
    blocked: Bool[np.ndarray, "rows cols"],
    ceiling_m: float,
) -> SceneMesh:
    """The mesh with classes and instances by position for triangles that carry no label."""
    if known.all():
        return mesh
    semantic, instance = mesh.face_semantic.copy(), mesh.face_instance.copy()
    walls = ndimage.binary_dilation(structure, _EIGHT)
    things, _ = ndimage.label(ndimage.binary_dilation(blocked & ~structure, _EIGHT), _EIGHT)
    first_free = int(instance.max(initial=0)) + 1
    unknown = np.flatnonzero(~known)
    for start in range(0, len(unknown), _UNKNOWN_CHUNK):
        chosen = unknown[start : start + _UNKNOWN_CHUNK]
        corners = mesh.vertices_m[mesh.faces[chosen]].astype(np.float64)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat = np.abs(normal[:, 2]) > 0.7 * np.linalg.norm(normal, axis=1)
        middle = corners.mean(axis=1)
        cell = np.floor((middle[:, :2] - grid.origin_m) / grid.resolution_m).astype(int)
        col = np.clip(cell[:, 0], 0, grid.cols - 1)
        row = np.clip(cell[:, 1], 0, grid.rows - 1)
        kinds = np.where(walls[row, col], SemanticClass.WALL, SemanticClass.FURNITURE)
        kinds = np.where(
            flat & (middle[:, 2] > ceiling_m - 0.2) & (middle[:, 2] > 1.8),
            SemanticClass.CEILING,
            kinds,
        )
        kinds = np.where(flat & (np.abs(middle[:, 2]) < 0.12), SemanticClass.FLOOR, kinds)
        semantic[chosen] = kinds
        numbers = np.where(kinds == SemanticClass.FURNITURE, first_free + things[row, col], -1)
        numbers = np.where(kinds == SemanticClass.WALL, first_free, numbers)
        instance[chosen] = numbers
    return SceneMesh(
        mesh.vertices_m,
        mesh.faces,
        semantic,
        instance,
        mesh.face_material,
        mesh.corner_uv,
        mesh.materials,
    )
