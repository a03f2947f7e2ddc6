"""The paper's figures from stored runs: trajectories, localization over time, plan lengths."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection

from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.figures import draw_belief, draw_trajectory
from toponav.evaluation.records import plan_length_m
from toponav.evaluation.stored_run import Building, StoredRun
from toponav.maps.draw import BEHAVIOR_COLORS
from toponav.worlds.draw import draw_plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "choose_episodes",
    "lengths_figure",
    "localization_figure",
    "trajectories_figure",
]

_MOMENTS = 4
_AROUND_M = 3.0


def choose_episodes(run: StoredRun, agent: str, count: int = 6) -> list[int]:
    """Episodes worth a figure: the longest plans that succeeded, and last the longest failure.

    By the tolerant rule. Where fewer succeeded, failures fill up, and the other way round.
    """
    rows = sorted(run.rows_of(agent), key=lambda row: (-row["plan_nodes"], row["episode"]))
    good = [row["episode"] for row in rows if row["tolerant_outcome"] == "success"]
    lost = [row["episode"] for row in rows if row["tolerant_outcome"] != "success"]
    successes = good[: count - 1] if lost else good[:count]
    return successes + lost[: count - len(successes)]


def trajectories_figure(
    run: StoredRun, agent: str, building: Building, episodes: Sequence[int]
) -> "Figure":
    """Driven paths over the floor plan, a panel an episode (the paper's figures 5 and 13)."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    records = [run.record(agent, episode, building.map) for episode in episodes]
    cols = min(3, len(records))
    rows = -(-len(records) // cols)
    figure = Figure(figsize=(4.4 * cols, 4.3 * rows + 0.5), layout="constrained")
    panels = figure.subplots(rows, cols, squeeze=False).ravel()
    for ax, record in zip(panels, records, strict=False):
        _draw_path(ax, building, record)
    for ax in panels[len(records) :]:
        ax.set_axis_off()
    handles = [
        Line2D([], [], color=color, lw=2.5, label=str(behavior).replace("_", " "))
        for behavior, color in BEHAVIOR_COLORS.items()
    ]
    handles += [
        Line2D([], [], ls="", marker="o", mfc="none", mec="black", label="start"),
        Line2D([], [], ls="", marker="*", color="black", label="goal"),
        Line2D([], [], ls="", marker="x", color="#b5402a", mew=2.5, label="failed"),
        Line2D([], [], color="#F0E442", lw=6.0, label="plan"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=9, frameon=False, fontsize=8)
    figure.suptitle(f"{run.name}, {run.title(agent)}: paths by executed behaviour")
    return figure


def _draw_path(ax: "Axes", building: Building, record: EpisodeRecord) -> None:
    draw_trajectory(ax, building.scene, building.map, record, whole_map=False)
    length_m = plan_length_m(building.map, record.plan)
    outcome = str(record.tolerant.outcome)
    if record.tolerant.success and not record.strict.success:
        outcome = f"success (strict: {record.strict.outcome})"
    ax.set_title(f"episode {record.index}, {length_m:.0f} m: {outcome}", fontsize=9)
    _frame(ax, record, _AROUND_M)
    ax.set_xlabel("")
    ax.set_ylabel("")
    ax.tick_params(labelsize=6)


def localization_figure(run: StoredRun, agent: str, building: Building, episode: int) -> "Figure":
    """What the agent believed over time (the paper's figure 6): maps at moments, and a strip.

    The darker an edge, the more probable the agent held it; the strip has the belief over the
    plan's edges at every step, and the true edge as a line.
    """
    from matplotlib.figure import Figure

    record = run.record(agent, episode, building.map)
    figure = Figure(figsize=(13.0, 7.6), layout="constrained")
    grid = figure.add_gridspec(2, _MOMENTS, height_ratios=(1.0, 1.05))
    for column, at in enumerate(_moments(record)):
        ax = figure.add_subplot(grid[0, column])
        _draw_moment(ax, building, record, at)
    strip = figure.add_subplot(grid[1, :])
    draw_belief(strip, record)
    for at in _moments(record):
        strip.axvline(record.steps[at].time_s, color="#b5402a", lw=0.8, ls=":")
    strip.set_title(
        "below: belief over the plan's edges, the true edge as a black line; above: red is the "
        "robot, the ring the believed node, an arrow the darker the more probable",
        fontsize=9,
    )
    figure.suptitle(
        f"{run.name}, {run.title(agent)}, episode {episode}: localization over time "
        f"({record.tolerant.outcome})"
    )
    return figure


def _moments(record: EpisodeRecord) -> list[int]:
    """Steps worth a picture: those with the most doubtful belief, spread over the run."""
    count = len(record.steps)
    bounds = np.linspace(0, count, _MOMENTS + 1).round().astype(int)
    sure = np.array([max(step.plan_probability, default=1.0) for step in record.steps])
    spans = zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True)
    return [first + int(sure[first:stop].argmin()) for first, stop in spans if stop > first]


def _draw_moment(ax: "Axes", building: Building, record: EpisodeRecord, at: int) -> None:
    step = record.steps[at]
    draw_plan(ax, building.scene, names=False)
    probable = dict(zip(record.plan.edges, step.plan_probability, strict=True))
    if step.believed_edge is not None and step.believed_edge not in probable:
        probable[step.believed_edge] = step.elsewhere_probability
    _draw_faint_map(ax, building)
    _draw_probable(ax, building, probable)
    if step.believed_node is not None and step.believed_node in building.map:
        node = building.map.node(step.believed_node)
        ax.plot(node.x_m, node.y_m, "o", mfc="none", mec="#56B4E9", ms=13, mew=2.5, zorder=8)
    ax.plot([step.x_m], [step.y_m], "o", color="#b5402a", ms=7, zorder=9)
    tip_m = 0.7
    ax.annotate(
        "",
        (step.x_m + tip_m * np.cos(step.yaw_rad), step.y_m + tip_m * np.sin(step.yaw_rad)),
        (step.x_m, step.y_m),
        arrowprops={"arrowstyle": "-|>", "color": "#b5402a", "lw": 1.6},
        zorder=9,
    )
    ax.set_xlim(step.x_m - 4.5, step.x_m + 4.5)
    ax.set_ylim(step.y_m - 4.5, step.y_m + 4.5)
    behavior = (step.behavior or "stopped").replace("_", " ")
    ax.set_title(f"{step.time_s:.0f} s: {behavior}", fontsize=9)
    ax.set_xlabel("")
    ax.set_ylabel("")
    ax.tick_params(labelsize=6)


def _draw_faint_map(ax: "Axes", building: Building) -> None:
    nodes = building.map.node
    ax.add_collection(
        LineCollection(
            [
                [(node.x_m, node.y_m) for node in (nodes(edge.source), nodes(edge.target))]
                for edge in building.map.edges
            ],
            colors="#9aa3ab",
            linewidths=0.6,
            zorder=3,
        )
    )
    positions = building.map.positions_m
    ax.plot(positions[:, 0], positions[:, 1], "o", color="#6b747c", ms=2.5, zorder=4)


def _draw_probable(ax: "Axes", building: Building, probable: dict[str, float]) -> None:
    """Arrows as dark as the edges are probable."""
    for name, share in sorted(probable.items(), key=lambda item: item[1]):
        if share < 0.03 or name not in building.map.edge_index:
            continue
        edge = building.map.edge(name)
        source, target = building.map.node(edge.source), building.map.node(edge.target)
        ax.annotate(
            "",
            (target.x_m, target.y_m),
            (source.x_m, source.y_m),
            arrowprops={
                "arrowstyle": "-|>,head_width=0.35,head_length=0.6",
                "color": str(0.85 * (1.0 - share)),
                "lw": 1.0 + 3.0 * share,
            },
            zorder=7,
        )


def _frame(ax: "Axes", record: EpisodeRecord, margin_m: float) -> None:
    """Show where the robot was, at least ten metres square, within what is shown now."""
    x_m = np.array([step.x_m for step in record.steps])
    y_m = np.array([step.y_m for step in record.steps])
    half_m = max(5.0, np.ptp(x_m) / 2 + margin_m, np.ptp(y_m) / 2 + margin_m)
    ax.set_xlim((x_m.min() + x_m.max()) / 2 - half_m, (x_m.min() + x_m.max()) / 2 + half_m)
    ax.set_ylim((y_m.min() + y_m.max()) / 2 - half_m, (y_m.min() + y_m.max()) / 2 + half_m)


def lengths_figure(runs: Sequence[tuple[StoredRun, Building | None]]) -> "Figure":
    """Histograms of the plans' lengths, in metres and in nodes (the paper's figures 11, 12).

    Args:
        runs: The runs, each with its building where an older run did not store the lengths.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2.9 * max(2, len(runs)), 4.8), layout="constrained")
    panels = figure.subplots(2, len(runs), squeeze=False)
    lengths = [list(_lengths(run, building)) for run, building in runs]
    most_m = max((m for found in lengths for m, _ in found), default=1.0)
    most_nodes = max((nodes for found in lengths for _, nodes in found), default=1)
    for column, ((run, _), found) in enumerate(zip(runs, lengths, strict=True)):
        metres, nodes = panels[0, column], panels[1, column]
        metres.hist([m for m, _ in found], np.arange(0, most_m + 5, 5), color="#4f6d8f")
        nodes.hist([n for _, n in found], np.arange(0, most_nodes + 3, 2) - 0.5, color="#4f6d8f")
        for edge in (10.5, 20.5):
            nodes.axvline(edge, color="#b5402a", lw=0.8, ls=":")
        metres.set_title(f"{run.name} ({len(found)})", fontsize=9)
        metres.set_xlabel("plan [m]")
        nodes.set_xlabel("plan [nodes]")
    for ax in panels[:, 0]:
        ax.set_ylabel("plans")
    for ax in panels.ravel():
        ax.spines[["top", "right"]].set_visible(False)
    figure.suptitle("Lengths of the evaluated plans; dotted: difficulty I, II, III", fontsize=10)
    return figure


def _lengths(run: StoredRun, building: Building | None) -> Iterator[tuple[float, int]]:
    """Metres and nodes of each plan, once however many agents drove it."""
    seen: set[int] = set()
    for row in run.rows:
        if row["episode"] in seen:
            continue
        seen.add(row["episode"])
        length_m = row.get("plan_m")
        if length_m is None and building is not None:
            length_m = plan_length_m(building.map, run.plan_of(row, building.map))
        if length_m is not None:
            yield float(length_m), int(row["plan_nodes"])
