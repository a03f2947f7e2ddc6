"""From bags to a training cache: depth resampled to what the networks see, labels as numbers."""

import dataclasses
import functools
import hashlib
import io
import json
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow.compute as pc

from toponav.core.errors import InputError
from toponav.core.files import (
    check_file_name,
    check_out_folder,
    os_fault,
    read_json,
    write_atomically,
)
from toponav.core.vocabulary import Behavior
from toponav.data.annotations import annotate_dataset
from toponav.data.buildings import MAP_FILE
from toponav.data.dataset import (
    ANNOTATION_COLUMNS,
    ANNOTATIONS,
    INDEX,
    INDEX_COLUMNS,
    Manifest,
    building_dir,
    read_manifest,
    read_table,
    trajectory_path,
)
from toponav.data.parallel import check_workers, run_parallel
from toponav.data.storage import depth_images, read_summary
from toponav.data.training_set import CACHE_FILE, CACHE_SCHEMA, TrainingSet
from toponav.maps.spec import load_map
from toponav.models.graphnav.metric.presets import BestPreset, best_preset
from toponav.models.graphnav.preprocess import FrameReducer, frame_reducer
from toponav.models.graphnav.presets import Preset, get_preset

__all__ = ["prepare"]

_PER_TASK: Final = 25
_FRAMES, _PARTIAL, _DONE = "frames.npy", ".frames.npy.partial", ".done"
_FLOATS: Final = {
    "pose": ("x_m", "y_m", "yaw_rad"),
    "velocity": ("linear_m_s", "angular_rad_s"),
    "command": ("command_linear_m_s", "command_angular_rad_s"),
    "executed": ("executed_linear_m_s", "executed_angular_rad_s"),
}
_NAMED: Final = {
    "node": "node",
    "true_node": "node",
    "edge": "edge",
    "plan_edge": "edge",
    "behavior": "behavior",
    "edge_behavior": "behavior",
}


def prepare(
    dataset_dir: str | Path,
    out_dir: str | Path,
    preset: str | Preset | BestPreset,
    *,
    workers: int = 1,
    on_progress: Callable[[int, int], None] | None = None,
) -> TrainingSet:
    """Make the training cache of a dataset for a preset, and open it.

    An interrupted preparation goes on where it stopped; a finished one for the same dataset
    and image is opened as it is.

    Args:
        dataset_dir: A finished dataset.
        out_dir: The cache's folder; made where it is missing.
        preset: Whose image to make.
        workers: Processes.
        on_progress: Told how many trajectories of how many are done.

    Raises:
        InputError: The dataset is unfinished or broken, or its camera does not see what the
            preset wants to see.
    """
    dataset, out = Path(dataset_dir), Path(out_dir)
    chosen = _preset(preset) if isinstance(preset, str) else preset
    manifest = read_manifest(dataset)
    if not manifest.complete:
        raise InputError(
            "the dataset must be finished",
            where=str(dataset),
            remedy="run the same `toponav collect` again to finish it",
        )
    wanted = {
        "schema": CACHE_SCHEMA,
        "image": dataclasses.asdict(chosen.image),
        "dataset": _digest(manifest),
    }
    if (out / CACHE_FILE).exists() and _same(out / CACHE_FILE, wanted):
        return TrainingSet.open(out)
    check_workers(workers)
    check_out_folder(out)
    _begin(out, wanted)
    rows = _rows(dataset, manifest)
    starts = np.cumsum([0] + [row["frames"] for row in rows]).tolist()
    _fill_frames(dataset, out, chosen, rows, starts, workers, on_progress)
    _write_columns(dataset, out, rows, workers)
    os.replace(out / _PARTIAL, out / _FRAMES)
    entries = [
        {name: row[name] for name in _ENTRY} | {"trajectory": row["trajectory"]} for row in rows
    ]
    document = {**wanted, "preset": chosen.name, "trajectories": entries}
    write_atomically(out / CACHE_FILE, (json.dumps(document) + "\n").encode())
    shutil.rmtree(out / _DONE)
    return TrainingSet.open(out)


