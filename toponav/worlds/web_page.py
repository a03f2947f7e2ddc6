"""A building as one web page that turns it in 3-D, without a server or the network.

The page holds everything: the model (`mesh.glb`, as base64) and a small viewer built on three.js,
which draws glTF in every browser since 2017. One file can be kept, sent and opened years later;
a page that fetches its model cannot be opened from disk at all, since browsers forbid that.
"""

import base64
import html
import json
from importlib.resources import files

import numpy as np

from toponav.worlds.draw import room_anchors_m
from toponav.worlds.gltf import glb_bytes
from toponav.worlds.scene import Scene

__all__ = ["scene_page"]


def scene_page(scene: Scene) -> str:
    """HTML that shows the scene in 3-D, with room names and whose work is in it.

    Example:
        >>> scene_page(scene).startswith("<!doctype html>")
        True
    """
    bundle = files("toponav.worlds") / "viewer"
    rooms = [
        {"name": room.name, "x_m": round(float(x_m), 3), "y_m": round(float(y_m), 3)}
        for room, (x_m, y_m) in zip(scene.rooms, room_anchors_m(scene), strict=True)
        if np.isfinite(x_m)
    ]
    # A "<" in a name must not end the element that holds it.
    facts = json.dumps({"name": scene.name, "rooms": rooms}).replace("<", "\\u003c")
    parts = {
        "TITLE": html.escape(scene.name),
        "CREDITS": _credits(scene),
        "FACTS": facts,
        "MODEL": base64.b64encode(glb_bytes(scene.mesh)).decode("ascii"),
        "SCRIPT": (bundle / "viewer.js").read_text("utf-8"),
    }
    page = (bundle / "page.html").read_text("utf-8")
    # Cut at the marks instead of replacing them one by one: a name may look like a mark.
    pieces = page.split("@")
    return "".join(parts.get(piece, piece) for piece in pieces)


def _credits(scene: Scene) -> str:
    """Whose work is in the scene, as a list that unfolds."""
    if not scene.attribution:
        return ""
    entries = "".join(
        f"<li>{html.escape(entry.work)}: {html.escape(entry.creator)}, "
        f"{html.escape(entry.licence)}</li>"
        for entry in scene.attribution
    )
    return f"<details><summary>With work by others</summary><ul>{entries}</ul></details>"
