"""A dataset on disk: its folder, its manifest and its index.

DIR/dataset.json            what was asked for, with what versions, and a hash per file
DIR/index.parquet           one row a trajectory
DIR/annotations.parquet     one row a frame
DIR/trajectories/*.mcap     one ROS 2 bag a trajectory
DIR/buildings/NAME/         scene and map of each building
"""

import hashlib
import json
import platform
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

import toponav
from toponav.core.errors import InputError
from toponav.data.recording import TrajectoryEnd, TrajectoryMetadata
from toponav.data.storage import read_summary, write_atomically

__all__ = [
    "ANNOTATIONS",
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
_SCHEMA: Final = 1


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
        return [index for index in range(self.episodes) if index not in set(self.dropped)]


def trajectory_path(dataset_dir: Path, index: int) -> Path:
    """The file of a trajectory."""
    return dataset_dir / "trajectories" / f"{index:06d}.mcap"


def building_dir(dataset_dir: Path, name: str) -> Path:
    """The folder of a building."""
    return dataset_dir / "buildings" / name


def recorded(dataset_dir: Path) -> list[int]:
    """Numbers of the trajectories that are there, in order."""
    files = (dataset_dir / "trajectories").glob("*.mcap")
    return sorted(int(path.stem) for path in files if path.stem.isdigit())


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
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(
            f"a dataset is a folder with {MANIFEST}, got: {error.strerror}",
            where=str(dataset_dir),
            remedy="give the folder that `toponav collect graphnav --out` wrote",
        ) from error
    except ValueError as error:
        raise _bad_manifest(path, f"must be JSON, got: {error}") from error
    try:
        if document["schema"] != _SCHEMA:
            raise ValueError(f"schema must be {_SCHEMA}, got {document['schema']}")
        return Manifest(
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
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _bad_manifest(path, f"lacks or garbles {error}") from error


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
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def index_row(dataset_dir: Path, index: int) -> dict[str, Any]:
    """A trajectory's row in the index, from its file alone.

    Raises:
        InputError: The file is missing or broken.
    """
    metadata, end, digest, size = read_summary(trajectory_path(dataset_dir, index))
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


def read_table(path: Path, remedy: str) -> Any:
    """The table in a Parquet file.

    Raises:
        InputError: It is missing or broken.
    """
    try:
        return pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        detail = str(error).splitlines()[0]
        raise InputError(
            f"the table must be readable, got: {detail}", where=str(path), remedy=remedy
        ) from error


@contextmanager
def locked(dataset_dir: Path) -> Iterator[None]:
    """Hold a dataset for writing; the lock goes with the process, however it ends.

    Raises:
        InputError: Another process is writing to it.
    """
    dataset_dir.mkdir(parents=True, exist_ok=True)
    with open(dataset_dir / ".lock", "w") as file:
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
