"""The arrays of a saved scene, read without trusting the file."""

import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.errors import InputError
from toponav.worlds.grid import GridFrame

__all__ = ["read_arrays"]

_MAX_ITEMS = 200_000_000


def read_arrays(path: Path, grid: GridFrame, extruded: bool) -> dict[str, np.ndarray]:
    """The arrays of a scene, of exactly these types and sizes; nothing else is read."""
    wanted: dict[str, tuple[str, tuple[int | None, ...]]] = {
        "heights_m": ("<f4", grid.shape),
        "room_index": ("<i2", grid.shape),
        "semantics": ("|u1", grid.shape),
    }
    if not extruded:
        wanted |= {
            "mesh_vertices_m": ("<f4", (None, 3)),
            "mesh_faces": ("<i4", (None, 3)),
            "mesh_face_semantic": ("|u1", (None,)),
            "mesh_face_instance": ("<i4", (None,)),
        }
    arrays = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for name, (dtype, shape) in wanted.items():
                arrays[name] = _read_npy(archive, name, np.dtype(dtype), shape)
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror or error})",
            where=str(path),
            remedy="copy the folder again or generate the scene again",
        ) from None
    except Exception as error:  # Damaged zip files fail in a dozen ways.
        raise InputError(
            f"does not hold the scene's arrays ({error})",
            where=str(path),
            remedy="copy the folder again or generate the scene again",
        ) from None
    return arrays


def _read_npy(
    archive: zipfile.ZipFile, name: str, dtype: np.dtype[Any], shape: tuple[int | None, ...]
) -> np.ndarray:
    """One array, its header checked before any memory is taken for it."""
    with archive.open(f"{name}.npy") as stream:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise ValueError(f"{name} is of an unknown format")
        found, in_columns, found_dtype = np.lib.format.read_array_header_1_0(stream)
        fits = len(found) == len(shape) and all(
            size is None or size == got for size, got in zip(shape, found, strict=True)
        )
        if not fits or in_columns or found_dtype != dtype or math.prod(found) > _MAX_ITEMS:
            raise ValueError(f"{name} must be {dtype}{list(shape)}, got {found_dtype}{list(found)}")
        size = math.prod(found) * dtype.itemsize
        data = stream.read(size)
    if len(data) != size:
        raise ValueError(f"{name} is cut")
    return np.frombuffer(data, dtype).reshape(found).copy()
