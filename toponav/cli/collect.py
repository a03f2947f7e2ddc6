"""`toponav collect`: record the expert's drives, or a learner's with the expert's labels."""

import json as json_module
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    from toponav.data.collect import CollectConfig
    from toponav.data.driving import DriverFactory

__all__ = ["collect_graphnav", "register"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {
        ("collect", "graphnav"): collect_graphnav,
        ("collect", "dagger"): collect_dagger,
        ("collect", "nts"): collect_nts,
    }


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
    longest_of: int = 1,
    width: int = 320,
    height: int = 240,
    rgb: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    semantic: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
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
        attempts: A drive that collides or sticks is tried again with half the noise; after
            this many the last one is kept as far as it came, and flagged.
        any_yaw_fraction: Fraction of drives that start facing anywhere.
        longest_of: Of this many random pairs of rooms, drive the one with the longest plan:
            with 16, the mean drive is about as long as the paper's (section VI-C).
        width: Columns of the images.
        height: Rows of the images.
        rgb: Record colour images beside depth.
        semantic: Record the class of what each pixel shows, the truth, beside depth.
        no_annotate: Leave out annotations.parquet.
        json: Print the dataset's statistics as JSON.
    """
    from toponav.core.camera import PinholeCamera
    from toponav.data.collect import CollectConfig
    from toponav.data.driving import StartConfig
    from toponav.data.noise import NoiseConfig
    from toponav.data.recording import ExtraImage

    extra: tuple[tuple[ExtraImage, bool], ...] = (("rgb", rgb), ("semantic", semantic))
    config = CollectConfig(
        episodes=episodes,
        seed=seed,
        buildings=buildings,
        episodes_per_building=episodes_per_building,
        attempts=attempts,
        noise=NoiseConfig(noise_scale=noise_scale),
        start=StartConfig(any_yaw_fraction=any_yaw_fraction, longest_of=longest_of),
        camera=PinholeCamera(width=width, height=height),
        images=tuple(name for name, is_on in extra if is_on),
    )
    _record(out, config, None, workers, annotate=not no_annotate, json=json)
    return 0


def collect_dagger(
    *,
    out: Path,
    weights: str,
    episodes: int,
    agent: Literal["gtl", "graphnav", "graphnav_pf"] = "gtl",
    expert_share: float = 0.3,
    workers: int = 1,
    seed: int = 0,
    buildings: tuple[str, ...] = ("offices-train",),
    episodes_per_building: int = 10,
    any_yaw_fraction: float = 0.2,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Collect a DAgger round: the learner drives, the expert says what it would have done.

    Example: toponav collect dagger --out data/round1 --weights runs/compact --episodes 300

    Train on it together with what was there: toponav train all --data CACHE0 CACHE1 ...

    Args:
        out: Folder of the dataset.
        weights: Folder of the learner's checkpoints, or a shipped preset.
        episodes: How many drives.
        agent: Whose behaviours: gtl knows the true node, the others localize themselves.
        expert_share: Fraction of the time that the expert has the wheel.
        workers: Processes.
        seed: Seed of the dataset.
        buildings: As for `toponav collect graphnav`.
        episodes_per_building: Drives in one building before the next one's turn.
        any_yaw_fraction: Fraction of drives that start facing anywhere.
        json: Print the dataset's statistics as JSON.
    """
    from toponav.data.collect import CollectConfig
    from toponav.data.driving import StartConfig
    from toponav.models.checkpoints import load_any_weights
    from toponav.training.dagger import LearnerFactory

    load_any_weights(weights)
    config = CollectConfig(
        episodes=episodes,
        seed=seed,
        buildings=buildings,
        episodes_per_building=episodes_per_building,
        attempts=1,
        start=StartConfig(any_yaw_fraction=any_yaw_fraction),
    )
    learner = LearnerFactory(weights, agent, expert_share, config.camera)
    _record(out, config, learner, workers, annotate=True, json=json)
    return 0


def collect_nts(
    *,
    out: Path,
    homes: int = 68,
    panoramas: int = 300,
    workers: int = 1,
    seed: int = 0,
    suite: Literal["homes-train", "homes-val", "homes-test"] = "homes-train",
    height: int = 128,
    width: int = 512,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Collect panoramas of homes for Neural Topological SLAM, with the labels of all pairs.

    Example: toponav collect nts --out data/nts --homes 68 --panoramas 300 --workers 8

    The default is the paper's data set: 68 homes, 300 random panoramas each, 6.12 million pairs
    (7 GB). Interrupt it whenever you like: the same command resumes with the next home, and the
    data do not depend on the number of workers.

    Args:
        out: Folder of the panoramas.
        homes: How many homes of the suite, from the first.
        panoramas: Panoramas in each home.
        workers: Processes.
        seed: Seed of where panoramas are taken.
        suite: Suite of homes.
        height: Rows of the images.
        width: Columns of the images, a multiple of 8.
        json: Print what was collected as JSON.
    """
    from toponav.cli.progress_bar import progress
    from toponav.data.nts.labels import labels_of
    from toponav.data.nts.pairs import PairStream
    from toponav.data.nts.panoramas import PanoramaConfig, collect_panoramas

    config = PanoramaConfig(suite, homes, panoramas, height, width, seed)
    with progress("homes") as update:
        collected = collect_panoramas(
            out, config, workers=workers, on_progress=lambda done: update(done, homes)
        )
    labels = []
    with progress("labels") as update:
        for number, home in enumerate(collected):
            labels.append(labels_of(home))
            update(number + 1, len(collected))
    stream = PairStream(labels)
    found = {
        "homes": len(collected),
        "panoramas": sum(len(home) for home in collected),
        "pairs": len(stream),
        "same_node": round(stream.same_node_fraction, 4),
        "explorable_directions": round(
            sum(float(one.explorable.sum()) for one in labels)
            / sum(len(home) for home in collected),
            4,
        ),
    }
    if json:
        print(json_module.dumps(found))
    else:
        print(
            f"{found['panoramas']:,} panoramas of {found['homes']} homes, {found['pairs']:,} "
            f"pairs: {found['same_node']:.1%} in one node, {found['explorable_directions']:.1f} "
            f"explorable directions a panorama: {out}"
        )
    return 0


def _record(
    out: Path,
    config: "CollectConfig",
    driver: "DriverFactory | None",
    workers: int,
    *,
    annotate: bool,
    json: bool,
) -> None:
    from toponav.cli.data import print_statistics
    from toponav.cli.progress_bar import progress
    from toponav.data.collect import collect
    from toponav.data.statistics import dataset_statistics

    with progress("trajectories") as update:
        collect(
            out,
            config,
            workers=workers,
            driver=driver,
            annotate=annotate,
            on_progress=lambda done: update(done, config.episodes),
        )
    statistics = dataset_statistics(out)
    if json:
        print(json_module.dumps(statistics))
    else:
        print_statistics(statistics, out)
