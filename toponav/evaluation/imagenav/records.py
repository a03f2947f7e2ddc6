"""Image-goal episodes on disk: one Parquet file an episode, and one table of all."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from toponav.core.files import write_atomically
from toponav.core.geometry import Pose2
from toponav.core.imagenav import ImageNavEpisode
from toponav.evaluation.imagenav.episode import (
    OUTCOMES,
    GoalRecord,
    ImageNavRecord,
    ImageNavStep,
)

__all__ = ["StoredImageNav", "load_record", "save_record", "write_episode_table"]

_KEY = b"toponav"
_STEPS = pa.schema(
    [
        ("goal", pa.int16()),
        ("x_m", pa.float64()),
        ("y_m", pa.float64()),
        ("yaw_rad", pa.float64()),
        ("action", pa.int8()),
        ("collided", pa.bool_()),
        ("mode", pa.string()),
        ("nodes", pa.int32()),
        ("ghosts", pa.int32()),
        ("act_ms", pa.float32()),
    ]
)


@dataclass(frozen=True)
class StoredImageNav:
    """A record with what it was made from.

    Attributes:
        record: What happened.
        key: Hash of everything that determines it.
        commit: Source version that made it, or None where unknown.
    """

    record: ImageNavRecord
    key: str
    commit: str | None = None


def save_record(path: Path, stored: StoredImageNav) -> None:
    """Write one episode; a reader finds the whole file or none."""
    record = stored.record
    metadata = {
        "key": stored.key,
        "commit": stored.commit,
        "agent": record.agent,
        "episode": asdict(record.episode),
        "rooms": record.rooms,
        "goals": [asdict(goal) for goal in record.goals],
        "wall_s": record.wall_s,
    }
    table = pa.Table.from_pylist([asdict(step) for step in record.steps], schema=_STEPS)
    _write(path, table.replace_schema_metadata({_KEY: json.dumps(metadata).encode()}))


def load_record(path: Path) -> StoredImageNav | None:
    """The episode in a file, or None where the file is absent, cut short or of another kind."""
    try:
        table = pq.read_table(path)
        metadata = json.loads(table.schema.metadata[_KEY])
        return _stored(metadata, table.to_pylist())
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError):
        # Whatever is wrong with the file, the cure is the same: run the episode again.
        return None


def _stored(metadata: dict[str, Any], rows: list[dict[str, Any]]) -> StoredImageNav:
    given = metadata["episode"]
    episode = ImageNavEpisode(
        **{**given, "start": Pose2(*given["start"]), "goal": Pose2(*given["goal"])}
    )
    goals = tuple(
        GoalRecord(**{**goal, "goal": Pose2(*goal["goal"])}) for goal in metadata["goals"]
    )
    if not goals or any(goal.outcome not in OUTCOMES for goal in goals):
        raise ValueError("outcomes")
    record = ImageNavRecord(
        agent=metadata["agent"],
        episode=episode,
        rooms=metadata["rooms"],
        goals=goals,
        steps=tuple(ImageNavStep(**row) for row in rows),
        wall_s=metadata["wall_s"],
    )
    return StoredImageNav(record, metadata["key"], metadata["commit"])


def write_episode_table(path: Path, records: Sequence[ImageNavRecord]) -> None:
    """Write `episodes.parquet`: one row a goal, one an episode where goals do not follow."""
    _write(path, pa.Table.from_pylist([row for record in records for row in _rows(record)]))


def _rows(record: ImageNavRecord) -> list[dict[str, Any]]:
    episode = record.episode
    start = episode.start
    return [
        {
            "agent": record.agent,
            "episode": episode.id,
            "difficulty": episode.difficulty,
            "number": episode.number,
            "scene_suite": episode.scene_suite,
            "scene_seed": episode.scene_seed,
            "rooms": record.rooms,
            "goal": number,
            "start_x_m": start.x_m,
            "start_y_m": start.y_m,
            "start_yaw_rad": start.yaw_rad,
            "goal_x_m": goal.goal.x_m,
            "goal_y_m": goal.goal.y_m,
            "goal_yaw_rad": goal.goal.yaw_rad,
            "geodesic_m": goal.geodesic_m,
            "success": goal.success,
            "spl": goal.spl,
            "outcome": goal.outcome,
            "reason": goal.reason,
            "path_m": goal.path_m,
            "distance_m": goal.distance_m,
            "steps": goal.steps,
            "collisions": goal.collisions,
            "wall_s": record.wall_s,
        }
        for number, goal in enumerate(record.goals)
    ]


def _write(path: Path, table: pa.Table) -> None:
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    write_atomically(path, sink.getvalue().to_pybytes())
