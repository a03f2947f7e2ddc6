"""Pictures of the labels: what the four functions should answer, over plan and panorama."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float32

from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M, direction_of_bin
from toponav.data.nts.labels import exits_of, labels_of, score_of
from toponav.data.nts.panoramas import HomePanoramas

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["column_of_direction", "label_figure"]

_ROW_IN = 2.6
_WIDTH_IN = 9.0


def column_of_direction(yaw_rad: float, width: int) -> float:
    """The column of a stitched panorama that shows a direction from forward, left positive.

    Example:
        >>> column_of_direction(0.0, 512), round(column_of_direction(math.pi / 2, 512))
        (256.0, 128)
    """
    quarter = round(yaw_rad / (math.pi / 2))
    offset = math.tan(wrap_angle(yaw_rad - quarter * math.pi / 2))
    return (width / 2 - quarter * width / 4 - offset * width / 8) % width


def label_figure(
    home: HomePanoramas,
    pairs: Sequence[tuple[int, int]],
    predicted: Sequence[Float32[np.ndarray, " directions"]] | None = None,
) -> "Figure":
    """Plan, source and goal of some pairs: node, exits, directions and their scores.

    Args:
        home: A collected home.
        pairs: Numbers of sources and goals.
        predicted: What a network takes the scores of each pair for, shown above the labels.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH_IN, _ROW_IN * len(pairs)), layout="constrained", dpi=100)
    grid = figure.add_gridspec(2 * len(pairs), 2, width_ratios=[1, 2.6])
    for number, (source, goal) in enumerate(pairs):
        plan = figure.add_subplot(grid[2 * number : 2 * number + 2, 0])
        _draw_plan(plan, home, source, goal)
        above = figure.add_subplot(grid[2 * number, 1])
        _draw_source(above, home, source, goal)
        if predicted is not None:
            _draw_predicted(above, home, source, predicted[number])
        below = figure.add_subplot(grid[2 * number + 1, 1])
        below.imshow(home.rgb[goal])
        below.set_title("goal", fontsize=8)
        below.set_axis_off()
    return figure


def _draw_plan(axes: "Axes", home: HomePanoramas, source: int, goal: int) -> None:
    ground, labels = home.ground, labels_of(home)
    pose = Pose2(*home.poses[source].tolist())
    exits = exits_of(ground, pose)
    colors = np.full((*ground.free.shape, 3), 90, np.uint8)
    colors[ground.free] = 255
    colors[exits.node] = (190, 215, 255)
    axes.imshow(colors, origin="lower", extent=ground.grid.extent_m, interpolation="nearest")
    centers = ground.centers_of(exits.cells)
    scores = score_of(labels.via_m[source, goal])
    axes.scatter(
        centers[:, 0], centers[:, 1], c=scores[exits.bins], cmap="plasma", s=5, vmin=0, vmax=1
    )
    axes.plot(*home.poses[goal, :2], "*", color="tab:green", markersize=11)
    axes.arrow(
        pose.x_m,
        pose.y_m,
        0.7 * math.cos(pose.yaw_rad),
        0.7 * math.sin(pose.yaw_rad),
        width=0.08,
        color="tab:red",
    )
    near = ground.grid.extent_m
    axes.set_xlim(max(near[0], pose.x_m - 9), min(near[1], pose.x_m + 9))
    axes.set_axis_off()
    same = "same node" if labels.same_node[source, goal] else "other node"
    axes.set_title(
        f"{same}, {labels.geodesic_m[source, goal]:.1f} m (node {NODE_RADIUS_M:g} m)", fontsize=8
    )


def _draw_source(axes: "Axes", home: HomePanoramas, source: int, goal: int) -> None:
    labels = labels_of(home)
    width, height = home.config.width, home.config.height
    axes.imshow(home.rgb[source])
    scores: Any = score_of(labels.via_m[source, goal])
    for number in range(DIRECTIONS):
        edge = column_of_direction(direction_of_bin(number) + math.pi / DIRECTIONS, width)
        axes.axvline(edge, color="white", linewidth=0.4)
        if labels.explorable[source, number]:
            middle = column_of_direction(direction_of_bin(number), width)
            axes.text(
                middle,
                height * 0.93,
                f"{scores[number]:.2f}",
                color="white",
                fontsize=7,
                ha="center",
                backgroundcolor=(0.1, 0.1, 0.3, 0.7),
            )
    if labels.same_node[source, goal]:
        column = column_of_direction(float(labels.bearing_rad[source, goal]), width)
        axes.axvline(column, color="tab:green", linewidth=2)
    axes.set_xlim(0, width)
    axes.set_title("source, with the score of each explorable direction", fontsize=8)
    axes.set_axis_off()


def _draw_predicted(
    axes: "Axes", home: HomePanoramas, source: int, scores: Float32[np.ndarray, " directions"]
) -> None:
    labels = labels_of(home)
    open_to = labels.explorable[source]
    best = int(np.where(open_to, scores, -1.0).argmax())
    for number in np.flatnonzero(open_to).tolist():
        axes.text(
            column_of_direction(direction_of_bin(number), home.config.width),
            home.config.height * 0.08,
            f"{scores[number]:.2f}",
            color="black",
            fontsize=7,
            ha="center",
            va="top",
            backgroundcolor="gold" if number == best else (1.0, 1.0, 1.0, 0.75),
        )
    axes.set_title("source, with scores: predicted above, true below", fontsize=8)
