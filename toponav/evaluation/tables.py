"""The paper's tables I, V and VI with our numbers beside theirs."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from toponav.core.errors import InputError
from toponav.core.files import read_json_object
from toponav.evaluation.agents import AGENTS, title_of
from toponav.evaluation.table_layout import (
    NONE,
    PaperTable,
    counted,
    interval,
    pair,
    percent,
    to_csv,
    to_latex,
    to_rich,
)

__all__ = [
    "BEHAVIOR_COLUMNS",
    "PaperTable",
    "StoredResults",
    "load_results",
    "localization_table",
    "ordered",
    "paper_numbers",
    "prediction_table",
    "success_table",
    "summary_table",
    "title_in",
    "to_csv",
    "to_latex",
    "to_rich",
]

BEHAVIOR_COLUMNS: Mapping[str, str] = {
    "cf": "corridor_follow",
    "fd": "find_door",
    "tr": "turn_right",
    "tl": "turn_left",
    "s": "straight",
}
_DIFFICULTIES = ("I", "II", "III")
_PAPER_ONLY_TITLES = {"phasenet": "PhaseNet", "behavrnn": "BehavRNN"}
_TABLE_5_ROWS = {
    **dict.fromkeys(("area_1", "area_5", "area_6"), "train (areas 1, 5, 6)"),
    "area_3": "validation (area 3)",
    "area_4": "test (area 4)",
}


@dataclass(frozen=True)
class StoredResults:
    """What an evaluation left in its folder.

    Attributes:
        name: Name of what was evaluated, such as `area_3`.
        results: The content of `results.json`.
        folder: Where it came from.
    """

    name: str
    results: Mapping[str, Any]
    folder: Path

    @property
    def drivers(self) -> dict[str, Any]:
        """The numbers of the agents that drove by themselves, by label."""
        agents: Mapping[str, Any] = self.results["agents"]
        return {label: row for label, row in agents.items() if not _is_probe(label, row)}

    @property
    def probes(self) -> dict[str, Any]:
        """The numbers of what only measured while another drove, by label."""
        agents: Mapping[str, Any] = self.results["agents"]
        return {label: row for label, row in agents.items() if _is_probe(label, row)}

    def ceiling(self, rule: str) -> float | None:
        """The expert's success rate by the strict or the tolerant rule."""
        expert = self.results["agents"].get("expert")
        if expert is None:
            return None
        found: float | None = (expert if rule == "strict" else expert["tolerant"])["success_rate"]
        return found


def _is_probe(label: str, numbers: Mapping[str, Any]) -> bool:
    spec = AGENTS.get(numbers.get("agent", label))
    return spec is not None and spec.is_probe


@cache
def paper_numbers() -> dict[str, Any]:
    """Tables I, V and VI of the GraphNav paper, as fractions, with their reference."""
    text = resources.files("toponav.evaluation").joinpath("paper_graphnav.json").read_text("utf-8")
    numbers: dict[str, Any] = json.loads(text)
    return numbers


def load_results(folder: Path) -> StoredResults:
    """The results in a folder that `toponav eval graphnav` wrote.

    Raises:
        InputError: If the evaluation is not finished, or the files are not its.
    """
    from toponav.evaluation import analysis_tables

    path = folder / "results.json"
    results, run = read_json_object(path), read_json_object(folder / "run.json")
    try:
        if results["suite"] != "graphnav" or not isinstance(results["agents"], dict):
            raise KeyError("suite")
        found = StoredResults(str(run["name"]), results, folder)
        if not "".join((found.name, *results["agents"])).isprintable():
            raise ValueError("names must be printable")
        # Laid out once, so that what it lacks is said with the name of the file.
        for lay_out in (success_table, localization_table, prediction_table):
            lay_out([found])
        for analyse in analysis_tables.ANALYSES.values():
            analyse([found])
        return found
    except (ValueError, KeyError, TypeError, AttributeError, IndexError):
        raise InputError(
            "is not the result of an evaluation on the GraphNav suite",
            where=str(path),
            remedy="name a folder that `toponav eval graphnav` wrote",
        ) from None


