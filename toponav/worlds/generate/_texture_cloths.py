"""Textures of cloth, and pictures: paintings, views out of windows, rows of books."""

import numpy as np

from toponav.worlds.generate._texture_tools import (
    SIDE_PX,
    Texture,
    as_texture,
    noise,
    shaded,
    tint,
)

__all__ = ["books", "carpet", "fabric", "landscape", "linen", "outdoors", "rug"]

_CLOTHS = (
    "#6f7d8c", "#8c5a4a", "#4f6658", "#b9a58a", "#35475e", "#9c8f86", "#7a3f46", "#c2b280",
    "#587b7f", "#a4624f", "#d0c4b4", "#454a50", "#8b7ba1", "#b07f3e", "#63804f", "#c98f86",
)  # fmt: skip


def fabric(rng: np.random.Generator) -> Texture:
    """A weave, now and then striped or checked."""
    color = tint(rng, *_CLOTHS)
    rows, cols = np.indices((SIDE_PX, SIDE_PX))
    weave = ((rows // 2 + cols // 2) % 2) * 0.06 - 0.03
    image = shaded(color, weave + noise(rng, SIDE_PX, 0.5) * 0.04, 1.0)
    style = rng.random()
    other = tint(rng, *_CLOTHS)
    if style < 0.15:
        stripe = ((cols // 16) % 2 == 0)[..., None]
        image = np.where(stripe, image, 0.5 * image + 0.5 * other)
    elif style < 0.25:
        check = (((cols // 16) % 2) + ((rows // 16) % 2))[..., None] / 2
        image = image * (1 - 0.5 * check) + 0.5 * check * other
    return as_texture(image)


def linen(rng: np.random.Generator) -> Texture:
    """Bed clothes: pale or patterned."""
    color = tint(
        rng, "#f1eee8", "#dfe6ee", "#e9d9d4", "#d4dfcf", "#8fa6bd", "#b98d93", "#6c7f95", "#ead9b0"
    )
    image = shaded(color, noise(rng, SIDE_PX, 1.5), 0.035)
    other = tint(rng, *_CLOTHS)
    rows, cols = np.indices((SIDE_PX, SIDE_PX)) / SIDE_PX
    style = rng.random()
    if style < 0.25:
        image = np.where(
            (np.sin(2 * np.pi * 5 * cols) > 0.5)[..., None], 0.4 * image + 0.6 * other, image
        )
    elif style < 0.45:
        dots = np.hypot((rows * 5) % 1 - 0.5, (cols * 5) % 1 - 0.5) < 0.2
        image = np.where(dots[..., None], other, image)
    return as_texture(image)


def carpet(rng: np.random.Generator) -> Texture:
    color = tint(rng, "#a99f91", "#8b8f94", "#b9a894", "#6f7880", "#9a8172", "#84907f", "#c2b8a8")
    pile = noise(rng, SIDE_PX, 0.1) * 0.07 + noise(rng, SIDE_PX, 1.2) * 0.03
    return as_texture(shaded(color, pile, 1.0))


def rug(rng: np.random.Generator) -> Texture:
    """A whole rug with a border and a field."""
    rows, cols = np.indices((SIDE_PX, SIDE_PX)) / SIDE_PX
    edge = np.minimum(np.minimum(rows, 1 - rows), np.minimum(cols, 1 - cols))
    colors = [tint(rng, *_CLOTHS, "#e8e0d0", "#a33c32", "#27364a") for _ in range(4)]
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
        level = (noise(rng, SIDE_PX, 1.8) > 0.2).astype(int) + (noise(rng, SIDE_PX, 1.8) > 0.8)
    image = np.choose(np.clip(level, 0, 2)[..., None], [colors[0], colors[1], colors[2]])
    image = np.where((edge < 0.09)[..., None], colors[3], image)
    image = np.where(((edge > 0.09) & (edge < 0.12))[..., None], colors[0], image)
    return as_texture(shaded(image, noise(rng, SIDE_PX, 0.1), 0.06))


def landscape(rng: np.random.Generator) -> Texture:
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
            hill = tint(rng, "#5d7a4f", "#7f8f5a", "#3f5f57", "#a08a5a", "#6b7f94", "#39566e")
            image = np.where((rows > ridge)[..., None], hill * (1.1 - 0.1 * depth), image)
    elif style < 0.75:
        image = np.tile(tint(rng, "#ece5d6", "#d9c8a9", "#2d3440", "#b7c4c2"), (side, side, 1))
        for _ in range(int(rng.integers(5, 13))):
            color = tint(rng, *_CLOTHS, "#d9432f", "#e3b23c", "#2f6690", "#f2efe6")
            row, col, size = rng.random(), rng.random(), rng.uniform(0.06, 0.28)
            if rng.random() < 0.5:
                shape = np.hypot(rows - row, cols - col) < size
            else:
                shape = (np.abs(rows - row) < size) & (np.abs(cols - col) < rng.uniform(0.05, 0.3))
            image = np.where(shape[..., None], color, image)
    else:
        flow = noise(rng, side, 1.9)
        one, two = tint(rng, *_CLOTHS), tint(rng, *_CLOTHS, "#e8d5b5", "#f0ece2")
        mix = (0.5 + 0.5 * np.tanh(2 * flow))[..., None]
        image = one * mix + two * (1 - mix)
    image = shaded(np.asarray(image), noise(rng, side, 0.7), 0.04)
    return as_texture(image)


def _sky(rng: np.random.Generator, rows: np.ndarray) -> np.ndarray:
    high, low = (
        tint(rng, "#7fb0d8", "#9cc0dc", "#e0a878"),
        tint(rng, "#dfeaf0", "#f3e3cf"),
    )
    mix = rows[..., None]
    return np.asarray(high * (1 - mix) + low * mix)


def outdoors(rng: np.random.Generator) -> Texture:
    """What one sees through a window: sky, trees or houses, ground."""
    side = 128
    rows, cols = np.indices((side, side)) / side
    image = _sky(rng, rows * 1.5)
    horizon = float(rng.uniform(0.5, 0.62))
    for _ in range(int(rng.integers(6, 14))):
        at, size = rng.random(), rng.uniform(0.05, 0.16)
        green = tint(rng, "#4f6f45", "#6f8a52", "#3f5a3f", "#8a9a5b")
        away = np.abs(cols - at)
        crown = np.hypot((rows - horizon + size * 0.6) / 1.3, np.minimum(away, 1 - away)) < size
        image = np.where(crown[..., None], green, image)
    if rng.random() < 0.5:
        at, wide = rng.uniform(0.1, 0.6), rng.uniform(0.15, 0.35)
        house = (cols > at) & (cols < at + wide) & (rows > horizon - rng.uniform(0.1, 0.3))
        image = np.where(house[..., None], tint(rng, "#c9b9a4", "#a65f4a", "#d9d4c9"), image)
    ground = tint(rng, "#7f9460", "#9aa36b", "#8f8f8a")
    image = np.where((rows > horizon + 0.04)[..., None], ground, image)
    return as_texture(shaded(image, noise(rng, side, 1.0), 0.05))


def books(rng: np.random.Generator) -> Texture:
    """One shelf of books seen from the front."""
    tall, wide = 48, 128
    image = np.tile(np.array([38.0, 30.0, 26.0]), (tall, wide, 1))
    col = 0
    while col < wide - 2:
        width = int(rng.integers(2, 7))
        top = int(rng.integers(0, 16))
        color = tint(rng, *_CLOTHS, "#efe6d2", "#b23a2e", "#2c4f7c", "#2f5d45", spread=14.0)
        image[top:, col : col + width] = color
        image[top:, col] *= 0.6
        if width > 3:
            image[top + 5 : top + 8, col + 1 : col + width - 1] = 0.5 * color + 110
        col += width
    return as_texture(image)
