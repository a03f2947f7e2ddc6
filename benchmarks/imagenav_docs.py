"""The tables of docs/nts.md, written from the stored runs of image-goal navigation.

    python benchmarks/imagenav_docs.py [--check]

Each table stands between `<!-- stored: NAME -->` and `<!-- end -->` in docs/nts.md and is laid out
from benchmarks/results/imagenav. `--check` writes nothing and ends with 1 where the page says
something else than what is stored.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from toponav.core.files import write_atomically
from toponav.core.imagenav import DIFFICULTIES, MAX_STEPS
from toponav.evaluation.imagenav.metrics import bootstrap_interval
from toponav.evaluation.imagenav.tables import paper_numbers

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "imagenav"
PAGE = ROOT / "docs" / "nts.md"
BUDGETS = (50, 100, 150, 200, 300, MAX_STEPS)
ROOMS = ((5, 6), (7, 7), (8, 9))
SENSORS = (("RGB-D", "rgbd", "nts_rgbd", "ans_rgbd"), ("RGB", "rgb", "nts_rgb", "ans_rgb"))
TITLES = {
    "nts_rgbd": "NTS, RGB-D",
    "ans_rgbd": "Active Neural SLAM adapted, RGB-D",
    "frontier_rgbd": "frontiers, RGB-D",
    "random": "random",
    "nts_rgb": "NTS, RGB",
    "ans_rgb": "Active Neural SLAM adapted, RGB",
    "nts_no_graph_rgbd": "without graph",
    "nts_no_score_rgbd": "without score",
    "oracle_localization": "F_L, same node",
    "oracle_relative_pose": "F_R, relative pose",
    "oracle_explorable": "F_G, explorable",
    "oracle_score": "F_S, score",
    "oracle": "all four",
    "shortest_path": "floor plan and true pose (`shortest_path`)",
}
ORACLES = ("localization", "relative_pose", "explorable", "score")
BETWEEN = (
    *(("no_noise", agent, "rgbd", agent) for agent in ("nts_rgbd", "ans_rgbd", "frontier_rgbd")),
    *(("sliding", f"nts_{sensor}", sensor, f"nts_{sensor}") for sensor in ("rgbd", "rgb")),
    *(("oracle", f"oracle_{truth}", "oracle", "nts_rgbd") for truth in ORACLES),
    ("oracle", "oracle", "oracle", "nts_rgbd"),
    *(("rgbd", "nts_rgbd", "learned", f"{agent}_rgbd")
      for agent in ("il", "target_rl", "metric_map_rl")),
    *(("rgb", "nts_rgb", "learned", f"{agent}_rgb") for agent in ("il", "target_rl")),
)  # fmt: skip
"""Run, agent, other run, its agent."""
Row = dict[str, Any]


@dataclass(frozen=True)
class Stored:
    """One stored run."""

    results: dict[str, Any]
    run: dict[str, Any]
    rows: tuple[Row, ...]

    def of(self, agent: str) -> list[Row]:
        """The first goals of an agent's episodes."""
        return [row for row in self.rows if row["agent"] == agent and row["goal"] == 0]


@cache
def stored(name: str) -> Stored:
    """The run of a name."""
    folder = RESULTS / name
    results, run = (json.loads((folder / f"{k}.json").read_text()) for k in ("results", "run"))
    return Stored(results, run, tuple(pq.read_table(folder / "episodes.parquet").to_pylist()))


def share(value: float) -> str:
    """A share as the page writes it: .93, 1.00."""
    return f"{value:.2f}".removeprefix("0")


def both(numbers: dict[str, Any] | None) -> str:
    """Success and SPL."""
    return "" if numbers is None else f"{share(numbers['success_rate'])} / {share(numbers['spl'])}"


def ends(interval: Sequence[float] | None) -> str:
    """An interval in per cent."""
    return "" if interval is None else f"{100 * interval[0]:.0f}..{100 * interval[1]:.0f}"


def points(values: np.ndarray, levels: Sequence[str]) -> str:
    """A mean of differences in points, with its bootstrap interval."""
    return f"{100 * values.mean():+.0f} ({ends(bootstrap_interval(values, levels))})"


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def table_1() -> str:
    """Success and SPL of all agents beside the paper's."""
    rows = []
    paper = paper_numbers()["table_1"]
    for sensor in ("rgbd", "rgb"):
        for agent, name in ((f"nts_{sensor}", "NTS"), (f"ans_{sensor}", "ANS")):
            theirs = (paper[sensor][agent][level] for level in (*DIFFICULTIES, "overall"))
            cells = [f"{share(success)} / {share(spl)}" for success, spl in theirs]
            modality = "RGB-D" if sensor == "rgbd" else "RGB"
            rows.append([f"*paper: {name}, {modality}*", "3000", *cells, "", ""])
    for run in ("rgbd", "rgb"):
        for agent, numbers in stored(run).results["agents"].items():
            levels = [both(numbers["by_difficulty"].get(level)) for level in DIFFICULTIES]
            intervals = ends(numbers["success_ci95"]), ends(numbers["spl_ci95"])
            n = str(numbers["episodes"])
            rows.append([TITLES[agent], n, *levels, both(numbers), *intervals])
    return table(["", "n", *DIFFICULTIES, "overall", "success, 95 %", "SPL, 95 %"], rows)