def success_table(stored: Sequence[StoredResults]) -> PaperTable:
    """Table I: success per behaviour, success and plan completion per difficulty and in all.

    Each agent has a row by the strict rule, one by the tolerant rule, and the paper's where
    the paper has one; the expert's success by the same rule stands at the end of each row.
    """
    rows: list[tuple[str, ...]] = []
    for found, label, lines in _beside_the_paper(stored, "table_1"):
        for source, numbers in lines:
            ceiling = NONE if source == "paper" else percent(found.ceiling(source))
            cells = (*_success_cells(numbers), ceiling)
            rows.append((found.name, title_in(found, label), source, *cells))
    return PaperTable(
        title="GraphNav, Table I: success rate (SR) and plan completion (PC), %",
        columns=(
            *("area", "model", "rule"),
            *BEHAVIOR_COLUMNS,
            *(f"{difficulty} SR / PC" for difficulty in _DIFFICULTIES),
            *("SR", "95 % interval", "PC", "PC 95 %", "SR feasible", "expert SR"),
        ),
        rows=tuple(rows),
        notes=(
            "strict: one step off the plan fails (the paper's rule); tolerant: one second does.",
            "Attempts in parentheses. SR feasible: success on the pairs that the expert passes.",
            "expert SR: what a planner with the floor plan reaches by the same rule: the ceiling.",
            f"paper: {paper_numbers()['reference']}.",
        ),
    )


def localization_table(stored: Sequence[StoredResults]) -> PaperTable:
    """Table V: how often the localized edge is right, teacher forced and in closed loop."""
    rows: list[tuple[str, ...]] = []
    for found in stored:
        for label, numbers in found.probes.items():
            cells = _localization_cells(numbers["tolerant"])
            measured = AGENTS[numbers.get("agent", label)].title
            model = title_in(found, label).replace(measured, "GraphNav")
            rows.append((found.name, model, measured.lower(), *cells))
        theirs = _TABLE_5_ROWS.get(_paper_area(found.name))
        if theirs is not None:
            share = percent(paper_numbers()["table_5"][theirs])
            rows.append((found.name, "GraphNav", "teacher forced, paper", share, *[NONE] * 3))
        for label in ordered(found.drivers, ()):
            spec = AGENTS.get(found.drivers[label].get("agent", label))
            if spec is not None and spec.is_privileged:
                continue
            for rule in ("strict", "tolerant"):
                numbers = found.drivers[label]
                cells = _localization_cells(numbers if rule == "strict" else numbers["tolerant"])
                rows.append((found.name, title_in(found, label), f"closed loop, {rule}", *cells))
    return PaperTable(
        title="GraphNav, Table V: localization accuracy, % of steps",
        columns=("area", "model", "measured", "edge", "95 % interval", "steps", "node"),
        rows=tuple(rows),
        notes=(
            "teacher forced: the expert drives, the network is told the last true edge.",
            "own belief on the expert's drives: the expert drives, nothing is told.",
            "closed loop: while the agent drives, up to its strict or tolerant verdict.",
            "Intervals are over episodes, whose steps hang together.",
        ),
    )


def prediction_table(stored: Sequence[StoredResults]) -> PaperTable:
    """Table VI: how often the behaviour is rightly chosen, and localization while driving."""
    rows: list[tuple[str, ...]] = []
    for found, label, lines in _beside_the_paper(stored, "table_6"):
        for source, numbers in lines:
            if source == "paper":
                cells = [*_prediction_cells(numbers), NONE]
            else:
                edge = percent(numbers["localization_accuracy"])
                cells = [*_prediction_cells(numbers["by_behavior"]), edge]
            rows.append((found.name, title_in(found, label), source, *cells))
    offline = ", ".join(
        f"{name} {percent(value)}" for name, value in paper_numbers()["table_5"].items()
    )
    return PaperTable(
        title="GraphNav, Table VI: per-behaviour prediction accuracy, % of steps",
        columns=("area", "model", "rule", *BEHAVIOR_COLUMNS, "edge"),
        rows=tuple(rows),
        notes=(
            "Steps in parentheses, up to the verdict; 95 % interval over episodes after the rate.",
            "edge: share of steps at which the believed edge is the true edge, while driving.",
            f"The paper's Table V measures the edge on recorded trajectories instead: {offline}.",
        ),
    )


