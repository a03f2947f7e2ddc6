"""`toponav collect graphnav`: record expert drives with noise."""

import json as json_module
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import tyro

__all__ = ["collect_graphnav", "register"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {("collect", "graphnav"): collect_graphnav}


def collect_graphnav(
    *,
    out: Path,
    episodes: int,
    workers: int = 1,
    seed: int = 0,
    buildings: tuple[str, ...] = ("offices-train",),
    episodes_per_building: int = 10,
    noise_scale: float = 1.0,
    attempts: int = 3,
    any_yaw_fraction: float = 0.2,
    width: int = 320,
    height: int = 240,
    no_annotate: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Collect drives of the expert: depth, poses and commands as ROS 2 bags, with labels.

    Example: toponav collect graphnav --out data/train --episodes 1000 --workers 8

    On the authors' areas: toponav collect graphnav --out data/areas --episodes 300
    --buildings area_1.yaml area_5b.yaml area_6.yaml

    Interrupt it whenever you like: the same command resumes, and more episodes are added to
    what is there. The data do not depend on the number of workers.

    Args:
        out: Folder of the dataset.
        episodes: How many drives, from one random room to another.
        workers: Processes.
        seed: Seed of the dataset.
        buildings: offices-train, offices-val, offices-test, or yaml files of areas and folders
            of saved scenes with a map.topo.json.
        episodes_per_building: Drives in one building before the next one's turn.
        noise_scale: Factor on the paper's noise on the executed commands.
        attempts: A drive that collides is tried again with half the noise; after this many
            the last one is kept, up to the contact.
        any_yaw_fraction: Fraction of drives that start facing anywhere.
        width: Columns of the depth images.
        height: Rows of the depth images.
        no_annotate: Leave out annotations.parquet.
        json: Print the dataset's statistics as JSON.
    """
    from toponav.cli.data import print_statistics, progress
    from toponav.core.camera import PinholeCamera
    from toponav.data.collect import CollectConfig, collect
    from toponav.data.driving import StartConfig
    from toponav.data.noise import NoiseConfig
    from toponav.data.statistics import dataset_statistics

    config = CollectConfig(
        episodes=episodes,
        seed=seed,
        buildings=buildings,
        episodes_per_building=episodes_per_building,
        attempts=attempts,
        noise=NoiseConfig(noise_scale=noise_scale),
        start=StartConfig(any_yaw_fraction=any_yaw_fraction),
        camera=PinholeCamera(width=width, height=height),
    )
    with progress("trajectories") as update:
        collect(
            out,
            config,
            workers=workers,
            annotate=not no_annotate,
            on_progress=lambda done: update(done, episodes),
        )
    statistics = dataset_statistics(out)
    if json:
        print(json_module.dumps(statistics))
    else:
        print_statistics(statistics, out)
    return 0
