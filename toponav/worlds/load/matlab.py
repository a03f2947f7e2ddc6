"""Numbers, text and structs from MATLAB 5 files, read in plain Python.

SciPy's reader is compiled, and a single flipped byte can make it end the process. This one
checks every size against the bytes that are there; what it does not know it leaves out.

Reference:
    MathWorks, "MAT-File Format", Level 5 MAT-files.
"""

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["MatlabStruct", "read_matlab_variable"]

_HEADER_BYTES = 128
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _CHAR = 1, 2, 4
_COMPLEX_FLAG = 0x08
_MOST_UNPACKED_BYTES = 512_000_000
_MOST_DEPTH = 16
_MOST_ITEMS = 1_000_000
_ELEMENT_TYPE = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8"}
_ELEMENT_TYPE |= {12: "i8", 13: "u8"}
_TEXT_TYPE = {1: "latin-1", 2: "utf-8", 16: "utf-8", 4: "utf-16", 17: "utf-16", 18: "utf-32"}
_ARRAY_TYPE = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4"}
_ARRAY_TYPE |= {14: "i8", 15: "u8"}


@dataclass(frozen=True)
class MatlabStruct:
    """An array of structs, flat: the values of each field in the order of the elements."""

    count: int
    fields: dict[str, list[Any]]

    def values(self, field: str) -> list[Any]:
        """The field's value in each element; None throughout where there is no such field."""
        return self.fields.get(field, [None] * self.count)


