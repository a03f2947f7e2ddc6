"""Textures of floors and walls, and of the wood and stone of furniture."""

import itertools

import numpy as np

from toponav.worlds.generate._texture_tools import (
    SIDE_PX,
    Texture,
    as_texture,
    noise,
    shaded,
    tint,
)

__all__ = [
    "brick",
    "floor_tiles",
    "paint",
    "painted_wood",
    "parquet",
    "planks",
    "stone",
    "wall_tiles",
    "wallpaper",
    "white",
    "wood",
]

_WOODS = ("#b98a5a", "#8a5a34", "#5b3a24", "#d3ae7b", "#a5723f", "#c9a882", "#74492b", "#ddc39a")


def wood(rng: np.random.Generator) -> Texture:
    """Grain of one board."""
    color = tint(rng, *_WOODS)
    grain = noise(rng, SIDE_PX, 1.1, stretch=14.0) * 0.07 + noise(rng, SIDE_PX, 0.4, 30.0) * 0.03
    rings = np.sin(8 * noise(rng, SIDE_PX, 2.2, 5.0)) * float(rng.uniform(0.01, 0.05))
    return as_texture(shaded(color, grain + rings, 1.0))


def painted_wood(rng: np.random.Generator) -> Texture:
    color = tint(
        rng, "#f2f0ea", "#e9e4d8", "#dfe6e6", "#c9d3cf", "#3f4a52", "#6d7f72", "#a9b8c4", "#e8dcc6"
    )
    return as_texture(shaded(color, noise(rng, 64, 1.0, 8.0), 0.012))


def planks(rng: np.random.Generator) -> Texture:
    """A floor of boards, two metres of it."""
    side = 256
    color = tint(rng, *_WOODS, "#9c9184", "#c7b8a2")
    count = int(rng.choice([8, 10, 14]))
    image = np.empty((side, side, 3))
    edges = np.linspace(0, side, count + 1).astype(int)
    grain = noise(rng, side, 1.0, 16.0) * 0.06
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
    return as_texture(image)


def parquet(rng: np.random.Generator) -> Texture:
    """Squares of strips laid across each other."""
    side, blocks = 192, int(rng.choice([4, 6]))
    color = tint(rng, *_WOODS)
    size = side // blocks
    image = np.empty((side, side, 3))
    grain = noise(rng, side, 0.9, 10.0) * 0.05
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
    return as_texture(image)


def _tiles(rng: np.random.Generator, colors: tuple[str, ...], accents: tuple[str, ...]) -> Texture:
    """Square or long tiles with joints, sometimes two colours or laid like bricks."""
    side = 192
    rows = int(rng.choice([2, 3, 4, 6]))
    cols = rows if rng.random() < 0.6 else max(rows // 2, 1)
    one, two = tint(rng, *colors), tint(rng, *accents)
    style = rng.random()
    image = np.empty((side, side, 3))
    stain = noise(rng, side, 1.3) * 0.03
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
    return as_texture(shaded(image, stain, 1.0))


def floor_tiles(rng: np.random.Generator) -> Texture:
    return _tiles(
        rng,
        ("#cfc8bb", "#b5ab9b", "#8e8c88", "#d9d5cc", "#a08c74", "#77706a", "#c9b79c"),
        ("#6b6762", "#a9563c", "#4b5358", "#efe9dd"),
    )


def wall_tiles(rng: np.random.Generator) -> Texture:
    return _tiles(
        rng,
        ("#eef1f0", "#dfe8ea", "#c5dcdf", "#a9cbd1", "#e7e2d5", "#c8d8c8", "#9fb9c8", "#f4efe6"),
        ("#6fa3b5", "#3f6f86", "#7fa58c", "#bfa07a", "#37485a"),
    )


def stone(rng: np.random.Generator) -> Texture:
    """Marble or granite of a worktop."""
    color = tint(rng, "#e6e2dc", "#4a4a4d", "#8f8a83", "#c9bfae", "#2f3236", "#b9b4ad")
    veins = 1 - np.abs(np.clip(noise(rng, SIDE_PX, 1.6), -1, 1))
    speck = noise(rng, SIDE_PX, 0.2)
    return as_texture(shaded(color, speck * 0.05 - 0.18 * veins**8, 1.0))


def brick(rng: np.random.Generator) -> Texture:
    side, rows, cols = 192, 12, 4
    color = tint(rng, "#a4553c", "#8d4a38", "#b9745a", "#c9c2b8")
    joint = tint(rng, "#b9b2a6", "#d6d0c6")
    image = np.tile(joint, (side, side, 1))
    tall, wide = side // rows, side // cols
    for i in range(rows):
        line = np.tile(joint, (tall, side, 1))
        for j in range(cols):
            tone = 1 + rng.normal(0, 0.1)
            line[2:, j * wide + 2 : (j + 1) * wide] = color * tone
        image[i * tall : (i + 1) * tall] = np.roll(line, (i % 2) * wide // 2, axis=1)
    return as_texture(shaded(image, noise(rng, side, 0.6), 0.05))


_PAINTS = (
    "#efe9dd", "#e3dccb", "#dfe5e2", "#cfd9d3", "#d8cfc4", "#c7d3dc", "#e8d9c9", "#b9c4b4",
    "#d9c3b5", "#a9b9c6", "#e9e3ef", "#f0ead2", "#c9b7a8", "#9fb0a5", "#d6b9a8", "#b7a9be",
)  # fmt: skip


def paint(rng: np.random.Generator) -> Texture:
    return as_texture(shaded(tint(rng, *_PAINTS), noise(rng, 64, 0.8), 0.015))


def white(rng: np.random.Generator) -> Texture:
    return as_texture(
        shaded(tint(rng, "#f3f1ec", "#f6f4f0", spread=2.0), noise(rng, 64, 0.8), 0.01)
    )


def wallpaper(rng: np.random.Generator) -> Texture:
    """Stripes, dots or diamonds on paint."""
    base = tint(rng, *_PAINTS)
    mark = np.clip(base + rng.choice([-1, 1]) * rng.uniform(18, 40) + rng.normal(0, 10, 3), 0, 255)
    rows, cols = np.indices((SIDE_PX, SIDE_PX)) / SIDE_PX
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
    return as_texture(shaded(image, noise(rng, SIDE_PX, 0.8), 0.012))