def _beside_the_paper(
    stored: Sequence[StoredResults], table: str
) -> Iterator[tuple[StoredResults, str, list[tuple[str, Mapping[str, Any]]]]]:
    """Each run's agents in order: strict and tolerant numbers, and the paper's where it has."""
    for found in stored:
        theirs = paper_numbers()[table].get(_paper_area(found.name), {})
        for label in ordered(found.drivers, theirs):
            ours = found.drivers.get(label)
            lines: list[tuple[str, Mapping[str, Any]]] = []
            if ours is not None:
                lines += [("strict", ours), ("tolerant", ours["tolerant"])]
            if label in theirs:
                lines.append(("paper", theirs[label]))
            yield found, label, lines


def summary_table(results: Mapping[str, Any], title: str) -> Table:
    """One line an agent, for the end of an evaluation."""
    columns = ("agent", "n", "success", "95 %", "plan", "tolerant", "feasible", "edge", "steps/s")
    rows = []
    for agent, numbers in results["agents"].items():
        speed = numbers["steps_per_second"]
        rows.append(
            (
                title_of(agent, numbers.get("agent")),
                str(numbers["episodes"]),
                percent(numbers["success_rate"]),
                interval(numbers["success_ci95"]),
                percent(numbers["plan_completion"]),
                percent(numbers["tolerant"]["success_rate"]),
                percent(numbers.get("success_on_expert_feasible")),
                percent(numbers["localization_accuracy"]),
                NONE if speed is None else f"{speed:.0f}",
            )
        )
    notes = (
        "success, plan (completion), feasible (success where the expert passes), edge",
        "(localization): %, strict rule. tolerant: success when a second off the plan fails.",
    )
    table = to_rich(PaperTable(title, columns, tuple(rows), notes, name_columns=1))
    table.box, table.pad_edge, table.padding = box.SIMPLE_HEAD, False, (0, 1, 0, 0)
    return table


def ordered(ours: Iterable[str], theirs: Iterable[str]) -> list[str]:
    """The paper's agents in its order, then the others in ours."""
    ours = list(ours)
    present = {*ours, *theirs}
    known = [*dict.fromkeys(("phasenet", "behavrnn", *AGENTS))]
    return [name for name in known if name in present] + [
        name for name in ours if name not in known
    ]


def title_in(found: StoredResults, label: str) -> str:
    """An agent's name in the tables."""
    if label not in AGENTS and label in _PAPER_ONLY_TITLES:
        return _PAPER_ONLY_TITLES[label]
    return title_of(label, found.results["agents"].get(label, {}).get("agent"))


def _paper_area(name: str) -> str:
    """The paper's area 5 is the half of the floor that was published as 5b."""
    return "area_5" if name in ("area_5a", "area_5b") else name


def _success_cells(numbers: Mapping[str, Any]) -> list[str]:
    behaviors = [
        counted(numbers["by_behavior"][name], "success_rate", "attempts")
        for name in BEHAVIOR_COLUMNS.values()
    ]
    return [
        *behaviors,
        *(pair(numbers["by_difficulty"][difficulty]) for difficulty in _DIFFICULTIES),
        percent(numbers["success_rate"]),
        interval(numbers.get("success_ci95")),
        percent(numbers["plan_completion"]),
        interval(numbers.get("plan_completion_ci95")),
        percent(numbers.get("success_on_expert_feasible")),
    ]


def _localization_cells(numbers: Mapping[str, Any]) -> list[str]:
    steps = numbers.get("localization_steps")
    return [
        percent(numbers["localization_accuracy"]),
        interval(numbers.get("localization_ci95")),
        NONE if steps is None else str(steps),
        percent(numbers["node_localization_accuracy"]),
    ]


def _prediction_cells(by_behavior: Mapping[str, Any]) -> list[str]:
    cells = []
    for name in BEHAVIOR_COLUMNS.values():
        ends = by_behavior[name].get("prediction_ci95")
        rate = counted(by_behavior[name], "prediction_accuracy", "prediction_steps")
        cells.append(rate if ends is None else rate.replace(" (", f" [{interval(ends)}] ("))
    return cells
