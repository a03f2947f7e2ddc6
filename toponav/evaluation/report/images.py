"""Pixels for the page: coloured depth images, belief strips, and data URLs of both."""

import base64
import io
from functools import cache

import numpy as np
from jaxtyping import Float, Float32, UInt8
from PIL import Image

__all__ = [
    "belief_image",
    "colorize_depth",
    "data_url",
    "depth_bytes",
    "depth_palette_css",
    "png_bytes",
]

# From near to far: paper white, sand, teal, night; even steps in lightness.
_DEPTH_STOPS = ((255, 244, 224), (246, 196, 122), (205, 120, 98), (96, 74, 123), (20, 22, 50))
_BELIEF_RGB = (37, 99, 235)


@cache
def _depth_palette() -> UInt8[np.ndarray, "256 3"]:
    # Rooms are small: most of the range goes to what is within a metre and a half.
    at = np.linspace(0.0, 1.0, len(_DEPTH_STOPS)) ** 1.6
    stops = np.array(_DEPTH_STOPS, dtype=float)
    channels = [np.interp(np.linspace(0, 1, 256), at, stops[:, channel]) for channel in range(3)]
    palette: np.ndarray = np.rint(np.stack(channels, axis=1)).astype(np.uint8)
    return palette


def depth_palette_css() -> str:
    """The depth colours as a CSS gradient from near to far."""
    palette = _depth_palette()[::15]
    return "linear-gradient(90deg," + ",".join(f"rgb{tuple(map(int, c))}" for c in palette) + ")"


def depth_bytes(
    depth_m: Float32[np.ndarray, "height width"], max_depth_m: float
) -> UInt8[np.ndarray, "height width"]:
    """A depth image in one byte a pixel: 0 at the camera, 255 at the far limit."""
    coded: np.ndarray = np.rint(np.clip(depth_m / max_depth_m, 0.0, 1.0) * 255).astype(np.uint8)
    return coded


def colorize_depth(
    depth: UInt8[np.ndarray, "height width"],
) -> UInt8[np.ndarray, "height width 3"]:
    """A depth image for people: light is near, dark is far."""
    colored: np.ndarray = _depth_palette()[depth]
    return colored


def belief_image(
    probability: Float[np.ndarray, "edges steps"],
) -> UInt8[np.ndarray, "edges steps 4"]:
    """Probabilities as one colour whose opacity is the probability, for any background."""
    image = np.empty((*probability.shape, 4), np.uint8)
    image[..., :3] = _BELIEF_RGB
    # The square root keeps small probabilities visible.
    image[..., 3] = np.rint(255 * np.sqrt(np.clip(probability, 0.0, 1.0)))
    return image


def png_bytes(image: np.ndarray) -> bytes:
    """The image as a PNG file."""
    sink = io.BytesIO()
    Image.fromarray(image).save(sink, format="PNG", optimize=True)
    return sink.getvalue()


def data_url(content: bytes, media_type: str) -> str:
    """The content as a URL, so that the page needs no other file."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode('ascii')}"
