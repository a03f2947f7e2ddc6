"""Where runs end: attempts and failures of each edge, as numbers and drawn on the floor plan."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from toponav.core.vocabulary import Behavior, Outcome
from toponav.evaluation.protocol import DeviationRule
from toponav.evaluation.stored_run import Building, StoredRun
from toponav.maps.draw import BEHAVIOR_COLORS
from toponav.maps.spec import TopologicalMap
from toponav.worlds.draw import draw_plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["EdgeCount", "draw_failures", "edge_counts", "failure_figure", "failures_csv"]

_MARKERS: Mapping[Outcome, str] = {
    Outcome.DEVIATED: "^",
    Outcome.COLLIDED: "X",
    Outcome.STUCK: "s",
    Outcome.TIMEOUT: "D",
}
_WORST = 14
_MARKER_M = 0.4


@dataclass
class EdgeCount:
    """How often one edge of the map was attempted, and how runs ended on it.

    Attributes:
        source: Node that the edge leaves.
        target: Node that it leads to.
        behavior: What is executed on it.
        attempts: Runs that came to its source with the edge next in their plan.
        ended: Runs that ended on it, by outcome.
    """

    source: str
    target: str
    behavior: Behavior
    attempts: int = 0
    ended: Counter[Outcome] = field(default_factory=Counter)

    @property
    def failures(self) -> int:
        """Runs that ended on it."""
        return sum(self.ended.values())


def edge_counts(
    rows: Sequence[Mapping[str, Any]], rule: DeviationRule = "tolerant"
) -> list[EdgeCount]:
    """Attempts and failures of every edge that was attempted, most failures first.

    Args:
        rows: Rows of `episodes.parquet`, of one agent.
        rule: Which verdict counts.
    """
    found: dict[tuple[str, str], EdgeCount] = {}
    for row in rows:
        nodes, reached = row["nodes"], row[f"{rule}_nodes_reached"]
        outcome = Outcome(row[f"{rule}_outcome"])
        attempted = min(reached, len(nodes) - 1)
        for position in range(attempted):
            source, target = nodes[position], nodes[position + 1]
            behavior = Behavior(row["behaviors"][position])
            count = found.setdefault((source, target), EdgeCount(source, target, behavior))
            count.attempts += 1
            if outcome is not Outcome.SUCCESS and position == attempted - 1:
                count.ended[outcome] += 1
    return sorted(
        found.values(), key=lambda one: (-one.failures, -one.attempts, one.source, one.target)
    )


def failures_csv(counts: Sequence[EdgeCount]) -> str:
    """The counts as CSV, an edge a row."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    writer.writerow(["source", "target", "behavior", "attempts", "failures", *map(str, _MARKERS)])
    for one in counts:
        ended = [one.ended[outcome] for outcome in _MARKERS]
        writer.writerow(
            [one.source, one.target, str(one.behavior), one.attempts, one.failures, *ended]
        )
    return sink.getvalue()


def failure_figure(
    run: StoredRun, agent: str, building: Building, rule: DeviationRule = "tolerant"
) -> "Figure":
    """The failure map of one agent beside a list of the edges on which most runs ended."""
    from matplotlib.figure import Figure

    rows = run.rows_of(agent)
    counts = edge_counts(rows, rule)
    width_m, height_m = _size_m(building)
    plan_in = 8.0
    figure = Figure(
        figsize=(plan_in + 3.6, float(np.clip(plan_in * height_m / width_m, 4.2, 11.0)) + 0.6),
        layout="constrained",
    )
    grid = figure.add_gridspec(1, 2, width_ratios=(plan_in, 3.6))
    plan, worst = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    draw_failures(plan, building, rows, rule)
    _draw_worst(worst, counts)
    failed = sum(one.failures for one in counts)
    figure.suptitle(
        f"{run.name}, {run.title(agent)}: where {failed} of {len(rows)} runs ended ({rule} rule)"
    )
    return figure


def draw_failures(
    ax: "Axes",
    building: Building,
    rows: Sequence[Mapping[str, Any]],
    rule: DeviationRule = "tolerant",
) -> None:
    """Draw the plan, each edge by its share of failures, and the place where each run ended.

    An edge is as wide as it was often attempted, from grey to red as runs ended on it; a number
    at a node says how many runs ended after it. A marker's shape is the outcome, its colour the
    behaviour that was to be executed; markers of the same place lie side by side.

    Args:
        ax: Axes to draw on, in metres.
        building: The building and its map.
        rows: Rows of `episodes.parquet`, of one agent.
        rule: Which verdict counts.
    """
    draw_plan(ax, building.scene, names=False)
    _draw_edges(ax, building.map, edge_counts(rows, rule))
    _draw_nodes(ax, building.map, edge_counts(rows, rule))
    used: set[tuple[Outcome, Behavior]] = set()
    taken: list[tuple[float, float]] = []
    for row in rows:
        outcome = Outcome(row[f"{rule}_outcome"])
        if outcome is Outcome.SUCCESS:
            continue
        position = min(row[f"{rule}_nodes_reached"], len(row["nodes"]) - 1) - 1
        behavior = Behavior(row["behaviors"][position])
        x_m, y_m = _beside_others(_end_of(row, rule, building.map), taken)
        used.add((outcome, behavior))
        ax.plot(
            [x_m], [y_m], _MARKERS[outcome], color=BEHAVIOR_COLORS[behavior], ms=7.5,
            mec="black", mew=0.6, alpha=0.9, zorder=9,
        )  # fmt: skip
    _draw_legend(ax, used)


