"""Procedural textures: pictures that repeat without a seam, each a function of a generator."""

from collections.abc import Callable

import numpy as np

from toponav.worlds.generate._texture_cloths import (
    books,
    carpet,
    fabric,
    landscape,
    linen,
    outdoors,
    rug,
)
from toponav.worlds.generate._texture_coverings import (
    brick,
    floor_tiles,
    paint,
    painted_wood,
    parquet,
    planks,
    stone,
    wall_tiles,
    wallpaper,
    white,
    wood,
)
from toponav.worlds.generate._texture_tools import (
    Texture,
    as_texture,
    noise,
    shaded,
    tint,
)

__all__ = ["PAINTERS", "Texture"]


def _metal(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#b9bcc0", "#8e9296", "#d3d5d6", "#6d6f72", "#c2a46a")
    return as_texture(shaded(color, noise(rng, 64, 0.5, 20.0), 0.03))


def _dark(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#1e1f22", "#2a2c30", "#17191c", spread=3.0)
    return as_texture(shaded(color, noise(rng, 64, 0.7), 0.04))


def _plastic(rng: np.random.Generator) -> Texture:
    color = tint(
        rng, "#d9483b", "#3b78b5", "#e8c13f", "#4f9d69", "#e9e6df", "#7b5ea7", "#e07b39", "#5f6a72"
    )
    return as_texture(shaded(color, noise(rng, 64, 0.8), 0.02))


def _ceramic(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#f5f5f3", "#eeece6", "#e6ecec", spread=2.0)
    return as_texture(shaded(color, noise(rng, 64, 1.2), 0.008))


def _leaf(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#4d7a3e", "#5f8f4a", "#3c6238", "#7c9a4c", "#466b52")
    return as_texture(shaded(color, noise(rng, 64, 0.9), 0.16))


def _cardboard(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#b08a5c", "#a27d52", "#c09c6d")
    return as_texture(shaded(color, noise(rng, 64, 0.9, 6.0), 0.04))


def _wicker(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#b58e5e", "#8d6a45", "#d0b083", "#e4dccd")
    rows, cols = np.indices((64, 64))
    weave = np.sin(rows * np.pi / 4) * np.where((cols // 8) % 2, 1.0, -1.0)
    return as_texture(shaded(color, weave * 0.18 + noise(rng, 64, 0.5) * 0.04, 1.0))


def _glow(rng: np.random.Generator) -> Texture:
    return as_texture(np.tile(tint(rng, "#fff1d6", "#fff8ea", "#ffe6bd", spread=3.0), (4, 4, 1)))


def _mirror(rng: np.random.Generator) -> Texture:
    """A dull reflection: light above, darker below."""
    rows = np.indices((64, 64))[0][..., None] / 64
    image = tint(rng, "#dfe6ea", spread=3.0) * (1 - rows) + tint(rng, "#9aa6ac", spread=4.0) * rows
    return as_texture(image)


def _water(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#cfe0e4", "#bfd8dc", spread=3.0)
    return as_texture(shaded(color, noise(rng, 64, 1.6), 0.02))


PAINTERS: dict[str, Callable[[np.random.Generator], Texture]] = {
    "wood": wood,
    "painted": painted_wood,
    "planks": planks,
    "parquet": parquet,
    "floor_tiles": floor_tiles,
    "wall_tiles": wall_tiles,
    "stone": stone,
    "brick": brick,
    "paint": paint,
    "white": white,
    "wallpaper": wallpaper,
    "fabric": fabric,
    "cushion": fabric,
    "curtain": fabric,
    "linen": linen,
    "carpet": carpet,
    "rug": rug,
    "picture": landscape,
    "outdoors": outdoors,
    "books": books,
    "metal": _metal,
    "dark": _dark,
    "plastic": _plastic,
    "ceramic": _ceramic,
    "leaf": _leaf,
    "cardboard": _cardboard,
    "wicker": _wicker,
    "glow": _glow,
    "mirror": _mirror,
    "water": _water,
}
"""What paints each kind of surface."""
