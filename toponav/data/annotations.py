"""The labels of a whole dataset as one table: `annotations.parquet`, one row a frame."""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from jaxtyping import Int

from toponav.core.vocabulary import Behavior
from toponav.data.annotate import Annotations, annotate_trajectory
from toponav.data.buildings import Building, load_building
from toponav.data.dataset import (
    ANNOTATIONS,
    building_dir,
    read_manifest,
    recorded,
    trajectory_path,
    write_table,
)
from toponav.data.parallel import run_parallel
from toponav.data.recording import Recording
from toponav.data.storage import read_trajectory
from toponav.sim.oracle import TruthLocalizer

__all__ = ["annotate_dataset", "annotation_table"]

_PER_TASK: Final = 40
_NAMES: Final = pa.dictionary(pa.int32(), pa.string())


def annotate_dataset(
    dataset_dir: Path, *, workers: int = 1, on_progress: Callable[[int], None] | None = None
) -> int:
    """Label every frame of a dataset; returns how many there are.

    Replaces `annotations.parquet`, all or nothing.

    Raises:
        InputError: It is not a dataset, or a trajectory or a building in it is broken.
    """
    expected = set(read_manifest(dataset_dir).expected)
    indices = [index for index in recorded(dataset_dir) if index in expected]
    tasks = [
        tuple(indices[first : first + _PER_TASK]) for first in range(0, len(indices), _PER_TASK)
    ]

    def poll(done: int) -> None:
        if on_progress is not None:
            on_progress(min(done * _PER_TASK, len(indices)))

    label = functools.partial(_annotate_some, dataset_dir)
    try:
        tables = run_parallel(label, tasks, workers, poll)
    finally:
        _building.cache_clear()
    table = pa.concat_tables(tables) if tables else pa.table({})
    write_table(dataset_dir / ANNOTATIONS, table.unify_dictionaries())
    return int(table.num_rows)


@functools.lru_cache(maxsize=2)
def _building(directory: Path) -> tuple[Building, TruthLocalizer]:
    building = load_building(directory)
    return building, TruthLocalizer(building.map, building.scene)


def _annotate_some(dataset_dir: Path, indices: tuple[int, ...]) -> Any:
    tables = []
    for index in indices:
        path = trajectory_path(dataset_dir, index)
        recording = read_trajectory(path, depth=False)
        directory = building_dir(dataset_dir, recording.metadata.building)
        building, localizer = _building(directory)
        labels = annotate_trajectory(
            recording.pose, recording.metadata.plan, building.scene, localizer
        )
        tables.append(annotation_table(recording, labels, building))
    return pa.concat_tables(tables)


def annotation_table(recording: Recording, labels: Annotations, building: Building) -> Any:
    """One trajectory's rows: poses, commands and labels, names instead of numbers."""
    frames = len(recording)
    behaviors = [str(behavior) for behavior in Behavior]
    rooms = [room.name for room in building.scene.rooms]
    nodes = [node.id for node in building.map.nodes]
    edges = [edge.id for edge in building.map.edges]
    return pa.table(
        {
            "trajectory": pa.array(np.full(frames, recording.metadata.index, np.int32)),
            "frame": pa.array(np.arange(frames, dtype=np.int32)),
            "time_s": pa.array(recording.time_s),
            "x_m": pa.array(recording.pose[:, 0]),
            "y_m": pa.array(recording.pose[:, 1]),
            "yaw_rad": pa.array(recording.pose[:, 2]),
            "linear_m_s": pa.array(recording.velocity[:, 0]),
            "angular_rad_s": pa.array(recording.velocity[:, 1]),
            "command_linear_m_s": pa.array(recording.command[:, 0]),
            "command_angular_rad_s": pa.array(recording.command[:, 1]),
            "executed_linear_m_s": pa.array(recording.executed[:, 0]),
            "executed_angular_rad_s": pa.array(recording.executed[:, 1]),
            "room": _named(labels.room, rooms),
            "node": _named(labels.node, nodes),
            "edge": _named(labels.edge, edges),
            "behavior": _named(labels.behavior, behaviors),
            "true_node": _named(labels.true_node, nodes),
            "plan_position": pa.array(labels.plan_position.astype(np.int32)),
            "plan_edge": _named(labels.plan_edge, edges),
            "edge_behavior": _named(labels.edge_behavior, behaviors),
            "off_plan": pa.array(labels.off_plan),
        }
    )


def _named(codes: Int[np.ndarray, " frames"], names: list[str]) -> Any:
    """Names by number; missing where the number is -1."""
    indices = pa.array(codes.astype(np.int32), mask=codes < 0)
    return pa.DictionaryArray.from_arrays(indices, pa.array(names, pa.string())).cast(_NAMES)
