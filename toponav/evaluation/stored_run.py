"""A finished evaluation read back from its folder: episodes, steps, and the building again."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import check_is_file, read_json_object
from toponav.core.vocabulary import Behavior, Outcome
from toponav.evaluation.agents import title_of
from toponav.evaluation.episode import EpisodeRecord, Step
from toponav.evaluation.protocol import Verdict
from toponav.evaluation.step_table import StepTable, StoredPath
from toponav.evaluation.tables import StoredResults, load_results
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap

if TYPE_CHECKING:
    from toponav.worlds.scene import Scene

__all__ = ["Building", "StoredRun", "find_building", "load_run"]

_COLUMNS = (
    *("agent", "episode", "plan_nodes", "nodes", "behaviors", "timeout_s", "driven_m"),
    *("strict_outcome", "strict_nodes_reached", "strict_step", "strict_node", "strict_contact"),
    *("tolerant_outcome", "tolerant_nodes_reached", "tolerant_step", "tolerant_node"),
)
_MOST_BYTES = 1 << 28
_PERIOD_S = 0.2
_RUN_AGAIN = "run the evaluation again with this version; finished episodes are kept"


@dataclass(frozen=True, eq=False)
class StoredRun:
    """What an evaluation left in its folder.

    Attributes:
        numbers: Its `results.json`.
        settings: Its `run.json`.
        rows: Its `episodes.parquet`, a mapping an episode.
    """

    numbers: StoredResults
    settings: Mapping[str, Any]
    rows: Sequence[Mapping[str, Any]]

    @property
    def name(self) -> str:
        """Name of what was evaluated."""
        return self.numbers.name

    @property
    def folder(self) -> Path:
        """Where it lies."""
        return self.numbers.folder

    @property
    def agents(self) -> tuple[str, ...]:
        """The agents that drove by themselves, by label."""
        return tuple(self.numbers.drivers)

    def title(self, agent: str) -> str:
        """An agent's name for titles."""
        return title_of(agent, self.numbers.results["agents"][agent].get("agent"))

    def check_agent(self, agent: str) -> None:
        """Nothing, if the agent drove in this run.

        Raises:
            InputError: Otherwise; offers the nearest name.
        """
        if agent not in self.agents:
            raise InputError(
                f"no agent of this run is called '{agent}'",
                where=str(self.folder),
                remedy=did_you_mean(agent, self.agents),
            )

    def rows_of(self, agent: str) -> list[Mapping[str, Any]]:
        """The episodes of one agent."""
        return [row for row in self.rows if row["agent"] == agent]

    @property
    def has_steps(self) -> bool:
        """Whether the paths are stored."""
        return (self.folder / "steps.parquet").is_file()

    @cached_property
    def steps(self) -> StepTable:
        """Every step of every episode."""
        return StepTable(self.folder / "steps.parquet")

    def plan_of(self, row: Mapping[str, Any], map_: TopologicalMap) -> Plan:
        """The plan of an episode."""
        nodes = tuple(row["nodes"])
        if row.get("edges"):
            return Plan(nodes, tuple(row["edges"]))
        leaving = [{edge.target: edge.id for edge in map_.out_edges(node)} for node in nodes[:-1]]
        return Plan(nodes, tuple(out[node] for out, node in zip(leaving, nodes[1:], strict=True)))

    def record(self, agent: str, episode: int, map_: TopologicalMap) -> EpisodeRecord:
        """An episode as it was recorded, to a centimetre, until its tolerant verdict.

        Raises:
            InputError: If the run has no such episode, or does not fit the map.
        """
        path = self.steps.path(agent, episode)
        row = next(row for row in self.rows_of(agent) if row["episode"] == episode)
        try:
            plan = self.plan_of(row, map_)
            behaviors = tuple(Behavior(name) for name in row["behaviors"])
            strict, tolerant = (_verdict(row, rule) for rule in ("strict", "tolerant"))
            if path.belief.shape[1] != len(plan.edges) or not 0 < tolerant.step <= len(path):
                raise ValueError("the steps are not those of the plan")
            steps = _steps(path, plan, map_)[: tolerant.step]
        except (KeyError, ValueError, TypeError) as error:
            raise InputError(
                f"episode {episode} of {agent} cannot be read: {str(error)[:120]}",
                where=str(self.folder / "episodes.parquet"),
                remedy=_RUN_AGAIN,
            ) from None
        return EpisodeRecord(
            agent=agent,
            index=episode,
            plan=plan,
            behaviors=behaviors,
            transitions=tuple(row.get("transitions") or ()),
            strict=strict,
            tolerant=tolerant,
            timeout_s=float(row["timeout_s"]),
            wall_s=0.0,
            steps=steps,
        )


