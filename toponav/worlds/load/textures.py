"""Pictures on surfaces, from files of strangers."""

import io
import warnings

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from toponav.core.errors import InputError

__all__ = ["MAX_TEXTURE_BYTES", "read_texture", "texture_of_image"]

MAX_TEXTURE_BYTES = 64_000_000
_MAX_PIXELS = 64_000_000
_FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TGA", "TIFF")


def read_texture(data: bytes, where: str, *, max_px: int = 512) -> UInt8[np.ndarray, "h w 3"]:
    """The picture in sRGB, no side longer than `max_px`; what is transparent becomes white.

    Raises:
        InputError: It is no whole picture of a known kind, or has too many pixels.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
                if image.width * image.height > _MAX_PIXELS:
                    raise ValueError(f"it has {image.width} x {image.height} pixels")
                warnings.simplefilter("ignore")  # Odd metadata in an otherwise good picture.
                image.draft("RGB", (max_px, max_px))
                return texture_of_image(image, max_px=max_px)
    except Exception as error:  # Image decoders fail in many ways on damaged files.
        raise InputError(
            f"is not a whole PNG, JPEG, BMP, GIF, TGA or TIFF picture ({str(error)[:100]})",
            where=where,
            remedy="convert the picture or copy it again",
        ) from None


def texture_of_image(image: Image.Image, *, max_px: int = 512) -> UInt8[np.ndarray, "h w 3"]:
    """A decoded picture, as `read_texture` gives it."""
    if image.mode.startswith("I") or image.mode == "F":
        image = image.convert("L")
    if "A" in image.getbands() or "transparency" in image.info:
        over = image.convert("RGBA")
        white = Image.new("RGBA", over.size, (255, 255, 255, 255))
        image = Image.alpha_composite(white, over)
    image = image.convert("RGB")
    if max(image.size) > max_px:
        scale = max_px / max(image.size)
        size = (max(1, round(image.width * scale)), max(1, round(image.height * scale)))
        image = image.resize(size, Image.Resampling.BOX)
    return np.asarray(image, np.uint8)
