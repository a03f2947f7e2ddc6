"""Compiled loop that fills packets of rays and hands them to Embree."""

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic

__all__ = ["cast_packets"]

# Offsets, in rows of one value per ray, in Embree's RTCRayHit8 / RTCRayHit16.
_ORIGIN, _NEAR, _DIRECTION, _TIME, _FAR, _MASK, _ID, _FLAGS = 0, 3, 4, 7, 8, 9, 10, 11
_U, _V, _FACE, _GEOMETRY, _INSTANCE, _ROWS = 15, 16, 17, 18, 19, 24
_NOTHING = np.int32(-1)
# Embree takes the reciprocal of anything smaller as positive, yet sorts the ray by its sign:
# coherent packets then miss what is there.
_TINY = np.float32(1e-12)


def _typed_call(  # type: ignore[no-untyped-def]
    typing_context, function, valid, scene, rays, arguments
):
    """Calls `void function(valid, scene, rays, arguments)` at an address known at run time.

    Taking the address as a value, instead of a ctypes function as a constant, lets numba keep
    the compiled kernel on disk.
    """
    signature = types.void(types.intp, types.intp, types.intp, types.intp, types.intp)

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        word = context.get_value_type(types.intp)
        kind = ir.FunctionType(ir.VoidType(), [word] * 4)
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])
        return context.get_dummy_value()

    return signature, generate


_intersect: Any = intrinsic(_typed_call)


@njit(cache=True, nogil=True)
def cast_packets(  # type: ignore[no-untyped-def]
    function, scene, arguments, rays, pixels, origin, cosine, sine, far_m, depth_m, face, uv
):
    """Writes depth, and face and barycentric coordinates where `face` is not empty.

    Args:
        function: Address of `rtcIntersect8` or `rtcIntersect16`.
        scene: Address of the Embree scene.
        arguments: Address of the intersection arguments.
        rays: float32 [packets, 3, width], in the robot's frame.
        pixels: int32 [packets, width], index into the image; -1 where a packet hangs over.
        origin: The optical centre, three numbers.
        cosine: Cosine of the robot's yaw.
        sine: Sine of the robot's yaw.
        far_m: Depth of a ray that meets nothing.
        depth_m: float32 [pixels], written.
        face: int32 [pixels] or empty, written; -1 where nothing was met.
        uv: float32 [pixels, 2] or empty, written.
    """
    packets, width = pixels.shape
    # Embree wants its packets on a 64-byte boundary.
    room = np.zeros(_ROWS * width + 16, np.float32)
    start = (-room.ctypes.data // 4) % 16
    record = room[start : start + _ROWS * width].reshape(_ROWS, width)
    bits = record.view(np.int32)
    valid_room = np.zeros(width + 16, np.int32)
    start = (-valid_room.ctypes.data // 4) % 16
    valid = valid_room[start : start + width]
    far = np.float32(far_m)
    c, s = np.float32(cosine), np.float32(sine)
    want_hits = face.size > 0
    for axis in range(3):
        record[_ORIGIN + axis, :] = origin[axis]
    record[_NEAR, :] = 0.0
    record[_TIME, :] = 0.0
    bits[_MASK, :] = -1
    for packet in range(packets):
        for k in range(width):
            forward, left = rays[packet, 0, k], rays[packet, 1, k]
            x, y = c * forward - s * left, s * forward + c * left
            record[_DIRECTION, k] = x if abs(x) > _TINY else np.float32(0.0)
            record[_DIRECTION + 1, k] = y if abs(y) > _TINY else np.float32(0.0)
            record[_DIRECTION + 2, k] = rays[packet, 2, k]
            record[_FAR, k] = far
            bits[_GEOMETRY, k] = _NOTHING
            bits[_INSTANCE, k] = _NOTHING
            valid[k] = -1 if pixels[packet, k] >= 0 else 0
        _intersect(function, valid.ctypes.data, scene, record.ctypes.data, arguments)
        for k in range(width):
            pixel = pixels[packet, k]
            if pixel >= 0:
                depth_m[pixel] = record[_FAR, k]
                if want_hits:
                    missed = bits[_GEOMETRY, k] == _NOTHING
                    face[pixel] = _NOTHING if missed else bits[_FACE, k]
                    uv[pixel, 0] = 0.0 if missed else record[_U, k]
                    uv[pixel, 1] = 0.0 if missed else record[_V, k]
