"""Episode records on disk: one Parquet file an episode, written whole or not at all."""

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from toponav.core.files import write_atomically
from toponav.core.vocabulary import Behavior, Difficulty, Outcome
from toponav.evaluation.episode import EpisodeRecord, Step
from toponav.evaluation.protocol import COLLISION_RULES, DEVIATION_RULES, Verdict
from toponav.evaluation.step_table import write_step_table
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap

__all__ = [
    "StoredEpisode",
    "load_episode",
    "plan_length_m",
    "save_episode",
    "write_atomically",
    "write_episode_table",
    "write_step_table",
]

_METADATA_KEY = b"toponav"

_STEP_SCHEMA = pa.schema(
    [
        ("time_s", pa.float32()),
        ("x_m", pa.float32()),
        ("y_m", pa.float32()),
        ("yaw_rad", pa.float32()),
        ("linear_m_s", pa.float32()),
        ("angular_rad_s", pa.float32()),
        ("true_node", pa.string()),
        ("true_edge", pa.string()),
        ("true_behavior", pa.string()),
        ("believed_node", pa.string()),
        ("believed_edge", pa.string()),
        ("behavior", pa.string()),
        ("stopped_because", pa.string()),
        ("plan_probability", pa.list_(pa.float32())),
        ("elsewhere_probability", pa.float32()),
        ("act_ms", pa.float32()),
    ]
)


@dataclass(frozen=True)
class StoredEpisode:
    """A record with what it was made from.

    Attributes:
        record: What happened.
        key: Hash of everything that determines the record.
        commit: Source version that made it, or None where unknown.
    """

    record: EpisodeRecord
    key: str
    commit: str | None = None


def save_episode(path: Path, stored: StoredEpisode) -> None:
    """Write one episode; a reader finds the whole file or none."""
    record = stored.record
    metadata = {
        "key": stored.key,
        "commit": stored.commit,
        "agent": record.agent,
        "index": record.index,
        "nodes": record.plan.nodes,
        "edges": record.plan.edges,
        "behaviors": record.behaviors,
        "transitions": record.transitions,
        "strict": asdict(record.strict),
        "tolerant": asdict(record.tolerant),
        "collisions": record.collisions,
        "by_other_collision_rule": [
            asdict(verdict) for verdict in record.by_other_collision_rule or ()
        ],
        "timeout_s": record.timeout_s,
        "wall_s": record.wall_s,
    }
    table = pa.Table.from_pylist([asdict(step) for step in record.steps], schema=_STEP_SCHEMA)
    table = table.replace_schema_metadata({_METADATA_KEY: json.dumps(metadata).encode()})
    _write_table(path, table)


def load_episode(path: Path) -> StoredEpisode | None:
    """The episode in a file, or None where the file is absent, cut short or of another kind."""
    try:
        table = pq.read_table(path)
        metadata = json.loads(table.schema.metadata[_METADATA_KEY])
        return _stored(metadata, table.to_pylist())
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError):
        # Whatever is wrong with the file, the cure is the same: run the episode again.
        return None


def _stored(metadata: dict[str, Any], rows: list[dict[str, Any]]) -> StoredEpisode:
    steps = tuple(
        Step(**{**row, "plan_probability": tuple(row["plan_probability"])}) for row in rows
    )
    other = tuple(map(_verdict, metadata["by_other_collision_rule"]))
    record = EpisodeRecord(
        agent=metadata["agent"],
        index=metadata["index"],
        plan=Plan(tuple(metadata["nodes"]), tuple(metadata["edges"])),
        behaviors=tuple(Behavior(name) for name in metadata["behaviors"]),
        transitions=tuple(metadata["transitions"]),
        strict=_verdict(metadata["strict"]),
        tolerant=_verdict(metadata["tolerant"]),
        timeout_s=metadata["timeout_s"],
        wall_s=metadata["wall_s"],
        steps=steps,
        collisions=metadata["collisions"],
        by_other_collision_rule=(other[0], other[1]) if len(other) == 2 else None,
    )
    return StoredEpisode(record, metadata["key"], metadata["commit"])


def _verdict(fields: dict[str, Any]) -> Verdict:
    return Verdict(**{**fields, "outcome": Outcome(fields["outcome"])})


def write_episode_table(
    path: Path, records: Sequence[EpisodeRecord], map_: TopologicalMap | None = None
) -> None:
    """Write `episodes.parquet`: one row an episode, every verdict in it.

    Args:
        path: Where to write.
        records: The episodes.
        map_: Their map, for the length of each plan in metres.
    """
    _write_table(path, pa.Table.from_pylist([_episode_row(record, map_) for record in records]))


def _episode_row(record: EpisodeRecord, map_: TopologicalMap | None) -> dict[str, Any]:
    plan = record.plan
    row: dict[str, Any] = {
        "agent": record.agent,
        "episode": record.index,
        "start_node": plan.nodes[0],
        "goal_node": plan.nodes[-1],
        "plan_nodes": len(plan.nodes),
        "plan_m": None if map_ is None else plan_length_m(map_, plan),
        "difficulty": str(Difficulty.of_plan(len(plan.nodes))),
        "nodes": list(plan.nodes),
        "edges": list(plan.edges),
        "behaviors": [str(behavior) for behavior in record.behaviors],
        "transitions": list(record.transitions),
        "collisions": record.collisions,
    }
    for rule in DEVIATION_RULES:
        verdict = record.verdict(rule)
        assert verdict is not None
        end = record.steps[verdict.step - 1]
        row |= {
            f"{rule}_success": verdict.success,
            f"{rule}_outcome": str(verdict.outcome),
            f"{rule}_plan_completion": verdict.plan_completion,
            f"{rule}_nodes_reached": verdict.nodes_reached,
            f"{rule}_step": verdict.step,
            f"{rule}_time_s": verdict.time_s,
            f"{rule}_node": verdict.node or "",
            f"{rule}_contact": verdict.contact or "",
            f"{rule}_x_m": end.x_m,
            f"{rule}_y_m": end.y_m,
        }
        for collisions in COLLISION_RULES:
            judged = record.verdict(rule, collisions)
            row |= {
                f"{rule}_outcome_collisions_{collisions}": (
                    None if judged is None else str(judged.outcome)
                ),
                f"{rule}_nodes_reached_collisions_{collisions}": (
                    None if judged is None else judged.nodes_reached
                ),
            }
    return row | {
        "timeout_s": record.timeout_s,
        "driven_m": record.driven_m,
        "steps": len(record.steps),
        "wall_s": record.wall_s,
    }


def plan_length_m(map_: TopologicalMap, plan: Plan) -> float:
    """Length of a plan from node to node, in metres."""
    nodes = [map_.node(node) for node in plan.nodes]
    return sum(math.hypot(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in itertools.pairwise(nodes))


def _write_table(path: Path, table: pa.Table) -> None:
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    write_atomically(path, sink.getvalue().to_pybytes())
