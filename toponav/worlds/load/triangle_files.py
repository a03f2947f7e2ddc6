"""glTF, PLY and STL files, through trimesh."""

import io
import struct
import warnings
from typing import Any

import numpy as np
from PIL import Image

from toponav.core.errors import InputError
from toponav.core.files import parse_json
from toponav.worlds.load.mesh_parts import MAX_FACES, MeshFile, MeshPart, Notes, move_part
from toponav.worlds.load.source_files import SourceFiles, beside
from toponav.worlds.load.textures import texture_of_image
from toponav.worlds.materials import GREY, Material, linear_rgb

__all__ = ["read_gltf", "read_ply", "read_stl"]

_MAX_BYTES = 2 << 30
_MAX_SIDE_FILE_BYTES = 2 << 30
_MAX_NODES = 200_000
_MAX_ITEMS = 3 * MAX_FACES
_MAX_HEADER_BYTES = 100_000
_MAX_TEXTURE_PIXELS = 64_000_000


def read_gltf(
    files: SourceFiles, name: str, notes: Notes, *, max_texture_px: int = 512
) -> MeshFile:
    """The parts of a `.glb` or `.gltf` file, one for each mesh of each node; y up, metres.

    Raises:
        InputError: It is no whole glTF 2.0 file, or is too large.
    """
    where = f"{files.label}/{name}"
    data = files.read(name, max_bytes=_MAX_BYTES)
    kind = "glb" if data[:4] == b"glTF" else "gltf"
    _check_gltf(data, kind, where)
    resolver = _Resolver(files, name, notes)
    scene = _load(data, kind, where, resolver)
    parts: list[MeshPart] = []
    made: dict[int, Material] = {}
    try:
        graph = scene.graph
        nodes = list(graph.nodes_geometry)
        if len(nodes) > _MAX_NODES:
            raise ValueError(f"at most {_MAX_NODES:,} nodes are read")
        if sum(len(_faces(scene.geometry[graph[node][1]])) for node in nodes) > MAX_FACES:
            raise ValueError(f"at most {MAX_FACES:,} triangles are read")
        for node in nodes:
            frame, geometry = graph[node]
            part = _part(scene.geometry[geometry], str(node), made, max_texture_px)
            if part is not None:
                parts.append(move_part(part, np.asarray(frame, np.float64)))
    except InputError:
        raise
    except Exception as error:
        raise _broken("glTF", where, error) from None
    return MeshFile(parts, 1.0, "Y")


def read_ply(files: SourceFiles, name: str) -> MeshFile:
    """The triangles of a PLY file; it says neither its unit nor its axis.

    Raises:
        InputError: It is no whole PLY file of triangles, or is too large.
    """
    where = f"{files.label}/{name}"
    data = files.read(name, max_bytes=_MAX_BYTES)
    _check_ply(data, where)
    return _single(_load(data, "ply", where), name, where)


def read_stl(files: SourceFiles, name: str) -> MeshFile:
    """The triangles of an STL file; it says neither its unit nor its axis.

    Raises:
        InputError: It is no whole STL file, or is too large.
    """
    where = f"{files.label}/{name}"
    data = files.read(name, max_bytes=_MAX_BYTES)
    count = struct.unpack("<I", data[80:84])[0] if len(data) >= 84 else 0
    binary = len(data) == 84 + 50 * count
    if count > MAX_FACES and (binary or not data.lstrip().startswith(b"solid")):
        raise InputError(
            f"at most {MAX_FACES:,} triangles are read, the file says {count:,}",
            where=where,
            remedy="simplify the mesh",
        )
    return _single(_load(data, "stl" if binary else "stl_ascii", where), name, where)


class _Resolver:
    """Gives trimesh the files that a glTF names, from its own folder alone."""

    def __init__(self, files: SourceFiles, name: str, notes: Notes) -> None:
        self._files, self._name, self._notes = files, name, notes

    def get(self, name: str) -> bytes:
        """The bytes of a file beside the document."""
        return self._files.read(beside(self._name, name), max_bytes=_MAX_SIDE_FILE_BYTES)

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)


def _load(data: bytes, kind: str, where: str, resolver: Any = None) -> Any:
    """What trimesh makes of a file; whatever goes wrong is the file's fault."""
    import trimesh

    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            loaded: Any = trimesh.load(
                io.BytesIO(data), file_type=kind, process=False, resolver=resolver
            )
    except InputError:
        raise
    except Exception as error:  # Damaged meshes fail in many ways inside the readers.
        raise _broken(kind, where, error) from None
    return loaded if isinstance(loaded, trimesh.Scene) else trimesh.Scene(loaded)


def _broken(kind: str, where: str, error: Exception) -> InputError:
    text = " ".join(str(error).split())[:150] or type(error).__name__
    return InputError(
        f"is not a whole {kind.removesuffix('_ascii').upper()} file of triangles ({text})",
        where=where,
        remedy="export the mesh again, or convert it to GLB",
    )