_ENTRY: Final = ("building", "plan_nodes", "plan_edges", "source", "outcome", "frames")


def _preset(name: str) -> Preset | BestPreset:
    return best_preset() if name == "best" else get_preset(name)


def _digest(manifest: Manifest) -> str:
    listed = sorted((index, digest) for index, (digest, _) in manifest.trajectories.items())
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()


def _same(path: Path, wanted: dict[str, Any]) -> bool:
    try:
        document = read_json(path)
    except InputError:
        return False
    return isinstance(document, dict) and all(
        document.get(name) == value for name, value in wanted.items()
    )


def _begin(out: Path, wanted: dict[str, Any]) -> None:
    """An empty cache, or the unfinished one of the same kind that is there."""
    done = out / _DONE
    if out.is_dir() and not ((out / CACHE_FILE).exists() or done.is_dir()) and any(out.iterdir()):
        raise InputError(
            "the folder holds files but no cache", where=str(out), remedy="name a new folder"
        )
    if done.is_dir() and not _same(done / "wanted.json", wanted):
        shutil.rmtree(done)
    (out / CACHE_FILE).unlink(missing_ok=True)
    if not (done / "wanted.json").exists():
        (out / _PARTIAL).unlink(missing_ok=True)
        done.mkdir(parents=True, exist_ok=True)
        write_atomically(done / "wanted.json", json.dumps(wanted).encode())


def _rows(dataset: Path, manifest: Manifest) -> list[dict[str, Any]]:
    remedy = "run `toponav data repair` on the dataset"
    table = read_table(dataset / INDEX, remedy, INDEX_COLUMNS)
    rows: list[dict[str, Any]] = [row for row in table.to_pylist() if row["frames"]]
    if not {row["trajectory"] for row in rows} <= set(manifest.expected) or not rows:
        raise InputError(
            f"{INDEX} does not fit dataset.json",
            where=str(dataset),
            remedy=remedy,
        )
    for row in rows:
        check_file_name(row["building"], f"{dataset / INDEX}, building")
        if row["frames"] < 0:
            raise InputError(
                f"a trajectory cannot have {row['frames']} frames",
                where=str(dataset / INDEX),
                remedy=remedy,
            )
    return rows