def read_matlab_variable(content: bytes, name: str) -> Any:
    """The variable of a MATLAB 5 file: an array, a string, a list, a `MatlabStruct` or None.

    Objects, sparse and complex arrays are None.

    Args:
        content: The file.
        name: Name of the variable.

    Raises:
        ValueError: The file is no MATLAB 5 file, is damaged, or unpacks to more than 512 MB.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:_HEADER_BYTES])
    if order is None:
        raise ValueError("it lacks the header of one")
    budget = _MOST_UNPACKED_BYTES
    for kind, data in _elements(memoryview(content)[_HEADER_BYTES:], order):
        if kind == _COMPRESSED:
            unpacked = _unpack(data, budget)
            budget -= len(unpacked)
            inner = list(_elements(memoryview(unpacked), order))
        else:
            inner = [(kind, data)]
        for inner_kind, matrix in inner:
            if inner_kind == _MATRIX:
                reader = _Reader(order)
                if reader.name(matrix) == name:
                    return reader.matrix(matrix, 0)
    return None


def _unpack(data: memoryview, budget: int) -> bytes:
    unzip = zlib.decompressobj()
    try:
        unpacked = unzip.decompress(data, budget)
    except zlib.error as error:
        raise ValueError(f"packed data is damaged: {error}") from None
    if not unzip.eof:
        too_large = len(unpacked) >= budget
        raise ValueError("it unpacks to too much" if too_large else "packed data is cut")
    return unpacked


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and content of each element that lies in these bytes."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}2I", data, at)
        start, step = at + 8, 8 + size
        if kind >> 16:  # A short element keeps its content in its tag.
            kind, size, start, step = kind & 0xFFFF, kind >> 16, at + 4, 8
            if size > 4:
                raise ValueError(f"a short element of {size} bytes")
        elif kind != _COMPRESSED:
            step += -size % 8
        if start + size > len(data):
            raise ValueError(f"an element of {size:,} bytes where {len(data) - start:,} are left")
        yield kind, data[start : start + size]
        at += step


class _Reader:
    """Reads one matrix and those within it."""

    def __init__(self, order: str) -> None:
        self._order = order
        self._left = _MOST_ITEMS

    def name(self, data: memoryview) -> str:
        """The variable's name."""
        parts = self._parts(data, 3)
        return bytes(parts[2][1]).decode("latin-1")

    def matrix(self, data: memoryview, depth: int) -> Any:
        """Its value."""
        self._left -= 1
        if depth > _MOST_DEPTH or self._left < 0:
            raise ValueError("it is nested too deep, or of too many parts")
        if not len(data):
            return np.zeros((0, 0))
        elements = _elements(data, self._order)
        flags, dims = self._flags_and_sizes(elements)
        next(elements, None)  # the name, empty within structs and cells
        array_class, count = flags & 0xFF, math.prod(dims)
        if array_class == _STRUCT:
            return self._struct(elements, count, depth)
        if array_class == _CELL:
            return [self._inner(elements, depth) for _ in range(self._checked(count))]
        if array_class == _CHAR:
            return self._text(elements)
        if array_class in _ARRAY_TYPE and not (flags >> 8) & _COMPLEX_FLAG:
            return self._numbers(elements, dims, _ARRAY_TYPE[array_class])
        return None

    def _parts(self, data: memoryview, count: int) -> list[tuple[int, memoryview]]:
        parts = [part for part, _ in zip(_elements(data, self._order), range(count), strict=False)]
        if len(parts) < count:
            raise ValueError("a matrix without a head")
        return parts

    def _flags_and_sizes(
        self, elements: Iterator[tuple[int, memoryview]]
    ) -> tuple[int, tuple[int, ...]]:
        _, flags = next(elements, (0, memoryview(b"")))
        _, sizes = next(elements, (0, memoryview(b"")))
        if len(flags) != 8 or not 8 <= len(sizes) <= 32 or len(sizes) % 4:
            raise ValueError("a matrix without flags or sizes")
        dims = struct.unpack(f"{self._order}{len(sizes) // 4}i", sizes)
        if min(dims) < 0:
            raise ValueError(f"a matrix of size {dims}")
        return struct.unpack_from(f"{self._order}I", flags)[0], dims

    def _checked(self, count: int) -> int:
        if count > self._left:
            raise ValueError(f"{count:,} parts")
        return count

    def _inner(self, elements: Iterator[tuple[int, memoryview]], depth: int) -> Any:
        kind, data = next(elements, (0, memoryview(b"")))
        if kind != _MATRIX:
            raise ValueError("a matrix is missing within another")
        return self.matrix(data, depth + 1)

    def _struct(
        self, elements: Iterator[tuple[int, memoryview]], count: int, depth: int
    ) -> MatlabStruct:
        _, width = next(elements, (0, memoryview(b"")))
        _, packed = next(elements, (0, memoryview(b"")))
        size = struct.unpack(f"{self._order}i", width)[0] if len(width) == 4 else 0
        if size <= 0 or len(packed) % size:
            raise ValueError("a struct without names of fields")
        names = [
            bytes(packed[at : at + size]).split(b"\0")[0].decode("latin-1")
            for at in range(0, len(packed), size)
        ]
        fields: dict[str, list[Any]] = {name: [] for name in names}
        for _ in range(self._checked(count)):
            for name in names:
                fields[name].append(self._inner(elements, depth))
        return MatlabStruct(count, fields)

    def _text(self, elements: Iterator[tuple[int, memoryview]]) -> str:
        kind, data = next(elements, (0, memoryview(b"")))
        if kind not in _TEXT_TYPE:
            raise ValueError(f"text of type {kind}")
        suffix = "" if kind in (1, 2, 16) else {"<": "-le", ">": "-be"}[self._order]
        return bytes(data).decode(_TEXT_TYPE[kind] + suffix)

    def _numbers(
        self, elements: Iterator[tuple[int, memoryview]], dims: tuple[int, ...], dtype: str
    ) -> np.ndarray:
        kind, data = next(elements, (0, memoryview(b"")))
        if kind not in _ELEMENT_TYPE:
            raise ValueError(f"numbers of type {kind}")
        stored = np.dtype(self._order + _ELEMENT_TYPE[kind])
        if len(data) != math.prod(dims) * stored.itemsize:
            raise ValueError(f"{len(data):,} bytes for a matrix of size {dims}")
        return np.frombuffer(data, stored).astype(dtype).reshape(dims, order="F")