def _draw_legend(ax: "Axes", used: set[tuple[Outcome, Behavior]]) -> None:
    handles = [
        Line2D([], [], ls="", marker=marker, color="0.6", mec="black", label=str(outcome))
        for outcome, marker in _MARKERS.items()
        if any(outcome is one for one, _ in used)
    ]
    handles += [
        Line2D([], [], ls="", marker="o", color=color, mec="black", label=_spoken(behavior))
        for behavior, color in BEHAVIOR_COLORS.items()
        if any(behavior is one for _, one in used)
    ]
    handles += [
        Line2D([], [], color=_share_color(share), lw=3.0, label=label)
        for share, label in ((0.0, "no run ended"), (0.25, "a quarter"), (0.5, "half or more"))
    ]
    ax.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.06),
        ncols=4,
        fontsize=7,
        frameon=False,
    )


def _draw_edges(ax: "Axes", map_: TopologicalMap, counts: Sequence[EdgeCount]) -> None:
    known = [one for one in counts if one.source in map_ and one.target in map_]
    known.sort(key=lambda one: one.failures / one.attempts)
    lines = [
        [(node.x_m, node.y_m) for node in (map_.node(one.source), map_.node(one.target))]
        for one in known
    ]
    ax.add_collection(
        LineCollection(
            lines,
            colors=[_share_color(one.failures / one.attempts) for one in known],
            linewidths=[0.8 + 0.9 * np.sqrt(one.attempts) for one in known],
            capstyle="round",
            alpha=0.85,
            zorder=4,
        )
    )


def _share_color(share: float) -> tuple[float, float, float]:
    """From grey where no run ended to red where half of them did."""
    t = min(1.0, 2.0 * share)
    start, end = np.array([0.68, 0.68, 0.66]), np.array([0.80, 0.10, 0.08])
    red, green, blue = (start + t * (end - start)).tolist()
    return red, green, blue


def _draw_worst(ax: "Axes", counts: Sequence[EdgeCount]) -> None:
    """The edges on which most runs ended, as bars by outcome."""
    worst = [one for one in counts if one.failures][:_WORST]
    shades = {
        Outcome.DEVIATED: "#4f6d8f",
        Outcome.COLLIDED: "#b5402a",
        Outcome.STUCK: "#d9a441",
        Outcome.TIMEOUT: "#8d8d86",
    }
    left = np.zeros(len(worst))
    for outcome, color in shades.items():
        width = np.array([one.ended[outcome] for one in worst], float)
        if width.any():
            ax.barh(range(len(worst)), width, left=left, color=color, label=str(outcome))
        left = left + width
    for row, one in enumerate(worst):
        ax.text(left[row], row, f" {one.failures} of {one.attempts}", va="center", fontsize=7)
    names = [f"{_spoken(one.behavior)}\n{one.source} to {one.target}" for one in worst]
    ax.set_yticks(range(len(worst)), names, fontsize=6)
    ax.set_ylim(max(len(worst), 6) - 0.5, -0.5)
    ax.set_xlim(0, 1.25 * max(left.max(initial=0.0), 1.0))
    ax.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True))
    ax.set_xlabel("runs that ended here")
    ax.spines[["top", "right"]].set_visible(False)
    if len(worst):
        ax.legend(fontsize=7, frameon=False, loc="lower right")


def _draw_nodes(ax: "Axes", map_: TopologicalMap, counts: Sequence[EdgeCount]) -> None:
    """At each node, how many runs ended on the way from it to the next."""
    ended: Counter[str] = Counter()
    for one in counts:
        ended[one.source] += one.failures
    for name, count in ended.items():
        if count and name in map_:
            node = map_.node(name)
            ax.annotate(
                str(count),
                (node.x_m, node.y_m),
                fontsize=6.5,
                ha="center",
                va="center",
                bbox={"boxstyle": "circle,pad=0.15", "fc": "white", "ec": "#b5402a", "lw": 0.8},
                zorder=8,
            )


def _beside_others(
    end_m: tuple[float, float], taken: list[tuple[float, float]]
) -> tuple[float, float]:
    """The place, or one as near as may be, where no earlier marker lies."""
    for turn in range(200):
        radius_m, angle_rad = 0.16 * np.sqrt(turn), 2.399963 * turn
        place = (end_m[0] + radius_m * np.cos(angle_rad), end_m[1] + radius_m * np.sin(angle_rad))
        if all(np.hypot(place[0] - x_m, place[1] - y_m) > _MARKER_M for x_m, y_m in taken):
            break
    taken.append((float(place[0]), float(place[1])))
    return taken[-1]


def _end_of(
    row: Mapping[str, Any], rule: DeviationRule, map_: TopologicalMap
) -> tuple[float, float]:
    """Where a run ended; at its last node, where an older version did not store the place."""
    x_m, y_m = row.get(f"{rule}_x_m"), row.get(f"{rule}_y_m")
    if x_m is not None and y_m is not None:
        return float(x_m), float(y_m)
    last = row[f"{rule}_node"] or row["nodes"][max(0, row[f"{rule}_nodes_reached"] - 1)]
    node = map_.node(last)
    return node.x_m, node.y_m


def _size_m(building: Building) -> tuple[float, float]:
    """Width and height of what `draw_plan` shows."""
    scene = building.scene
    used = np.argwhere(scene.occupied | (scene.room_index >= 0))
    if not len(used):
        return 1.0, 1.0
    height, width = (used.max(axis=0) - used.min(axis=0) + 1) * scene.grid.resolution_m
    return float(width) + 1.0, float(height) + 1.0


def _spoken(behavior: Behavior) -> str:
    return str(behavior).replace("_", " ")
