"""Frames as networks learn from them: a folder of memory-mapped arrays, made once.

CACHE/frames.npy       what the networks see, one byte a pixel
CACHE/columns.npz      labels and poses, one row a frame
CACHE/cache.json       image, trajectories, where it came from
CACHE/maps/            the map of each building
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from jaxtyping import Bool, Float32, Int8, Int32, Int64, UInt8

from toponav.core.arrays import Shape, map_npy, read_npz
from toponav.core.errors import InputError, shown
from toponav.core.files import check_file_name, read_json_object
from toponav.core.vocabulary import Behavior
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
        >>> data = TrainingSet.open("data/train/cache-compact")  # doctest: +SKIP
        >>> data.frames.shape, data.map_of(0).name  # doctest: +SKIP
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
        self._fits_map: set[int] = set()
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
        entry = self._entries[trajectory]
        found = _map(entry.map_path)
        if trajectory not in self._fits_map:
            unknown = set(entry.plan.nodes) - found.node_index.keys()
            unknown |= set(entry.plan.edges) - found.edge_index.keys()
            if unknown:
                raise InputError(
                    f"the plan of trajectory {trajectory} goes by {shown(min(unknown))}, which "
                    "the map does not have",
                    where=str(entry.map_path),
                    remedy=_REMEDY,
                )
            here = self.rows_of(trajectory)
            for what, codes, count in (
                ("edge", self.edge[here], len(found.edges)),
                ("node", self.node[here], len(found.nodes)),
            ):
                if codes.size and codes.max() >= count:
                    raise InputError(
                        f"a label names {what} {codes.max()} of a map with {count}",
                        where=str(entry.map_path),
                        remedy=_REMEDY,
                    )
            self._fits_map.add(trajectory)
        return found

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
    for name in (CACHE_FILE, "frames.npy", "columns.npz"):
        if not (directory / name).is_file():
            raise InputError(
                f"a finished training cache holds {name}, this folder does not",
                where=str(directory),
                remedy="run `toponav data prepare DATASET --preset compact --out CACHE`",
            )
    document = read_json_object(directory / CACHE_FILE)
    try:
        if document["schema"] != CACHE_SCHEMA:
            raise ValueError(f"schema must be {CACHE_SCHEMA}, got {shown(document['schema'])}")
        entries = [_entry(directory, row) for row in document["trajectories"]]
        image = dict(document["image"])
        shape = (sum(entry.frames for entry in entries), int(image["rows"]), int(image["cols"]))
        frames = map_npy(directory / "frames.npy", "|u1", shape, remedy=_REMEDY)
        columns = _read_columns(directory / "columns.npz", entries)
        return _Part(frames, columns, entries, image)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as error:
        if isinstance(error, InputError) and error.where.startswith(str(directory)):
            raise
        raise InputError(
            f"the training cache is broken: {str(error)[:200]}",
            where=str(directory),
            remedy=_REMEDY,
        ) from error


def _read_columns(path: Path, entries: Sequence[TrajectoryEntry]) -> dict[str, np.ndarray]:
    """The labels, of the types that they must have and within what they may say."""
    counts = [entry.frames for entry in entries]
    rows = sum(counts)
    wanted: dict[str, tuple[str, Shape]] = {
        "command": ("<f4", (rows, 2)),
        "executed": ("<f4", (rows, 2)),
        "velocity": ("<f4", (rows, 2)),
        "pose": ("<f4", (rows, 3)),
        "off_plan": ("|b1", (rows,)),
        **dict.fromkeys(("trajectory", "plan_position"), ("<i4", (rows,))),
        **dict.fromkeys(("node", "true_node", "edge", "plan_edge"), ("<i4", (rows,))),
        **dict.fromkeys(("behavior", "edge_behavior"), ("|i1", (rows,))),
    }
    columns = read_npz(path, wanted, remedy=_REMEDY)
    if not np.array_equal(columns["trajectory"], np.repeat(np.arange(len(counts)), counts)):
        raise ValueError(f"{path.name}: the rows are not in the order of the trajectories")
    for name, values in columns.items():
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise ValueError(f"{path.name}: {name} must be finite")
        lowest, highest = (-1, len(Behavior) - 1) if values.dtype == np.int8 else (-1, 2**31)
        within = (values >= lowest) & (values <= highest)
        if values.dtype.kind == "i" and not within.all():
            raise ValueError(f"{path.name}: {name} must lie in {lowest}..{highest}")
    return columns


def _entry(directory: Path, row: Mapping[str, Any]) -> TrajectoryEntry:
    building = check_file_name(row["building"], f"{directory / CACHE_FILE}, building")
    if int(row["frames"]) < 0:
        raise ValueError(f"a trajectory has {row['frames']} frames")
    return TrajectoryEntry(
        building=building,
        plan=Plan(tuple(map(str, row["plan_nodes"])), tuple(map(str, row["plan_edges"]))),
        map_path=directory / "maps" / f"{building}.topo.json",
        source=str(row["source"]),
        outcome=str(row["outcome"]),
        frames=int(row["frames"]),
    )
