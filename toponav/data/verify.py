"""Finding what is wrong with a dataset, file by file, and putting it right."""

import dataclasses
import functools
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from toponav.core.errors import InputError
from toponav.data.buildings import make_building, resolve_buildings
from toponav.data.collect import CollectConfig, collect, finish_dataset
from toponav.data.dataset import (
    ANNOTATION_COLUMNS,
    ANNOTATIONS,
    INDEX,
    INDEX_COLUMNS,
    Manifest,
    building_dir,
    discard_partials,
    file_hash,
    locked,
    read_manifest,
    read_table,
    recorded,
    trajectory_path,
    write_manifest,
)
from toponav.data.parallel import run_parallel
from toponav.data.storage import check_bag, read_summary

__all__ = ["Fault", "repair_dataset", "verify_dataset"]

_PER_TASK: Final = 25


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong.

    Attributes:
        file: The file, relative to the dataset.
        problem: What is wrong with it.
        trajectory: Its number, where it is a trajectory.
    """

    file: str
    problem: str
    trajectory: int | None = None


def verify_dataset(
    dataset_dir: Path,
    *,
    workers: int = 1,
    on_progress: Callable[[int, int], None] | None = None,
) -> list[Fault]:
    """Everything that is wrong with a dataset: missing, cut and altered files, by name.

    Every file's size and SHA-256 are compared with the manifest, and every bag's structure
    and checksums are checked.

    Raises:
        InputError: The folder is not a dataset, or its manifest is broken.
    """
    manifest = read_manifest(dataset_dir)
    faults: list[Fault] = []
    expected, there = manifest.expected, set(recorded(dataset_dir))
    if not manifest.complete:
        missing = len(set(expected) - there)
        faults.append(
            Fault(
                "dataset.json",
                f"the collection is unfinished: {missing} of {len(expected)} trajectories are "
                "missing, or not listed yet; run the same `toponav collect` again",
            )
        )
    tasks = [tuple(expected[at : at + _PER_TASK]) for at in range(0, len(expected), _PER_TASK)]

    def poll(done: int) -> None:
        if on_progress is not None:
            on_progress(min(done * _PER_TASK, len(expected)), len(expected))

    check = functools.partial(_check_some, dataset_dir, manifest)
    for found in run_parallel(check, tasks, workers, poll):
        faults += found
    for index in sorted(there - set(expected)):
        name = _name(dataset_dir, trajectory_path(dataset_dir, index))
        faults.append(Fault(name, "is not in the manifest", index))
    return faults + _building_faults(dataset_dir, manifest) + _table_faults(dataset_dir, manifest)


def _name(dataset_dir: Path, path: Path) -> str:
    return str(path.relative_to(dataset_dir))


def _check_some(dataset_dir: Path, manifest: Manifest, indices: tuple[int, ...]) -> list[Fault]:
    faults = []
    for index in indices:
        path = trajectory_path(dataset_dir, index)
        problem = _trajectory_problem(path, manifest, index)
        if problem:
            faults.append(Fault(_name(dataset_dir, path), problem, index))
    return faults


def _trajectory_problem(path: Path, manifest: Manifest, index: int) -> str:
    listed = manifest.trajectories.get(index)
    if not path.is_file():
        return "is missing" if listed or manifest.complete else ""
    size = path.stat().st_size
    if listed is not None and size < listed[1]:
        return f"is cut: {size} of {listed[1]} bytes"
    problem = check_bag(path)
    if listed is not None and file_hash(path) != listed[0]:
        return f"was altered: its SHA-256 differs from the manifest's; {problem or 'it reads'}"
    return problem


def _building_faults(dataset_dir: Path, manifest: Manifest) -> list[Fault]:
    faults = []
    for name, record in manifest.buildings.items():
        for file, digest in record["files"].items():
            path = building_dir(dataset_dir, name) / file
            if not path.is_file():
                faults.append(Fault(_name(dataset_dir, path), "is missing"))
            elif file_hash(path) != digest:
                faults.append(Fault(_name(dataset_dir, path), "was altered: its SHA-256 differs"))
    return faults


def _table_faults(dataset_dir: Path, manifest: Manifest) -> list[Fault]:
    if not manifest.complete:
        return []
    faults = []
    frames = None
    for file, remedy in ((INDEX, "repair"), (ANNOTATIONS, "annotate")):
        path = dataset_dir / file
        if file == ANNOTATIONS and not path.exists():
            continue
        try:
            columns = INDEX_COLUMNS if file == INDEX else ANNOTATION_COLUMNS
            table = read_table(path, f"run `toponav data {remedy}`", columns)
            if file == INDEX and not table.num_rows:
                wrong = bool(manifest.expected)
            elif file == INDEX:
                frames = sum(table["frames"].to_pylist())
                wrong = table["trajectory"].to_pylist() != manifest.expected
            else:
                wrong = frames is not None and table.num_rows != frames
        except InputError as error:
            faults.append(Fault(file, error.rule))
            continue
        if wrong:
            faults.append(Fault(file, f"does not fit the trajectories; run `data {remedy}`"))
    return faults


def repair_dataset(
    dataset_dir: Path,
    *,
    drop: bool = False,
    workers: int = 1,
    on_progress: Callable[[int], None] | None = None,
) -> tuple[list[Fault], Manifest]:
    """Put a dataset right: record bad trajectories again, or drop them.

    Only drives of the expert can be recorded again; those of a learner are dropped. Files
    that are not in the manifest are left alone.

    Args:
        dataset_dir: The dataset.
        drop: Take bad trajectories out instead of recording them again.
        workers: Processes.
        on_progress: Told how many trajectories are there.

    Returns:
        What was wrong, and the manifest as it is now.

    Raises:
        InputError: The folder is not a dataset, or its manifest is broken.
    """
    faults = verify_dataset(dataset_dir, workers=workers)
    manifest = read_manifest(dataset_dir)
    if not faults:
        return [], manifest
    bad = sorted(
        fault.trajectory
        for fault in faults
        if fault.trajectory is not None and fault.trajectory in set(manifest.expected)
    )
    config = CollectConfig.from_dict(manifest.config)
    by_expert = manifest.config.get("source") == "expert"
    with locked(dataset_dir):
        discard_partials(dataset_dir)
        if by_expert:
            _restore_buildings(dataset_dir, config, faults)
        for index in bad:
            trajectory_path(dataset_dir, index).unlink(missing_ok=True)
        (dataset_dir / ANNOTATIONS).unlink(missing_ok=True)
        missing = sorted(set(manifest.expected) - set(recorded(dataset_dir)))
        if drop or not by_expert:
            manifest = dataclasses.replace(
                manifest, dropped=tuple(sorted({*manifest.dropped, *missing}))
            )
        write_manifest(dataset_dir, dataclasses.replace(manifest, complete=False))
        if drop or not by_expert:
            return faults, finish_dataset(dataset_dir, manifest, workers=workers)
    return faults, collect(dataset_dir, config, workers=workers, on_progress=on_progress)


def _restore_buildings(dataset_dir: Path, config: CollectConfig, faults: list[Fault]) -> None:
    """Make damaged buildings again; the scene must come out the same."""
    damaged = {Path(fault.file).parts[1] for fault in faults if fault.file.startswith("build")}
    if not damaged:
        return
    source_of = resolve_buildings(config.buildings, config.seed)
    slots = range(-(-config.episodes // config.episodes_per_building))
    sources = {source.name: source for source in map(source_of, slots)}
    for name in sorted(damaged):
        if name not in sources:
            raise InputError(
                f"building {name} is none of those that this dataset is recorded in",
                where=str(dataset_dir / "dataset.json"),
                remedy="restore the manifest from a copy",
            )
        shutil.rmtree(building_dir(dataset_dir, name), ignore_errors=True)
        building = make_building(sources[name], dataset_dir)
        for index in recorded(dataset_dir):
            _same_scene(dataset_dir, index, name, building.scene.content_hash)


def _same_scene(dataset_dir: Path, index: int, name: str, scene_hash: str) -> None:
    try:
        metadata = read_summary(trajectory_path(dataset_dir, index))[0]
    except InputError:  # listed among the faults; recorded again
        return
    if metadata.building == name and metadata.scene_hash != scene_hash:
        raise InputError(
            f"building {name} no longer comes out as the scene that trajectory {index} was "
            "driven in: this version makes another",
            where=str(building_dir(dataset_dir, name)),
            remedy="restore the folder from a copy, or repair with the version in dataset.json",
        )
