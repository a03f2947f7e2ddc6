"""Tables 1 and 2 and figure 8 of Neural Topological SLAM, the paper's numbers beside ours."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toponav.core.errors import InputError
from toponav.core.files import read_json_object
from toponav.core.imagenav import DIFFICULTIES
from toponav.evaluation.imagenav.agents import IMAGE_NAV_AGENTS, title_of
from toponav.evaluation.table_layout import NONE, PaperTable, interval, percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "IMAGE_NAV_TABLES",
    "ImageNavResults",
    "episodes_table",
    "is_image_nav",
    "load_image_nav_results",
    "paired_table",
    "paper_numbers",
    "sequential_figure",
    "sequential_table",
    "success_table",
    "summary_table",
    "variants_table",
]

_LEVELS = (*DIFFICULTIES, "overall")


@dataclass(frozen=True)
class ImageNavResults:
    """What `toponav eval imagenav` left in its folder.

    Attributes:
        name: The suite of homes.
        results: The content of `results.json`.
        folder: Where it came from.
    """

    name: str
    results: Mapping[str, Any]
    folder: Path

    @property
    def agents(self) -> Mapping[str, Any]:
        """The numbers by label."""
        agents: Mapping[str, Any] = self.results["agents"]
        return agents

    @property
    def variant(self) -> str:
        """What was run, in words: `as in the paper`, or what differs."""
        given = next(iter(self.agents.values()))["variant"]
        words = [word for word, holds in _differences(given) if holds]
        return ", ".join(words) or "standard"


def _differences(variant: Mapping[str, Any]) -> Iterator[tuple[str, bool]]:
    yield "no noise", not variant["noise"]
    yield "no stop", not variant["stop"]
    yield "sliding", bool(variant["sliding"])
    yield f"{variant['goals']} goals", variant["goals"] > 1


def is_image_nav(folder: Path) -> bool:
    """Whether a folder of results is of the ImageNav suite."""
    path = folder / "results.json"
    return path.is_file() and read_json_object(path).get("suite") == "imagenav"


def load_image_nav_results(folder: Path) -> ImageNavResults:
    """The results in a folder that `toponav eval imagenav` wrote.

    Raises:
        InputError: If the evaluation is not finished, or the files are not its.
    """
    path = folder / "results.json"
    results, run = read_json_object(path), read_json_object(folder / "run.json")
    try:
        if results["suite"] != "imagenav" or not results["agents"]:
            raise KeyError("suite")
        found = ImageNavResults(str(run["name"]), results, folder)
        if not "".join((found.name, *found.agents)).isprintable():
            raise ValueError("names must be printable")
        # Laid out once, so that what it lacks is said with the name of the file.
        for lay_out in IMAGE_NAV_TABLES.values():
            lay_out([found])
        return found
    except (ValueError, KeyError, TypeError, AttributeError, IndexError):
        raise InputError(
            "is not the result of an evaluation on the ImageNav suite",
            where=str(path),
            remedy="name a folder that `toponav eval imagenav` wrote",
        ) from None


@cache
def paper_numbers() -> dict[str, Any]:
    """Tables 1 and 2 of the paper, as fractions, with their reference."""
    place = resources.files("toponav.evaluation.imagenav").joinpath("paper_nts.json")
    numbers: dict[str, Any] = json.loads(place.read_text("utf-8"))
    return numbers


def summary_table(results: Mapping[str, Any]) -> PaperTable:
    """One line an agent, for the end of an evaluation."""
    rows = []
    for label, numbers in results["agents"].items():
        cells = [_both(numbers["by_difficulty"].get(level)) for level in DIFFICULTIES]
        rows.append(
            (
                title_of(label, numbers.get("agent")),
                str(numbers["episodes"]),
                *cells,
                _both(numbers),
                interval(numbers["success_ci95"]),
                f"{numbers['act_ms_p99']:.0f}",
            )
        )
    return PaperTable(
        "ImageNav: success / SPL, %",
        ("agent", "n", *_LEVELS, "95 %", "ms p99"),
        tuple(rows),
        ("95 %: bootstrap interval of the success. ms: what a step takes the agent.",),
        name_columns=1,
    )


def success_table(stored: Sequence[ImageNavResults]) -> PaperTable:
    """Table 1: success and SPL by difficulty, RGB and RGB-D, ours above the paper's."""
    rows: list[tuple[str, ...]] = []
    for sensor, theirs in paper_numbers()["table_1"].items():
        names = [*theirs, *_ours_only(stored, sensor, theirs)]
        for name in names:
            for found, label, numbers in _runs_of(stored, name):
                where = f"{found.name}, {found.variant}"
                rows.append((sensor.upper(), title_of(label, name), where, *_cells(numbers)))
            if name in theirs:
                paper = theirs[name]
                cells = [f"{percent(paper[level][0])} / {percent(paper[level][1])}"
                         for level in _LEVELS]  # fmt: skip
                rows.append((sensor.upper(), paper["title"], "paper", NONE, *cells, NONE, NONE))
    return PaperTable(
        "NTS, Table 1: success / SPL, %",
        ("sensor", "model", "run", "n", *_LEVELS, "success 95 %", "SPL 95 %"),
        # An agent whose episodes are in two of the runs, with the same numbers, stands once.
        tuple(dict.fromkeys(rows)),
        (
            "Stopping within 1 m along the shortest path is success; 500 steps; noise of a",
            "LoCoBot; no sliding. Intervals: bootstrap over episodes, by difficulty.",
            "The paper's homes are Gibson scans, ours are generated: compare within a column.",
            f"paper: {paper_numbers()['reference']}.",
        ),
    )


