"""The paper's tables with our numbers beside theirs: text, CSV and LaTeX."""

import csv
import io
import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from rich import box
from rich.markup import escape
from rich.table import Table

from toponav.core.errors import InputError
from toponav.core.files import read_json_object
from toponav.evaluation.agents import AGENTS

__all__ = [
    "PaperTable",
    "StoredResults",
    "load_results",
    "paper_numbers",
    "prediction_table",
    "success_table",
    "summary_table",
    "to_csv",
    "to_latex",
    "to_rich",
]

_BEHAVIORS = {
    "cf": "corridor_follow",
    "fd": "find_door",
    "tr": "turn_right",
    "tl": "turn_left",
    "s": "straight",
}
_DIFFICULTIES = ("I", "II", "III")
_OTHER_TITLES = {"phasenet": "PhaseNet", "behavrnn": "BehavRNN"}
_NONE = "-"


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


@dataclass(frozen=True)
class PaperTable:
    """A table as text cells; the first columns are names, rows with the same names a group."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    name_columns: int = 3


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
    path = folder / "results.json"
    results, run = read_json_object(path), read_json_object(folder / "run.json")
    try:
        if results["suite"] != "graphnav" or not isinstance(results["agents"], dict):
            raise KeyError("suite")
        found = StoredResults(str(run["name"]), results, folder)
        if not "".join((found.name, *results["agents"])).isprintable():
            raise ValueError("names must be printable")
        # Laid out once, so that what it lacks is said with the name of the file.
        success_table([found])
        prediction_table([found])
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
    the paper has one.
    """
    rows: list[tuple[str, ...]] = []
    for found in stored:
        theirs = paper_numbers()["table_1"].get(_paper_area(found.name), {})
        for agent in _ordered(found.results["agents"], theirs):
            ours = found.results["agents"].get(agent)
            lines = []
            if ours is not None:
                lines += [("strict", ours), ("tolerant", ours["tolerant"])]
            if agent in theirs:
                lines.append(("paper", theirs[agent]))
            for source, numbers in lines:
                rows.append((found.name, _title(agent), source, *_success_cells(numbers)))
    return PaperTable(
        title="GraphNav, Table I: success rate (SR) and plan completion (PC), %",
        columns=(
            *("area", "model", "rule"),
            *_BEHAVIORS,
            *(f"{difficulty} SR / PC" for difficulty in _DIFFICULTIES),
            *("SR", "95 % interval", "PC", "SR feasible"),
        ),
        rows=tuple(rows),
        notes=(
            "strict: one step off the plan fails (the paper's rule); tolerant: one second does.",
            "Attempts in parentheses. SR feasible: success on the pairs that the expert passes.",
            f"paper: {paper_numbers()['reference']}.",
        ),
    )


def prediction_table(stored: Sequence[StoredResults]) -> PaperTable:
    """Table VI: how often the behaviour that the truth asks for was chosen; Table V beside it."""
    rows: list[tuple[str, ...]] = []
    for found in stored:
        theirs = paper_numbers()["table_6"].get(_paper_area(found.name), {})
        for agent in _ordered(found.results["agents"], theirs):
            ours = found.results["agents"].get(agent)
            if ours is not None:
                cells = _prediction_cells(ours["by_behavior"])
                accuracy = _percent(ours["localization_accuracy"])
                rows.append((found.name, _title(agent), "strict", *cells, accuracy))
            if agent in theirs:
                cells = _prediction_cells(theirs[agent])
                rows.append((found.name, _title(agent), "paper", *cells, _NONE))
    offline = ", ".join(
        f"{split} {_percent(value)}" for split, value in paper_numbers()["table_5"].items()
    )
    return PaperTable(
        title="GraphNav, Table VI: behaviour prediction accuracy, %",
        columns=("area", "model", "rule", *_BEHAVIORS, "edge"),
        rows=tuple(rows),
        notes=(
            "Steps in parentheses. edge: believed edge is the true edge, while driving.",
            f"The paper's Table V measures the edge on recorded trajectories instead: {offline}.",
        ),
    )


