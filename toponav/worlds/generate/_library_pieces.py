"""Models of a furniture library as pieces, where a class may take them."""

from functools import lru_cache

import numpy as np

from toponav.worlds.furniture_library import FurnitureLibrary, FurnitureModel
from toponav.worlds.generate._home_canvas import Piece
from toponav.worlds.generate.pieces import CLASSES
from toponav.worlds.generate.shapes import Shape
from toponav.worlds.generate.surfaces import Surface

__all__ = ["library_piece"]

# Class of the library and the greatest and least width, depth and height that fit its use.
_FITS: dict[str, tuple[str, tuple[float, ...]]] = {
    "bed": ("bed", (1.25, 2.2, 1.7, 2.4, 0.3, 1.6)),
    "single_bed": ("bed", (0.7, 1.25, 1.7, 2.3, 0.3, 1.6)),
    "child_bed": ("child_bed", (0.5, 1.3, 0.5, 1.6, 0.4, 1.4)),
    "bunk_bed": ("bunk_bed", (0.7, 1.6, 1.6, 2.3, 1.2, 2.1)),
    "sofa": ("sofa", (1.3, 2.6, 0.6, 1.15, 0.5, 1.2)),
    "armchair": ("armchair", (0.5, 1.15, 0.5, 1.15, 0.5, 1.3)),
    "chair": ("chair", (0.35, 0.6, 0.35, 0.65, 0.65, 1.2)),
    "office_chair": ("office_chair", (0.4, 0.8, 0.4, 0.8, 0.7, 1.4)),
    "stool": ("stool", (0.25, 0.5, 0.25, 0.5, 0.3, 0.9)),
    "bench": ("bench", (0.7, 1.5, 0.25, 0.5, 0.3, 0.6)),
    "ottoman": ("ottoman", (0.3, 0.9, 0.3, 0.9, 0.25, 0.6)),
    "dining_table": ("dining_table", (0.9, 2.0, 0.7, 1.3, 0.65, 0.85)),
    "coffee_table": ("coffee_table", (0.5, 1.4, 0.35, 0.9, 0.25, 0.55)),
    "desk": ("desk", (0.9, 1.8, 0.45, 0.95, 0.65, 0.9)),
    "nightstand": ("nightstand", (0.3, 0.6, 0.3, 0.55, 0.35, 0.75)),
    "dresser": ("dresser", (0.6, 1.6, 0.35, 0.65, 0.6, 1.3)),
    "wardrobe": ("wardrobe", (0.7, 2.4, 0.4, 0.75, 1.6, 2.4)),
    "bookcase": ("bookcase", (0.5, 1.5, 0.2, 0.5, 0.8, 2.3)),
    "shoe_rack": ("shoe_rack", (0.4, 1.1, 0.15, 0.45, 0.3, 1.2)),
    "tv_stand": ("tv_stand", (0.9, 2.2, 0.3, 0.65, 0.3, 0.8)),
    "tv": ("tv", (0.6, 1.4, 0.03, 0.4, 0.4, 0.9)),
    "computer": ("computer", (0.3, 0.7, 0.1, 0.6, 0.2, 0.6)),
    "printer": ("printer", (0.3, 0.6, 0.2, 0.5, 0.1, 0.4)),
    "floor_lamp": ("floor_lamp", (0.2, 0.6, 0.2, 0.6, 1.1, 2.0)),
    "table_lamp": ("table_lamp", (0.1, 0.4, 0.1, 0.4, 0.2, 0.7)),
    "plant": ("plant", (0.2, 0.9, 0.2, 0.9, 0.5, 1.9)),
    "vase": ("vase", (0.06, 0.35, 0.06, 0.35, 0.1, 0.6)),
    "refrigerator": ("refrigerator", (0.5, 0.95, 0.5, 0.8, 1.2, 2.1)),
    "microwave": ("microwave", (0.4, 0.6, 0.25, 0.5, 0.2, 0.4)),
    "washing_machine": ("washing_machine", (0.5, 0.7, 0.45, 0.7, 0.75, 1.0)),
    "toilet": ("toilet", (0.3, 0.6, 0.45, 0.85, 0.35, 1.1)),
    "washbasin": ("washbasin", (0.35, 1.2, 0.3, 0.65, 0.7, 1.15)),
    "bathtub": ("bathtub", (1.3, 1.9, 0.6, 0.95, 0.4, 1.0)),
    "shower": ("shower", (0.7, 1.1, 0.7, 1.1, 1.6, 2.3)),
    "piano": ("piano", (1.2, 1.7, 0.4, 0.8, 0.8, 1.4)),
    "fireplace": ("fireplace", (0.7, 1.9, 0.2, 0.7, 0.8, 2.4)),
    "trash_can": ("trash_can", (0.15, 0.45, 0.15, 0.45, 0.2, 0.8)),
    "filing_cabinet": ("filing_cabinet", (0.3, 0.7, 0.35, 0.75, 0.4, 1.5)),
    "fitness": ("fitness", (0.4, 1.0, 0.6, 1.6, 0.8, 1.7)),
}
_MOST_FACES = 6000


def library_piece(
    rng: np.random.Generator, library: FurnitureLibrary, name: str, held_out: bool
) -> Piece | None:
    """A model of the library that can stand for a class, or None where there is none."""
    models = _usable(library, name, held_out)
    if not models:
        return None
    return _piece(models[int(rng.integers(len(models)))], name)


@lru_cache(maxsize=512)
def _usable(library: FurnitureLibrary, name: str, held_out: bool) -> tuple[FurnitureModel, ...]:
    if name not in _FITS:
        return ()
    category, bounds = _FITS[name]
    return tuple(
        model
        for model in library.of(category, held_out=held_out)
        if model.elevation_m < 0.01
        and all(
            low <= size <= high
            for size, low, high in zip(model.size_m, bounds[::2], bounds[1::2], strict=True)
        )
    )


@lru_cache(maxsize=512)
def _piece(model: FurnitureModel, name: str) -> Piece | None:
    """A model with its back at y = 0, as parametric ones have it."""
    mesh = model.mesh
    if not 0 < len(mesh.faces) <= _MOST_FACES:
        return None
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    # Theirs look along -y: half a turn, then the back to y = 0.
    corners = corners * np.array([-1.0, -1.0, 1.0])
    low = corners.reshape(-1, 3).min(axis=0)
    high = corners.reshape(-1, 3).max(axis=0)
    corners -= np.array([(low[0] + high[0]) / 2, low[1], low[2]])
    slots = tuple(str(number) for number in range(len(mesh.materials)))
    shape = Shape(
        corners, mesh.corner_uv.astype(np.float64), mesh.face_material.astype(np.int32), slots
    )
    surfaces = tuple(Surface(material, None) for material in mesh.materials)
    return Piece(name, model.id, CLASSES[name].semantic, shape, surfaces, model.attribution)
