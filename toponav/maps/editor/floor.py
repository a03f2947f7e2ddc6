"""The floor plan under a map, as pictures and rooms that a page can show."""

import base64
import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Int16, UInt8
from PIL import Image

from toponav.worlds.draw import plan_image, room_anchors_m
from toponav.worlds.grid import GridFrame
from toponav.worlds.scene import Scene

__all__ = ["Floor"]

_MOST_ROOM_CELLS = 400_000
_NOTHING = 255


@dataclass(frozen=True, eq=False)
class Floor:
    """What is drawn under a map."""

    grid: GridFrame
    """Where its cells lie."""
    image: UInt8[np.ndarray, "rows cols 3"]
    """Its picture; row 0 at the lowest y."""
    room_index: Int16[np.ndarray, "rows cols"] | None = None
    """Number of the room of each cell, -1 for none; None where rooms are not known."""
    rooms: tuple[dict[str, Any], ...] = ()
    """Name, kind and a point inside of each room."""

    @classmethod
    def of_scene(cls, scene: Scene) -> "Floor":
        """The floor plan of a building, rooms tinted by kind."""
        anchors = room_anchors_m(scene)
        rooms = tuple(
            {
                "name": room.name,
                "kind": room.kind.value,
                "enclosed": room.kind.is_enclosed,
                "at": anchor.tolist() if np.isfinite(anchor).all() else None,
            }
            for room, anchor in zip(scene.rooms, anchors, strict=True)
        )
        return cls(scene.grid, plan_image(scene), scene.room_index, rooms)

    def png(self, *, dark: bool) -> bytes:
        """Its picture as PNG, for a light or a dark page; what lies outside is transparent."""
        image = self.image[::-1]
        nothing = (image == _NOTHING).all(axis=2)
        colors = _darkened(image) if dark else image
        alpha = np.where(nothing & (self.room_index is not None), 0, 255).astype(np.uint8)
        buffer = io.BytesIO()
        Image.fromarray(np.dstack([colors, alpha])).save(buffer, "PNG", compress_level=6)
        return buffer.getvalue()

    def to_document(self) -> dict[str, Any]:
        """Where it lies and the rooms on it, as JSON; cells are thinned to what a page needs."""
        left, right, bottom, top = self.grid.extent_m
        document: dict[str, Any] = {
            "extent": [left, right, bottom, top],
            "rooms": list(self.rooms),
            "cells": None,
        }
        if self.room_index is not None:
            step = max(1, int(np.ceil(np.sqrt(self.room_index.size / _MOST_ROOM_CELLS))))
            thinned = np.ascontiguousarray(self.room_index[step // 2 :: step, step // 2 :: step])
            document["cells"] = {
                "rows": thinned.shape[0],
                "cols": thinned.shape[1],
                "side": self.grid.resolution_m * step,
                "data": base64.b64encode(thinned.astype("<i2").tobytes()).decode("ascii"),
            }
        return document


def _darkened(image: UInt8[np.ndarray, "rows cols 3"]) -> UInt8[np.ndarray, "rows cols 3"]:
    """The same hues with light and dark exchanged, never brighter than a dark page can bear."""
    wide = image.astype(np.int16)
    turned = wide + 255 - wide.max(axis=2, keepdims=True) - wide.min(axis=2, keepdims=True)
    return np.asarray(np.clip(turned * 0.58 + 30, 0, 255), dtype=np.uint8)
