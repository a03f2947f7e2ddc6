"""Triangle meshes by the extension of their file, brought to metres with z up."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError
from toponav.worlds.load.collada import read_collada
from toponav.worlds.load.levels import flat_faces
from toponav.worlds.load.mesh_parts import MeshFile, MeshPart, Notes, move_part
from toponav.worlds.load.source_files import SourceFiles
from toponav.worlds.load.triangle_files import read_gltf, read_ply, read_stl
from toponav.worlds.load.wavefront import read_obj

__all__ = ["MESH_SUFFIXES", "UNITS_M", "UP_AXES", "read_mesh", "upright"]

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
UP_AXES = ("x", "y", "z", "-x", "-y", "-z")

_READERS: dict[str, Callable[[SourceFiles, str, Notes], MeshFile]] = {
    ".glb": lambda files, name, notes: read_gltf(files, name, notes),
    ".gltf": lambda files, name, notes: read_gltf(files, name, notes),
    ".obj": lambda files, name, notes: MeshFile(read_obj(files, name, notes)),
    ".dae": lambda files, name, notes: read_collada(files, name, notes),
    ".ply": lambda files, name, notes: read_ply(files, name),
    ".stl": lambda files, name, notes: read_stl(files, name),
}
MESH_SUFFIXES = tuple(_READERS)


def read_mesh(files: SourceFiles, name: str, notes: Notes) -> MeshFile:
    """What a mesh file holds, in its own frame.

    Raises:
        InputError: It is of no known kind, broken, or too large.
    """
    suffix = name[name.rfind(".") :].lower() if "." in name else ""
    if suffix not in _READERS:
        raise InputError(
            f"meshes are {', '.join(MESH_SUFFIXES)}, got {suffix[:20] or 'no extension'!r}",
            where=f"{files.label}/{name}",
            remedy="convert it to GLB",
        )
    return _READERS[suffix](files, name, notes)


def upright(
    mesh: MeshFile, notes: Notes, *, unit_m: float | None = None, up: str | None = None
) -> list[MeshPart]:
    """The parts in metres, z up.

    Args:
        mesh: What a file holds.
        notes: Where it is written down what was assumed.
        unit_m: Length of the file's unit; default what the file says, else a metre.
        up: Axis that points up, one of `UP_AXES`; default what the file says, else the one
            across which the largest flat surface lies, as floors do.
    """
    scale = unit_m if unit_m is not None else mesh.unit_m
    if scale is None:
        scale = 1.0
        notes.add("the file does not say its unit: metres (--units to change)")
    axis = up if up is not None else mesh.up
    if axis is None:
        axis = "xyz"[_flattest(mesh.parts)]
        notes.add(f"the file does not say which way is up: {axis} (--up to change)")
    matrix = np.eye(4)
    matrix[:3, :3] = _turn(axis.lower()) * scale
    return [move_part(part, matrix) for part in mesh.parts]


def _turn(axis: str) -> Float[np.ndarray, "3 3"]:
    """The rotation that brings an axis to z."""
    sign = -1.0 if axis.startswith("-") else 1.0
    place = "xyz".index(axis[-1])
    if place == 2:
        return np.diag([1.0, sign, sign])
    turned = np.zeros((3, 3))
    turned[2, place] = sign
    if place == 1:
        turned[0, 0], turned[1, 2] = 1.0, -sign
    else:
        turned[0, 2], turned[1, 1] = -sign, 1.0
    return turned


def _flattest(parts: Sequence[MeshPart]) -> int:
    """The axis across which the most surface lies in one plane; z where several do."""
    best, most = 2, 0.0
    for axis in (2, 1, 0):
        found = [_finite_flat(part, axis) for part in parts]
        area = np.concatenate([part[0] for part in found] or [np.zeros(0)])
        height = np.concatenate([part[1] for part in found] or [np.zeros(0)])
        if not len(area):
            continue
        # As many bins whatever the unit.
        span = max(float(np.ptp(height)), 1e-9)
        bins = np.floor((height - height.min()) / span * 200).astype(np.int64)
        peak = float(np.bincount(bins, weights=area).max())
        if peak > 1.05 * most:
            best, most = axis, peak
    return best


def _finite_flat(part: MeshPart, axis: int) -> tuple[np.ndarray, np.ndarray]:
    good = np.asarray(((part.faces >= 0) & (part.faces < len(part.vertices))).all(axis=1))
    with np.errstate(all="ignore"):
        area, height = flat_faces(part.vertices, part.faces[good], axis)
    finite = np.isfinite(area) & np.isfinite(height)
    return area[finite], height[finite]
