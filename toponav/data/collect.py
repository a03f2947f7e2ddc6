"""Collecting a dataset: expert drives with noise, in many buildings, by many workers.

Trajectory i is a pure function of the dataset's configuration and i. So it does not matter
who records it, or when: an interrupted collection goes on where it stopped, and a finished
one holds the same messages whatever the number of workers.
"""

import dataclasses
import functools
import itertools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.files import check_out_folder
from toponav.core.typed_json import from_json
from toponav.data.annotations import annotate_dataset
from toponav.data.buildings import (
    BuildingSource,
    building_record,
    make_building,
    resolve_buildings,
)
from toponav.data.dataset import (
    ANNOTATIONS,
    MAX_EPISODES,
    Manifest,
    building_dir,
    discard_partials,
    environment,
    index_row,
    locked,
    read_manifest,
    recorded,
    trajectory_path,
    write_index,
    write_manifest,
)
from toponav.data.driving import (
    DriverFactory,
    NoisyExpertFactory,
    Site,
    StartConfig,
    drive,
    sample_start,
)
from toponav.data.noise import NoiseConfig
from toponav.data.parallel import check_workers, run_parallel
from toponav.data.recording import ExtraImage, TrajectoryMetadata
from toponav.data.storage import StoredTrajectory, TrajectoryWriter
from toponav.maps.task import NavigationTask

__all__ = ["CollectConfig", "collect", "finish_dataset"]


@dataclass(frozen=True)
class CollectConfig:
    """What to collect; with the code's version it determines every frame."""

    episodes: int
    """How many trajectories."""
    seed: int = 0
    """Seed of the dataset."""
    buildings: tuple[str, ...] = ("offices-train",)
    """A suite of offices, or yaml files of areas and folders of saved scenes."""
    episodes_per_building: int = 10
    """Consecutive trajectories in one building before the next one's turn."""
    attempts: int = 3
    """Drives of the expert tried, each with half the noise, before one that misses its goal
    is kept. A learner has one try."""
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    """Noise on the executed commands."""
    start: StartConfig = field(default_factory=StartConfig)
    """Where drives begin."""
    camera: PinholeCamera = field(default_factory=PinholeCamera)
    """The depth camera."""
    images: tuple[ExtraImage, ...] = ()
    """What is recorded besides depth."""

    def __post_init__(self) -> None:
        for name in ("episodes", "episodes_per_building", "attempts"):
            if not 1 <= getattr(self, name) <= MAX_EPISODES:
                raise InputError(
                    f"{name} must be at least 1, got {getattr(self, name)}"
                    if getattr(self, name) < 1
                    else f"{name} must be at most {MAX_EPISODES:,}, got {getattr(self, name):,}",
                    where=f"--{name.replace('_', '-')}",
                    remedy="give a positive number",
                )
        if self.seed < 0:
            raise InputError(
                f"the seed must not be negative, got {self.seed}",
                where="--seed",
                remedy="give 0 or more",
            )
        paths = tuple(
            str(Path(name).resolve()) if Path(name).exists() else name for name in self.buildings
        )
        object.__setattr__(self, "buildings", paths)

    def to_dict(self) -> dict[str, Any]:
        """The configuration as plain values."""
        content = {**dataclasses.asdict(self), "buildings": list(self.buildings)}
        images = content.pop("images")
        # Left out where there are none, as before there were any.
        return {**content, "images": list(images)} if images else content

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> "CollectConfig":
        """The configuration that `to_dict` wrote.

        Raises:
            InputError: It is not one.
        """
        names = {item.name for item in dataclasses.fields(CollectConfig)}
        values = {name: value for name, value in content.items() if name in names}
        return from_json(
            CollectConfig,
            values,
            where="dataset.json, config",
            remedy="collect into another folder, or restore the file",
        )


def collect(
    out: Path,
    config: CollectConfig,
    *,
    workers: int = 1,
    driver: DriverFactory | None = None,
    annotate: bool = True,
    on_progress: Callable[[int], None] | None = None,
) -> Manifest:
    """Record what is missing of a dataset, then index, label and list it.

    Run again with the same arguments it goes on where it stopped; with more episodes it adds
    to what is there.

    Args:
        out: The dataset's folder; made where it is missing.
        config: What to collect.
        workers: Processes.
        driver: Makes who drives; the expert with noise when None.
        annotate: Whether to write `annotations.parquet` too.
        on_progress: Told how many trajectories are there, about twice a second.

    Raises:
        InputError: The folder holds a dataset with another configuration, or a building
            cannot be made or driven in.

    Example:
        >>> collect(Path("data/train"), CollectConfig(episodes=1000), workers=8)  # doctest: +SKIP
    """
    check_workers(workers)
    check_out_folder(out)
    factory = driver or NoisyExpertFactory(config.noise)
    resolve_buildings(config.buildings, config.seed)
    with locked(out):
        before = _begin(out, config, factory)
        if before.complete and (not annotate or (out / ANNOTATIONS).exists()):
            return before
        pending = sorted(set(before.expected) - set(recorded(out)))
        chunks = [
            tuple(group)
            for _, group in itertools.groupby(
                pending, lambda index: index // config.episodes_per_building
            )
        ]
        (out / "trajectories").mkdir(exist_ok=True)

        def poll(_done: int) -> None:
            if on_progress is not None:
                on_progress(len(recorded(out)))

        poll(0)
        record = functools.partial(_record_chunk, out, config, factory)
        try:
            run_parallel(record, chunks, workers, poll)
        finally:
            _site.cache_clear()
        return finish_dataset(out, before, workers=workers, annotate=annotate)


