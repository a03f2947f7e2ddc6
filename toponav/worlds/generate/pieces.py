"""Every parametric furniture class: importing this fills the catalogue."""

from toponav.worlds.generate import (
    _pieces_bath,
    _pieces_bedroom,
    _pieces_decor,
    _pieces_kitchen,
    _pieces_seats,
    _pieces_storage,
    _pieces_tables,
)
from toponav.worlds.generate._catalogue import CLASSES, FurnitureClass, parametric_model

__all__ = ["CLASSES", "FurnitureClass", "parametric_model"]

_MODULES = (
    _pieces_bath,
    _pieces_bedroom,
    _pieces_decor,
    _pieces_kitchen,
    _pieces_seats,
    _pieces_storage,
    _pieces_tables,
)
