"""`toponav scene import`: any building that a user already has."""

import json
import sys
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from toponav.core.errors import InputError
from toponav.core.files import check_out_folder

__all__ = ["import_scene"]


def import_scene(
    path: Annotated[Path, tyro.conf.Positional],
    out: Path,
    units: Literal["m", "cm", "mm", "in", "ft"] | None = None,
    up: Literal["x", "y", "z", "-x", "-y", "-z"] | None = None,
    floor_height: float | None = None,
    models: tuple[Path, ...] = (),
    seed: int = 0,
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Turn a building that you have into a scene.

    Reads meshes (GLB, glTF, OBJ, PLY, DAE, STL; also the semantic.obj of Stanford 2D-3D-S),
    Gazebo worlds (.world, .sdf), ROS maps and Stanford areas (their yaml), and homes of
    Sweet Home 3D (.sh3d). Says what it assumed, repaired and left out. Nothing is written but
    the folder given by --out.

    Example: toponav scene import small_house/worlds/small_house.world --out scenes/small_house

    Args:
        path: The building's file.
        out: Folder to write the scene to.
        units: Unit of a mesh; default what the file says, else metres.
        up: Axis of a mesh that points up; default what the file says, else the one across which
            the largest flat surface lies.
        floor_height: Take the storey nearest to this height in metres, not the largest.
        models: Folders with the models that a Gazebo world names; default those beside it.
        seed: Chooses heights of furniture where a floor plan does not give them.
        as_json: Print what was made as JSON.
    """
    from toponav.cli.progress_bar import progress
    from toponav.cli.scene import facts_of, print_facts
    from toponav.worlds.load.importer import ImportOptions, import_building
    from toponav.worlds.storage import save_scene

    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}", where="--seed", remedy="use 0")
    if floor_height is not None and not abs(floor_height) < 1e5:
        raise InputError(
            f"floor height must be metres, got {floor_height}",
            where="--floor-height",
            remedy="give the height of the storey's floor in the file, in metres",
        )
    check_out_folder(out)
    options = ImportOptions(units, up, floor_height, tuple(models), seed)
    # Where nobody watches, errors stay one line and no bar is drawn.
    bar: AbstractContextManager[Any] = (
        progress(f"Reading {path.name[:40]}") if sys.stderr.isatty() else nullcontext()
    )
    with bar as step:
        if step is not None:
            step(0, None)
        imported = import_building(path, options)
        save_scene(imported.scene, out)
    facts: dict[str, Any] = {"read as": imported.kind, **facts_of(imported.scene, out)}
    if as_json:
        print(json.dumps({**facts, "notes": list(imported.notes)}))
        return 0
    print_facts(facts)
    for note in imported.notes:
        print(f"note: {note}")
    return 0