def _check_gltf(data: bytes, kind: str, where: str) -> None:
    """That no accessor asks for more memory than the file can fill."""
    text = data
    if kind == "glb":
        if len(data) < 20 or data[16:20] != b"JSON":
            raise _broken("glb", where, ValueError("its header is cut"))
        size = struct.unpack("<I", data[12:16])[0]
        text = data[20 : 20 + size].rstrip(b"\0 ")
    document = parse_json(text, where)
    try:
        version = str(document["asset"]["version"])
        accessors = document.get("accessors", [])
        counts = [int(accessor["count"]) for accessor in accessors]
        empty = [int(one["count"]) for one in accessors if "bufferView" not in one]
        nodes = len(document.get("nodes", []))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _broken("glTF", where, error) from None
    too_many = max(counts, default=0) > _MAX_ITEMS or sum(empty) > _MAX_ITEMS // 10
    if too_many or min(counts, default=0) < 0 or nodes > _MAX_NODES:
        raise InputError(
            f"an accessor has 0..{_MAX_ITEMS:,} items and a file {_MAX_NODES:,} nodes, got "
            f"{max(counts, default=0):,} and {nodes:,}",
            where=where,
            remedy="simplify the mesh or export it again",
        )
    if not version.startswith("2"):
        raise InputError(
            f"must be glTF 2.0, got version {version[:20]!r}", where=where, remedy="export again"
        )
    required = document.get("extensionsRequired", [])
    odd = [one for one in required if "draco" in str(one) or "meshopt" in str(one)]
    if odd:
        raise InputError(
            f"compressed meshes ({str(odd[0])[:60]}) are not read",
            where=where,
            remedy="export without mesh compression",
        )


def _check_ply(data: bytes, where: str) -> None:
    """That the header promises no more than the file can hold."""
    end = data.find(b"end_header", 0, _MAX_HEADER_BYTES)
    if not data.startswith(b"ply") or end < 0:
        raise _broken("ply", where, ValueError("it has no header"))
    for line in data[:end].split(b"\n"):
        words = line.split()
        if words[:1] == [b"element"]:
            count = int(words[2]) if len(words) == 3 and words[2].isdigit() else -1
            if not 0 <= count <= min(_MAX_ITEMS, len(data)):
                raise InputError(
                    f"must hold at most {_MAX_ITEMS:,} of each element and all that it says, got "
                    f"{line.decode('latin-1')[:60]!r}",
                    where=where,
                    remedy="export the mesh again, or simplify it",
                )


def _single(scene: Any, name: str, where: str) -> MeshFile:
    """The meshes of a format that knows no nodes."""
    made: dict[int, Material] = {}
    try:
        found = [_part(geometry, name, made, 512) for geometry in scene.geometry.values()]
    except Exception as error:
        raise _broken(name.rpartition(".")[2], where, error) from None
    parts = [part for part in found if part is not None]
    if sum(len(part.faces) for part in parts) > MAX_FACES:
        raise InputError(
            f"at most {MAX_FACES:,} triangles are read", where=where, remedy="simplify the mesh"
        )
    return MeshFile(parts)


def _faces(geometry: Any) -> Any:
    return getattr(geometry, "faces", ())


def _part(
    geometry: Any, name: str, made: dict[int, Material], max_texture_px: int
) -> MeshPart | None:
    """One mesh of trimesh's; None where it holds no triangles."""
    if not len(_faces(geometry)):
        return None
    faces = np.asarray(geometry.faces)
    faces = np.where(np.abs(faces) < 2**31, faces, -1).astype(np.int32)
    vertices = np.asarray(geometry.vertices, np.float32)
    visual = geometry.visual
    surface = getattr(visual, "material", None)
    uv = getattr(visual, "uv", None)
    corner_uv = None
    if uv is not None and len(uv) == len(vertices):
        good = np.asarray(((faces >= 0) & (faces < len(vertices))).all(axis=1))
        corner_uv = np.asarray(uv, np.float32)[:, :2][np.where(good[:, None], faces, 0)]
    if surface is not None:
        if id(surface) not in made:
            made[id(surface)] = _material(surface, max_texture_px)
        return MeshPart(name, vertices, faces, None, corner_uv, (made[id(surface)],))
    if getattr(visual, "kind", None) in ("vertex", "face"):
        face_material, materials = _painted(np.asarray(visual.face_colors)[:, :3])
        return MeshPart(name, vertices, faces, face_material, None, materials)
    return MeshPart(name, vertices, faces)


def _material(surface: Any, max_texture_px: int) -> Material:
    """A material of glTF, whose colour is linear already."""
    image = getattr(surface, "baseColorTexture", None)
    image = getattr(surface, "image", None) if image is None else image
    texture = None
    if isinstance(image, Image.Image) and image.width * image.height <= _MAX_TEXTURE_PIXELS:
        texture = texture_of_image(image, max_px=max_texture_px)
    factor = getattr(surface, "baseColorFactor", None)
    color = (1.0, 1.0, 1.0)
    if factor is not None:
        parts = np.asarray(factor, np.float64).ravel()[:3]
        parts = parts / 255.0 if parts.max(initial=0.0) > 1.0 else parts
        if len(parts) == 3 and np.isfinite(parts).all():
            red, green, blue = np.clip(parts, 0.0, 1.0).tolist()
            color = (red, green, blue)
    glow = getattr(surface, "emissiveFactor", None)
    emission = float(np.clip(np.nan_to_num(np.max(glow)), 0, 1)) if glow is not None else 0.0
    label = str(getattr(surface, "name", None) or "material")
    name = "".join(letter for letter in label if letter.isprintable())[:100] or "material"
    return Material(name, color, texture, emission)


def _painted(colors: np.ndarray) -> tuple[np.ndarray, tuple[Material, ...]]:
    """Colours of a scan's triangles, as a few hundred materials."""
    coarse = (colors.astype(np.int32) >> 5) << 5
    key = (coarse[:, 0] << 16) | (coarse[:, 1] << 8) | coarse[:, 2]
    unique, number = np.unique(key, return_inverse=True)
    materials = tuple(
        Material(
            f"#{value:06x}",
            linear_rgb([((value >> shift) & 255) / 255 + 16 / 255 for shift in (16, 8, 0)]),
        )
        for value in unique.tolist()
    )
    return number.ravel().astype(np.int32), materials or (GREY,)
