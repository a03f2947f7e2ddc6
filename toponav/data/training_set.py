"""Frames as networks learn from them: a folder of memory-mapped arrays, made once.

CACHE/frames.npy       what the networks see, one byte a pixel
CACHE/columns.npz      labels and poses, one row a frame
CACHE/cache.json       image, trajectories, where it came from
CACHE/maps/            the map of each building
"""

import functools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from jaxtyping import Bool, Float32, Int8, Int32, Int64, UInt8

from toponav.core.errors import InputError
from toponav.data.splits import Split, split_buildings
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap, load_map

__all__ = ["CACHE_FILE", "CACHE_SCHEMA", "Labels", "TrainingSet", "TrajectoryEntry"]

Labels = Literal["plan", "heuristic"]
CACHE_FILE: Final = "cache.json"
CACHE_SCHEMA: Final = 1
_LONGEST_DETOUR: Final = 5
_REMEDY = "run `toponav data prepare` again"


@dataclass(frozen=True)
class TrajectoryEntry:
    """What is known of one trajectory beside its frames.

    Attributes:
        building: The building that it was driven in.
        plan: The plan that it followed.
        map_path: File of the building's map.
        source: Who drove.
        outcome: How it ended.
        frames: How many frames it has.
    """

    building: str
    plan: Plan
    map_path: Path
    source: str
    outcome: str
    frames: int


class TrainingSet:
    """Frames, labels, maps and plans of one or more prepared datasets.

    Frames of a trajectory are contiguous and in time order. Where several caches are opened,
    their trajectories are numbered on; the frames of a single cache stay on disk and are
    mapped, those of several are read into memory.

    Attributes:
        frames: What the networks see, one byte a pixel.
        command: The expert's command: m/s and rad/s.
        executed: What the robot was told: m/s and rad/s.
        behavior: Position in `list(Behavior)`, -1 where there is no label.
        edge: Index into the edges of the frame's map, -1 where there is no label.
        node: Index into the nodes of the frame's map, -1 where there is no label.
        plan_position: How many nodes of the plan the robot had come.
        off_plan: Whether the true node was known and not in the plan.
        trajectory: Number of the trajectory.
        pose: True x, y (metres) and yaw (radians).

    Example:
        >>> data = TrainingSet.open("data/train/cache-compact")
        >>> data.frames.shape, data.map_of(0).name
        ((251341, 32, 96), 'office_0000000')
    """

    def __init__(
        self,
        frames: UInt8[np.ndarray, "frames rows cols"],
        columns: Mapping[str, np.ndarray],
        entries: Sequence[TrajectoryEntry],
        image: Mapping[str, Any],
        labels: Labels = "plan",
    ) -> None:
        self.frames = frames
        self.labels = labels
        self.image = dict(image)
        self.command: Float32[np.ndarray, "frames 2"] = columns["command"]
        self.executed: Float32[np.ndarray, "frames 2"] = columns["executed"]
        self.pose: Float32[np.ndarray, "frames 3"] = columns["pose"]
        self.trajectory: Int32[np.ndarray, " frames"] = columns["trajectory"]
        self.off_plan: Bool[np.ndarray, " frames"] = columns["off_plan"]
        self.plan_position: Int32[np.ndarray, " frames"] = columns["plan_position"]
        self.behavior: Int8[np.ndarray, " frames"]
        self.edge: Int32[np.ndarray, " frames"]
        self.node: Int32[np.ndarray, " frames"]
        if labels == "plan":
            self.behavior = columns["edge_behavior"]
            astray = _long_runs(self.off_plan, self.trajectory)
            self.edge = np.where(astray, np.int32(-1), columns["plan_edge"])
            self.node = columns["true_node"]
        else:
            self.behavior = columns["behavior"]
            self.edge = columns["edge"]
            self.node = columns["node"]
        self._entries = tuple(entries)
        counts = [entry.frames for entry in self._entries]
        self.starts: Int64[np.ndarray, " bounds"] = np.concatenate([[0], np.cumsum(counts)])

    @staticmethod
    def open(
        directories: str | Path | Sequence[str | Path], labels: Labels = "plan"
    ) -> "TrainingSet":
        """The training set in one or more folders written by `prepare`.

        Args:
            directories: A folder, or several of the same image, such as DAgger rounds.
            labels: `plan`: behaviour and edge are what a robot that knows its true node
                executes on the plan; a robot astray for a second or more has no edge.
                `heuristic`: behaviour, node and edge by the paper's annotation.

        Raises:
            InputError: A folder is no finished cache, or the images differ.
        """
        if labels not in ("plan", "heuristic"):
            raise InputError(
                f"labels are 'plan' or 'heuristic', got {labels!r}",
                where="TrainingSet.open",
                remedy="use 'plan', the default",
            )
        if isinstance(directories, str | Path):
            directories = [directories]
        parts = [_read(Path(directory)) for directory in directories]
        if not parts:
            raise InputError("a training set needs a folder", where="--data", remedy="give one")
        image = parts[0].image
        for part, directory in zip(parts, directories, strict=True):
            if part.image != image:
                raise InputError(
                    "all caches must have the same image, got "
                    f"{_size(part.image)} and {_size(image)}",
                    where=str(directory),
                    remedy="prepare all datasets for the same preset",
                )
        if len(parts) == 1:
            return TrainingSet(parts[0].frames, parts[0].columns, parts[0].entries, image, labels)
        offsets = np.cumsum([0] + [len(part.entries) for part in parts])
        for part, offset in zip(parts, offsets.tolist(), strict=False):
            part.columns["trajectory"] = part.columns["trajectory"] + np.int32(offset)
        columns = {
            name: np.concatenate([part.columns[name] for part in parts])
            for name in parts[0].columns
        }
        entries = [entry for part in parts for entry in part.entries]
        frames = np.concatenate([part.frames for part in parts])
        return TrainingSet(frames, columns, entries, image, labels)

    def __len__(self) -> int:
        return len(self.trajectory)

    @property
    def trajectories(self) -> int:
        """How many trajectories there are."""
        return len(self._entries)

    def entry(self, trajectory: int) -> TrajectoryEntry:
        """What is known of a trajectory."""
        return self._entries[trajectory]

    def rows_of(self, trajectory: int) -> slice:
        """The rows of a trajectory's frames."""
        return slice(int(self.starts[trajectory]), int(self.starts[trajectory + 1]))

    def map_of(self, trajectory: int) -> TopologicalMap:
        """The map that the trajectory was driven on; read once."""
        return _map(self._entries[trajectory].map_path)

    def plan_of(self, trajectory: int) -> Plan:
        """The plan that the trajectory followed."""
        return self._entries[trajectory].plan

    def building_of(self, trajectory: int) -> str:
        """The building that the trajectory was driven in."""
        return self._entries[trajectory].building

    @property
    def buildings(self) -> tuple[str, ...]:
        """Names of the buildings, sorted."""
        return tuple(sorted({entry.building for entry in self._entries}))

    def split(self, name: Split) -> Int64[np.ndarray, " rows"]:
        """Rows of the frames of one side of the division by buildings: train, val or all."""
        chosen = split_buildings(self.buildings, name)
        wanted = np.array([entry.building in chosen for entry in self._entries], bool)
        rows: np.ndarray = np.flatnonzero(wanted[self.trajectory])
        return rows


