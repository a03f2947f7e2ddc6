"""`toponav explore`: Neural Topological SLAM maps a building."""

import json as json_module
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import tyro

__all__ = ["explore", "register"]

_Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {("explore",): explore}


def explore(
    scene: Annotated[Path, tyro.conf.Positional],
    /,
    *,
    out: Path,
    steps: int = 3000,
    seed: int = 0,
    no_noise: _Flag = False,
    rgb: _Flag = False,
    weights: str | None = None,
    drive: int = 0,
    json: _Flag = False,
) -> int:
    """Map a building as Neural Topological SLAM does: drive, see, add nodes and edges.

    toponav explore office --out office.topo.json

    Map it, and let GraphNav drive ten plans on that map:

    toponav explore office --out office.topo.json --drive 10

    Writes the map, with rooms, doors and behaviours made from the floor that was seen, where any
    other command reads it. Beside it lie folders of the same name: `-graph`, the image graph with
    its panoramas, its edges as measured, and what was left to explore; and `-building`, the
    building with the rooms that the map names, which `toponav eval graphnav` takes with the map.

    Args:
        scene: Folder of a scene.
        out: Map to write, `NAME.topo.json`.
        steps: Actions at most.
        seed: Seed of the start, of the noise and of the plans.
        no_noise: Perfect motions and odometry.
        rgb: Without a depth camera.
        weights: Folder of other weights. What ships, if left out.
        drive: Let GraphNav and the expert drive so many plans on the map.
        json: Print what was found as JSON.
    """
    from toponav.cli._map_files import require_map_name
    from toponav.cli.progress_bar import progress
    from toponav.core.errors import InputError
    from toponav.evaluation.imagenav.drive_explored import drive_explored
    from toponav.evaluation.imagenav.explore import ExploreConfig, explore_building
    from toponav.evaluation.imagenav.explored_map import with_rooms_of
    from toponav.evaluation.metrics import suite_results
    from toponav.maps.spec import save_map
    from toponav.models.checkpoints import load_nts
    from toponav.worlds.storage import load_scene, save_scene

    require_map_name(out)
    if not 0 <= drive <= 1000:
        raise InputError(
            f"plans to drive are 0 to 1000, got {drive}",
            where="--drive",
            remedy="ten show how well the map serves",
        )
    building = load_scene(scene)
    config = ExploreConfig(steps=steps, noise=not no_noise, seed=seed)
    with progress("exploring") as update:
        found = explore_building(
            building, load_nts(weights or "nts", depth=not rgb), config, update
        )
    save_map(found.map, out)
    folder = _beside(out, "graph")
    found.graph.save(folder)
    if not found.why_no_rooms:
        save_scene(with_rooms_of(building, found.floor), _beside(out, "building"))
    results: dict[str, Any] = {}
    if drive:
        with progress("driving on the map") as update:
            results = suite_results(
                drive_explored(building, found, drive, seed=seed, progress=update)
            )
    _print(found, out, folder, results, json)
    return 0


def _beside(out: Path, what: str) -> Path:
    return out.with_name(f"{out.name.removesuffix('.json').removesuffix('.topo')}-{what}")


def _print(found: Any, out: Path, folder: Path, results: dict[str, Any], json: bool) -> None:
    kinds = Counter(str(node.kind) for node in found.map.nodes)
    numbers = {
        "nodes": len(found.graph.nodes),
        "edges": len(found.graph.edges),
        "unexplored": len(found.graph.ghosts),
        "covered": round(found.covered, 3),
        "off_m": round(found.off_m, 3),
        "steps": found.steps,
        "rooms": kinds["room"],
        "doors": kinds["door"],
        "map_nodes": len(found.map.nodes),
        "map_edges": len(found.map.edges),
        "why_no_rooms": found.why_no_rooms,
    }
    if json:
        made = {"map": str(out), "graph": str(folder)}
        print(json_module.dumps({**numbers, **made, **({"drive": results} if results else {})}))
        return
    print(
        f"{numbers['nodes']} places and {numbers['edges']} ways between them in {found.steps} "
        f"steps; {100 * found.covered:.0f} % of the floor came within 3 m; at the end the robot "
        f"was {found.off_m:.2f} m from where it thought"
    )
    if found.why_no_rooms:
        print(f"the map has no rooms and doors: {found.why_no_rooms}")
    else:
        print(
            f"the map has {kinds['room']} rooms, {kinds['door']} doors, {len(found.map.nodes)} "
            f"nodes and {len(found.map.edges)} behaviours"
        )
    if results:
        from toponav.cli.tables import whole
        from toponav.evaluation.tables import summary_table

        print(whole(summary_table(results, title="driving on that map")))
    print(f"{out}\n{folder}")
