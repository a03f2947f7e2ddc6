"""`toponav map edit`: a map in the browser."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toponav.cli._map_files import (
    MapPath,
    building_of_scene,
    is_yaml,
    load_building,
    require_map_name,
)
from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.maps.editor.map_file import MapFile
    from toponav.maps.editor.serve import Editor

__all__ = ["edit"]


def edit(
    map: MapPath,
    scene: Path | None = None,
    area: Path | None = None,
    plan: Path | None = None,
    port: int = 0,
    browser: bool = True,
) -> int:
    """Draw and correct a map in the browser, over the floor plan, checked while you draw.

    Serves a page to this machine alone until Ctrl+C. Edits are saved as you make them; what the
    file held before is kept beside it with `~` after its name. Without a building the floor plan
    that the map names is shown.

    Example: toponav map edit area_3.topo.json --area graphnav_areas/area_3.yaml

    Args:
        map: A `*.topo.json`; a new one is started where there is none.
        scene: Building to draw it over: folder of a scene.
        area: Building to draw it over: the yaml of a Stanford area.
        plan: Floor plan to draw it over: the yaml of a ROS map.
        port: Port of 127.0.0.1 to listen on; any free one when 0.
        browser: Open the page in the browser.
    """
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    editor = _editor(map, scene, area, plan)

    def announce(address: str) -> None:
        console.print(f"editing {map}: open\n  {address}\nCtrl+C ends", markup=False)

    editor.serve(port=port, open_browser=browser, announce=announce)
    return 0


def _editor(map: Path, scene: Path | None, area: Path | None, plan: Path | None) -> "Editor":
    """The editor with what is known of the map's building."""
    from toponav.maps.editor.map_file import MapFile
    from toponav.maps.editor.serve import Editor
    from toponav.maps.editor.work import Workshop

    given = [path for path in (scene, area, plan) if path is not None]
    if len(given) > 1:
        raise InputError(
            f"a map lies over one building, got {len(given)}",
            where="--scene, --area, --plan",
            remedy="give one of them",
        )
    require_map_name(map)
    if not given:
        file = MapFile(map)
        named = _named_plan(file.open().document, file.path)
        return Editor(file, Workshop()) if named is None else _over(file, named)
    plan_yaml = given[0] if is_yaml(given[0]) else given[0] / "map.yaml"
    relative = os.path.relpath(plan_yaml.absolute(), map.resolve().parent)
    return _over(MapFile(map, plan=Path(relative).as_posix()), given[0])


def _named_plan(document: dict[str, Any], map_path: Path) -> Path | None:
    """The floor plan that a map names, where it is still there."""
    name = document["frame"]["plan"]
    plan = map_path.parent / name if name else None
    return plan if plan is not None and plan.is_file() else None


def _over(file: "MapFile", building: Path) -> "Editor":
    """The editor with all that a building adds: its plan, the checks of places, construction."""
    from toponav.maps.construct import map_from_scene
    from toponav.maps.editor.floor import Floor
    from toponav.maps.editor.serve import Editor
    from toponav.maps.editor.work import Workshop

    if is_yaml(building) and (building.parent / "scene.json").is_file():
        building = building.parent
    scene = load_building(building)
    known = building_of_scene(scene, building)
    return Editor(file, Workshop(known, lambda: map_from_scene(scene)), Floor.of_scene(scene))
