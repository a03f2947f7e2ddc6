"""What a dataset holds, in numbers."""

from collections import Counter
from pathlib import Path
from typing import Any

from toponav.core.vocabulary import Behavior
from toponav.data.dataset import (
    ANNOTATION_COLUMNS,
    ANNOTATIONS,
    INDEX,
    INDEX_COLUMNS,
    read_manifest,
    read_table,
)
from toponav.data.splits import validation_buildings

__all__ = ["dataset_statistics"]


def dataset_statistics(dataset_dir: Path) -> dict[str, Any]:
    """Counts of trajectories, frames, outcomes, buildings and labels, ready for JSON.

    Raises:
        InputError: The folder is not a dataset, or a table in it is broken.
    """
    manifest = read_manifest(dataset_dir)
    result: dict[str, Any] = {
        "kind": manifest.kind,
        "complete": manifest.complete,
        "episodes": manifest.episodes,
        "dropped": len(manifest.dropped),
        "config": dict(manifest.config),
        "environment": dict(manifest.environment),
    }
    if not manifest.complete:
        return result
    rows = read_table(dataset_dir / INDEX, "run `toponav data repair`", INDEX_COLUMNS).to_pylist()
    frames = sum(row["frames"] for row in rows)
    result |= {
        "trajectories": len(rows),
        "frames": frames,
        "frames_per_trajectory": round(frames / max(len(rows), 1), 2),
        "hours": round(frames * 0.2 / 3600, 3),
        "distance_m": round(sum(row["distance_m"] for row in rows), 1),
        "bytes": sum(row["bytes"] for row in rows),
        "outcomes": dict(Counter(row["outcome"] for row in rows)),
        "attempts": dict(sorted(Counter(str(row["attempt"]) for row in rows).items())),
        "buildings": _per_building(rows),
    }
    if (dataset_dir / ANNOTATIONS).exists():
        result["labels"] = _labels(dataset_dir)
    return result


def _per_building(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    held_out = validation_buildings(row["building"] for row in rows)
    found: dict[str, dict[str, Any]] = {}
    for row in sorted(rows, key=lambda row: str(row["building"])):
        name = row["building"]
        entry = found.setdefault(
            name,
            {"trajectories": 0, "frames": 0, "split": "val" if name in held_out else "train"},
        )
        entry["trajectories"] += 1
        entry["frames"] += row["frames"]
    return found


def _labels(dataset_dir: Path) -> dict[str, Any]:
    table = read_table(
        dataset_dir / ANNOTATIONS, "run `toponav data annotate`", ANNOTATION_COLUMNS
    )
    if not table.num_rows:
        return {}
    result: dict[str, Any] = {}
    for column in ("behavior", "edge_behavior"):
        counts = {
            entry["values"]: entry["counts"]
            for entry in table[column].combine_chunks().value_counts().to_pylist()
        }
        result[column] = {str(name): counts.get(str(name), 0) for name in Behavior}
        result[column]["none"] = counts.get(None, 0)
    for column in ("node", "edge", "plan_edge"):
        result[f"{column}_labelled"] = round(1.0 - table[column].null_count / table.num_rows, 4)
    result["off_plan"] = round(sum(table["off_plan"].to_pylist()) / table.num_rows, 4)
    return result
