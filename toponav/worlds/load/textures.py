"""Pictures on surfaces, from files of strangers."""

import io
import posixpath
import warnings

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from toponav.core.errors import InputError, shown
from toponav.worlds.load.mesh_parts import Notes
from toponav.worlds.load.source_files import SourceFiles, beside

__all__ = ["named_texture", "read_texture", "texture_of_image"]

_MAX_BYTES = 64_000_000
_ELSEWHERE = ("", "textures/", "../textures/", "../materials/textures/", "materials/textures/")
"""Where exporters mean to have put a picture whose path is one of the author's own machine."""
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


def named_texture(
    files: SourceFiles, document: str, reference: str, notes: Notes, *, max_px: int = 512
) -> UInt8[np.ndarray, "h w 3"] | None:
    """The picture that a document names, or None, noted, where there is none that can be read.

    A path that leads nowhere is tried again as a bare file name, beside the document and in
    the folders where textures usually lie.

    Args:
        files: Where the document and its pictures lie.
        document: Name of the document.
        reference: What it says.
        notes: Where it is written down that a picture is left out.
        max_px: Longest side; larger pictures are shrunk.
    """
    fault = ""
    plain = posixpath.basename(reference.strip().replace("\\", "/"))
    for name in [reference, *(folder + plain for folder in _ELSEWHERE)]:
        try:
            place = beside(document, name)
            return read_texture(files.read(place, max_bytes=_MAX_BYTES), place, max_px=max_px)
        except InputError as error:
            fault = fault or error.rule[:120]
    notes.add(f"texture {shown(reference, 60)} left out: {fault}")
    return None