@functools.lru_cache(maxsize=4096)
def _map(path: Path) -> TopologicalMap:
    return load_map(path)


def _size(image: Mapping[str, Any]) -> str:
    return f"{image.get('rows')}x{image.get('cols')} {image.get('projection')}"


def _long_runs(
    flags: Bool[np.ndarray, " frames"], trajectory: Int32[np.ndarray, " frames"]
) -> Bool[np.ndarray, " frames"]:
    """Where a flag holds for a second or more on end, within one trajectory."""
    begins = np.ones(len(flags), bool)
    begins[1:] = (flags[1:] != flags[:-1]) | (trajectory[1:] != trajectory[:-1])
    run = np.cumsum(begins) - 1
    return np.asarray(flags & (np.bincount(run)[run] >= _LONGEST_DETOUR)) if len(flags) else flags


@dataclass
class _Part:
    frames: np.ndarray
    columns: dict[str, np.ndarray]
    entries: list[TrajectoryEntry]
    image: dict[str, Any]


def _read(directory: Path) -> _Part:
    try:
        document = json.loads((directory / CACHE_FILE).read_bytes())
        if document["schema"] != CACHE_SCHEMA:
            raise ValueError(f"schema must be {CACHE_SCHEMA}, got {document['schema']}")
        frames = np.load(directory / "frames.npy", mmap_mode="r", allow_pickle=False)
        with np.load(directory / "columns.npz", allow_pickle=False) as archive:
            columns = {name: archive[name] for name in archive.files}
        entries = [_entry(directory, row) for row in document["trajectories"]]
        count = sum(entry.frames for entry in entries)
        lengths = {len(frames), *(len(column) for column in columns.values())}
        if lengths != {count} or frames.dtype != np.uint8:
            raise ValueError(f"every array must have {count} rows, got {sorted(lengths)}")
        return _Part(frames, columns, entries, dict(document["image"]))
    except FileNotFoundError as error:
        missing = Path(str(error.filename)).name
        raise InputError(
            f"a finished training cache holds {missing}, this folder does not",
            where=str(directory),
            remedy="run `toponav data prepare DATASET --preset compact --out CACHE`",
        ) from error
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise InputError(
            f"the training cache is broken: {error}", where=str(directory), remedy=_REMEDY
        ) from error


def _entry(directory: Path, row: Mapping[str, Any]) -> TrajectoryEntry:
    building = str(row["building"])
    return TrajectoryEntry(
        building=building,
        plan=Plan(tuple(row["plan_nodes"]), tuple(row["plan_edges"])),
        map_path=directory / "maps" / f"{building}.topo.json",
        source=str(row["source"]),
        outcome=str(row["outcome"]),
        frames=int(row["frames"]),
    )