def _fill_frames(
    dataset: Path,
    out: Path,
    preset: Preset | BestPreset,
    rows: Sequence[dict[str, Any]],
    starts: Sequence[int],
    workers: int,
    on_progress: Callable[[int, int], None] | None,
) -> None:
    image = preset.image
    shape = (starts[-1], image.rows, image.cols)
    if not (out / _PARTIAL).exists():
        for marker in (out / _DONE).glob("*.done"):
            marker.unlink()
        _reserve(out / _PARTIAL, shape)
    tasks = []
    for first in range(0, len(rows), _PER_TASK):
        if not (out / _DONE / f"{first}.done").exists():
            stop = min(first + _PER_TASK, len(rows))
            numbers = tuple(row["trajectory"] for row in rows[first:stop])
            tasks.append((first, numbers, tuple(starts[first : stop + 1])))
    finished = -(-len(rows) // _PER_TASK) - len(tasks)

    def poll(done: int) -> None:
        if on_progress is not None:
            on_progress(min((finished + done) * _PER_TASK, len(rows)), len(rows))

    poll(0)
    run_parallel(functools.partial(_resample_some, dataset, out, preset), tasks, workers, poll)


def _reserve(path: Path, shape: tuple[int, ...]) -> None:
    """An array on disk, its space taken at once: a full disk under a mapping kills the process."""
    try:
        frames = np.lib.format.open_memmap(path, "w+", np.uint8, shape)
        frames.flush()
        if hasattr(os, "posix_fallocate"):
            with open(path, "r+b") as file:
                os.posix_fallocate(file.fileno(), 0, path.stat().st_size)
    except OSError as error:
        path.unlink(missing_ok=True)
        raise os_fault(error, path, verb="be written") from None


def _resample_some(
    dataset: Path,
    out: Path,
    preset: Preset | BestPreset,
    task: tuple[int, tuple[int, ...], tuple[int, ...]],
) -> None:
    first, numbers, starts = task
    frames = np.lib.format.open_memmap(out / _PARTIAL, "r+")
    resampler: FrameReducer | None = None
    for number, start, stop in zip(numbers, starts[:-1], starts[1:], strict=True):
        path = trajectory_path(dataset, number)
        metadata = read_summary(path)[0]
        if resampler is None or resampler.camera != metadata.camera:
            resampler = frame_reducer(metadata.camera, preset)
        at = start
        for at, depth_mm in enumerate(depth_images(path), start=start + 1):
            if at > stop:
                break
            depth_m = depth_mm.astype(np.float32)
            depth_m *= np.float32(0.001)
            frames[at - 1] = resampler(depth_m)
        if at != stop:
            raise InputError(
                f"the bag must hold {stop - start} images, as {INDEX} says",
                where=str(path),
                remedy="run `toponav data repair` on the dataset",
            )
    frames.flush()
    (out / _DONE / f"{first}.done").touch()


def _write_columns(dataset: Path, out: Path, rows: Sequence[dict[str, Any]], workers: int) -> None:
    if not (dataset / ANNOTATIONS).exists():
        annotate_dataset(dataset, workers=workers)
    remedy = "run `toponav data annotate` on the dataset"
    table = read_table(dataset / ANNOTATIONS, remedy, ANNOTATION_COLUMNS)
    if table.num_rows != sum(row["frames"] for row in rows):
        raise InputError(
            "there must be a label row for each frame", where=str(dataset), remedy=remedy
        )
    columns = {
        name: np.stack([table[part].to_numpy() for part in parts], axis=1).astype(np.float32)
        for name, parts in _FLOATS.items()
    }
    counts = [row["frames"] for row in rows]
    columns["trajectory"] = np.repeat(np.arange(len(rows), dtype=np.int32), counts)
    columns["off_plan"] = table["off_plan"].to_numpy().astype(bool)
    columns["plan_position"] = table["plan_position"].to_numpy().astype(np.int32)
    building = np.repeat([row["building"] for row in rows], counts)
    columns |= _numbered(dataset, out, table, building)
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **columns)
    write_atomically(out / "columns.npz", buffer.getvalue())


def _numbered(dataset: Path, out: Path, table: Any, building: np.ndarray) -> dict[str, np.ndarray]:
    """Names as numbers: indices into the nodes and edges of each building's map."""
    (out / "maps").mkdir(exist_ok=True)
    codes = {
        name: np.full(len(building), -1, np.int8 if kind == "behavior" else np.int32)
        for name, kind in _NAMED.items()
    }
    behaviors = {str(behavior): code for code, behavior in enumerate(Behavior)}
    for name in sorted(set(building.tolist())):
        map_path = building_dir(dataset, name) / MAP_FILE
        write_atomically(out / "maps" / f"{name}.topo.json", map_path.read_bytes())
        topological_map = load_map(map_path)
        numbers = {
            "node": topological_map.node_index,
            "edge": topological_map.edge_index,
            "behavior": behaviors,
        }
        here = np.flatnonzero(building == name)
        for column, kind in _NAMED.items():
            values = pc.take(table[column], here).combine_chunks().dictionary_encode()
            number_of = numbers[kind]
            names = values.dictionary.to_pylist()  # may list other buildings' names too
            lookup = np.array([number_of.get(value, -1) for value in names] + [-1])
            found = values.indices.fill_null(len(lookup) - 1).to_numpy(zero_copy_only=False)
            codes[column][here] = lookup[found.astype(np.int64)]
    return codes