def variants_table(stored: Sequence[ImageNavResults]) -> PaperTable:
    """Table 2: success without the stop action, and without noise."""
    rows: list[tuple[str, ...]] = []
    for key, theirs in paper_numbers()["table_2"].items():
        words = key.replace("_", " ")
        runs = [found for found in stored if found.variant == words]
        for name in [*theirs, *_ours_only(runs, "rgbd", theirs)]:
            for found, label, numbers in _runs_of(runs, name):
                levels = [numbers["by_difficulty"].get(level) for level in DIFFICULTIES]
                cells = [_success(one) for one in (*levels, numbers)]
                ends = interval(numbers["success_ci95"])
                row = (words, title_of(label, name), found.name, str(numbers["episodes"]))
                rows.append((*row, *cells, ends))
            if name in theirs:
                title = paper_numbers()["table_1"]["rgbd"][name]["title"]
                cells = [percent(value) for value in theirs[name]]
                rows.append((words, title, "paper", NONE, *cells, NONE))
    return PaperTable(
        "NTS, Table 2: success without stop, and without noise, RGB-D, %",
        ("variant", "model", "run", "n", *_LEVELS, "success 95 %"),
        tuple(rows),
        (f"paper: {paper_numbers()['reference']}.",),
    )


def sequential_table(stored: Sequence[ImageNavResults]) -> PaperTable:
    """Figure 8 as a table: the share of goals reached up to each goal, and its SPL."""
    runs = [found for found in stored if _most_goals(found) > 1]
    most = max((_most_goals(found) for found in runs), default=1)
    rows = []
    for found in runs:
        for label, numbers in found.agents.items():
            upto = [goal["up_to"] for goal in numbers["by_goal"]]
            cells = [f"{_both(goal)} [{interval(goal['success_ci95'])}]" for goal in upto]
            cells += [NONE] * (most - len(cells))
            name = title_of(label, numbers.get("agent"))
            rows.append((found.name, name, str(numbers["episodes"]), *cells))
    return PaperTable(
        "NTS, figure 8: success / SPL of the goals up to each, % [95 % interval of success]",
        ("suite", "model", "n", *(str(number + 1) for number in range(most))),
        tuple(rows),
        ("The paper gives its numbers as a drawing alone.",),
    )


def paired_table(stored: Sequence[ImageNavResults]) -> PaperTable:
    """Each run's first agent against the others, on the same episodes with the same noise."""
    rows = []
    for found in stored:
        for pair in found.results["paired"]:
            difference, spl = pair["success_difference"], pair["spl_difference"]
            ratio = pair["success_ratio"]
            rows.append(
                (
                    f"{found.name}, {found.variant}",
                    pair["agent"],
                    pair["than"],
                    str(pair["episodes"]),
                    f"{percent(difference['mean'])} [{interval(difference['ci95'])}]",
                    f"{percent(spl['mean'])} [{interval(spl['ci95'])}]",
                    NONE if ratio is None else f"{ratio:.2f}",
                )
            )
    return PaperTable(
        "ImageNav: differences on paired episodes, points",
        ("run", "agent", "than", "n", "success [95 %]", "SPL [95 %]", "ratio"),
        tuple(rows),
        ("ratio: of the success rates.",),
    )