def episodes() -> str:
    """How hard the episodes of table 1 are."""
    rows = []
    for level, numbers in stored("rgbd").results["episodes"].items():
        low_m, high_m = numbers["geodesic_m_range"]
        fewest, most = numbers["rooms_range"]
        rows.append(
            [
                level,
                str(numbers["episodes"]),
                str(numbers["homes"]),
                f"{numbers['rooms_mean']:.1f} ({fewest}..{most})",
                f"{numbers['geodesic_m_mean']:.1f} ({low_m:.1f}..{high_m:.1f})",
                f"{numbers['geodesic_over_straight_mean']:.2f}",
            ]
        )
    return table(
        ["", "n", "homes", "rooms of the home", "shortest path, m", "path / straight line"], rows
    )


def paths() -> str:
    """How far and how long the agents of table 1 drove."""
    rows = []
    for run in ("rgbd", "rgb"):
        for agent in stored(run).results["agents"]:
            found = stored(run).of(agent)
            cells = []
            for level in DIFFICULTIES:
                own = [row for row in found if row["difficulty"] == level]
                path_m = np.mean([row["path_m"] for row in own])
                cells.append(f"{path_m:.1f} m, {np.mean([row['steps'] for row in own]):.0f}")
            rows.append([TITLES[agent], *cells])
    return table(["path and steps, mean", *DIFFICULTIES], rows)


def _pairs(run: str, first: str, second: str, other: str | None = None) -> list[tuple[Row, Row]]:
    """The episodes that two agents both drove, the second one perhaps in another run."""
    theirs = {row["episode"]: row for row in stored(other or run).of(second)}
    ours = stored(run).of(first)
    return [(row, theirs[row["episode"]]) for row in ours if row["episode"] in theirs]


def _within(row: Row, budget: int) -> float:
    return float(row["success"] and row["steps"] <= budget)


def budgets() -> str:
    """Success within fewer steps: NTS and Active Neural SLAM on the same episodes."""
    rows = []
    for modality, run, first, second in SENSORS:
        pairs = _pairs(run, first, second)
        levels = [ours["difficulty"] for ours, _ in pairs]
        for budget in BUDGETS:
            ours, theirs = (np.array([_within(pair[k], budget) for pair in pairs]) for k in (0, 1))
            ratio = ours.sum() / theirs.sum() if theirs.sum() else float("nan")
            rows.append(
                [
                    modality,
                    f"{budget}",
                    share(ours.mean()),
                    share(theirs.mean()),
                    f"{ratio:.2f}",
                    points(ours - theirs, levels),
                ]
            )
    return table(["", "steps", "NTS", "ANS", "ratio", "points, 95 %"], rows)


def rooms() -> str:
    """NTS and Active Neural SLAM by the number of rooms of the home."""
    rows = []
    for modality, run, first, second in SENSORS:
        pairs = _pairs(run, first, second)
        for low, high in ROOMS:
            found = [pair for pair in pairs if low <= pair[0]["rooms"] <= high]
            if not found:
                continue
            mean = [
                f"{share(np.mean([pair[k]['success'] for pair in found]))} / "
                f"{share(np.mean([pair[k]['spl'] for pair in found]))}"
                for k in (0, 1)
            ]
            spl = np.array([ours["spl"] - theirs["spl"] for ours, theirs in found])
            levels = [ours["difficulty"] for ours, _ in found]
            span = str(low) if low == high else f"{low} and {high}"
            rows.append([modality, span, str(len(found)), *mean, points(spl, levels)])
    return table(["", "rooms", "n", "NTS", "ANS", "SPL points, 95 %"], rows)


def paired() -> str:
    """NTS against the others on the same episodes."""
    rows = []
    for run in ("rgbd", "rgb"):
        for pair in stored(run).results["paired"]:
            cells = [
                f"{100 * pair[key]['mean']:+.0f} ({ends(pair[key]['ci95'])})"
                for key in ("success_difference", "spl_difference")
            ]
            ratio = pair["success_ratio"]
            names = TITLES[pair["agent"]], TITLES[pair["than"]]
            shown = "" if ratio is None else f"{ratio:.2f}"
            rows.append([*names, str(pair["episodes"]), *cells, shown])
    return table(["", "than", "n", "success, points", "SPL, points", "ratio of success"], rows)


