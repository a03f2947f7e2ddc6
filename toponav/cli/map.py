"""`toponav map`: build, check, look at, plan on, convert and edit topological maps."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.cli._map_files import (
    Json,
    area_map,
    is_yaml,
    load_building,
    require_map_name,
    with_plan,
)
from toponav.cli.map_check import check
from toponav.cli.map_convert import convert
from toponav.cli.map_edit import edit
from toponav.cli.map_show import describe, plan, show
from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.maps.spec import TopologicalMap

__all__ = ["build", "check", "convert", "edit", "plan", "register", "show"]

Source = Literal["auto", "floor", "drawing"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module by the words that call them."""
    return {
        ("map", "build"): build,
        ("map", "check"): check,
        ("map", "show"): show,
        ("map", "plan"): plan,
        ("map", "convert"): convert,
        ("map", "edit"): edit,
    }


def build(
    building: Annotated[Path, tyro.conf.Positional],
    out: Path,
    source: Annotated[Source, tyro.conf.arg(name="from")] = "auto",
    as_json: Json = False,
) -> int:
    """Build the topological map of a building from its floor plan.

    Rooms come from the scene, or are cut from the free space where it names none. Doors are
    the gaps between rooms that a robot fits through; corridors follow the middle of hallways.
    A generated office knows its own hallways and gives its map from them.

    Example: toponav map build graphnav_areas/area_3.yaml --out area_3.topo.json

    Args:
        building: Folder of a scene, or the yaml of a Stanford area or of a ROS map.
        out: Map to write, `NAME.topo.json`.
        source: `auto`, `floor` to measure a generated office too, or `drawing` for the map
            that the authors drew of a Stanford area.
        as_json: Print what was made as JSON.
    """
    from toponav.maps.spec import save_map

    require_map_name(out)
    made = _made(building, source)
    plan_yaml = building if is_yaml(building) else building / "map.yaml"
    made = with_plan(made, plan_yaml, out)
    save_map(made, out)
    return describe(made, out, as_json)


def _made(building: Path, source: Source) -> "TopologicalMap":
    """The map of a building, from the source asked for."""
    from toponav.maps.construct import map_from_scene

    if source == "drawing":
        if not is_yaml(building):
            raise InputError(
                "only Stanford areas come with the authors' drawing",
                where=str(building),
                remedy="leave out --from drawing, or give the yaml of an area",
            )
        return area_map(building)
    return map_from_scene(load_building(building), use_layout=source == "auto")
