"""Surfaces of homes: kinds of material, numbered variants of each, and which are held out."""

import hashlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from toponav.worlds.generate._textures import PAINTERS
from toponav.worlds.materials import Material

__all__ = ["SURFACE_KINDS", "VARIANTS", "Surface", "is_held_out", "surface", "variants"]

VARIANTS = 40
"""Variants of each kind of surface and of each furniture class."""

SURFACE_KINDS = tuple(PAINTERS)
"""Every kind of surface."""

_HELD_OUT_SHARE = 0.25
_SCALE_M = {
    "planks": 2.0,
    "parquet": 1.6,
    "floor_tiles": 1.2,
    "wall_tiles": 0.9,
    "brick": 1.0,
    "wallpaper": 0.9,
    "carpet": 1.2,
    "fabric": 0.35,
    "cushion": 0.35,
    "curtain": 0.5,
    "linen": 0.9,
    "books": 0.9,
    "wicker": 0.3,
    # These pictures cover their surface once.
    "rug": None,
    "picture": None,
    "outdoors": None,
    "mirror": None,
}
_GLOW = {"outdoors": 0.9, "glow": 1.0}


@dataclass(frozen=True, eq=False)
class Surface:
    """A material and how many metres one repeat of its texture covers.

    Attributes:
        material: What it looks like.
        scale_m: Metres a repeat; None where texture places are repeats already.
    """

    material: Material
    scale_m: float | None


def is_held_out(identity: str) -> bool:
    """Whether a model or surface is kept for test homes: a quarter are, by hash of their name.

    Example:
        >>> is_held_out("sofa/3")
        True
    """
    digest = hashlib.sha256(identity.encode()).digest()
    return int.from_bytes(digest[:4], "big") < _HELD_OUT_SHARE * 2**32


@lru_cache(maxsize=256)
def variants(kind: str, held_out: bool) -> tuple[int, ...]:
    """The variants of a kind of surface or furniture that test homes use, or all others."""
    return tuple(n for n in range(VARIANTS) if is_held_out(f"{kind}/{n}") == held_out)


@lru_cache(maxsize=512)
def surface(kind: str, variant: int) -> Surface:
    """One surface; the same kind and variant always look the same."""
    number = SURFACE_KINDS.index(kind)
    texture = PAINTERS[kind](np.random.default_rng([7001, number, variant]))
    texture.setflags(write=False)
    material = Material(f"{kind}/{variant}", (1.0, 1.0, 1.0), texture, _GLOW.get(kind, 0.0))
    return Surface(material, _SCALE_M.get(kind, 0.8))