def between() -> str:
    """The same episodes in two runs, or by two agents of the oracles' run."""
    rows = []
    for run, first, other, second in BETWEEN:
        pairs = _pairs(run, first, second, other)
        levels = [ours["difficulty"] for ours, _ in pairs]
        cells = [
            points(
                np.array([float(ours[key]) - float(theirs[key]) for ours, theirs in pairs]), levels
            )
            for key in ("success", "spl")
        ]
        names = [f"`{agent}`, {name}" for agent, name in ((first, run), (second, other))]
        rows.append([*names, str(len(pairs)), *cells])
    return table(["run", "than", "n", "success, points", "SPL, points"], rows)


def table_2() -> str:
    """Success without stop and without noise, and with sliding."""
    rows = []
    paper = paper_numbers()["table_2"]
    for run in ("no_stop", "no_noise", "sliding"):
        if not (RESULTS / run / "results.json").exists():
            continue
        for agent, numbers in stored(run).results["agents"].items():
            by = numbers["by_difficulty"]
            cells = [share(by[level]["success_rate"]) for level in DIFFICULTIES]
            overall = f"{share(numbers['success_rate'])} ({ends(numbers['success_ci95'])})"
            theirs = paper.get(run, {}).get(agent)
            said = "" if theirs is None else share(theirs[-1])
            name = f"{run.replace('_', ' ')}: {TITLES[agent]}"
            row = [name, str(numbers["episodes"]), *cells, overall, share(numbers["spl"]), said]
            rows.append(row)
    columns = ["", "n", *DIFFICULTIES, "overall, 95 %", "SPL", "paper"]
    return table(columns, rows)


def figure_8() -> str:
    """Success and SPL of all goals up to one."""
    agents = stored("goals").results["agents"]
    rows = []
    for agent, numbers in agents.items():
        upto = [goal["up_to"] for goal in numbers["by_goal"]]
        last = f"{ends(upto[-1]['success_ci95'])} / {ends(upto[-1]['spl_ci95'])}"
        rows.append([TITLES[agent], str(numbers["episodes"]), *map(both, upto), last])
    most = len(next(iter(agents.values()))["by_goal"])
    return table(["", "n", *(str(k + 1) for k in range(most)), "the last, 95 %"], rows)


def figure_8_paired() -> str:
    """NTS against its ablations on the same sequences: goal by goal, and over all goals."""
    run = stored("goals")
    first, *others = run.results["agents"]
    found = {(row["agent"], row["episode"], row["goal"]): row for row in run.rows}
    most = 1 + max(row["goal"] for row in run.rows)
    begun = run.of(first)
    levels = [row["difficulty"] for row in begun]
    rows = []
    for other in others:
        spl = np.array(
            [
                [
                    found[(first, row["episode"], goal)]["spl"]
                    - found[(other, row["episode"], goal)]["spl"]
                    for goal in range(most)
                ]
                for row in begun
            ]
        )
        cells = [points(values, levels) for values in (*spl.T, spl.mean(axis=1))]
        rows.append([f"NTS over NTS {TITLES[other]}", *cells])
    goals = [f"goal {k + 1}" for k in range(most)]
    return table(["SPL of one goal, points", *goals, "all"], rows)


def oracle() -> str:
    """NTS with the truth for its functions."""
    numbers = stored("oracle").results["agents"]
    order = ["nts_rgbd", *(name for name in TITLES if name in numbers and name != "nts_rgbd")]
    rows = []
    for agent in order:
        own = numbers[agent]
        cells = [both(own["by_difficulty"].get(level)) for level in DIFFICULTIES]
        title = "none" if agent == "nts_rgbd" else TITLES[agent]
        rows.append([title, str(own["episodes"]), *cells, both(own), ends(own["spl_ci95"])])
    return table(["truth", "n", *DIFFICULTIES, "overall", "SPL, 95 %"], rows)


TABLES: dict[str, Callable[[], str]] = {
    make.__name__: make
    for make in (table_1, episodes, paths, paired, budgets, rooms, table_2, figure_8,
                 figure_8_paired, oracle, between)
}  # fmt: skip


def written(page: str) -> str:
    """The page with its tables as they are stored."""

    def fill(match: re.Match[str]) -> str:
        return f"{match[1]}\n\n{TABLES[match[2]]()}\n\n{match[3]}"

    return re.sub(r"(<!-- stored: (\w+) -->)\n.*?(<!-- end -->)", fill, page, flags=re.DOTALL)


def main(arguments: list[str] | None = None) -> int:
    """Writes the tables, or says whether the page has them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; 1 where they differ")
    options = parser.parse_args(arguments)
    page = PAGE.read_text("utf-8")
    if options.check:
        return int(written(page) != page)
    write_atomically(PAGE, written(page))
    return 0


if __name__ == "__main__":
    sys.exit(main())
