"""`toponav explore`: Neural Topological SLAM maps a building."""

import json as json_module
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
    steps: int = 1000,
    seed: int = 0,
    no_noise: _Flag = False,
    rgb: _Flag = False,
    weights: str | None = None,
    json: _Flag = False,
) -> int:
    """Map a building as Neural Topological SLAM does: drive, see, add nodes and edges.

    toponav explore home --out home.topo.json

    Writes the map, where any other command reads it, and beside it a folder of the same name with
    the image graph: its panoramas, its edges as measured, and what was left to explore.

    Args:
        scene: Folder of a scene.
        out: Map to write, `NAME.topo.json`.
        steps: Actions at most.
        seed: Seed of the start and of the noise.
        no_noise: Perfect motions and odometry.
        rgb: Without a depth camera.
        weights: Folder of other weights. What ships, if left out.
        json: Print what was found as JSON.
    """
    from toponav.cli._map_files import require_map_name
    from toponav.evaluation.imagenav.explore import ExploreConfig, explore_building
    from toponav.maps.spec import save_map
    from toponav.models.checkpoints import load_nts
    from toponav.worlds.storage import load_scene

    require_map_name(out)
    config = ExploreConfig(steps=steps, noise=not no_noise, seed=seed)
    found = explore_building(load_scene(scene), load_nts(weights or "nts", depth=not rgb), config)
    save_map(found.map, out)
    folder = out.with_name(out.name.removesuffix(".topo.json") + "-graph")
    found.graph.save(folder)
    numbers = {
        "nodes": len(found.graph.nodes),
        "edges": len(found.graph.edges),
        "unexplored": len(found.graph.ghosts),
        "covered": round(found.covered, 3),
        "steps": found.steps,
    }
    if json:
        print(json_module.dumps({**numbers, "map": str(out), "graph": str(folder)}))
    else:
        print(
            f"{numbers['nodes']} places and {numbers['edges']} ways between them in {found.steps} "
            f"steps; {100 * found.covered:.0f} % of the floor came within 3 m\n{out}\n{folder}"
        )
    return 0
