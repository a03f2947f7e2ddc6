"""Bindings to the Embree library that embreex bundles: what embreex itself does not offer."""

import ctypes
import weakref
from functools import cache
from importlib.util import find_spec

import numpy as np
from jaxtyping import Float32, Int32

__all__ = ["EmbreeScene", "load_library"]

# Values of Embree 4's public headers (rtcore_geometry.h, rtcore_device.h, rtcore_scene.h).
_TRIANGLE, _INDEX_BUFFER, _VERTEX_BUFFER = 0, 0, 1
_FORMAT_UINT3, _FORMAT_FLOAT3 = 0x5003, 0x9003
_NATIVE_RAY_PROPERTY = {16: 34, 8: 33}
_ROBUST = 4
_COHERENT = 1 << 16


class _IntersectArguments(ctypes.Structure):
    """`RTCIntersectArguments`, with room to spare for what later versions append."""

    _fields_ = (
        ("flags", ctypes.c_uint),
        ("feature_mask", ctypes.c_uint),
        ("context", ctypes.c_void_p),
        ("filter", ctypes.c_void_p),
        ("intersect", ctypes.c_void_p),
        ("reserved", ctypes.c_ubyte * 64),
    )


@cache
def load_library() -> ctypes.CDLL | None:
    """The Embree library behind embreex, or None where its functions cannot be reached.

    Symbols are looked up through embreex's own extension module, which searches the libraries
    it was linked with; so the name and place of the bundled library do not matter.
    """
    if find_spec("embreex") is None:
        return None
    from embreex import rtcore_scene

    pointer, size, number = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_uint
    signatures = {
        "rtcNewDevice": (pointer, [ctypes.c_char_p]),
        "rtcGetDeviceProperty": (ctypes.c_ssize_t, [pointer, ctypes.c_int]),
        "rtcGetDeviceError": (ctypes.c_int, [pointer]),
        "rtcNewScene": (pointer, [pointer]),
        "rtcReleaseScene": (None, [pointer]),
        "rtcSetSceneFlags": (None, [pointer, ctypes.c_int]),
        "rtcCommitScene": (None, [pointer]),
        "rtcNewGeometry": (pointer, [pointer, ctypes.c_int]),
        "rtcReleaseGeometry": (None, [pointer]),
        "rtcCommitGeometry": (None, [pointer]),
        "rtcAttachGeometry": (number, [pointer, pointer]),
        "rtcSetNewGeometryBuffer": (
            pointer,
            [pointer, ctypes.c_int, number, ctypes.c_int, size, size],
        ),
        "rtcIntersect8": (None, [pointer] * 4),
        "rtcIntersect16": (None, [pointer] * 4),
    }
    try:
        library = ctypes.CDLL(rtcore_scene.__file__)
        for name, (result, arguments) in signatures.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError):
        return None
    return library


@cache
def _device() -> int:
    """The one device of this process, for all scenes.

    With a second device of one thread, a thread of Embree's scheduler spins until every device is
    released: it takes a processor core for as long as there are cameras (embreex 4.4, on Linux).
    """
    library = load_library()
    assert library is not None, "callers ask packets_available() first"
    return int(library.rtcNewDevice(b"threads=1"))


class EmbreeScene:
    """Triangles ready to be hit by packets of rays.

    Args:
        vertices_m: Corner positions.
        faces: Three vertex indices a triangle.
        robust: Whether a ray may never slip between two triangles that share an edge; costs
            about a quarter of the speed.

    Attributes:
        width: Rays per packet: 16 or 8, whichever the processor's registers hold.
        function: Address of the intersection function of that width.
        scene: Address of the scene.
        arguments: Address of the intersection arguments.
    """

    def __init__(
        self,
        vertices_m: Float32[np.ndarray, "vertices 3"],
        faces: Int32[np.ndarray, "faces 3"],
        robust: bool = False,
    ) -> None:
        library = load_library()
        assert library is not None, "callers ask packets_available() first"
        device = _device()
        scene = library.rtcNewScene(device)
        library.rtcSetSceneFlags(scene, _ROBUST if robust else 0)
        geometry = library.rtcNewGeometry(device, _TRIANGLE)
        buffers = (
            (_VERTEX_BUFFER, _FORMAT_FLOAT3, np.ascontiguousarray(vertices_m, np.float32)),
            (_INDEX_BUFFER, _FORMAT_UINT3, np.ascontiguousarray(faces, np.uint32)),
        )
        for kind, layout, array in buffers:
            place = library.rtcSetNewGeometryBuffer(geometry, kind, 0, layout, 12, len(array))
            # Embree allocates, so that its own padding rules hold.
            if place:
                ctypes.memmove(place, array.ctypes.data, array.nbytes)
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(scene)
        self._release = weakref.finalize(self, library.rtcReleaseScene, scene)
        error = library.rtcGetDeviceError(device)
        if error:
            raise RuntimeError(f"Embree could not build the scene: error {error}")
        supported = {
            width: library.rtcGetDeviceProperty(device, code)
            for width, code in _NATIVE_RAY_PROPERTY.items()
        }
        # Sixteen rays on an AVX2 machine run at a third of the speed of eight.
        self.width = 16 if supported[16] else 8
        function = library.rtcIntersect16 if self.width == 16 else library.rtcIntersect8
        self._arguments = _IntersectArguments(flags=_COHERENT, feature_mask=0xFFFFFFFF)
        self.function = ctypes.cast(function, ctypes.c_void_p).value or 0
        self.scene = int(scene)
        self.arguments = ctypes.addressof(self._arguments)