def load_run(folder: Path) -> StoredRun:
    """The run in a folder that `toponav eval graphnav` wrote.

    Raises:
        InputError: If a file is missing or of another kind.
    """
    numbers = load_results(folder)
    path = folder / "episodes.parquet"
    check_is_file(path, max_bytes=_MOST_BYTES)
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"is not a table of episodes: {str(error)[:200]}", where=str(path), remedy=_RUN_AGAIN
        ) from None
    missing = [name for name in _COLUMNS if name not in table.column_names]
    if missing:
        raise InputError(
            f"has no column {missing[0]}", where=f"{path}, columns", remedy=_RUN_AGAIN
        )
    return StoredRun(numbers, read_json_object(folder / "run.json"), table.to_pylist())


def _verdict(row: Mapping[str, Any], rule: str) -> Verdict:
    step = int(row[f"{rule}_step"])
    return Verdict(
        outcome=Outcome(row[f"{rule}_outcome"]),
        nodes_reached=int(row[f"{rule}_nodes_reached"]),
        plan_nodes=int(row["plan_nodes"]),
        step=step,
        time_s=_PERIOD_S * step,
        node=row[f"{rule}_node"] or None,
        contact=row.get(f"{rule}_contact") or None,
    )


def _steps(path: StoredPath, plan: Plan, map_: TopologicalMap) -> tuple[Step, ...]:
    edge_from = dict(zip(plan.nodes, plan.edges, strict=False))
    behavior_of = {edge: str(map_.edge(edge).behavior) for edge in plan.edges}
    steps = []
    for at in range(len(path)):
        true_edge = edge_from.get(path.true_node[at] or "")
        steps.append(
            Step(
                time_s=_PERIOD_S * at,
                x_m=float(path.x_m[at]),
                y_m=float(path.y_m[at]),
                yaw_rad=float(path.yaw_rad[at]),
                linear_m_s=float(path.linear_m_s[at]),
                angular_rad_s=float(path.angular_rad_s[at]),
                true_node=path.true_node[at],
                true_edge=true_edge,
                true_behavior=behavior_of.get(true_edge or ""),
                believed_node=path.believed_node[at],
                believed_edge=path.believed_edge[at],
                behavior=path.behavior[at],
                stopped_because=path.stopped_because[at],
                plan_probability=tuple(path.belief[at].tolist()),
                elsewhere_probability=float(path.elsewhere[at]),
                act_ms=0.0,
            )
        )
    return tuple(steps)


@dataclass(frozen=True, eq=False)
class Building:
    """Where a run was driven."""

    scene: "Scene"
    """The building."""
    map: TopologicalMap
    """Its topological map."""


def find_building(
    run: StoredRun,
    area: Path | None = None,
    scene: Path | None = None,
    map_: Path | None = None,
) -> Building:
    """The building and the map of a stored run, checked against what the run noted of them.

    A Stanford area is looked for by its name under `$TOPONAV_DATA` and in `../shared/data`, a
    scene with `map.topo.json` in the run's own folder.

    Args:
        run: The run.
        area: The area's yaml, if it lies elsewhere.
        scene: Folder of the scene, if it lies elsewhere.
        map_: Map of that scene.

    Raises:
        InputError: If they are not found, or are not those of the run.
    """
    from toponav.evaluation.suite import map_hash
    from toponav.maps.formats.canvas import load_area_map
    from toponav.maps.spec import load_map
    from toponav.worlds.load.stanford import load_area
    from toponav.worlds.storage import load_scene

    area = area or (_find_area(run) if scene is None else None)
    if area is not None:
        found = Building(load_area(area), load_area_map(area))
    else:
        scene, map_ = scene or run.folder / "scene", map_ or run.folder / "map.topo.json"
        if not scene.is_dir() or not map_.is_file():
            raise InputError(
                f"the building '{run.name}' of this run is not found",
                where=str(run.folder),
                remedy="name it with --area AREA.yaml, or with --scene DIR --map MAP",
            )
        found = Building(load_scene(scene), load_map(map_))
    noted = run.settings.get("data", {})
    for what, here, there in (
        ("building", found.scene.content_hash, noted.get("scene_content")),
        ("map", map_hash(found.map), noted.get("map_content")),
    ):
        if there is not None and here != there:
            raise InputError(
                f"is not the {what} of the run in {run.folder}",
                where=str(area or (scene if what == "building" else map_)),
                remedy="name the one that was evaluated, or evaluate again",
            )
    return found


def _find_area(run: StoredRun) -> Path | None:
    name = (run.settings.get("source") or {}).get("area")
    if not isinstance(name, str) or Path(name).name != name:
        return None
    data = Path(os.environ.get("TOPONAV_DATA", Path("..", "shared", "data")))
    for folder in (data / "graphnav_areas", data, run.folder):
        if (folder / name).is_file():
            return folder / name
    return None
