"""A dataset on disk: its folder, its manifest and its index.

DIR/dataset.json            what was asked for, with what versions, and a hash per file
DIR/index.parquet           one row a trajectory
DIR/annotations.parquet     one row a frame
DIR/trajectories/*.mcap     one ROS 2 bag a trajectory
DIR/buildings/NAME/         scene and map of each building
"""

import json
import platform
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

import toponav
from toponav.core.errors import InputError, shown
from toponav.core.files import (
    check_file_name,
    check_is_file,
    file_beside,
    hash_of_file,
    os_fault,
    read_json_object,
    write_atomically,
)
from toponav.data.recording import TrajectoryEnd, TrajectoryMetadata
from toponav.data.storage import read_summary

__all__ = [
    "ANNOTATIONS",
    "ANNOTATION_COLUMNS",
    "INDEX_COLUMNS",
    "MAX_EPISODES",
    "Manifest",
    "building_dir",
    "discard_partials",
    "environment",
    "file_hash",
    "index_row",
    "locked",
    "read_manifest",
    "read_table",
    "recorded",
    "trajectory_path",
    "write_index",
    "write_manifest",
    "write_table",
]

MANIFEST: Final = "dataset.json"
INDEX: Final = "index.parquet"
ANNOTATIONS: Final = "annotations.parquet"
INDEX_COLUMNS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("trajectory", "frames", "attempt", "bytes"), "int"),
    **dict.fromkeys(("building", "source", "outcome"), "text"),
    **dict.fromkeys(("plan_nodes", "plan_edges"), "names"),
    "distance_m": "float",
}
"""What readers of the index need, and of what kind it is."""
_LABELS: Final = ("room", "node", "edge", "behavior", "true_node", "plan_edge", "edge_behavior")
_MOTION: Final = ("time_s", "x_m", "y_m", "yaw_rad", "linear_m_s", "angular_rad_s")
_COMMANDS: Final = tuple(
    f"{who}_{what}" for who in ("command", "executed") for what in ("linear_m_s", "angular_rad_s")
)
ANNOTATION_COLUMNS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("trajectory", "frame", "plan_position"), "int"),
    **dict.fromkeys((*_MOTION, *_COMMANDS), "float"),
    **dict.fromkeys(_LABELS, "text"),
    "off_plan": "bool",
}
"""What readers of the annotations need, and of what kind it is."""
MAX_EPISODES: Final = 10_000_000
_SCHEMA: Final = 1
_MAX_ROWS: Final = 200_000_000


@dataclass(frozen=True)
class Manifest:
    """What a dataset should hold.

    Attributes:
        kind: What was recorded: `graphnav`.
        episodes: How many trajectories were asked for; they are numbered from 0.
        config: Resolved configuration; with it the dataset can be recorded again.
        environment: Versions and commit that it was recorded with.
        complete: Whether all are there and listed.
        dropped: Numbers of trajectories that a repair took out.
        trajectories: SHA-256 and size by number.
        buildings: Scene hash, map hash and a SHA-256 per file, by name.
    """

    kind: str
    episodes: int
    config: Mapping[str, Any]
    environment: Mapping[str, str]
    complete: bool = False
    dropped: tuple[int, ...] = ()
    trajectories: Mapping[int, tuple[str, int]] = field(default_factory=dict)
    buildings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def expected(self) -> list[int]:
        """Numbers of the trajectories that should be there."""
        dropped = set(self.dropped)
        return [index for index in range(self.episodes) if index not in dropped]


def trajectory_path(dataset_dir: Path, index: int) -> Path:
    """The file of a trajectory."""
    return dataset_dir / "trajectories" / f"{index:06d}.mcap"


def building_dir(dataset_dir: Path, name: str) -> Path:
    """The folder of a building."""
    return dataset_dir / "buildings" / check_file_name(name, f"{dataset_dir}, a building's name")


