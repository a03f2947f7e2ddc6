"""`toponav map edit`: a map in the browser."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.maps.editor.map_file import MapFile
    from toponav.maps.editor.serve import Editor
    from toponav.worlds.scene import Scene

__all__ = ["edit"]

_ROBOT_RADIUS_M = 0.18
_YAML = (".yaml", ".yml")


def edit(
    map: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="MAP")],
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
    if not map.name.endswith(".json"):
        raise InputError(
            f"a map is a JSON file, got '{map.name}'",
            where=str(map),
            remedy=f"name it {map.stem or 'map'}.topo.json, or use `toponav map convert` first",
        )
    file = MapFile(map)
    building = given[0] if given else _named_plan(file.open().document, file.path)
    if building is None:
        return Editor(file, Workshop())
    return _over(file, _load_scene(building), building)


def _named_plan(document: dict[str, Any], map_path: Path) -> Path | None:
    """The floor plan that a map names, where it is still there."""
    name = document["frame"]["plan"]
    plan = map_path.parent / name if name else None
    return plan if plan is not None and plan.is_file() else None


def _load_scene(building: Path) -> "Scene":
    """The scene of a folder, of a floor plan inside of one, of an area, or of a bare ROS map."""
    from toponav.worlds.load.stanford import load_area
    from toponav.worlds.storage import load_scene

    if building.suffix.lower() not in _YAML:
        return load_scene(building)
    if (building.parent / "scene.json").is_file():
        return load_scene(building.parent)
    return load_area(building)


def _over(file: "MapFile", scene: "Scene", building: Path) -> "Editor":
    """The editor with all that a building adds: its plan, the checks of places, construction."""
    from toponav.maps.construct import map_from_scene
    from toponav.maps.editor.floor import Floor
    from toponav.maps.editor.serve import Editor
    from toponav.maps.editor.work import Workshop
    from toponav.maps.validate import Building
    from toponav.worlds.free_space import FreeSpace
    from toponav.worlds.load.stanford import AreaFiles

    is_area = building.suffix.lower() in _YAML and not (building.parent / "scene.json").is_file()
    left_out = AreaFiles.read(building).invalid_rooms if is_area else ()
    has_rooms = bool(scene.rooms)
    known = Building(
        rooms={room.name: room.kind for room in scene.rooms} if has_rooms else None,
        rooms_left_out=frozenset(left_out),
        room_at=scene.room_at if has_rooms else None,
        is_free=FreeSpace.of(scene, _ROBOT_RADIUS_M).is_free,
    )
    return Editor(file, Workshop(known, lambda: map_from_scene(scene)), Floor.of_scene(scene))
