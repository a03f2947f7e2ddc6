"""`toponav scene`: make, import and look at buildings."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.cli.scene_import import import_scene
from toponav.core.errors import InputError
from toponav.core.files import check_out_file, check_out_folder

if TYPE_CHECKING:
    from toponav.worlds.scene import Scene

__all__ = [
    "facts_of",
    "generate_home",
    "generate_office",
    "import_scene",
    "print_facts",
    "register",
    "show_scene",
]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module by the words that call them."""
    return {
        ("scene", "generate", "office"): generate_office,
        ("scene", "generate", "home"): generate_home,
        ("scene", "import"): import_scene,
        ("scene", "show"): show_scene,
    }


def generate_office(
    out: Path,
    seed: int = 0,
    size: Literal["any", "small", "medium", "large"] = "any",
    partitions: float = 0.0,
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Generate an office floor: corridors, rooms, doors and furniture.

    The same seed and version make the same building, bit for bit.

    Example: toponav scene generate office --seed 7 --out scenes/office_7

    Args:
        out: Folder to write the scene to.
        seed: Which building.
        size: How large; `any` lets the seed choose.
        partitions: Share of the rooms that walls with gaps divide into chambers.
        as_json: Print what was made as JSON.
    """
    from toponav.worlds.generate.office import generate_office as generate
    from toponav.worlds.storage import save_scene

    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}", where="--seed", remedy="use 0")
    check_out_folder(out)
    scene = generate(seed, size=None if size == "any" else size, partitions=partitions)
    save_scene(scene, out)
    return _report(scene, out, as_json)


def generate_home(
    out: Path,
    seed: int = 0,
    rooms: int | None = None,
    furniture: tuple[Path, ...] = (),
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Generate a furnished home: rooms, doors, windows and furniture with textures.

    The same seed and version make the same home, bit for bit. From furniture libraries, homes of
    seeds 2000 to 2999 (for testing) take the models that are held out, and no other home does.

    Example: toponav scene generate home --seed 7 --rooms 6 --out scenes/home_7

    With real furniture: toponav scene generate home --seed 7 --out scenes/home_7 --furniture
    /usr/share/sweethome3d/furniture/Scopia.sh3f

    Args:
        out: Folder to write the scene to.
        seed: Which home.
        rooms: How many rooms, hallways included, 2 to 9; the seed chooses where not given.
        furniture: Libraries of Sweet Home 3D (.sh3f) to furnish from; who made their models is
            kept in the scene. What they lack is parametric furniture, as without any.
        as_json: Print what was made as JSON.
    """
    from toponav.worlds.furniture_library import join_libraries, load_sh3f
    from toponav.worlds.generate.home import generate_home as generate
    from toponav.worlds.storage import save_scene

    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}", where="--seed", remedy="use 0")
    check_out_folder(out)
    libraries = [load_sh3f(path) for path in furniture]
    scene = generate(seed, rooms=rooms, furniture=join_libraries(libraries) if libraries else None)
    save_scene(scene, out)
    return _report(scene, out, as_json)


def show_scene(
    scene: Annotated[Path, tyro.conf.Positional],
    out: Path | None = None,
    views: int = 4,
    web: bool = False,
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Describe a scene and draw its floor plan, colour views and a panorama; or turn it in 3-D.

    Example: toponav scene show scenes/area_3 --out area_3.png

    Args:
        scene: Folder of the scene, or the yaml of a Stanford area or ROS map.
        out: Image to write, PNG, PDF or SVG; default `plan.png` in the current folder. With
            `--web` an HTML page; where none is named the page opens in the browser.
        views: How many views to draw below the plan.
        web: Write one web page that holds the scene as a 3-D model, to turn and walk around.
        as_json: Print the description as JSON.
    """
    from toponav.worlds.load.stanford import load_area
    from toponav.worlds.storage import load_scene

    if not 0 <= views <= 24:
        raise InputError(f"views must lie in 0..24, got {views}", where="--views", remedy="use 4")
    target = out or Path("scene.html" if web else "plan.png")
    endings = (".html", ".htm") if web else (".png", ".pdf", ".svg")
    if target.suffix.lower() not in endings:
        what = "the page must be HTML" if web else "the image must be PNG, PDF or SVG"
        raise InputError(
            f"{what}, got '{target.suffix}'",
            where="--out",
            remedy=f"name a file such as {'scene.html' if web else 'plan.png'}",
        )
    check_out_file(target)
    building = load_area(scene) if scene.suffix in (".yaml", ".yml") else load_scene(scene)
    if web:
        _write_page(building, target, show=out is None)
    else:
        _write_figure(building, target, views)
    return _report(building, target, as_json)


def _write_figure(scene: "Scene", target: Path, views: int) -> None:
    import matplotlib

    from toponav.cli._figures import save_figure
    from toponav.cli._scene_figure import scene_figure

    with matplotlib.rc_context({"svg.fonttype": "none"}):
        save_figure(scene_figure(scene, views), target, dpi=150, bbox_inches="tight")


def _write_page(scene: "Scene", target: Path, show: bool) -> None:
    from toponav.core.files import write_atomically
    from toponav.worlds.web_page import scene_page

    write_atomically(target, scene_page(scene))
    if show:
        import webbrowser

        webbrowser.open(target.resolve().as_uri())


def _report(scene: "Scene", where: Path, as_json: bool) -> int:
    """Prints what the scene holds and where the result lies."""
    facts = facts_of(scene, where)
    if as_json:
        print(json.dumps(facts))
    else:
        print_facts(facts)
    return 0


def facts_of(scene: "Scene", where: Path) -> dict[str, Any]:
    """What a scene holds, and where it was written."""
    kinds = [str(room.kind) for room in scene.rooms]
    return {
        "name": scene.name,
        "written": str(where),
        "size_m": [
            round(scene.grid.cols * scene.grid.resolution_m, 2),
            round(scene.grid.rows * scene.grid.resolution_m, 2),
        ],
        "ceiling_m": scene.ceiling_m,
        "rooms": {kind: kinds.count(kind) for kind in sorted(set(kinds))},
        "doors": len(scene.doors),
        "triangles": len(scene.mesh.faces),
        "content_hash": scene.content_hash,
        "attribution": [dataclasses.asdict(entry) for entry in scene.attribution],
    }


def print_facts(facts: dict[str, Any]) -> None:
    """Facts as a table for people."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(show_header=False, box=None)
    for key, value in facts.items():
        if key == "attribution":
            for entry in value:
                by = f"{entry['work']}: {entry['creator']}, {entry['licence']}"
                table.add_row("work by others", escape(by))
            continue
        if isinstance(value, dict):
            value = ", ".join(f"{count} {kind}" for kind, count in value.items()) or "none"
        elif isinstance(value, list):
            value = " x ".join(map(str, value))
        table.add_row(key, escape(str(value)))
    Console().print(table)
