"""Procedural textures: pictures that repeat without a seam, each a function of a generator."""

import itertools
from collections.abc import Callable

import numpy as np
from jaxtyping import Float, UInt8

__all__ = ["PAINTERS", "Texture"]

Texture = UInt8[np.ndarray, "height width 3"]
_Plane = Float[np.ndarray, "height width"]
_Color = Float[np.ndarray, "3"]

_SIDE = 128


def _noise(rng: np.random.Generator, side: int, slope: float, stretch: float = 1.0) -> _Plane:
    """Seamless noise of mean 0 and deviation 1; `stretch` > 1 makes streaks along x."""
    white = np.fft.fft2(rng.standard_normal((side, side)))
    rows, cols = np.meshgrid(np.fft.fftfreq(side), np.fft.fftfreq(side), indexing="ij")
    frequency = np.hypot(rows, cols * stretch)
    frequency[0, 0] = np.inf
    plane = np.real(np.fft.ifft2(white / frequency**slope))
    return np.asarray(plane / max(float(plane.std()), 1e-9))


def _rgb(rng: np.random.Generator, *choices: str, spread: float = 6.0) -> _Color:
    """One of some colours, a little off."""
    text = choices[int(rng.integers(len(choices)))]
    color = np.array([int(text[at : at + 2], 16) for at in (1, 3, 5)], float)
    return np.asarray(np.clip(color + rng.normal(0, spread, 3), 0, 255))


def _picture(image: np.ndarray) -> Texture:
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def _shade(color: np.ndarray, plane: _Plane, depth: float) -> np.ndarray:
    return np.asarray(color * (1.0 + depth * plane[..., None]))


_WOODS = ("#b98a5a", "#8a5a34", "#5b3a24", "#d3ae7b", "#a5723f", "#c9a882", "#74492b", "#ddc39a")


def _wood(rng: np.random.Generator) -> Texture:
    """Grain of one board."""
    color = _rgb(rng, *_WOODS)
    grain = _noise(rng, _SIDE, 1.1, stretch=14.0) * 0.07 + _noise(rng, _SIDE, 0.4, 30.0) * 0.03
    rings = np.sin(8 * _noise(rng, _SIDE, 2.2, 5.0)) * float(rng.uniform(0.01, 0.05))
    return _picture(_shade(color, grain + rings, 1.0))


def _painted_wood(rng: np.random.Generator) -> Texture:
    color = _rgb(
        rng, "#f2f0ea", "#e9e4d8", "#dfe6e6", "#c9d3cf", "#3f4a52", "#6d7f72", "#a9b8c4", "#e8dcc6"
    )
    return _picture(_shade(color, _noise(rng, 64, 1.0, 8.0), 0.012))


def _planks(rng: np.random.Generator) -> Texture:
    """A floor of boards, two metres of it."""
    side = 256
    color = _rgb(rng, *_WOODS, "#9c9184", "#c7b8a2")
    count = int(rng.choice([8, 10, 14]))
    image = np.empty((side, side, 3))
    edges = np.linspace(0, side, count + 1).astype(int)
    grain = _noise(rng, side, 1.0, 16.0) * 0.06
    for low, high in itertools.pairwise(edges):
        joint = np.sort(rng.integers(0, side, 2))
        tone = 1.0 + rng.normal(0, 0.07, 2)
        cols = np.arange(side)
        board = (cols >= joint[0]) & (cols < joint[1])
        row = np.where(board, tone[0], tone[1])[None, :]
        strip = np.roll(grain[low:high], int(rng.integers(side)), axis=1)
        image[low:high] = color * ((1 + strip) * row)[..., None]
        image[low : low + 1] *= 0.62
        image[low:high, joint] *= 0.62
    return _picture(image)


