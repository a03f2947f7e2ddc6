"""Datasets in other formats: NumPy archives, one a trajectory."""

import functools
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa

from toponav.core.files import check_out_folder, write_atomically
from toponav.data.dataset import ANNOTATIONS, read_manifest, read_table, trajectory_path
from toponav.data.parallel import run_parallel
from toponav.data.storage import read_summary, read_trajectory

__all__ = ["export_npz"]

_LABELS: Final = ("room", "node", "edge", "behavior", "plan_edge", "edge_behavior")


def export_npz(
    dataset_dir: Path,
    out_dir: Path,
    *,
    workers: int = 1,
    on_progress: Callable[[int, int], None] | None = None,
) -> int:
    """Write each trajectory as `NNNNNN.npz`; returns how many there are now.

    An archive holds `time_s`, `depth_mm`, `pose`, `velocity`, `command`, `executed`, the
    metadata as JSON text and, where the dataset is annotated, each frame's room, node, edge
    and behaviour as text (empty where there is none); and `rgb` and `semantic` where these were
    recorded. It loads without pickle. Archives that are already there are kept.

    Raises:
        InputError: The folder is not a dataset, or a file in it is broken.
    """
    check_out_folder(out_dir)
    indices = [
        index
        for index in read_manifest(dataset_dir).expected
        if not (out_dir / f"{index:06d}.npz").exists()
    ]
    tasks = [tuple(indices[at : at + 10]) for at in range(0, len(indices), 10)]

    def poll(done: int) -> None:
        if on_progress is not None:
            on_progress(min(done * 10, len(indices)), len(indices))

    run_parallel(functools.partial(_export_some, dataset_dir, out_dir), tasks, workers, poll)
    return len(list(out_dir.glob("*.npz")))


def _export_some(dataset_dir: Path, out_dir: Path, indices: tuple[int, ...]) -> None:
    labels = _labels_of(dataset_dir, indices)
    for index in indices:
        path = trajectory_path(dataset_dir, index)
        images = read_summary(path)[0].images
        recording = read_trajectory(path, rgb="rgb" in images, semantic="semantic" in images)
        content: dict[str, Any] = {
            "metadata": np.array(recording.metadata.to_json()),
            "end": np.array(recording.end.to_json()),
            "time_s": recording.time_s,
            "depth_mm": recording.depth_mm,
            "pose": recording.pose,
            "velocity": recording.velocity,
            "command": recording.command,
            "executed": recording.executed,
            **{name: getattr(recording, name) for name in images},
            **labels.get(index, {}),
        }
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, **content)
        write_atomically(out_dir / f"{index:06d}.npz", buffer.getvalue())


def _labels_of(dataset_dir: Path, indices: tuple[int, ...]) -> dict[int, dict[str, np.ndarray]]:
    path = dataset_dir / ANNOTATIONS
    if not path.exists():
        return {}
    kinds = {"trajectory": "int", **dict.fromkeys(_LABELS, "text")}
    table = read_table(path, "run `toponav data annotate`", kinds)
    rows = np.asarray(table["trajectory"])
    found = {}
    for index in indices:
        here = table.filter(pa.array(rows == index))
        found[index] = {
            name: np.array([value or "" for value in here[name].to_pylist()], np.str_)
            for name in _LABELS
        }
    return found