def episodes_table(stored: Sequence[ImageNavResults]) -> PaperTable:
    """How hard the episodes are: shortest paths, detours and rooms of the homes."""
    rows = []
    for found in stored:
        for level, numbers in found.results["episodes"].items():
            low, high = numbers["geodesic_m_range"]
            fewest, most = numbers["rooms_range"]
            rows.append(
                (
                    f"{found.name}, {found.variant}",
                    level,
                    str(numbers["episodes"]),
                    str(numbers["homes"]),
                    f"{numbers['geodesic_m_mean']:.2f} ({low:.2f}..{high:.2f})",
                    f"{numbers['geodesic_over_straight_mean']:.2f}",
                    f"{numbers['rooms_mean']:.1f} ({fewest}..{most})",
                )
            )
    return PaperTable(
        "ImageNav: the episodes",
        ("run", "level", "n", "homes", "shortest path, m", "path / straight", "rooms"),
        tuple(rows),
        name_columns=2,
    )


IMAGE_NAV_TABLES = {
    "nts_1": success_table,
    "nts_2": variants_table,
    "nts_figure_8": sequential_table,
    "nts_paired": paired_table,
    "nts_episodes": episodes_table,
}
"""Every table of the suite, by the name of its file."""


def sequential_figure(stored: Sequence[ImageNavResults]) -> "Figure":
    """Figure 8: success and SPL over the number of sequential goals, with 95 % bands."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    axes = figure.subplots(1, 2)
    for found in stored:
        if _most_goals(found) < 2:
            continue
        for label, numbers in found.agents.items():
            goals = [goal["goal"] for goal in numbers["by_goal"]]
            for ax, name in zip(axes, ("success_rate", "spl"), strict=True):
                upto = [goal["up_to"] for goal in numbers["by_goal"]]
                bands = [goal[name.replace("_rate", "") + "_ci95"] for goal in upto]
                values = [goal[name] for goal in upto]
                ends = [band or [value] * 2 for band, value in zip(bands, values, strict=True)]
                (line,) = ax.plot(goals, values, "o-", label=title_of(label, numbers.get("agent")))
                ax.fill_between(
                    goals, *zip(*ends, strict=True), color=line.get_color(), alpha=0.15, lw=0
                )
                ax.set_xticks(goals)
    for ax, title in zip(axes, ("Success rate", "SPL"), strict=True):
        ax.set_xlabel("sequential goals")
        ax.set_title(title)
        ax.set_ylim(0, 1)
        ax.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        axes[0].legend(handles, labels, fontsize="small")
    return figure


def _most_goals(found: ImageNavResults) -> int:
    return max(len(numbers["by_goal"]) for numbers in found.agents.values())


def _runs_of(
    stored: Sequence[ImageNavResults], name: str
) -> Iterator[tuple[ImageNavResults, str, Mapping[str, Any]]]:
    for found in stored:
        for label, numbers in found.agents.items():
            if numbers.get("agent", label) == name:
                yield found, label, numbers


def _ours_only(
    stored: Sequence[ImageNavResults], sensor: str, theirs: Mapping[str, Any]
) -> list[str]:
    """Agents that the paper does not have, of one sensor."""
    names = [
        numbers.get("agent", label) for found in stored for label, numbers in found.agents.items()
    ]
    wanted = []
    for name in dict.fromkeys(names):
        spec = IMAGE_NAV_AGENTS.get(name)
        own = "rgbd" if spec is None or spec.depth else "rgb"
        if name not in theirs and sensor == own:
            wanted.append(name)
    return wanted


def _cells(numbers: Mapping[str, Any]) -> tuple[str, ...]:
    levels = [_both(numbers["by_difficulty"].get(level)) for level in DIFFICULTIES]
    ends = interval(numbers["success_ci95"]), interval(numbers["spl_ci95"])
    return (str(numbers["episodes"]), *levels, _both(numbers), *ends)


def _both(numbers: Mapping[str, Any] | None) -> str:
    if numbers is None:
        return NONE
    return f"{percent(numbers['success_rate'])} / {percent(numbers['spl'])}"


def _success(numbers: Mapping[str, Any] | None) -> str:
    return NONE if numbers is None else percent(numbers["success_rate"])
