"""What is evaluated: a building, its map, and the plans to follow in it."""

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.vocabulary import NodeKind
from toponav.maps.plan import Plan, plans_for, shortest_plan
from toponav.maps.spec import TopologicalMap, load_map, map_to_document
from toponav.worlds.free_space import FreeSpace

if TYPE_CHECKING:
    from toponav.worlds.scene import Scene

__all__ = [
    "EpisodeTask",
    "LeftOut",
    "Suite",
    "SuiteSource",
    "load_suite",
    "map_hash",
    "sample_tasks",
    "seed_of",
    "suite_of",
]

_START_YAW_SPREAD_RAD = math.radians(20.0)
_START_RADIUS_M = 0.25


@dataclass(frozen=True)
class SuiteSource:
    """Where a suite comes from: an area with published pairs, or a scene with sampled plans."""

    area: Path | None = None
    """The authors' yaml of a Stanford area."""
    plans: Path | None = None
    """Published start/goal pairs of that area (JSON)."""
    scene: Path | None = None
    """Folder of a scene."""
    map: Path | None = None
    """Topological map of that scene."""
    episodes: int | None = None
    """How many episodes: the first so many pairs, or so many sampled plans (default 20)."""
    seed: int = 0
    """Seed of the sampled plans."""

    def __post_init__(self) -> None:
        by_area = self.area is not None and self.plans is not None
        by_scene = self.scene is not None and self.map is not None
        any_area = self.area is not None or self.plans is not None
        any_scene = self.scene is not None or self.map is not None
        if by_area == by_scene or (by_area and any_scene) or (by_scene and any_area):
            raise InputError(
                "an evaluation needs an area with pairs, or a scene with its map",
                where="toponav eval graphnav",
                remedy="give --area AREA.yaml --plans PLANS.json, or --scene DIR --map MAP",
            )
        if self.episodes is not None and self.episodes < 1:
            raise InputError(
                f"episodes must be at least 1, got {self.episodes}",
                where="--episodes",
                remedy="leave it out to take all pairs",
            )


@dataclass(frozen=True)
class EpisodeTask:
    """One episode to run.

    Attributes:
        index: Its number; published pairs keep their position in the file.
        plan: What to follow.
        start: Where the robot stands at first.
    """

    index: int
    plan: Plan
    start: Pose2


@dataclass(frozen=True)
class LeftOut:
    """A published pair without a plan."""

    index: int
    start_room: str
    end_room: str
    reason: str


@dataclass(frozen=True, eq=False)
class Suite:
    """A building, its map and the episodes to run in it.

    Attributes:
        name: Name for display.
        scene: The building.
        map: Its topological map.
        tasks: The episodes, by index.
        left_out: Published pairs without a plan.
    """

    name: str
    scene: "Scene"
    map: TopologicalMap
    tasks: tuple[EpisodeTask, ...]
    left_out: tuple[LeftOut, ...] = ()

    def task(self, index: int) -> EpisodeTask:
        """The episode of that number."""
        return self._by_index[index]

    @cached_property
    def _by_index(self) -> dict[int, EpisodeTask]:
        return {task.index: task for task in self.tasks}

    @cached_property
    def map_hash(self) -> str:
        """SHA-256 of the map's content."""
        return map_hash(self.map)


def map_hash(map_: TopologicalMap) -> str:
    """SHA-256 of a map's content, whatever file it came from."""
    document = json.dumps(map_to_document(map_), sort_keys=True)
    return hashlib.sha256(document.encode()).hexdigest()


def seed_of(*parts: int | str) -> int:
    """A seed that depends on all parts and on nothing else, the same on every machine.

    Example:
        >>> seed_of(0, 1) == seed_of(0, 1), seed_of(0, 1) == seed_of(0, 2)
        (True, False)
    """
    text = "/".join(str(part) for part in parts)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:7], "big")


def load_suite(source: SuiteSource) -> Suite:
    """The suite that a source describes.

    Raises:
        InputError: If a file cannot be read, or nothing is left to run.
    """
    if source.area is not None:
        assert source.plans is not None
        return _load_area_suite(source.area, source.plans, source.episodes)
    assert source.scene is not None
    assert source.map is not None
    from toponav.worlds.storage import load_scene

    scene = load_scene(source.scene)
    return suite_of(scene, load_map(source.map), source.episodes or 20, source.seed)


