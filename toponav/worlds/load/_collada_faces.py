"""The triangles of a COLLADA geometry."""

import warnings
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float, Float32, Int32, Int64

from toponav.core.errors import InputError
from toponav.worlds.load.mesh_parts import MAX_FACES, Notes

__all__ = ["ColladaGeometry", "geometry_of", "numbers_of"]

_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


@dataclass(frozen=True, eq=False)
class ColladaGeometry:
    """Triangles of one geometry; `face_symbol` indexes the material symbols."""

    vertices: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    face_symbol: Int32[np.ndarray, " faces"]
    corner_uv: Float32[np.ndarray, "faces 3 2"]
    symbols: tuple[str, ...]


def numbers_of(text: str) -> Float[np.ndarray, " numbers"]:
    """The numbers in a text; up to the first word that is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            return np.fromstring(text, np.float64, sep=" ")
        except ValueError:
            words = text.split()
            good = []
            for word in words:
                try:
                    good.append(float(word))
                except ValueError:
                    break
            return np.array(good, np.float64)


def _indices_of(text: str | None) -> Int64[np.ndarray, " numbers"]:
    """Whole numbers; what is none or too large becomes -1, which no source has."""
    values = numbers_of(text or "")
    good = np.abs(values) < 2**31
    return np.where(good, values, -1.0).astype(np.int64)


def geometry_of(element: Element, where: str, notes: Notes) -> ColladaGeometry | None:
    """The triangles of a geometry, or None where it is no mesh.

    Raises:
        InputError: It has too many triangles.
    """
    mesh = element.find("mesh")
    if mesh is None:
        notes.add("geometries that are no meshes left out")
        return None
    sources = {source.get("id", ""): source for source in mesh.iterfind("source")}
    position_of = {
        vertices.get("id", ""): (entry.get("source") or "").lstrip("#")
        for vertices in mesh.iterfind("vertices")
        for entry in vertices.iterfind("input")
        if entry.get("semantic") == "POSITION"
    }
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    symbols: list[str] = []
    total = before = 0
    for primitive in mesh:
        if primitive.tag not in _PRIMITIVES:
            if primitive.tag in ("lines", "linestrips"):
                notes.add("lines left out")
            continue
        piece = _triangles(primitive, sources, position_of)
        if piece is None:
            notes.add("triangles without positions left out")
            continue
        vertices, faces, uv = piece
        total += len(faces)
        if total > MAX_FACES:
            raise InputError(
                f"at most {MAX_FACES:,} triangles are read", where=where, remedy="simplify it"
            )
        good = np.asarray(((faces >= 0) & (faces < len(vertices))).all(axis=1))
        faces = np.where(good[:, None], faces + before, -1)
        pieces.append((vertices, faces, uv))
        symbols.append(primitive.get("material") or "")
        before += len(vertices)
    if not pieces:
        return None
    counts = [len(faces) for _, faces, _ in pieces]
    return ColladaGeometry(
        np.concatenate([vertices for vertices, _, _ in pieces]).astype(np.float32),
        np.concatenate([faces for _, faces, _ in pieces]).astype(np.int32),
        np.repeat(np.arange(len(pieces), dtype=np.int32), counts),
        np.concatenate([uv for _, _, uv in pieces]).astype(np.float32),
        tuple(symbols),
    )


def _source(source: Element | None, width: int) -> Float[np.ndarray, "items width"]:
    """The rows of a source, so many numbers each."""
    array = source.find("float_array") if source is not None else None
    if source is None or array is None:
        return np.zeros((0, width))
    accessor = source.find("technique_common/accessor")
    stride = offset = 0
    if accessor is not None:
        stride = _whole(accessor.get("stride"), width)
        offset = _whole(accessor.get("offset"), 0)
    stride = stride if 1 <= stride <= 64 else width
    values = numbers_of(array.text or "")[max(offset, 0) :]
    rows = values[: len(values) // stride * stride].reshape(-1, stride)
    if stride < width:
        rows = np.pad(rows, ((0, 0), (0, width - stride)))
    return rows[:, :width]


def _whole(text: str | None, default: int) -> int:
    try:
        return min(max(int(text or default), -1), 1 << 30)
    except ValueError:
        return default


def _triangles(
    primitive: Element, sources: dict[str, Element], position_of: dict[str, str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Positions, triangles and texture places of one primitive element."""
    place_at: tuple[int, str] | None = None
    uv_at: tuple[int, str] | None = None
    width = 1
    for entry in primitive.iterfind("input"):
        offset = max(_whole(entry.get("offset"), 0), 0)
        source = (entry.get("source") or "").lstrip("#")
        width = max(width, offset + 1)
        if entry.get("semantic") == "VERTEX":
            place_at = offset, position_of.get(source, source)
        elif entry.get("semantic") == "TEXCOORD" and uv_at is None:
            uv_at = offset, source
    if place_at is None or width > 64:
        return None
    vertices = _source(sources.get(place_at[1]), 3)
    corners, polygons = _polygons(primitive, width)
    triangles = _fans(polygons, primitive.tag == "tristrips")
    triangles = triangles[(triangles < len(corners)).all(axis=1)]
    faces = corners[:, place_at[0]][triangles] if len(triangles) else np.zeros((0, 3), np.int64)
    uv = np.zeros((len(faces), 3, 2))
    if uv_at is not None and len(faces):
        places = _source(sources.get(uv_at[1]), 2)
        wanted = corners[:, uv_at[0]][triangles]
        known = (wanted >= 0) & (wanted < len(places))
        if len(places):
            uv = np.where(known[..., None], places[np.where(known, wanted, 0)], 0.0)
    return vertices, faces, uv


def _polygons(
    primitive: Element, width: int
) -> tuple[Int64[np.ndarray, "corners width"], Int64[np.ndarray, " polygons"]]:
    """The rows of indices, and how many of them each polygon takes in turn."""
    lists = [_indices_of(entry.text) for entry in primitive.iterfind("p")]
    lists = [values[: len(values) // width * width].reshape(-1, width) for values in lists]
    corners = np.concatenate(lists) if lists else np.zeros((0, width), np.int64)
    if primitive.tag == "triangles":
        sizes = np.full(len(corners) // 3, 3, np.int64)
    elif primitive.tag == "polylist":
        sizes = np.clip(_indices_of(primitive.findtext("vcount")), 0, len(corners))
    else:
        sizes = np.array([len(values) for values in lists], np.int64)
    # Counts that add up to more than there is would read beyond the end.
    return corners, sizes[np.cumsum(sizes) <= len(corners)]


def _fans(sizes: Int64[np.ndarray, " polygons"], strips: bool) -> Int64[np.ndarray, "faces 3"]:
    """Triangles, as rows of indices, of polygons that follow one another."""
    starts = np.cumsum(sizes) - sizes
    counts = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, counts)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    if not strips:
        return np.stack([first, first + step + 1, first + step + 2], axis=1)
    odd = step % 2
    return np.stack([first + step, first + step + 1 + odd, first + step + 2 - odd], axis=1)