def recorded(dataset_dir: Path) -> list[int]:
    """Numbers of the trajectories that are there, in order."""
    files = (dataset_dir / "trajectories").glob("*.mcap")
    return sorted(int(path.stem) for path in files if re.fullmatch("[0-9]{6,9}", path.stem))


def discard_partials(dataset_dir: Path) -> int:
    """Remove what an interrupted writer left behind; returns how many files there were."""
    count = 0
    for path in list(dataset_dir.glob("**/.*.partial")):
        with suppress(OSError):
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()
            count += 1
    return count


def write_manifest(dataset_dir: Path, manifest: Manifest) -> None:
    """Replace `dataset.json`, all or nothing."""
    document = {
        "schema": _SCHEMA,
        "kind": manifest.kind,
        "episodes": manifest.episodes,
        "complete": manifest.complete,
        "dropped": list(manifest.dropped),
        "config": manifest.config,
        "environment": manifest.environment,
        "trajectories": {
            f"{index:06d}": {"sha256": digest, "bytes": size}
            for index, (digest, size) in sorted(manifest.trajectories.items())
        },
        "buildings": dict(sorted(manifest.buildings.items())),
    }
    text = json.dumps(document, indent=1) + "\n"
    write_atomically(dataset_dir / MANIFEST, text.encode())


def read_manifest(dataset_dir: Path) -> Manifest:
    """The manifest of a dataset.

    Raises:
        InputError: The folder is not a dataset, or its manifest is broken.
    """
    path = dataset_dir / MANIFEST
    if not path.exists():
        raise InputError(
            f"a dataset is a folder with {MANIFEST}, which is missing",
            where=str(dataset_dir),
            remedy="give the folder that `toponav collect graphnav --out` wrote",
        )
    try:
        document = read_json_object(path)
    except InputError as error:
        raise _bad_manifest(path, f"must be JSON, got: {error.rule}") from None
    try:
        return _manifest(document, path)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise _bad_manifest(path, f"lacks or garbles {str(error)[:200]}") from error


def _manifest(document: Mapping[str, Any], path: Path) -> Manifest:
    if document["schema"] != _SCHEMA:
        raise ValueError(f"schema must be {_SCHEMA}, got {shown(document['schema'])}")
    found = Manifest(
        kind=str(document["kind"]),
        episodes=int(document["episodes"]),
        config=dict(document["config"]),
        environment=dict(document["environment"]),
        complete=bool(document["complete"]),
        dropped=tuple(map(int, document["dropped"])),
        trajectories={
            int(number): (str(entry["sha256"]), int(entry["bytes"]))
            for number, entry in document["trajectories"].items()
        },
        buildings=dict(document["buildings"]),
    )
    for name, record in found.buildings.items():
        check_file_name(name, f"{path}, buildings")
        for file in record["files"]:
            file_beside(path, file, f"buildings.{name}")
    if not 0 <= found.episodes <= MAX_EPISODES:
        raise ValueError(f"episodes, which must lie in 0..{MAX_EPISODES:,}: {found.episodes}")
    return found


def _bad_manifest(path: Path, rule: str) -> InputError:
    return InputError(
        f"the manifest {rule}",
        where=str(path),
        remedy="restore it from a copy, or run the same `toponav collect` again to rebuild it",
    )


def environment() -> dict[str, str]:
    """Versions and commit, for the record."""
    versions = {"toponav": toponav.__version__, "python": platform.python_version()}
    for package in ("numpy", "mujoco", "numba", "mcap"):
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    return {**versions, "machine": platform.machine(), "commit": _commit()}


def _commit() -> str:
    root = Path(toponav.__file__).parent.parent
    if not (root / ".git").exists():
        return "unknown"
    try:
        done = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "HEAD"],
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() or "unknown"


def file_hash(path: Path) -> str:
    """SHA-256 of a file."""
    return hash_of_file(path)