def suite_of(scene: "Scene", map_: TopologicalMap, episodes: int, seed: int) -> Suite:
    """A suite of sampled plans."""
    return Suite(scene.name, scene, map_, sample_tasks(scene, map_, episodes, seed))


def _load_area_suite(area: Path, plans: Path, episodes: int | None) -> Suite:
    from toponav.maps.formats.canvas import load_area_map
    from toponav.worlds.load.stanford import load_area, load_pairs

    scene, map_ = load_area(area), load_area_map(area)
    pairs = load_pairs(plans)
    found, reasons = plans_for(map_, [(pair.start_room, pair.end_room) for pair in pairs])
    tasks = [EpisodeTask(index, found[index], pairs[index].start_pose) for index in sorted(found)]
    if not tasks:
        raise InputError(
            f"none of the {len(pairs)} pairs has a plan in the map of {area.name}",
            where=str(plans),
            remedy="give the pairs that were published with this area",
        )
    left_out = tuple(
        LeftOut(index, pairs[index].start_room, pairs[index].end_room, reasons[index])
        for index in sorted(reasons)
    )
    return Suite(scene.name, scene, map_, tuple(tasks[:episodes]), left_out)


def sample_tasks(
    scene: "Scene", map_: TopologicalMap, episodes: int, seed: int
) -> tuple[EpisodeTask, ...]:
    """Episodes between random rooms; the first n are the same however many are asked for.

    Start and goal are distinct room nodes (any nodes, where the map has fewer than two rooms)
    with a plan between them. The robot stands at a random free place in the start room, with
    the yaw of the plan's first edge +- 20 degrees.

    Raises:
        InputError: If no two nodes are joined by a plan.

    Reference:
        GraphNav, section VI-B: "random start and end nodes, followed by the shortest path".
    """
    free = FreeSpace.of(scene, _START_RADIUS_M)
    rooms = [node.id for node in map_.nodes if node.kind is NodeKind.ROOM]
    candidates = rooms if len(rooms) >= 2 else [node.id for node in map_.nodes]
    return tuple(
        _sample_task(index, free, scene, map_, candidates, seed) for index in range(episodes)
    )


def _sample_task(
    index: int,
    free: FreeSpace,
    scene: "Scene",
    map_: TopologicalMap,
    candidates: Sequence[str],
    seed: int,
) -> EpisodeTask:
    rng = np.random.default_rng(seed_of("suite", seed, index))
    for _ in range(200):
        if len(candidates) < 2:
            break
        start, goal = (str(node) for node in rng.choice(candidates, 2, replace=False))
        try:
            plan = shortest_plan(map_, start, goal)
        except InputError:
            continue
        x_m, y_m = _start_position(free, scene, map_, plan, rng)
        spread_rad = rng.uniform(-_START_YAW_SPREAD_RAD, _START_YAW_SPREAD_RAD)
        yaw_rad = wrap_angle(map_.edge(plan.edges[0]).yaw_rad + spread_rad)
        return EpisodeTask(index, plan, Pose2(x_m, y_m, yaw_rad))
    raise InputError(
        "no two rooms are joined by a plan",
        where=f"map '{map_.name}'",
        remedy="run `toponav map check` on it",
    )


def _start_position(
    free: FreeSpace,
    scene: "Scene",
    map_: TopologicalMap,
    plan: Plan,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """A free place in the start node's room that is connected with the plan's second node."""
    node, following = map_.node(plan.nodes[0]), map_.node(plan.nodes[1])
    names = [room.name for room in scene.rooms]
    if node.kind is NodeKind.ROOM and node.room in names:
        inside = free.free & (scene.room_index == names.index(node.room))
        try:
            connected = free.component[free.nearest_free(following.x_m, following.y_m)]
            inside &= free.component == connected
        except InputError:
            pass  # The map's node lies in furniture: any free place in the room will do.
        cells = np.argwhere(inside)
        if len(cells):
            row, col = cells[rng.integers(len(cells))].tolist()
            x_m, y_m = scene.grid.center_of(row, col)
            return float(x_m), float(y_m)
    return node.x_m, node.y_m
