"""Every step of a run's episodes in one small file: paths, true places, what was believed.

Numbers are whole: centimetres, hundredths of a radian and of a metre a second, and probability
in steps of 1/31. So a step takes about six bytes, and a run on a hundred plans with six
agents less than a megabyte.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from jaxtyping import Float64

from toponav.core.errors import InputError
from toponav.core.files import check_is_file, write_atomically
from toponav.evaluation.episode import EpisodeRecord, Step

__all__ = ["StepTable", "StoredPath", "write_step_table"]

_LEVELS = 31
_MOST_BYTES = 1 << 30
_MOST_ROWS = 50_000_000

_NUMBERS = {
    "x_cm": pa.int32(),
    "y_cm": pa.int32(),
    "yaw_crad": pa.int16(),
    "linear_cm_s": pa.int16(),
    "angular_crad_s": pa.int16(),
}
_WORDS = ("true_node", "believed_node", "believed_edge", "behavior", "stopped_because")
_SCHEMA = pa.schema(
    [
        ("agent", pa.dictionary(pa.int16(), pa.string())),
        ("episode", pa.int32()),
        *_NUMBERS.items(),
        *((name, pa.dictionary(pa.int32(), pa.string())) for name in _WORDS),
        ("belief", pa.binary()),
        ("elsewhere", pa.uint8()),
    ]
)


@dataclass(frozen=True, eq=False)
class StoredPath:
    """One episode's steps as arrays, in time order, 0.2 s apart.

    Attributes:
        x_m: True position along x.
        y_m: True position along y.
        yaw_rad: True heading.
        linear_m_s: Commanded speed.
        angular_rad_s: Commanded turn rate.
        true_node: True node, or None, of each step.
        believed_node: Node that the agent took itself to be at.
        believed_edge: Edge that it took itself to be on.
        behavior: Behaviour that it executed.
        stopped_because: Why the agent stopped by itself, or an empty string.
        belief: Probability of each edge of the plan, a row a step.
        elsewhere: Probability off the plan.
    """

    x_m: Float64[np.ndarray, " steps"]
    y_m: Float64[np.ndarray, " steps"]
    yaw_rad: Float64[np.ndarray, " steps"]
    linear_m_s: Float64[np.ndarray, " steps"]
    angular_rad_s: Float64[np.ndarray, " steps"]
    true_node: Sequence[str | None]
    believed_node: Sequence[str | None]
    believed_edge: Sequence[str | None]
    behavior: Sequence[str | None]
    stopped_because: Sequence[str]
    belief: Float64[np.ndarray, "steps edges"]
    elsewhere: Float64[np.ndarray, " steps"]

    def __len__(self) -> int:
        return len(self.x_m)


def write_step_table(path: Path, records: Sequence[EpisodeRecord]) -> None:
    """Write `steps.parquet`: every step of every episode, for figures and further analysis."""
    columns: dict[str, list[Any]] = {name: [] for name in _SCHEMA.names}
    for record in records:
        for step in record.steps:
            for name, value in _row(record, step).items():
                columns[name].append(value)
    arrays = {
        name: pa.array(values, _plain(_SCHEMA.field(name).type))
        for name, values in columns.items()
    }
    table = pa.table(arrays).cast(_SCHEMA)
    sink = pa.BufferOutputStream()
    pq.write_table(
        table,
        sink,
        compression="zstd",
        compression_level=15,
        use_dictionary=["agent", *_WORDS],
        column_encoding=dict.fromkeys([*_NUMBERS, "episode"], "DELTA_BINARY_PACKED"),
        write_statistics=False,
    )
    write_atomically(path, sink.getvalue().to_pybytes())


def _plain(kind: pa.DataType) -> pa.DataType:
    return kind.value_type if pa.types.is_dictionary(kind) else kind


def _row(record: EpisodeRecord, step: Step) -> dict[str, Any]:
    levels = [round(_LEVELS * min(1.0, share)) for share in step.plan_probability]
    return {
        "agent": record.agent,
        "episode": record.index,
        "x_cm": round(100 * step.x_m),
        "y_cm": round(100 * step.y_m),
        "yaw_crad": round(100 * step.yaw_rad),
        "linear_cm_s": _within(100 * step.linear_m_s),
        "angular_crad_s": _within(100 * step.angular_rad_s),
        **{name: getattr(step, name) for name in _WORDS},
        "belief": bytes(levels),
        "elsewhere": round(_LEVELS * min(1.0, step.elsewhere_probability)),
    }


def _within(value: float) -> int:
    return max(-32768, min(32767, round(value)))


class StepTable:
    """The steps that a run left, by agent and episode.

    Args:
        path: `steps.parquet` in a folder of results.

    Raises:
        InputError: If there is no such file, or it is of another kind.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        check_is_file(path, max_bytes=_MOST_BYTES)
        try:
            if pq.read_metadata(path).num_rows > _MOST_ROWS:
                raise ValueError(f"more than {_MOST_ROWS} steps")
            table = pq.read_table(path).cast(_SCHEMA)
        except (OSError, pa.ArrowException, ValueError) as error:
            raise self._broken(str(error)) from None
        self._table = table
        self._spans = dict(self._find_spans())

    def __contains__(self, key: tuple[str, int]) -> bool:
        return key in self._spans

    @property
    def episodes(self) -> tuple[tuple[str, int], ...]:
        """Agent and number of each episode, in the order of the file."""
        return tuple(self._spans)

    def path(self, agent: str, episode: int) -> StoredPath:
        """The steps of one episode.

        Raises:
            InputError: If the run has no such episode.
        """
        if (agent, episode) not in self._spans:
            raise InputError(
                f"has no episode {episode} of {agent}",
                where=str(self._path),
                remedy="name an agent and an episode of this run",
            )
        first, stop = self._spans[agent, episode]
        rows = self._table.slice(first, stop - first)
        number = {
            name: rows[name].to_numpy(zero_copy_only=False).astype(np.float64) / 100
            for name in _NUMBERS
        }
        words: Mapping[str, list[Any]] = {name: rows[name].to_pylist() for name in _WORDS}
        belief = [np.frombuffer(levels or b"", np.uint8) for levels in rows["belief"].to_pylist()]
        if len({len(levels) for levels in belief}) > 1:
            raise self._broken(f"the belief of episode {episode} changes its length")
        return StoredPath(
            number["x_cm"],
            number["y_cm"],
            number["yaw_crad"],
            number["linear_cm_s"],
            number["angular_crad_s"],
            words["true_node"],
            words["believed_node"],
            words["believed_edge"],
            words["behavior"],
            [word or "" for word in words["stopped_because"]],
            np.array(belief, np.float64).reshape(len(rows), -1) / _LEVELS,
            rows["elsewhere"].to_numpy(zero_copy_only=False).astype(np.float64) / _LEVELS,
        )

    def _find_spans(self) -> Iterator[tuple[tuple[str, int], tuple[int, int]]]:
        if not len(self._table):
            return
        names = self._table["agent"].cast(pa.string()).to_pylist()
        agents = pc.index_in(self._table["agent"].cast(pa.string()), pa.array(sorted(set(names))))
        codes = agents.to_numpy(zero_copy_only=False).astype(np.int64)
        episodes = self._table["episode"].to_numpy(zero_copy_only=False).astype(np.int64)
        begins = np.flatnonzero((np.diff(codes) != 0) | (np.diff(episodes) != 0)) + 1
        bounds = [0, *begins.tolist(), len(codes)]
        for first, stop in itertools.pairwise(bounds):
            yield (names[first], int(episodes[first])), (first, stop)

    def _broken(self, why: str) -> InputError:
        return InputError(
            f"is not a table of steps: {why[:200]}",
            where=str(self._path),
            remedy="run the evaluation again; finished episodes are kept",
        )
