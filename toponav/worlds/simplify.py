"""Fewer triangles for a mesh that has more than anyone needs."""

import numpy as np
from jaxtyping import Float, Int

from toponav.worlds.mesh import SceneMesh

__all__ = ["simplify_mesh"]

_TRIES, _ENOUGH = 10, 4


def simplify_mesh(mesh: SceneMesh, max_faces: int) -> SceneMesh:
    """The mesh with at most so many triangles, its corners drawn together cell by cell.

    Space is cut into cubes, as small as the number of triangles allows; the corners in one
    cube become one, their mean, and triangles that lose a side vanish. Classes, instances,
    materials and places in textures stay with their triangles. Equal meshes give equal results
    on every machine.

    Reference:
        Rossignac and Borrel 1993, multi-resolution 3D approximations (vertex clustering).
    """
    if len(mesh.faces) <= max_faces:
        return mesh
    vertices = mesh.vertices_m.astype(np.float64)
    low = vertices.min(axis=0)
    sides = np.diff(vertices[mesh.faces], axis=1)
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    smallest = max(float(np.ptp(vertices, axis=0).max()) * 1e-5, 1e-9)
    size = max(float(np.sqrt(area / max_faces)), smallest)
    best: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
    for number in range(_TRIES):
        result = _clustered(mesh, vertices, low, size)
        count = len(result[1])
        if count <= max_faces and (best is None or count > len(best[1])):
            best = result
        if 0.85 * max_faces <= count <= max_faces or (best is not None and number >= _ENOUGH):
            break
        # A surface crosses one cube for each square of its side.
        step = float(np.clip(np.sqrt(max(count, 1) / (0.92 * max_faces)), 0.5, 2.0))
        size = max(size * (step if count <= max_faces else max(step, 1.05)), smallest)
    while best is None:
        size *= 2
        result = _clustered(mesh, vertices, low, size)
        best = result if len(result[1]) <= max_faces else None
    corners, faces, kept = best
    return SceneMesh(
        corners.astype(np.float32),
        faces.astype(np.int32),
        mesh.face_semantic[kept],
        mesh.face_instance[kept],
        mesh.face_material[kept],
        mesh.corner_uv[kept],
        mesh.materials,
    )


def _clustered(
    mesh: SceneMesh,
    vertices: Float[np.ndarray, "vertices 3"],
    low: Float[np.ndarray, " 3"],
    size: float,
) -> tuple[Float[np.ndarray, "corners 3"], Int[np.ndarray, "kept 3"], Int[np.ndarray, " kept"]]:
    """Corners, triangles, and which of the old triangles they were, for cubes of this size."""
    cell = np.floor((vertices - low) / size).astype(np.int64)
    span = cell.max(axis=0) + 1
    key = (cell[:, 0] * span[1] + cell[:, 1]) * span[2] + cell[:, 2]
    _, group = np.unique(key, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group)
    corners = np.stack(
        [np.bincount(group, weights=vertices[:, axis]) / count for axis in range(3)], axis=1
    )
    faces = group[mesh.faces]
    whole = (
        (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 0] != faces[:, 2])
    )
    kept = np.flatnonzero(whole)
    if len(kept):
        # Of triangles that fell together the first stays, whichever way it looks.
        alike = np.sort(faces[kept], axis=1)
        _, first = np.unique(alike, axis=0, return_index=True)
        kept = kept[np.sort(first)]
    used, local = np.unique(faces[kept], return_inverse=True)
    return corners[used], local.reshape(-1, 3), kept
