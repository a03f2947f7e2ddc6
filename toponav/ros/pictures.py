"""Panoramas as image messages and as files. Imports message packages, not rclpy."""

from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np
import PIL.Image
from jaxtyping import Float32, UInt8
from sensor_msgs.msg import Image

from toponav.core.errors import InputError
from toponav.core.files import check_is_file, write_atomically
from toponav.core.imagenav import PANORAMA_SHAPE, ImageGoal
from toponav.data.image_messages import color_of_image, depth_of_image, without_holes
from toponav.ros import _fill

__all__ = ["depth_of", "depth_path", "fill_goal", "goal_of", "read_goal", "rgb_of", "write_goal"]

_MAX_DEPTH_M: Final = 10.0
_MAX_BYTES: Final = 16 << 20


def rgb_of(message: Image) -> UInt8[np.ndarray, "height width 3"]:
    """The colours of an image message."""
    return color_of_image(
        message.encoding, message.height, message.width, message.step, message.data
    )


def depth_of(message: Image) -> Float32[np.ndarray, "height width"]:
    """The metres of an image message, without NaN."""
    depth_m = depth_of_image(
        message.encoding,
        message.height,
        message.width,
        message.step,
        bool(message.is_bigendian),
        message.data,
    )
    return without_holes(depth_m, _MAX_DEPTH_M)


def goal_of(request: Any, wants_depth: bool) -> ImageGoal:
    """The picture that a GoToImage goal asks for.

    Raises:
        InputError: It has another size than panoramas have, or lacks the depth that is compared.
    """
    rgb = rgb_of(request.goal_image)
    depth_m = depth_of(request.goal_depth) if request.goal_depth.width else None
    for shape in (rgb.shape[:2], *(() if depth_m is None else (depth_m.shape,))):
        if shape != PANORAMA_SHAPE:
            raise InputError(
                f"a goal picture has {PANORAMA_SHAPE[1]}x{PANORAMA_SHAPE[0]} pixels, "
                f"got {shape[1]}x{shape[0]}",
                where="GoToImage goal",
                remedy="give a panorama; its middle column looks ahead",
            )
    if wants_depth and depth_m is None:
        raise InputError(
            "this agent compares depth, and the goal has none",
            where="GoToImage goal, goal_depth",
            remedy="give the panorama's depth, or serve an agent of colour alone",
        )
    return ImageGoal(rgb, depth_m)


def fill_goal(request: Any, goal: ImageGoal) -> Any:
    """The same goal as a message."""
    request.goal_image = _fill.image_message(goal.rgb, "rgb8", "goal", 0)
    if goal.depth_m is not None:
        request.goal_depth = _fill.image_message(goal.depth_m, "32FC1", "goal", 0)
    return request


def depth_path(picture: Path) -> Path:
    """Where the depth of a picture is kept: beside it, in millimetres."""
    return picture.with_name(f"{picture.stem}.depth.png")


def write_goal(picture: Path, goal: ImageGoal) -> list[Path]:
    """The files written: the panorama as PNG and, where there is depth, 16 bits of millimetres."""
    written = [write_atomically(picture, _png(goal.rgb))]
    if goal.depth_m is not None:
        depth_mm = np.clip(np.rint(1000.0 * goal.depth_m), 0, 65535).astype(np.uint16)
        written.append(write_atomically(depth_path(picture), _png(depth_mm)))
    return written


def read_goal(picture: Path) -> ImageGoal:
    """The panorama of a file, with the depth that lies beside it.

    Raises:
        InputError: There is no such file, or it is no PNG of a panorama's size.
    """
    rgb = _read(picture, "RGB")
    beside = depth_path(picture)
    if not beside.exists():
        return ImageGoal(rgb, None)
    return ImageGoal(rgb, (_read(beside, "I").astype(np.float32) / 1000.0).astype(np.float32))


def _png(pixels: np.ndarray) -> bytes:
    buffer = BytesIO()
    PIL.Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def _read(path: Path, mode: str) -> np.ndarray:
    check_is_file(path, max_bytes=_MAX_BYTES)
    wanted = (PANORAMA_SHAPE[1], PANORAMA_SHAPE[0])
    try:
        with PIL.Image.open(path, formats=["PNG"]) as image:
            if image.size == wanted:
                return np.asarray(image.convert(mode))
            found = f"{image.width}x{image.height}"
    except Exception as error:  # decoders fail in many ways on damaged files
        raise InputError(
            f"the picture cannot be read: {error}",
            where=str(path),
            remedy="make it with `toponav ros picture`",
        ) from None
    raise InputError(
        f"a panorama has {wanted[0]}x{wanted[1]} pixels, got {found}",
        where=str(path),
        remedy="make it with `toponav ros picture`",
    )
