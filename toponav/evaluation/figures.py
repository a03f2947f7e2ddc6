"""Figures of single episodes for papers and notebooks: the path on the plan, belief over time."""

from typing import TYPE_CHECKING

import numpy as np

from toponav.core.vocabulary import Behavior
from toponav.evaluation.episode import EpisodeRecord
from toponav.maps.draw import BEHAVIOR_COLORS, draw_map
from toponav.maps.spec import TopologicalMap
from toponav.worlds.draw import draw_plan
from toponav.worlds.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["belief_over_time", "draw_belief", "draw_trajectory", "episode_figure"]


def belief_over_time(record: EpisodeRecord) -> np.ndarray:
    """Probability of each plan edge at each step, [edges + 1, steps]; last row: off the plan."""
    columns = [(*step.plan_probability, step.elsewhere_probability) for step in record.steps]
    return np.array(columns, dtype=np.float64).reshape(len(columns), len(record.plan.nodes)).T


def draw_trajectory(
    ax: "Axes",
    scene: Scene,
    map_: TopologicalMap,
    record: EpisodeRecord,
    *,
    whole_map: bool = True,
) -> None:
    """Draw the building, the map with the plan, and the path, coloured by executed behaviour.

    A ring marks the start and a cross the end of a run that failed by the tolerant rule.

    Args:
        ax: Axes to draw on, in metres.
        scene: The building.
        map_: Its topological map.
        record: The episode.
        whole_map: Whether to draw every edge of the map, or only the plan as a pale band.
    """
    draw_plan(ax, scene, names=False)
    if whole_map:
        draw_map(ax, map_, record.plan, labels=False, legend=False)
    else:
        nodes = [map_.node(node) for node in record.plan.nodes]
        ax.plot(
            [node.x_m for node in nodes], [node.y_m for node in nodes],
            color="#F0E442", lw=7.0, solid_capstyle="round", solid_joinstyle="round", zorder=3,
        )  # fmt: skip
        ax.plot(nodes[-1].x_m, nodes[-1].y_m, "*", color="black", ms=9, zorder=8)
    x_m = np.array([step.x_m for step in record.steps])
    y_m = np.array([step.y_m for step in record.steps])
    for behavior in (*Behavior, None):
        chosen = np.array([step.behavior == behavior for step in record.steps])
        # Each stretch reaches to the next step, so that the path has no gaps.
        shown = chosen | np.concatenate([[False], chosen[:-1]])
        color = "#444444" if behavior is None else BEHAVIOR_COLORS[behavior]
        if chosen.any():
            ax.plot(
                np.where(shown, x_m, np.nan),
                np.where(shown, y_m, np.nan),
                color=color,
                lw=2.2,
                zorder=7,
            )
    ax.plot(x_m[0], y_m[0], "o", mfc="none", mec="black", ms=9, zorder=8)
    if not record.tolerant.success:
        ax.plot(x_m[-1], y_m[-1], "x", color="#b5402a", ms=10, mew=2.5, zorder=9)


def draw_belief(ax: "Axes", record: EpisodeRecord) -> None:
    """Draw the belief over the plan's edges over time, with the true edge as a line.

    Args:
        ax: Axes to draw on; time in seconds to the right, the plan's edges downwards.
        record: The episode.
    """
    matrix = belief_over_time(record)
    end_s = record.steps[-1].time_s + 0.2
    edges = len(matrix)
    ax.imshow(
        matrix,
        aspect="auto",
        cmap="Blues",
        vmin=0.0,
        vmax=1.0,
        extent=(0.0, end_s, edges - 0.5, -0.5),
        interpolation="none",
    )
    index = {edge: position for position, edge in enumerate(record.plan.edges)}
    truth = [index.get(step.true_edge or "", np.nan) for step in record.steps]
    ax.step([step.time_s for step in record.steps], truth, where="post", color="black", lw=1.2)
    labels = [
        f"{behavior.replace('_', ' ')} to {node}"
        for behavior, node in zip(record.behaviors, record.plan.nodes[1:], strict=True)
    ]
    ax.set_yticks(range(edges), [*labels, "off the plan"], fontsize=6)
    ax.set_xlabel("time [s]")


def episode_figure(scene: Scene, map_: TopologicalMap, record: EpisodeRecord) -> "Figure":
    """Path and belief of one episode side by side; save it with `figure.savefig`.

    Example:
        >>> stored = load_episode(Path("runs/area_3/episodes/gtl/00007.parquet"))  # doctest: +SKIP
        >>> episode_figure(scene, map_, stored.record).savefig("7.pdf")  # doctest: +SKIP
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    path, belief = figure.subplots(1, 2)
    draw_trajectory(path, scene, map_, record)
    draw_belief(belief, record)
    figure.suptitle(
        f"{record.agent}, episode {record.index}: {record.plan.nodes[0]} to "
        f"{record.plan.nodes[-1]}, strict {record.strict.outcome}, "
        f"tolerant {record.tolerant.outcome}"
    )
    return figure