def summary_table(results: Mapping[str, Any], title: str) -> Table:
    """One line an agent, for the end of an evaluation."""
    columns = ("agent", "n", "success", "95 %", "plan", "tolerant", "feasible", "edge", "steps/s")
    rows = []
    for agent, numbers in results["agents"].items():
        speed = numbers["steps_per_second"]
        rows.append(
            (
                _title(agent),
                str(numbers["episodes"]),
                _percent(numbers["success_rate"]),
                _interval(numbers["success_ci95"]),
                _percent(numbers["plan_completion"]),
                _percent(numbers["tolerant"]["success_rate"]),
                _percent(numbers.get("success_on_expert_feasible")),
                _percent(numbers["localization_accuracy"]),
                _NONE if speed is None else f"{speed:.0f}",
            )
        )
    notes = (
        "success, plan (completion), feasible (success where the expert passes), edge",
        "(localization): %, strict rule. tolerant: success when a second off the plan fails.",
    )
    table = to_rich(PaperTable(title, columns, tuple(rows), notes, name_columns=1))
    table.box, table.pad_edge, table.padding = box.SIMPLE_HEAD, False, (0, 1, 0, 0)
    return table


def to_rich(table: PaperTable) -> Table:
    """The table for a terminal."""
    caption = "\n".join(table.notes) or None
    shown = Table(title=escape(table.title), caption=caption, caption_justify="left")
    for position, column in enumerate(table.columns):
        is_name = position < table.name_columns
        shown.add_column(column, justify="left" if is_name else "right", no_wrap=is_name)
    areas = [row[0] if table.name_columns > 1 else "" for row in table.rows]
    for row, area, following in itertools.zip_longest(table.rows, areas, areas[1:]):
        shown.add_row(*map(escape, row), end_section=area != following)
    return shown


def to_csv(table: PaperTable) -> str:
    """The table as CSV, with a header."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return sink.getvalue()


def to_latex(table: PaperTable) -> str:
    """The table as a LaTeX `table*` that needs the package booktabs."""
    names = table.name_columns
    columns = "l" * names + "r" * (len(table.columns) - names)
    lines = [
        r"\begin{table*}",
        r"\centering\footnotesize\setlength{\tabcolsep}{3pt}",
        rf"\caption{{{_latex(table.title)}. {_latex(' '.join(table.notes))}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        " & ".join(map(_latex, table.columns)) + r" \\",
        r"\midrule",
    ]
    for before, row in zip((None, *table.rows), table.rows, strict=False):
        if before is not None and before[: names - 1] != row[: names - 1]:
            lines.append(r"\addlinespace")
        lines.append(" & ".join(map(_latex, row)) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", r"\end{table*}"]) + "\n"


def _latex(text: str) -> str:
    for plain, escaped in (("\\", r"\textbackslash{}"), ("%", r"\%"), ("_", r"\_"), ("&", r"\&")):
        text = text.replace(plain, escaped)
    return text


def _paper_area(name: str) -> str:
    """The paper's area 5 is the half of the floor that was published as 5b."""
    return "area_5" if name in ("area_5a", "area_5b") else name


def _ordered(ours: Iterable[str], theirs: Iterable[str]) -> list[str]:
    """The paper's agents in its order, then the others in ours."""
    present = set(ours) | set(theirs)
    known = ["phasenet", "behavrnn", *AGENTS]
    return [name for name in known if name in present] + [
        name for name in ours if name not in known
    ]


def _title(agent: str) -> str:
    return AGENTS[agent].title if agent in AGENTS else _OTHER_TITLES.get(agent, agent)


def _success_cells(numbers: Mapping[str, Any]) -> list[str]:
    behaviors = [
        _counted(numbers["by_behavior"][name], "success_rate", "attempts")
        for name in _BEHAVIORS.values()
    ]
    difficulties = [
        f"{_percent(numbers['by_difficulty'][difficulty]['success_rate'])} / "
        f"{_percent(numbers['by_difficulty'][difficulty]['plan_completion'])}"
        for difficulty in _DIFFICULTIES
    ]
    return [
        *behaviors,
        *difficulties,
        _percent(numbers["success_rate"]),
        _interval(numbers.get("success_ci95")),
        _percent(numbers["plan_completion"]),
        _percent(numbers.get("success_on_expert_feasible")),
    ]


def _prediction_cells(by_behavior: Mapping[str, Any]) -> list[str]:
    return [
        _counted(by_behavior[name], "prediction_accuracy", "prediction_steps")
        for name in _BEHAVIORS.values()
    ]


def _counted(numbers: Mapping[str, Any], rate: str, count: str) -> str:
    return f"{_percent(numbers[rate])} ({numbers[count]})"


def _percent(value: float | None) -> str:
    return _NONE if value is None else f"{100 * value:.1f}"


def _interval(ends: Sequence[float] | None) -> str:
    return _NONE if ends is None else f"{100 * ends[0]:.0f}..{100 * ends[1]:.0f}"
