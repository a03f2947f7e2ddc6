"""Figures of topological maps to print: the plan below, a legend, a scale bar."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from toponav.maps.draw import draw_floor, draw_map
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap

if TYPE_CHECKING:
    from toponav.worlds.load.ros_map import RosMap
    from toponav.worlds.scene import Scene

__all__ = ["map_figure"]

_LEGEND_IN = 1.75
_MARGIN_IN = 0.1
_MARGIN_M = 1.0
_LIMITS_IN = (3.0, 24.0)
_BARS_M = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)


def map_figure(
    topological_map: TopologicalMap,
    plan: Plan | None = None,
    *,
    scene: "Scene | None" = None,
    floor: "RosMap | None" = None,
    width_in: float = 10.0,
    title: str | None = None,
) -> Figure:
    """A map over its floor plan, as large as the building's shape asks for.

    Lines, names and the legend are vectors in PDF and SVG files; only the floor is an image.

    Args:
        topological_map: Map to draw.
        plan: Walk to mark; the rest of the map is then drawn fainter.
        scene: Building to draw below it, with rooms tinted.
        floor: Floor plan to draw where there is no scene.
        width_in: Width of the figure in inches, legend included.
        title: Title; the map's name by default.

    Example:
        >>> map_figure(load_map("office.topo.json")).savefig("office.pdf")
    """
    figure = Figure()
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    if scene is not None:
        from toponav.worlds.draw import draw_plan

        draw_plan(axes, scene, names=False)
    elif floor is not None:
        draw_floor(axes, floor.occupied, floor.grid.origin_m, floor.grid.resolution_m)
    draw_map(axes, topological_map, plan, faint=0.4)
    left, right, low, high = _frame(topological_map, axes if scene or floor else None)
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    axes.set_axis_off()
    drawing_in = width_in - _LEGEND_IN - 2 * _MARGIN_IN
    height_in = float(np.clip(drawing_in * (high - low) / (right - left), *_LIMITS_IN))
    drawing_in = min(drawing_in, height_in * (right - left) / (high - low))
    total_in = (drawing_in + _LEGEND_IN + 2 * _MARGIN_IN, height_in + 0.4)
    figure.set_size_inches(*total_in)
    axes.set_position(
        (
            _MARGIN_IN / total_in[0],
            _MARGIN_IN / total_in[1],
            drawing_in / total_in[0],
            height_in / total_in[1],
        )
    )
    axes.set_title(title or topological_map.name, fontsize=11, loc="left", pad=4)
    _draw_scale(axes, left, low, right - left)
    return figure


def _frame(
    topological_map: TopologicalMap, axes: Axes | None
) -> tuple[float, float, float, float]:
    """Left, right, low and high edge of what is drawn, in metres."""
    points = topological_map.positions_m if len(topological_map.nodes) else np.zeros((1, 2))
    (left, low), (right, high) = points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M
    if axes is not None:
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        left, right, low, high = min(left, x0), max(right, x1), min(low, y0), max(high, y1)
    return float(left), float(right), float(low) - _MARGIN_M, float(high)


def _draw_scale(axes: Axes, left: float, low: float, width_m: float) -> None:
    """A bar of a round number of metres in the lower left corner, half of it filled."""
    bar_m = max((bar for bar in _BARS_M if bar <= width_m / 5), default=_BARS_M[0])
    thick_m = width_m / 250
    x_m, y_m = left + width_m / 60, low + width_m / 60
    for start, color in ((0.0, "black"), (0.5, "white")):
        axes.add_patch(
            Rectangle(
                (x_m + start * bar_m, y_m), bar_m / 2, thick_m,
                facecolor=color, edgecolor="black", linewidth=0.7, zorder=10,
            )
        )  # fmt: skip
    axes.text(
        x_m + bar_m, y_m + thick_m * 1.8, f"{bar_m:g} m", fontsize=8, ha="center", va="bottom",
        zorder=10,
    )  # fmt: skip
    axes.text(x_m, y_m + thick_m * 1.8, "0", fontsize=8, ha="center", va="bottom", zorder=10)