def index_row(dataset_dir: Path, index: int) -> dict[str, Any]:
    """A trajectory's row in the index, from its file alone.

    Raises:
        InputError: The file is missing or broken.
    """
    path = trajectory_path(dataset_dir, index)
    metadata, end, digest, size = read_summary(path)
    if metadata.index != index:
        raise InputError(
            f"the bag must hold trajectory {index}, got number {metadata.index}",
            where=str(path),
            remedy="restore its name, or run `toponav data repair`",
        )
    return _row(metadata, end, digest, size)


def _row(
    metadata: TrajectoryMetadata, end: TrajectoryEnd, digest: str, size: int
) -> dict[str, Any]:
    return {
        "trajectory": metadata.index,
        "building": metadata.building,
        "source": metadata.source,
        "outcome": end.outcome,
        "contact": end.contact,
        "frames": end.frames,
        "distance_m": end.distance_m,
        "start": metadata.plan.nodes[0],
        "goal": metadata.plan.nodes[-1],
        "plan_nodes": list(metadata.plan.nodes),
        "plan_edges": list(metadata.plan.edges),
        "noise_scale": metadata.noise_scale,
        "attempt": metadata.attempt,
        "sha256": digest,
        "bytes": size,
    }


def write_index(dataset_dir: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Replace `index.parquet`."""
    write_table(dataset_dir / INDEX, pa.Table.from_pylist([dict(row) for row in rows]))


def write_table(path: Path, table: Any) -> None:
    """Write a Parquet file, all or nothing."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    write_atomically(path, sink.getvalue().to_pybytes())


def read_table(path: Path, remedy: str, columns: Mapping[str, str] | None = None) -> Any:
    """The table in a Parquet file.

    Args:
        path: The file.
        remedy: What to do when it is broken.
        columns: Columns that it must have, each with its kind: `int`, `float`, `text`, `bool`,
            `names` (a list of text).

    Raises:
        InputError: It is missing or broken, or lacks a column.
    """
    try:
        check_is_file(path)
    except InputError as error:
        raise InputError(error.rule, where=error.where, remedy=remedy) from None
    try:
        with pq.ParquetFile(path) as file:
            if file.metadata.num_rows > _MAX_ROWS:
                raise ValueError(f"{file.metadata.num_rows:,} rows")
            table = file.read()
        table.validate(full=True)
        for name, kind in (columns if columns and table.num_rows else {}).items():
            if name not in table.column_names or not _KINDS[kind](table.schema.field(name).type):
                raise ValueError(f"a column '{name}' that is missing or not {kind}")
            if table[name].null_count and kind != "text":
                raise ValueError(f"gaps in the column '{name}'")
        return table
    except (OSError, ValueError, pa.ArrowException, MemoryError) as error:
        detail = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(
            f"the table must be readable, got: {detail}", where=str(path), remedy=remedy
        ) from error


def _is_text(kind: Any) -> bool:
    if pa.types.is_dictionary(kind):
        kind = kind.value_type
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


_KINDS: Final[Mapping[str, Callable[[Any], bool]]] = {
    "int": pa.types.is_integer,
    "float": pa.types.is_floating,
    "bool": pa.types.is_boolean,
    "text": _is_text,
    "names": lambda kind: pa.types.is_list(kind) and _is_text(kind.value_type),
}


@contextmanager
def locked(dataset_dir: Path) -> Iterator[None]:
    """Hold a dataset for writing; the lock goes with the process, however it ends.

    Raises:
        InputError: Another process is writing to it.
    """
    try:
        dataset_dir.mkdir(parents=True, exist_ok=True)
        lock = open(dataset_dir / ".lock", "w")  # noqa: SIM115
    except OSError as error:
        raise os_fault(error, dataset_dir, verb="be written") from None
    with lock as file:
        if not _try_lock(file):
            raise InputError(
                "only one command may write to a dataset at a time",
                where=str(dataset_dir),
                remedy="wait for the other command, or stop it and run this again",
            )
        yield


def _try_lock(file: IO[str]) -> bool:
    try:
        import fcntl
    except ImportError:  # not on this platform: nothing to lock with
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
