"""`toponav map`: build, check, look at, plan on and convert topological maps."""

import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from toponav.cli.map_convert import convert
from toponav.core.errors import InputError
from toponav.core.files import check_out_file

if TYPE_CHECKING:
    from toponav.maps.plan import Plan
    from toponav.maps.spec import TopologicalMap
    from toponav.maps.validate import Building, Fault
    from toponav.worlds.scene import Scene

__all__ = ["build", "check", "convert", "plan", "register", "show"]

_ROBOT_RADIUS_M = 0.18
_YAML = (".yaml", ".yml")
_IMAGES = (".png", ".pdf", ".svg", ".jpg")

Json = Annotated[bool, tyro.conf.arg(name="json")]
MapPath = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="MAP")]
NodeId = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="NODE")]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module by the words that call them."""
    from toponav.cli.map_edit import edit

    return {
        ("map", "build"): build,
        ("map", "check"): check,
        ("map", "show"): show,
        ("map", "plan"): plan,
        ("map", "convert"): convert,
        ("map", "edit"): edit,
    }


def build(
    building: Annotated[Path, tyro.conf.Positional], out: Path, as_json: Json = False
) -> int:
    """Write the topological map of a building.

    A generated scene gives it from its layout, a Stanford area from the authors' drawing.

    Example: toponav map build graphnav_areas/area_3.yaml --out area_3.topo.json

    Args:
        building: Folder of a generated scene, or the yaml of a Stanford area.
        out: Map to write, `NAME.topo.json`.
        as_json: Print what was made as JSON.
    """
    from toponav.maps.spec import save_map

    _require_map_name(out)
    if building.suffix.lower() in _YAML:
        made, plan_yaml = _area_map(building), building
    else:
        made, plan_yaml = _scene_map(_load_scene(building)), building / "map.yaml"
    made = _with_plan(made, plan_yaml, out)
    save_map(made, out)
    return _report(made, out, as_json)


def check(
    map: MapPath,
    scene: Path | None = None,
    as_json: Json = False,
) -> int:
    """Report every fault of a map, each with its place and remedy; status 1 if any is an error.

    The six rules of GraphNav's section IV, and what any map needs. With the building, it also
    checks that nodes stand in their rooms and that the robot fits there.

    Example: toponav map check area_3.topo.json --scene graphnav_areas/area_3.yaml

    Args:
        map: A `*.topo.json`, or the yaml of a Stanford area to check the authors' drawing.
        scene: Building: folder of a scene, or the yaml of a Stanford area.
        as_json: Print the faults as JSON.
    """
    from toponav.maps.validate import check_file, has_errors, validate

    if map.suffix.lower() in _YAML:
        from toponav.maps.formats.canvas import drawing_faults
        from toponav.worlds.load.stanford import AreaFiles

        files = AreaFiles.read(map)
        drawn = _area_map(map)
        faults = (*validate(drawn, _building(scene or map)), *drawing_faults(files, drawn))
    else:
        faults = check_file(map, None if scene is None else _building(scene))[1]
    if as_json:
        document = {"map": str(map), "faults": [fault.to_document() for fault in faults]}
        print(json.dumps(document, indent=1))
    else:
        _print_faults(map, faults)
    return int(has_errors(faults))


def show(
    map: MapPath,
    out: Path = Path("map.png"),
    scene: Path | None = None,
    start: str | None = None,
    goal: str | None = None,
    as_json: Json = False,
) -> int:
    """Describe a map and draw it, over the floor plan where that is known.

    Example: toponav map show area_3.topo.json --out area_3.png --start office_5 --goal WC_2

    Args:
        map: A `*.topo.json`, or the yaml of a Stanford area.
        out: Image to write, PNG, PDF, SVG or JPG.
        scene: Building to draw it over; default the floor plan that the map names.
        start: Node to start a plan from, to draw it too.
        goal: Node that the plan leads to.
        as_json: Print the description as JSON.
    """
    from toponav.maps.plan import shortest_plan

    if out.suffix.lower() not in _IMAGES:
        raise InputError(
            f"the image must be PNG, PDF, SVG or JPG, got '{out.suffix}'",
            where="--out",
            remedy="name a file such as map.png",
        )
    check_out_file(out)
    if (start is None) != (goal is None):
        raise InputError(
            "a plan has a start and a goal, got one of them",
            where="--start, --goal",
            remedy="give both or neither",
        )
    shown = _load(map)
    walk = None if start is None or goal is None else shortest_plan(shown, start, goal)
    _draw(shown, walk, out, scene, map)
    return _report(shown, out, as_json)


def plan(
    map: MapPath,
    start: NodeId,
    goal: NodeId,
    as_json: Json = False,
) -> int:
    """Print the plan with the fewest behaviours from one node to another.

    Example: toponav map plan area_3.topo.json office_5 WC_2

    Args:
        map: A `*.topo.json`, or the yaml of a Stanford area.
        start: Node to start from; rooms have a node of their name.
        goal: Node to reach.
        as_json: Print the plan as JSON.
    """
    from toponav.maps.plan import shortest_plan

    loaded = _load(map)
    walk = shortest_plan(loaded, start, goal)
    edges = [loaded.edge(edge) for edge in walk.edges]
    if as_json:
        document = {
            "nodes": walk.nodes,
            "edges": walk.edges,
            "behaviors": [edge.behavior.value for edge in edges],
            "lengths_m": [round(edge.length_m, 3) for edge in edges],
            "length_m": round(walk.length_m(loaded), 3),
            "difficulty": walk.difficulty.value,
        }
        print(json.dumps(document, indent=1))
        return 0
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table("", "node", "then", "metres", box=None, pad_edge=False)
    for number, (node, edge) in enumerate(zip(walk.nodes, edges, strict=False), start=1):
        table.add_row(str(number), escape(node), edge.behavior.value, f"{edge.length_m:.1f}")
    table.add_row(str(len(walk.nodes)), escape(walk.nodes[-1]), "goal", "")
    console = Console()
    console.print(table)
    console.print(
        f"{len(walk.nodes)} nodes, {walk.length_m(loaded):.1f} m, difficulty {walk.difficulty}"
    )
    return 0


def _require_map_name(path: Path) -> None:
    if not path.name.endswith(".json"):
        raise InputError(
            f"a map is a JSON file, got '{path.name}'",
            where=str(path),
            remedy=f"name it {path.stem or 'map'}.topo.json",
        )
    check_out_file(path, flag="map")


def _load(path: Path) -> "TopologicalMap":
    from toponav.maps.spec import load_map

    return _area_map(path) if path.suffix.lower() in _YAML else load_map(path)


def _area_map(area_yaml: Path) -> "TopologicalMap":
    from toponav.maps.formats.canvas import load_area_map

    return load_area_map(area_yaml)


def _scene_map(scene: "Scene") -> "TopologicalMap":
    from toponav.maps.construct import map_from_layout

    return map_from_layout(scene)


def _load_scene(path: Path) -> "Scene":
    from toponav.worlds.load.stanford import load_area
    from toponav.worlds.storage import load_scene

    return load_area(path) if path.suffix.lower() in _YAML else load_scene(path)


def _with_plan(made: "TopologicalMap", plan_yaml: Path, out: Path) -> "TopologicalMap":
    """The map with a reference to its floor plan that holds where the map is written."""
    from dataclasses import replace

    relative = os.path.relpath(plan_yaml.absolute(), out.absolute().parent)
    frame = replace(made.frame, plan=Path(relative).as_posix() if plan_yaml.is_file() else None)
    return replace(made, frame=frame)


def _building(path: Path) -> "Building":
    """What the checks may ask about the building."""
    from toponav.maps.validate import Building
    from toponav.worlds.free_space import FreeSpace
    from toponav.worlds.load.stanford import AreaFiles

    scene = _load_scene(path)
    left_out: tuple[str, ...] = ()
    if path.suffix.lower() in _YAML:
        left_out = AreaFiles.read(path).invalid_rooms
    has_rooms = bool(scene.rooms)
    return Building(
        rooms={room.name: room.kind for room in scene.rooms} if has_rooms else None,
        rooms_left_out=frozenset(left_out),
        room_at=scene.room_at if has_rooms else None,
        is_free=FreeSpace.of(scene, _ROBOT_RADIUS_M).is_free,
    )


def _print_faults(path: Path, faults: "Sequence[Fault]") -> None:
    from rich.console import Console
    from rich.markup import escape

    console = Console(soft_wrap=True)
    for fault in faults:
        color = {"error": "red", "warning": "yellow"}[fault.severity]
        number = fault.rule.paper_number
        rule = f"{fault.rule}{f' (rule {number})' if number else ''}"
        where = "" if fault.place_m is None else " at ({:.2f}, {:.2f})".format(*fault.place_m)
        console.print(
            f"[{color}]{fault.severity}[/{color}] {escape(fault.element)}{where}: {rule}\n"
            f"    {escape(fault.message)}. Remedy: {escape(fault.remedy)}",
            highlight=False,
        )
    counts = Counter(fault.severity for fault in faults)
    found = ", ".join(
        f"{count} {kind}{'s' if count > 1 else ''}" for kind, count in sorted(counts.items())
    )
    console.print(f"{path}: {found or 'no faults'}", highlight=False, markup=False)


def _report(made: "TopologicalMap", out: Path, as_json: bool) -> int:
    behaviors = Counter(edge.behavior.value for edge in made.edges)
    kinds = Counter(node.kind.value for node in made.nodes)
    document = {
        "map": made.name,
        "wrote": str(out),
        "nodes": len(made.nodes),
        "edges": len(made.edges),
        "nodes_by_kind": dict(sorted(kinds.items())),
        "edges_by_behavior": dict(sorted(behaviors.items())),
        "metres": round(sum(edge.length_m for edge in made.edges), 2),
    }
    if as_json:
        print(json.dumps(document, indent=1))
        return 0
    from rich.console import Console

    console = Console(soft_wrap=True, highlight=False)
    console.print(f"{made.name}: {len(made.nodes)} nodes, {len(made.edges)} edges", markup=False)
    for title, counts in (("nodes", kinds), ("edges", behaviors)):
        console.print(f"  {title}: " + ", ".join(f"{n} {k}" for k, n in sorted(counts.items())))
    console.print(f"wrote {out}", markup=False)
    return 0


def _draw(
    shown: "TopologicalMap", walk: "Plan | None", out: Path, scene: Path | None, source: Path
) -> None:
    from matplotlib.figure import Figure

    from toponav.cli._figures import save_figure
    from toponav.maps.draw import draw_floor, draw_map
    from toponav.worlds.draw import draw_plan
    from toponav.worlds.load.ros_map import read_ros_map

    figure = Figure(figsize=(11.0, 11.0), layout="constrained")
    axes = figure.add_subplot()
    floor = source.parent / shown.frame.plan if shown.frame.plan else None
    if scene is not None:
        draw_plan(axes, _load_scene(scene), names=False)
    elif floor is not None and floor.is_file():
        ros_map = read_ros_map(floor)
        draw_floor(axes, ros_map.occupied, ros_map.grid.origin_m, ros_map.grid.resolution_m)
    draw_map(axes, shown, walk)
    axes.set_title(shown.name)
    save_figure(figure, out, dpi=150)
