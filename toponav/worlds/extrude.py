"""Exact small meshes of buildings whose cells are solid from the floor to a height."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int32, UInt8
from scipy import ndimage

from toponav.worlds.grid import GridFrame, SemanticClass
from toponav.worlds.grid_kernels import rectangles_of_labels
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.plan_surfaces import class_surfaces, planar_uv

__all__ = ["extrude", "instances_of", "merge_rectangles"]


def merge_rectangles(mask: Bool[np.ndarray, "rows cols"]) -> Int32[np.ndarray, "rectangles 4"]:
    """Disjoint rectangles that together cover exactly the true cells; few, not fewest.

    Returns:
        row0, col0, row1, col1 of each, ends exclusive.

    Example:
        >>> merge_rectangles(np.array([[True, True], [True, False]])).tolist()
        [[0, 0, 1, 2], [1, 0, 2, 1]]
    """
    rectangles: Int32[np.ndarray, "rectangles 5"] = rectangles_of_labels(mask.astype(np.int32))
    return rectangles[:, :4].copy()


def instances_of(semantics: UInt8[np.ndarray, "rows cols"]) -> Int32[np.ndarray, "rows cols"]:
    """A number for each connected piece of one class; -1 on floor."""
    instances = np.full(semantics.shape, -1, np.int32)
    count = 0
    for value in np.unique(semantics[semantics != SemanticClass.FLOOR]):
        pieces, found = ndimage.label(semantics == value, structure=np.ones((3, 3)))
        instances[pieces > 0] = pieces[pieces > 0] + (count - 1)
        count += found
    return instances


def extrude(
    grid: GridFrame,
    heights_m: Float32[np.ndarray, "rows cols"],
    semantics: UInt8[np.ndarray, "rows cols"],
    ceiling_m: float,
) -> SceneMesh:
    """The surface of all free space between floor and ceiling, with collinear pieces merged.

    The grid's outer edge is closed by a wall, so no ray from free space escapes. Floor and
    ceiling are one rectangle each and run on under walls, which leaves no seam at their feet.

    Args:
        grid: Where the cells lie.
        heights_m: 0 is floor; h is solid from the floor to h.
        semantics: Class of the obstacle in each cell.
        ceiling_m: Height of the ceiling.
    """
    solid = _Solid.of(heights_m, semantics, np.float32(ceiling_m))
    quads = [*_sides(solid), _tops(solid), _slabs(grid, np.float32(ceiling_m))]
    rows, cols, z_m, classes, instances = (
        np.concatenate([quad[part] for quad in quads]) for part in range(5)
    )
    corners = np.stack([rows.ravel(), cols.ravel(), z_m.ravel()], axis=1).astype(np.float64)
    unique, index = np.unique(corners, axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    faces = np.stack([index[:, [0, 1, 2]], index[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    vertices = np.stack(
        [
            grid.origin_m[0] + unique[:, 1] * grid.resolution_m,
            grid.origin_m[1] + unique[:, 0] * grid.resolution_m,
            unique[:, 2],
        ],
        axis=1,
    )
    places, triangles = vertices.astype(np.float32), faces.astype(np.int32)
    semantic = np.repeat(classes, 2).astype(np.uint8)
    return SceneMesh(
        places,
        triangles,
        semantic,
        np.repeat(instances, 2).astype(np.int32),
        semantic.astype(np.int32),
        planar_uv(places, triangles, semantic),
        tuple(each.material for each in class_surfaces()),
    )


# Rows, columns and heights of the four corners, counter-clockwise from free space, then the
# class and the instance of each quad.
_Quads = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class _Solid:
    """The cells with a ring of outer wall around them."""

    heights_m: np.ndarray
    semantics: np.ndarray
    instances: np.ndarray

    @staticmethod
    def of(heights_m: np.ndarray, semantics: np.ndarray, ceiling_m: np.float32) -> "_Solid":
        solid = np.where(heights_m > 0, semantics, np.uint8(SemanticClass.FLOOR))
        instances = instances_of(solid)
        return _Solid(
            np.pad(heights_m, 1, constant_values=ceiling_m),
            np.pad(solid, 1, constant_values=np.uint8(SemanticClass.WALL)),
            np.pad(instances, 1, constant_values=instances.max() + 1),
        )


def _sides(solid: _Solid) -> list[_Quads]:
    """Vertical quads wherever two neighbours differ in height, merged along straight runs."""
    quads = []
    for along_rows in (True, False):
        # Turn the grid so that the edges to merge always run down the first axis.
        turn = (lambda a: a) if along_rows else np.transpose
        heights = turn(solid.heights_m)[1:-1]
        classes = turn(solid.semantics)[1:-1]
        instances = turn(solid.instances)[1:-1]
        for faces_right in (True, False):
            high, low = (
                (np.s_[:, :-1], np.s_[:, 1:]) if faces_right else (np.s_[:, 1:], np.s_[:, :-1])
            )
            exists = heights[high] > heights[low]
            keys = (heights[high], heights[low], instances[high], classes[high])
            start, end, line = _runs(exists, keys)
            top, bottom, instance, kind = (key[start, line] for key in keys)
            near, far = (start, end) if faces_right == along_rows else (end, start)
            edge = np.stack([line] * 4, axis=1)
            run = np.stack([near, far, far, near], axis=1)
            z_m = np.stack([bottom, bottom, top, top], axis=1)
            rows, cols = (run, edge) if along_rows else (edge, run)
            quads.append((rows, cols, z_m, kind, instance))
    return quads


def _runs(
    exists: np.ndarray, keys: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First row, end row and column of each vertical run over which all keys stay equal."""
    same = exists[1:] & exists[:-1]
    for key in keys:
        same &= key[1:] == key[:-1]
    edge = np.zeros((1, exists.shape[1]), bool)
    starts = exists & ~np.concatenate([edge, same])
    ends = exists & ~np.concatenate([same, edge])
    line, start = np.nonzero(starts.T)
    _, last = np.nonzero(ends.T)
    return start, last + 1, line


def _tops(solid: _Solid) -> _Quads:
    """Horizontal quads on everything lower than the ceiling, merged to rectangles."""
    heights, instances = solid.heights_m[1:-1, 1:-1], solid.instances[1:-1, 1:-1]
    open_top = (heights > 0) & (heights < solid.heights_m[0, 0])
    pairs = np.stack([heights[open_top], instances[open_top]], axis=1).astype(np.float64)
    labels = np.zeros(heights.shape, np.int32)
    labels[open_top] = np.unique(pairs, axis=0, return_inverse=True)[1].ravel() + 1
    row0, col0, row1, col1, _ = rectangles_of_labels(labels).T
    top = heights[row0, col0]
    return (
        np.stack([row0, row0, row1, row1], axis=1),
        np.stack([col0, col1, col1, col0], axis=1),
        np.stack([top] * 4, axis=1),
        solid.semantics[1:-1, 1:-1][row0, col0],
        instances[row0, col0],
    )


def _slabs(grid: GridFrame, ceiling_m: np.float32) -> _Quads:
    """The floor and the ceiling over the whole grid."""
    rows, cols = grid.shape
    return (
        np.array([[0, 0, rows, rows], [0, rows, rows, 0]]),
        np.array([[0, cols, cols, 0], [0, 0, cols, cols]]),
        np.array([[0] * 4, [ceiling_m] * 4], np.float32),
        np.array([SemanticClass.FLOOR, SemanticClass.CEILING], np.uint8),
        np.array([-1, -1], np.int32),
    )
