"""What surfaces look like, and whose work they are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from toponav.core.errors import InputError

__all__ = ["GREY", "MAX_TEXTURE_PX", "Attribution", "Material", "distinct_textures", "linear_rgb"]

MAX_TEXTURE_PX = 4096
"""Longest side of a texture: what every graphics card takes."""

_MAX_EMISSION = 1000.0


@dataclass(frozen=True, eq=False)
class Material:
    """What light leaves a surface: a colour, a texture that repeats, and a glow of its own.

    Attributes:
        name: Name for display, such as `oak`.
        color: Red, green and blue, linear from 0 to 1; multiplies the texture.
        texture: Picture in sRGB, top row first, or None for plain colour; one repeat of it is
            one unit of `SceneMesh.corner_uv`.
        emission: Light that it gives off itself, as a share of its colour; 0 for most things.

    Example:
        >>> Material("oak", linear_rgb("#b08050")).color[0] > 0.4
        True
    """

    name: str
    color: tuple[float, float, float] = (0.6, 0.6, 0.6)
    texture: UInt8[np.ndarray, "height width 3"] | None = None
    emission: float = 0.0

    def __post_init__(self) -> None:
        def require(holds: bool, rule: str, remedy: str) -> None:
            if not holds:
                raise InputError(rule, where=f"material {self.name[:60]!r}", remedy=remedy)

        require(
            len(self.name) <= 200 and self.name.isprintable(),
            "a name must be printable and have at most 200 characters",
            "rename it",
        )
        require(
            len(self.color) == 3 and all(0.0 <= part <= 1.0 for part in self.color),
            f"color must be three numbers from 0 to 1, got {self.color}",
            "divide by 255, and undo the sRGB curve with linear_rgb",
        )
        require(
            0.0 <= self.emission <= _MAX_EMISSION,
            f"emission must lie in 0..{_MAX_EMISSION:g}, got {self.emission}",
            "give 0 for what does not glow and 1 for a lamp",
        )
        if self.texture is not None:
            shape = self.texture.shape
            fits = len(shape) == 3 and shape[2] == 3 and self.texture.dtype == np.uint8
            require(
                fits and min(shape[:2]) >= 1 and max(shape[:2]) <= MAX_TEXTURE_PX,
                f"a texture must be 8-bit RGB of at most {MAX_TEXTURE_PX} px a side, got "
                f"{self.texture.dtype} {shape}",
                "convert or shrink the picture",
            )


@dataclass(frozen=True)
class Attribution:
    """Whose work is in a scene, as its licence wants it said.

    Attributes:
        work: What it is called, such as a furniture model's name.
        creator: Who made it.
        licence: Terms that it may be used under, such as `CC BY 4.0`.
        source: File (never the path), package or address that it came from.
    """

    work: str
    creator: str
    licence: str
    source: str = ""

    def __post_init__(self) -> None:
        for field in ("work", "creator", "licence", "source"):
            text = getattr(self, field)
            if len(text) > 500 or not text.isprintable():
                raise InputError(
                    f"{field} must be printable and have at most 500 characters, "
                    f"got {text[:60]!r}",
                    where="Attribution",
                    remedy="shorten it to one line",
                )


GREY = Material("grey")
"""What a mesh without materials is made of."""


def linear_rgb(srgb: str | Sequence[float]) -> tuple[float, float, float]:
    """A colour on a linear scale, from `#rrggbb` or three sRGB numbers from 0 to 1.

    Reference:
        IEC 61966-2-1, the sRGB curve.

    Example:
        >>> [round(part, 3) for part in linear_rgb("#ff8000")]
        [1.0, 0.216, 0.0]
    """
    if isinstance(srgb, str):
        srgb = [int(srgb[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    curve: Float[np.ndarray, " 3"] = np.asarray(srgb, np.float64)
    linear = np.where(curve <= 0.04045, curve / 12.92, ((curve + 0.055) / 1.055) ** 2.4)
    return (float(linear[0]), float(linear[1]), float(linear[2]))


def distinct_textures(
    materials: Sequence[Material],
) -> tuple[list[UInt8[np.ndarray, "_ _ 3"]], list[int | None]]:
    """Each different texture once, in order, and which of them each material has."""
    textures: list[np.ndarray] = []
    number_of: dict[tuple[tuple[int, ...], bytes], int] = {}
    numbers: list[int | None] = []
    for material in materials:
        if material.texture is None:
            numbers.append(None)
            continue
        key = (material.texture.shape, material.texture.tobytes())
        if key not in number_of:
            number_of[key] = len(textures)
            textures.append(np.ascontiguousarray(material.texture))
        numbers.append(number_of[key])
    return textures, numbers
