"""NumPy archives of strangers: nothing unpickles, nothing takes more memory than asked for."""

import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.errors import InputError
from toponav.core.files import check_is_file

__all__ = ["Shape", "map_npy", "read_npz"]

Shape = tuple[int | None, ...]
"""Sizes of an array; None stands for any."""

_MAX_ITEMS = 1 << 30


def read_npz(
    path: Path,
    wanted: Mapping[str, tuple[str, Shape]],
    *,
    remedy: str,
    max_items: int = _MAX_ITEMS,
) -> dict[str, np.ndarray]:
    """The arrays of an `.npz` file, of exactly these types and sizes; nothing else is read.

    Args:
        path: The archive.
        wanted: Type and shape of each array by its name; None in a shape is any size.
        remedy: What to do when it is broken.
        max_items: Most numbers in one array.

    Raises:
        InputError: The file is missing or broken, or an array is of another type or size.
    """
    arrays = {}
    check_is_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            for name, (dtype, shape) in wanted.items():
                arrays[name] = _read_npy(archive, name, np.dtype(dtype), shape, max_items)
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror or error})", where=str(path), remedy=remedy
        ) from None
    except Exception as error:  # Damaged zip files fail in a dozen ways.
        raise InputError(
            f"does not hold the arrays that it should ({str(error)[:200]})",
            where=str(path),
            remedy=remedy,
        ) from None
    return arrays


def map_npy(path: Path, dtype: str, shape: Shape, *, remedy: str) -> np.ndarray:
    """The array of an `.npy` file, left on disk, of exactly this type and size.

    Raises:
        InputError: The file is missing or broken, or holds another array.
    """
    check_is_file(path)
    try:
        array = np.lib.format.open_memmap(path, "r")
        _check_kind(path.name, array.shape, array.dtype, np.dtype(dtype), shape)
    except Exception as error:  # NumPy parses the header as Python, which fails in many ways.
        raise InputError(
            f"does not hold the array that it should ({str(error)[:200]})",
            where=str(path),
            remedy=remedy,
        ) from None
    return array


def _check_kind(
    name: str, found: tuple[int, ...], found_dtype: Any, dtype: np.dtype[Any], shape: Shape
) -> None:
    fits = len(found) == len(shape) and all(
        size is None or size == got for size, got in zip(shape, found, strict=True)
    )
    if not fits or found_dtype != dtype:
        raise ValueError(f"{name} must be {dtype}{list(shape)}, got {found_dtype}{list(found)}")


def _read_npy(
    archive: zipfile.ZipFile, name: str, dtype: np.dtype[Any], shape: Shape, max_items: int
) -> np.ndarray:
    """One array, its header checked before any memory is taken for it."""
    with archive.open(f"{name}.npy") as stream:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise ValueError(f"{name} is of an unknown format")
        found, in_columns, found_dtype = np.lib.format.read_array_header_1_0(stream)
        _check_kind(name, found, found_dtype, dtype, shape)
        if in_columns or math.prod(found) > max_items:
            raise ValueError(f"{name} must be stored by rows, with {max_items:,} numbers at most")
        size = math.prod(found) * dtype.itemsize
        data = stream.read(size)
    if len(data) != size:
        raise ValueError(f"{name} is cut")
    return np.frombuffer(data, dtype).reshape(found).copy()
