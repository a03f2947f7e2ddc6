"""`toponav scene`: make, import and look at buildings."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.cli.scene_import import import_scene
from toponav.core.errors import InputError
from toponav.core.files import check_out_file, check_out_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from toponav.core.geometry import Pose2
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
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Generate an office floor: corridors, rooms, doors and furniture.

    The same seed and version make the same building, bit for bit.

    Example: toponav scene generate office --seed 7 --out scenes/office_7

    Args:
        out: Folder to write the scene to.
        seed: Which building.
        size: How large; `any` lets the seed choose.
        as_json: Print what was made as JSON.
    """
    from toponav.worlds.generate.office import generate_office as generate
    from toponav.worlds.storage import save_scene

    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}", where="--seed", remedy="use 0")
    check_out_folder(out)
    scene = generate(seed, size=None if size == "any" else size)
    save_scene(scene, out)
    return _report(scene, out, as_json)


def generate_home(
    out: Path,
    seed: int = 0,
    rooms: int | None = None,
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Generate a furnished home: rooms, doors, windows and furniture with textures.

    The same seed and version make the same home, bit for bit.

    Example: toponav scene generate home --seed 7 --rooms 6 --out scenes/home_7

    Args:
        out: Folder to write the scene to.
        seed: Which home.
        rooms: How many rooms, hallways included, 2 to 9; the seed chooses where not given.
        as_json: Print what was made as JSON.
    """
    from toponav.worlds.generate.home import generate_home as generate
    from toponav.worlds.storage import save_scene

    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}", where="--seed", remedy="use 0")
    check_out_folder(out)
    scene = generate(seed, rooms=rooms)
    save_scene(scene, out)
    return _report(scene, out, as_json)


def show_scene(
    scene: Annotated[Path, tyro.conf.Positional],
    out: Path | None = None,
    views: int = 4,
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Describe a scene and draw its floor plan with some depth views.

    Example: toponav scene show scenes/area_3 --out area_3.png

    Args:
        scene: Folder of the scene, or the yaml of a Stanford area or ROS map.
        out: Image to write, PNG, PDF or SVG; default `plan.png` in the current folder.
        views: How many depth views to draw beside the plan.
        as_json: Print the description as JSON.
    """
    import matplotlib

    from toponav.cli._figures import save_figure
    from toponav.worlds.load.stanford import load_area
    from toponav.worlds.storage import load_scene

    if not 0 <= views <= 24:
        raise InputError(f"views must lie in 0..24, got {views}", where="--views", remedy="use 4")
    target = out or Path("plan.png")
    if target.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(
            f"the image must be PNG, PDF or SVG, got '{target.suffix}'",
            where="--out",
            remedy="name a file such as plan.png",
        )
    check_out_file(target)
    building = load_area(scene) if scene.suffix in (".yaml", ".yml") else load_scene(scene)
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure = _figure(building, views)
        save_figure(figure, target, dpi=150, bbox_inches="tight")
    return _report(building, target, as_json)


def _figure(scene: "Scene", views: int) -> "Figure":
    """The plan, and below it depth images from where the plan shows arrows."""
    from matplotlib.figure import Figure

    from toponav.core.camera import PinholeCamera
    from toponav.sim.render.make import make_renderer
    from toponav.worlds.draw import draw_plan

    poses = _view_poses(scene, views)
    heights = [min(9.0 * scene.grid.rows / scene.grid.cols, 14.0), 2.2][: 2 if poses else 1]
    figure = Figure(figsize=(9.0, sum(heights)), layout="constrained")
    grid = figure.add_gridspec(len(heights), max(len(poses), 1), height_ratios=heights)
    plan = figure.add_subplot(grid[0, :])
    draw_plan(plan, scene)
    plan.set_title(scene.name)
    camera = PinholeCamera()
    renderer = make_renderer(scene, camera) if poses else None
    for number, pose in enumerate(poses):
        plan.annotate(
            f"{number + 1}",
            (pose.x_m, pose.y_m),
            color="#b03020",
            fontsize=8,
            ha="center",
            va="center",
            bbox={"boxstyle": "circle,pad=0.15", "fc": "white", "ec": "#b03020", "lw": 0.8},
        )
        ahead = pose.compose(pose._replace(x_m=1.2, y_m=0.0, yaw_rad=0.0))
        plan.annotate(
            "",
            (ahead.x_m, ahead.y_m),
            (pose.x_m, pose.y_m),
            arrowprops={"arrowstyle": "->", "color": "#b03020"},
        )
        assert renderer is not None
        image = figure.add_subplot(grid[1, number])
        image.imshow(renderer.render(pose), cmap="viridis_r", vmin=0, vmax=camera.max_depth_m)
        image.set_title(f"{number + 1}: {scene.room_at(pose.x_m, pose.y_m) or ''}", fontsize=7)
        image.set_axis_off()
    return figure


def _view_poses(scene: "Scene", views: int) -> list["Pose2"]:
    """Poses in rooms spread over the scene, each looking where it is most open."""
    import math

    import numpy as np

    from toponav.core.geometry import Pose2
    from toponav.worlds.draw import room_anchors_m
    from toponav.worlds.free_space import FreeSpace

    anchors = [
        tuple(anchor) for anchor in room_anchors_m(scene).tolist() if anchor[0] == anchor[0]
    ]
    chosen = [
        anchors[i] for i in np.linspace(0, len(anchors) - 1, min(views, len(anchors)), dtype=int)
    ]
    space = FreeSpace.of(scene, 0.2)
    poses = []
    for x_m, y_m in chosen:
        try:
            x_m, y_m = scene.grid.center_of(*space.nearest_free(x_m, y_m, within_m=3.0))
        except InputError:
            continue

        def open_m(yaw_rad: float, x_m: float = x_m, y_m: float = y_m) -> float:
            steps_m = np.arange(0.0, 6.0, 0.1)
            for step_m in steps_m:
                point = x_m + step_m * math.cos(yaw_rad), y_m + step_m * math.sin(yaw_rad)
                if not space.is_free(*point):
                    return float(step_m)
            return float(steps_m[-1])

        yaws = [math.radians(angle) for angle in range(-180, 180, 15)]
        poses.append(Pose2(x_m, y_m, max(yaws, key=open_m)))
    return poses


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
    }


def print_facts(facts: dict[str, Any]) -> None:
    """Facts as a table for people."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(show_header=False, box=None)
    for key, value in facts.items():
        if isinstance(value, dict):
            value = ", ".join(f"{count} {kind}" for kind, count in value.items()) or "none"
        elif isinstance(value, list):
            value = " x ".join(map(str, value))
        table.add_row(key, escape(str(value)))
    Console().print(table)