def _begin(out: Path, config: CollectConfig, factory: DriverFactory) -> Manifest:
    """The manifest to fill: a new one, or the one that is there if it wants the same."""
    discard_partials(out)
    wanted = {**config.to_dict(), "source": factory.source}
    driver: Any = factory
    if factory.source != "expert" and hasattr(driver, "__dataclass_fields__"):
        # Through JSON, as it will be compared with what a file says.
        wanted["driver"] = json.loads(json.dumps(dataclasses.asdict(driver), default=str))
    manifest = Manifest("graphnav", config.episodes, wanted, environment())
    if (out / "dataset.json").exists():
        there = read_manifest(out)
        differing = sorted(
            name
            for name in wanted.keys() | there.config.keys()
            if name != "episodes" and wanted.get(name) != there.config.get(name)
        )
        if differing:
            raise InputError(
                f"the dataset there was collected with another {', '.join(differing)}: "
                + ", ".join(f"{name} = {there.config.get(name)}" for name in differing),
                where=str(out),
                remedy="give the same options to resume it, or another folder",
            )
        episodes = max(there.episodes, config.episodes)
        manifest = dataclasses.replace(
            there, episodes=episodes, config={**wanted, "episodes": episodes}
        )
        there_is_all = set(manifest.expected) <= set(recorded(out))
        manifest = dataclasses.replace(manifest, complete=there.complete and there_is_all)
    elif recorded(out):
        raise InputError(
            "the folder holds trajectories but no dataset.json",
            where=str(out),
            remedy="give an empty folder",
        )
    write_manifest(out, manifest)
    return manifest


def finish_dataset(
    out: Path, manifest: Manifest, *, workers: int = 1, annotate: bool = True
) -> Manifest:
    """Index, label and list what was recorded; the manifest is written last."""
    rows = [index_row(out, index) for index in manifest.expected]
    write_index(out, rows)
    if annotate:
        annotate_dataset(out, workers=workers)
    names = sorted({row["building"] for row in rows})
    finished = dataclasses.replace(
        manifest,
        complete=True,
        trajectories={row["trajectory"]: (row["sha256"], row["bytes"]) for row in rows},
        buildings={name: building_record(building_dir(out, name)) for name in names},
    )
    write_manifest(out, finished)
    return finished


@functools.lru_cache(maxsize=1)
def _site(
    out: Path, source: BuildingSource, camera: PinholeCamera, images: tuple[ExtraImage, ...]
) -> Site:
    return Site(make_building(source, out), camera, images)


def _record_chunk(
    out: Path, config: CollectConfig, factory: DriverFactory, indices: tuple[int, ...]
) -> int:
    """Record some trajectories; returns how many frames they have."""
    source_of = resolve_buildings(config.buildings, config.seed)
    driver = factory()
    frames = 0
    for index in indices:
        source = source_of(index // config.episodes_per_building)
        site = _site(out, source, config.camera, config.images)
        stored = _record(out, config, site, driver, factory.source, index)
        frames += stored.end.frames
    return frames


def _record(
    out: Path, config: CollectConfig, site: Site, driver: Any, source: str, index: int
) -> StoredTrajectory:
    """Record one trajectory; one that misses its goal is driven again with less noise."""
    random = np.random.default_rng((config.seed, index))
    plan, start = sample_start(site, config.start, random)
    building = site.building
    metadata = TrajectoryMetadata(
        index=index,
        dataset_seed=config.seed,
        building=building.name,
        scene_hash=building.scene.content_hash,
        map_hash=building.map_hash,
        plan=plan,
        camera=config.camera,
        source=source,
        noise_scale=config.noise.noise_scale,
        images=config.images,
    )
    # What a learner does wrong is what it has to learn from: its drives are kept as they are.
    attempts = config.attempts if source == "expert" else 1
    for attempt in range(attempts):
        tried = dataclasses.replace(
            metadata, attempt=attempt, noise_scale=metadata.noise_scale * 0.5**attempt
        )
        writer = TrajectoryWriter(trajectory_path(out, index), tried)
        driver.reset(
            NavigationTask(building.map, plan),
            np.random.default_rng((config.seed, index, attempt + 1)),
            attempt,
        )
        outcome, contact = drive(site, plan, start, driver, writer, config.start.after_goal_steps)
        if outcome == "success" or attempt + 1 == attempts:
            return writer.finish(outcome, contact)
    raise AssertionError("attempts is at least 1")