def _parquet(rng: np.random.Generator) -> Texture:
    """Squares of strips laid across each other."""
    side, blocks = 192, int(rng.choice([4, 6]))
    color = _rgb(rng, *_WOODS)
    size = side // blocks
    image = np.empty((side, side, 3))
    grain = _noise(rng, side, 0.9, 10.0) * 0.05
    for i in range(blocks):
        for j in range(blocks):
            tone = np.repeat(1 + rng.normal(0, 0.06, 4), size // 4 + 1)[:size]
            block = (1 + grain[i * size : (i + 1) * size, j * size : (j + 1) * size]) * tone[
                :, None
            ]
            block[:: max(size // 4, 1)] *= 0.8
            block[0] *= 0.8
            turned = block.T if (i + j) % 2 else block
            image[i * size : (i + 1) * size, j * size : (j + 1) * size] = color * turned[..., None]
    return _picture(image)


def _tiles(rng: np.random.Generator, colors: tuple[str, ...], accents: tuple[str, ...]) -> Texture:
    """Square or long tiles with joints, sometimes two colours or laid like bricks."""
    side = 192
    rows = int(rng.choice([2, 3, 4, 6]))
    cols = rows if rng.random() < 0.6 else max(rows // 2, 1)
    one, two = _rgb(rng, *colors), _rgb(rng, *accents)
    style = rng.random()
    image = np.empty((side, side, 3))
    stain = _noise(rng, side, 1.3) * 0.03
    tall, wide = side // rows, side // cols
    for i in range(rows):
        shift = wide // 2 if (style < 0.3 and i % 2 and rows % 2 == 0) else 0
        line = np.empty((tall, side, 3))
        for j in range(cols):
            second = style > 0.75 and (i + j) % 2 and rows % 2 == 0 and cols % 2 == 0
            tone = 1 + rng.normal(0, 0.025)
            line[:, j * wide : (j + 1) * wide] = (two if second else one) * tone
            line[:, j * wide : j * wide + 2] = 0.75 * one + 40
        line[:2] = 0.75 * one + 40
        image[i * tall : (i + 1) * tall] = np.roll(line, shift, axis=1)
    return _picture(_shade(image, stain, 1.0))


def _floor_tiles(rng: np.random.Generator) -> Texture:
    return _tiles(
        rng,
        ("#cfc8bb", "#b5ab9b", "#8e8c88", "#d9d5cc", "#a08c74", "#77706a", "#c9b79c"),
        ("#6b6762", "#a9563c", "#4b5358", "#efe9dd"),
    )


def _wall_tiles(rng: np.random.Generator) -> Texture:
    return _tiles(
        rng,
        ("#eef1f0", "#dfe8ea", "#c5dcdf", "#a9cbd1", "#e7e2d5", "#c8d8c8", "#9fb9c8", "#f4efe6"),
        ("#6fa3b5", "#3f6f86", "#7fa58c", "#bfa07a", "#37485a"),
    )


def _stone(rng: np.random.Generator) -> Texture:
    """Marble or granite of a worktop."""
    color = _rgb(rng, "#e6e2dc", "#4a4a4d", "#8f8a83", "#c9bfae", "#2f3236", "#b9b4ad")
    veins = 1 - np.abs(np.clip(_noise(rng, _SIDE, 1.6), -1, 1))
    speck = _noise(rng, _SIDE, 0.2)
    return _picture(_shade(color, speck * 0.05 - 0.18 * veins**8, 1.0))


def _brick(rng: np.random.Generator) -> Texture:
    side, rows, cols = 192, 12, 4
    color = _rgb(rng, "#a4553c", "#8d4a38", "#b9745a", "#c9c2b8")
    joint = _rgb(rng, "#b9b2a6", "#d6d0c6")
    image = np.tile(joint, (side, side, 1))
    tall, wide = side // rows, side // cols
    for i in range(rows):
        line = np.tile(joint, (tall, side, 1))
        for j in range(cols):
            tone = 1 + rng.normal(0, 0.1)
            line[2:, j * wide + 2 : (j + 1) * wide] = color * tone
        image[i * tall : (i + 1) * tall] = np.roll(line, (i % 2) * wide // 2, axis=1)
    return _picture(_shade(image, _noise(rng, side, 0.6), 0.05))


_PAINTS = (
    "#efe9dd", "#e3dccb", "#dfe5e2", "#cfd9d3", "#d8cfc4", "#c7d3dc", "#e8d9c9", "#b9c4b4",
    "#d9c3b5", "#a9b9c6", "#e9e3ef", "#f0ead2", "#c9b7a8", "#9fb0a5", "#d6b9a8", "#b7a9be",
)  # fmt: skip


def _paint(rng: np.random.Generator) -> Texture:
    return _picture(_shade(_rgb(rng, *_PAINTS), _noise(rng, 64, 0.8), 0.015))


def _white(rng: np.random.Generator) -> Texture:
    return _picture(
        _shade(_rgb(rng, "#f3f1ec", "#f6f4f0", spread=2.0), _noise(rng, 64, 0.8), 0.01)
    )


def _wallpaper(rng: np.random.Generator) -> Texture:
    """Stripes, dots or diamonds on paint."""
    base = _rgb(rng, *_PAINTS)
    mark = np.clip(base + rng.choice([-1, 1]) * rng.uniform(18, 40) + rng.normal(0, 10, 3), 0, 255)
    rows, cols = np.indices((_SIDE, _SIDE)) / _SIDE
    count = int(rng.choice([4, 6, 8]))
    style = int(rng.integers(4))
    if style == 0:
        shape = np.sin(2 * np.pi * count * cols) > rng.uniform(-0.2, 0.7)
    elif style == 1:
        shape = np.hypot((rows * count) % 1 - 0.5, (cols * count) % 1 - 0.5) < rng.uniform(
            0.12, 0.3
        )
    elif style == 2:
        shape = np.abs((rows * count) % 1 - 0.5) + np.abs((cols * count) % 1 - 0.5) < 0.38
    else:
        wave = 0.25 * np.sin(2 * np.pi * 2 * rows)
        shape = np.abs((cols * count + wave) % 1 - 0.5) < 0.12
    image = np.where(shape[..., None], mark, base)
    return _picture(_shade(image, _noise(rng, _SIDE, 0.8), 0.012))


_CLOTHS = (
    "#6f7d8c", "#8c5a4a", "#4f6658", "#b9a58a", "#35475e", "#9c8f86", "#7a3f46", "#c2b280",
    "#587b7f", "#a4624f", "#d0c4b4", "#454a50", "#8b7ba1", "#b07f3e", "#63804f", "#c98f86",
)  # fmt: skip


def _fabric(rng: np.random.Generator) -> Texture:
    """A weave, now and then striped or checked."""
    color = _rgb(rng, *_CLOTHS)
    rows, cols = np.indices((_SIDE, _SIDE))
    weave = ((rows // 2 + cols // 2) % 2) * 0.06 - 0.03
    image = _shade(color, weave + _noise(rng, _SIDE, 0.5) * 0.04, 1.0)
    style = rng.random()
    other = _rgb(rng, *_CLOTHS)
    if style < 0.15:
        stripe = ((cols // 16) % 2 == 0)[..., None]
        image = np.where(stripe, image, 0.5 * image + 0.5 * other)
    elif style < 0.25:
        check = (((cols // 16) % 2) + ((rows // 16) % 2))[..., None] / 2
        image = image * (1 - 0.5 * check) + 0.5 * check * other
    return _picture(image)


def _linen(rng: np.random.Generator) -> Texture:
    """Bed clothes: pale or patterned."""
    color = _rgb(
        rng, "#f1eee8", "#dfe6ee", "#e9d9d4", "#d4dfcf", "#8fa6bd", "#b98d93", "#6c7f95", "#ead9b0"
    )
    image = _shade(color, _noise(rng, _SIDE, 1.5), 0.035)
    other = _rgb(rng, *_CLOTHS)
    rows, cols = np.indices((_SIDE, _SIDE)) / _SIDE
    style = rng.random()
    if style < 0.25:
        image = np.where(
            (np.sin(2 * np.pi * 5 * cols) > 0.5)[..., None], 0.4 * image + 0.6 * other, image
        )
    elif style < 0.45:
        dots = np.hypot((rows * 5) % 1 - 0.5, (cols * 5) % 1 - 0.5) < 0.2
        image = np.where(dots[..., None], other, image)
    return _picture(image)


def _carpet(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#a99f91", "#8b8f94", "#b9a894", "#6f7880", "#9a8172", "#84907f", "#c2b8a8")
    pile = _noise(rng, _SIDE, 0.1) * 0.07 + _noise(rng, _SIDE, 1.2) * 0.03
    return _picture(_shade(color, pile, 1.0))


def _rug(rng: np.random.Generator) -> Texture:
    """A whole rug with a border and a field."""
    rows, cols = np.indices((_SIDE, _SIDE)) / _SIDE
    edge = np.minimum(np.minimum(rows, 1 - rows), np.minimum(cols, 1 - cols))
    colors = [_rgb(rng, *_CLOTHS, "#e8e0d0", "#a33c32", "#27364a") for _ in range(4)]
    style = int(rng.integers(4))
    if style == 0:
        ring = np.hypot(rows - 0.5, cols - 0.5)
        level = (ring * rng.uniform(8, 16)).astype(int) % 3
    elif style == 1:
        level = (np.abs(rows - 0.5) * 2 + np.abs(cols - 0.5) * 2) * rng.uniform(3, 7)
        level = level.astype(int) % 3
    elif style == 2:
        level = (rows * rng.integers(6, 14)).astype(int) % 3
    else:
        level = (_noise(rng, _SIDE, 1.8) > 0.2).astype(int) + (_noise(rng, _SIDE, 1.8) > 0.8)
    image = np.choose(np.clip(level, 0, 2)[..., None], [colors[0], colors[1], colors[2]])
    image = np.where((edge < 0.09)[..., None], colors[3], image)
    image = np.where(((edge > 0.09) & (edge < 0.12))[..., None], colors[0], image)
    return _picture(_shade(image, _noise(rng, _SIDE, 0.1), 0.06))


def _landscape(rng: np.random.Generator) -> Texture:
    """A painting to hang: hills under a sky, a still life, or shapes."""
    side = 96
    rows, cols = np.indices((side, side)) / side
    style = rng.random()
    if style < 0.4:
        image = _sky(rng, rows)
        for depth in range(4):
            ridge = (
                0.45
                + 0.12 * depth
                + 0.06 * np.sin(2 * np.pi * (rng.uniform(0.6, 2.2) * cols + rng.random()))
            )
            hill = _rgb(rng, "#5d7a4f", "#7f8f5a", "#3f5f57", "#a08a5a", "#6b7f94", "#39566e")
            image = np.where((rows > ridge)[..., None], hill * (1.1 - 0.1 * depth), image)
    elif style < 0.75:
        image = np.tile(_rgb(rng, "#ece5d6", "#d9c8a9", "#2d3440", "#b7c4c2"), (side, side, 1))
        for _ in range(int(rng.integers(5, 13))):
            color = _rgb(rng, *_CLOTHS, "#d9432f", "#e3b23c", "#2f6690", "#f2efe6")
            row, col, size = rng.random(), rng.random(), rng.uniform(0.06, 0.28)
            if rng.random() < 0.5:
                shape = np.hypot(rows - row, cols - col) < size
            else:
                shape = (np.abs(rows - row) < size) & (np.abs(cols - col) < rng.uniform(0.05, 0.3))
            image = np.where(shape[..., None], color, image)
    else:
        flow = _noise(rng, side, 1.9)
        one, two = _rgb(rng, *_CLOTHS), _rgb(rng, *_CLOTHS, "#e8d5b5", "#f0ece2")
        mix = (0.5 + 0.5 * np.tanh(2 * flow))[..., None]
        image = one * mix + two * (1 - mix)
    image = _shade(np.asarray(image), _noise(rng, side, 0.7), 0.04)
    return _picture(image)


def _sky(rng: np.random.Generator, rows: np.ndarray) -> np.ndarray:
    high, low = _rgb(rng, "#7fb0d8", "#9cc0dc", "#e0a878"), _rgb(rng, "#dfeaf0", "#f3e3cf")
    mix = rows[..., None]
    return np.asarray(high * (1 - mix) + low * mix)


def _outdoors(rng: np.random.Generator) -> Texture:
    """What one sees through a window: sky, trees or houses, ground."""
    side = 128
    rows, cols = np.indices((side, side)) / side
    image = _sky(rng, rows * 1.5)
    horizon = float(rng.uniform(0.5, 0.62))
    for _ in range(int(rng.integers(6, 14))):
        at, size = rng.random(), rng.uniform(0.05, 0.16)
        green = _rgb(rng, "#4f6f45", "#6f8a52", "#3f5a3f", "#8a9a5b")
        away = np.abs(cols - at)
        crown = np.hypot((rows - horizon + size * 0.6) / 1.3, np.minimum(away, 1 - away)) < size
        image = np.where(crown[..., None], green, image)
    if rng.random() < 0.5:
        at, wide = rng.uniform(0.1, 0.6), rng.uniform(0.15, 0.35)
        house = (cols > at) & (cols < at + wide) & (rows > horizon - rng.uniform(0.1, 0.3))
        image = np.where(house[..., None], _rgb(rng, "#c9b9a4", "#a65f4a", "#d9d4c9"), image)
    ground = _rgb(rng, "#7f9460", "#9aa36b", "#8f8f8a")
    image = np.where((rows > horizon + 0.04)[..., None], ground, image)
    return _picture(_shade(image, _noise(rng, side, 1.0), 0.05))


def _books(rng: np.random.Generator) -> Texture:
    """One shelf of books seen from the front."""
    tall, wide = 48, 128
    image = np.tile(np.array([38.0, 30.0, 26.0]), (tall, wide, 1))
    col = 0
    while col < wide - 2:
        width = int(rng.integers(2, 7))
        top = int(rng.integers(0, 16))
        color = _rgb(rng, *_CLOTHS, "#efe6d2", "#b23a2e", "#2c4f7c", "#2f5d45", spread=14.0)
        image[top:, col : col + width] = color
        image[top:, col] *= 0.6
        if width > 3:
            image[top + 5 : top + 8, col + 1 : col + width - 1] = 0.5 * color + 110
        col += width
    return _picture(image)


def _metal(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#b9bcc0", "#8e9296", "#d3d5d6", "#6d6f72", "#c2a46a")
    return _picture(_shade(color, _noise(rng, 64, 0.5, 20.0), 0.03))


def _dark(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#1e1f22", "#2a2c30", "#17191c", spread=3.0)
    return _picture(_shade(color, _noise(rng, 64, 0.7), 0.04))


def _plastic(rng: np.random.Generator) -> Texture:
    color = _rgb(
        rng, "#d9483b", "#3b78b5", "#e8c13f", "#4f9d69", "#e9e6df", "#7b5ea7", "#e07b39", "#5f6a72"
    )
    return _picture(_shade(color, _noise(rng, 64, 0.8), 0.02))


def _ceramic(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#f5f5f3", "#eeece6", "#e6ecec", spread=2.0)
    return _picture(_shade(color, _noise(rng, 64, 1.2), 0.008))


def _leaf(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#4d7a3e", "#5f8f4a", "#3c6238", "#7c9a4c", "#466b52")
    return _picture(_shade(color, _noise(rng, 64, 0.9), 0.16))


def _cardboard(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#b08a5c", "#a27d52", "#c09c6d")
    return _picture(_shade(color, _noise(rng, 64, 0.9, 6.0), 0.04))


def _wicker(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#b58e5e", "#8d6a45", "#d0b083", "#e4dccd")
    rows, cols = np.indices((64, 64))
    weave = np.sin(rows * np.pi / 4) * np.where((cols // 8) % 2, 1.0, -1.0)
    return _picture(_shade(color, weave * 0.18 + _noise(rng, 64, 0.5) * 0.04, 1.0))


def _glow(rng: np.random.Generator) -> Texture:
    return _picture(np.tile(_rgb(rng, "#fff1d6", "#fff8ea", "#ffe6bd", spread=3.0), (4, 4, 1)))


def _mirror(rng: np.random.Generator) -> Texture:
    """A dull reflection: light above, darker below."""
    rows = np.indices((64, 64))[0][..., None] / 64
    image = _rgb(rng, "#dfe6ea", spread=3.0) * (1 - rows) + _rgb(rng, "#9aa6ac", spread=4.0) * rows
    return _picture(image)


def _water(rng: np.random.Generator) -> Texture:
    color = _rgb(rng, "#cfe0e4", "#bfd8dc", spread=3.0)
    return _picture(_shade(color, _noise(rng, 64, 1.6), 0.02))


PAINTERS: dict[str, Callable[[np.random.Generator], Texture]] = {
    "wood": _wood,
    "painted": _painted_wood,
    "planks": _planks,
    "parquet": _parquet,
    "floor_tiles": _floor_tiles,
    "wall_tiles": _wall_tiles,
    "stone": _stone,
    "brick": _brick,
    "paint": _paint,
    "white": _white,
    "wallpaper": _wallpaper,
    "fabric": _fabric,
    "cushion": _fabric,
    "curtain": _fabric,
    "linen": _linen,
    "carpet": _carpet,
    "rug": _rug,
    "picture": _landscape,
    "outdoors": _outdoors,
    "books": _books,
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
