"""Seamless noise and colours that textures are painted with."""

import numpy as np
from jaxtyping import Float, UInt8

__all__ = ["SIDE_PX", "Color", "Plane", "Texture", "as_texture", "noise", "shaded", "tint"]

Texture = UInt8[np.ndarray, "height width 3"]
Plane = Float[np.ndarray, "height width"]
Color = Float[np.ndarray, "3"]

SIDE_PX = 128


def noise(rng: np.random.Generator, side: int, slope: float, stretch: float = 1.0) -> Plane:
    """Seamless noise of mean 0 and deviation 1; `stretch` > 1 makes streaks along x."""
    white = np.fft.fft2(rng.standard_normal((side, side)))
    rows, cols = np.meshgrid(np.fft.fftfreq(side), np.fft.fftfreq(side), indexing="ij")
    frequency = np.hypot(rows, cols * stretch)
    frequency[0, 0] = np.inf
    plane = np.real(np.fft.ifft2(white / frequency**slope))
    return np.asarray(plane / max(float(plane.std()), 1e-9))


def tint(rng: np.random.Generator, *choices: str, spread: float = 6.0) -> Color:
    """One of some colours, a little off."""
    text = choices[int(rng.integers(len(choices)))]
    color = np.array([int(text[at : at + 2], 16) for at in (1, 3, 5)], float)
    return np.asarray(np.clip(color + rng.normal(0, spread, 3), 0, 255))


def as_texture(image: np.ndarray) -> Texture:
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def shaded(color: np.ndarray, plane: Plane, depth: float) -> np.ndarray:
    return np.asarray(color * (1.0 + depth * plane[..., None]))
