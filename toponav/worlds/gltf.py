"""Meshes as binary glTF, for viewers and modelling programs."""

import io
import json
import struct
from typing import Any

import numpy as np
from jaxtyping import Float32, UInt8, UInt32
from PIL import Image

from toponav.worlds.grid import SemanticClass
from toponav.worlds.materials import distinct_textures
from toponav.worlds.mesh import SceneMesh

__all__ = ["glb_bytes"]

# glTF is y up, toponav is z up: columns of the matrix one after another.
_Y_UP = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1]
_FLOAT, _UINT32 = 5126, 5125
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_REPEAT, _LINEAR, _LINEAR_MIPMAP_LINEAR = 10497, 9729, 9987
# Seen from outside they vanish, so that one can look into a building.
_ONE_SIDED = (SemanticClass.WALL, SemanticClass.CEILING)


def glb_bytes(mesh: SceneMesh) -> bytes:
    """The mesh as binary glTF 2.0, y up: one named part per semantic class, textures inside.

    Reference:
        Khronos glTF 2.0, sections 3.6 (buffers), 3.9 (materials), 4 (GLB).
    """
    writer = _Writer(mesh)
    for value in np.unique(mesh.face_semantic):
        writer.add_part(SemanticClass(int(value)))
    return writer.finish()


class _Writer:
    """The JSON and the binary chunk of a GLB, part by part."""

    def __init__(self, mesh: SceneMesh) -> None:
        self._mesh = mesh
        self._blob = bytearray()
        self._textures, self._texture_of = distinct_textures(mesh.materials)
        self._material_number: dict[tuple[int, bool], int] = {}
        self._document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "toponav"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"name": "building", "matrix": _Y_UP, "children": []}],
            "meshes": [],
            "materials": [],
            "accessors": [],
            "bufferViews": [],
        }
        if self._textures:
            views = [self._view(_png(texture)) for texture in self._textures]
            self._document |= {
                "images": [{"bufferView": view, "mimeType": "image/png"} for view in views],
                "samplers": [
                    {
                        "magFilter": _LINEAR,
                        "minFilter": _LINEAR_MIPMAP_LINEAR,
                        "wrapS": _REPEAT,
                        "wrapT": _REPEAT,
                    }
                ],
                "textures": [{"source": source, "sampler": 0} for source in range(len(views))],
            }

    def add_part(self, kind: SemanticClass) -> None:
        """Adds the faces of one class as a node, with a primitive per material."""
        mesh, document = self._mesh, self._document
        of_kind = mesh.face_semantic == kind
        primitives = []
        for material in np.unique(mesh.face_material[of_kind]):
            faces = np.flatnonzero(of_kind & (mesh.face_material == material))
            primitives.append(self._primitive(faces, int(material), kind not in _ONE_SIDED))
        name = kind.name.lower()
        document["nodes"][0]["children"].append(len(document["nodes"]))
        document["nodes"].append({"name": name, "mesh": len(document["meshes"])})
        document["meshes"].append({"name": name, "primitives": primitives})

    def finish(self) -> bytes:
        """The whole file."""
        if not self._document["meshes"]:  # glTF allows no empty list.
            for key in ("meshes", "materials", "accessors", "bufferViews"):
                if not self._document[key]:
                    del self._document[key]
            del self._document["nodes"][0]["children"]
        if self._blob:
            self._document["buffers"] = [{"byteLength": len(self._blob)}]
        text = json.dumps(self._document, separators=(",", ":")).encode()
        chunks = _chunk(b"JSON", text, b" ")
        if self._blob:
            chunks += _chunk(b"BIN\0", bytes(self._blob), b"\0")
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def _primitive(self, faces: np.ndarray, material: int, two_sided: bool) -> dict[str, Any]:
        """Some faces of one material; corners that agree in place and texture are shared."""
        mesh = self._mesh
        corners = mesh.vertices_m[mesh.faces[faces]].reshape(-1, 3)
        attributes = {"POSITION": corners}
        if mesh.materials[material].texture is not None:
            uv = mesh.corner_uv[faces].reshape(-1, 2)
            # A texture's origin is its upper left corner in glTF, v runs down.
            attributes["TEXCOORD_0"] = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)
        rows = np.concatenate(list(attributes.values()), axis=1).astype(np.float32)
        unique, index = np.unique(rows, axis=0, return_inverse=True)
        places = {"POSITION": self._floats(unique[:, :3], bounds=True)}
        if "TEXCOORD_0" in attributes:
            places["TEXCOORD_0"] = self._floats(unique[:, 3:])
        return {
            "attributes": places,
            "indices": self._indices(index.ravel().astype(np.uint32)),
            "material": self._material(material, two_sided),
        }

    def _material(self, number: int, two_sided: bool) -> int:
        """The index in the file of a material, written when first used."""
        key = (number, two_sided)
        if key in self._material_number:
            return self._material_number[key]
        material, texture = self._mesh.materials[number], self._texture_of[number]
        surface: dict[str, Any] = {
            "baseColorFactor": [*material.color, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.9,
        }
        entry: dict[str, Any] = {"name": material.name, "pbrMetallicRoughness": surface}
        if texture is not None:
            surface["baseColorTexture"] = {"index": texture}
        if two_sided:
            entry["doubleSided"] = True
        if material.emission > 0:
            entry["emissiveFactor"] = [
                min(1.0, part * material.emission) for part in material.color
            ]
            if texture is not None:
                entry["emissiveTexture"] = {"index": texture}
        self._material_number[key] = len(self._document["materials"])
        self._document["materials"].append(entry)
        return self._material_number[key]

    def _floats(self, values: Float32[np.ndarray, "items parts"], bounds: bool = False) -> int:
        entry: dict[str, Any] = {
            "componentType": _FLOAT,
            "count": len(values),
            "type": f"VEC{values.shape[1]}",
        }
        if bounds:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self._accessor(values.astype("<f4").tobytes(), entry, _ARRAY_BUFFER)

    def _indices(self, values: UInt32[np.ndarray, " items"]) -> int:
        entry = {"componentType": _UINT32, "count": len(values), "type": "SCALAR"}
        return self._accessor(values.astype("<u4").tobytes(), entry, _ELEMENT_ARRAY_BUFFER)

    def _accessor(self, data: bytes, entry: dict[str, Any], target: int) -> int:
        view = self._view(data, target)
        self._document["accessors"].append({"bufferView": view, **entry})
        return len(self._document["accessors"]) - 1

    def _view(self, data: bytes, target: int | None = None) -> int:
        """The index of a piece of the binary chunk, appended at a multiple of four bytes."""
        entry = {"buffer": 0, "byteOffset": len(self._blob), "byteLength": len(data)}
        if target is not None:
            entry["target"] = target
        self._blob += data + b"\0" * (-len(data) % 4)
        self._document["bufferViews"].append(entry)
        return len(self._document["bufferViews"]) - 1


def _png(texture: UInt8[np.ndarray, "height width 3"]) -> bytes:
    """A texture as a PNG file."""
    buffer = io.BytesIO()
    Image.fromarray(texture).save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def _chunk(kind: bytes, data: bytes, padding: bytes) -> bytes:
    data += padding * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data
