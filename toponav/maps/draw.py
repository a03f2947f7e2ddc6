"""Pictures of topological maps: lanes side by side, a colour per behaviour."""

from collections.abc import Iterable, Mapping

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D

from toponav.core.episode import Belief
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import Plan
from toponav.maps.spec import Edge, TopologicalMap

__all__ = ["BEHAVIOR_COLORS", "draw_floor", "draw_map"]

# Okabe and Ito's colours: told apart with every common kind of colour blindness.
BEHAVIOR_COLORS: Mapping[Behavior, str] = {
    Behavior.CORRIDOR_FOLLOW: "#0072B2",
    Behavior.FIND_DOOR: "#E69F00",
    Behavior.TURN_LEFT: "#009E73",
    Behavior.TURN_RIGHT: "#D55E00",
    Behavior.STRAIGHT: "#CC79A7",
}
_MARKERS: Mapping[NodeKind, tuple[str, float]] = {
    NodeKind.ROOM: ("s", 22.0),
    NodeKind.DOOR: ("^", 14.0),
    NodeKind.HALLWAY: ("o", 7.0),
    NodeKind.OPEN_SPACE: ("D", 10.0),
}
_PLAN_COLOR = "#F0E442"
_BELIEF_COLOR = "#56B4E9"
_LANE_OFFSET_M = 0.09
_NODE_GAP_M = 0.08
_ARROW_M = (0.28, 0.11)


def draw_floor(
    axes: Axes,
    occupied: Bool[np.ndarray, "rows cols"],
    origin_m: tuple[float, float],
    resolution_m: float,
) -> None:
    """Draw a floor plan in metres, row 0 at the bottom.

    Args:
        axes: Where to draw.
        occupied: Cells with anything but floor.
        origin_m: Position of the lower-left corner of cell (0, 0).
        resolution_m: Side of a cell.
    """
    rows, cols = occupied.shape
    left, bottom = origin_m
    axes.imshow(
        np.where(occupied, 0.55, 1.0),
        cmap="gray",
        vmin=0.0,
        vmax=1.0,
        origin="lower",
        extent=(left, left + cols * resolution_m, bottom, bottom + rows * resolution_m),
        interpolation="nearest",
        zorder=0,
    )


def draw_map(
    axes: Axes,
    topological_map: TopologicalMap,
    plan: Plan | None = None,
    belief: Belief | None = None,
    *,
    labels: bool = True,
    legend: bool = True,
    faint: float = 1.0,
) -> None:
    """Draw a map: edges as arrows that keep to the right, coloured by behaviour.

    Args:
        axes: Where to draw, in metres.
        topological_map: Map to draw.
        plan: Walk to mark, if any.
        belief: What an agent thinks, if known: its edges get a halo by probability.
        labels: Whether to name the rooms.
        legend: Whether to explain the colours.
        faint: Opacity of the edges that are not on the plan.

    Example:
        >>> figure, axes = plt.subplots()
        >>> draw_map(axes, load_map("office.topo.json"))
    """
    if plan is not None:
        edges = [topological_map.edge(edge) for edge in plan.edges]
        _draw_halo(axes, topological_map, edges, _PLAN_COLOR, [1.0] * len(edges), width=9.0)
    if belief is not None:
        _draw_belief(axes, topological_map, belief)
    on_plan = frozenset() if plan is None or faint >= 1 else frozenset(plan.edges)
    _draw_edges(axes, topological_map, on_plan, faint if on_plan else 1.0)
    _draw_nodes(axes, topological_map, plan)
    if labels:
        _draw_labels(axes, topological_map)
    if legend:
        _draw_legend(axes, topological_map, plan)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _lanes(
    topological_map: TopologicalMap, edges: Iterable[Edge]
) -> Float[np.ndarray, "edges 2 2"]:
    """Start and end of each edge, moved to the right of its direction and off the nodes."""
    index = topological_map.node_index
    ends = [(index[edge.source], index[edge.target]) for edge in edges]
    points = topological_map.positions_m[np.array(ends, dtype=np.int64).reshape(-1, 2)]
    along = points[:, 1] - points[:, 0]
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    unit = along / length
    right = np.stack([unit[:, 1], -unit[:, 0]], axis=1) * np.minimum(_LANE_OFFSET_M, length / 6)
    gap = unit * np.minimum(_NODE_GAP_M, length / 6)
    lanes: np.ndarray = np.stack([points[:, 0] + right + gap, points[:, 1] + right - gap], axis=1)
    return lanes


def _draw_edges(
    axes: Axes, topological_map: TopologicalMap, on_plan: frozenset[str], faint: float
) -> None:
    for behavior, color in BEHAVIOR_COLORS.items():
        edges = [edge for edge in topological_map.edges if edge.behavior is behavior]
        if not edges:
            continue
        lanes = _lanes(topological_map, edges)
        opacity = [1.0 if edge.id in on_plan else faint for edge in edges]
        colors = [to_rgba(color, alpha) for alpha in opacity]
        axes.add_collection(LineCollection(list(lanes), colors=colors, linewidths=1.1, zorder=4))
        heads = PolyCollection(list(_heads(lanes)), facecolors=colors, edgecolors="none", zorder=5)
        axes.add_collection(heads)
    axes.autoscale_view()


def _heads(lanes: Float[np.ndarray, "edges 2 2"]) -> Float[np.ndarray, "edges 3 2"]:
    """A triangle at the end of each lane."""
    along = lanes[:, 1] - lanes[:, 0]
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    unit = along / length
    across = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    scale = np.minimum(1.0, length / (2 * _ARROW_M[0]))
    base = lanes[:, 1] - unit * _ARROW_M[0] * scale
    side = across * _ARROW_M[1] * scale
    heads: np.ndarray = np.stack([lanes[:, 1], base + side, base - side], axis=1)
    return heads


def _draw_halo(
    axes: Axes,
    topological_map: TopologicalMap,
    edges: list[Edge],
    color: str,
    strengths: Iterable[float],
    *,
    width: float,
) -> None:
    halo = LineCollection(
        list(_lanes(topological_map, edges)),
        colors=color,
        linewidths=width,
        alpha=np.clip(np.fromiter(strengths, dtype=np.float64), 0.0, 1.0),
        capstyle="round",
        zorder=3,
    )
    axes.add_collection(halo)


def _draw_belief(axes: Axes, topological_map: TopologicalMap, belief: Belief) -> None:
    probable = {
        name: float(probability)
        for name, probability in belief.edge_probability.items()
        if probability > 0.01 and name in topological_map.edge_index
    }
    if belief.edge is not None and belief.edge in topological_map.edge_index:
        probable.setdefault(belief.edge, 1.0)
    edges = [topological_map.edge(name) for name in probable]
    _draw_halo(axes, topological_map, edges, _BELIEF_COLOR, probable.values(), width=5.0)
    if belief.node is not None and belief.node in topological_map:
        node = topological_map.node(belief.node)
        axes.scatter(
            [node.x_m], [node.y_m], s=160, facecolors="none", edgecolors=_BELIEF_COLOR,
            linewidths=2.5, zorder=7,
        )  # fmt: skip


def _draw_nodes(axes: Axes, topological_map: TopologicalMap, plan: Plan | None) -> None:
    for kind, (marker, size) in _MARKERS.items():
        points = np.array([(n.x_m, n.y_m) for n in topological_map.nodes if n.kind is kind])
        if points.size:
            x_m, y_m = points.T
            axes.scatter(x_m, y_m, s=size, marker=marker, color="black", linewidths=0, zorder=6)
    if plan is None:
        return
    for node_id, text in ((plan.nodes[0], "start"), (plan.nodes[-1], "goal")):
        node = topological_map.node(node_id)
        axes.annotate(
            text,
            (node.x_m, node.y_m),
            textcoords="offset points",
            xytext=(6, -12),
            fontsize=9,
            fontweight="bold",
            bbox={"facecolor": _PLAN_COLOR, "edgecolor": "black", "pad": 1.5},
            zorder=9,
        )


def _draw_labels(axes: Axes, topological_map: TopologicalMap) -> None:
    for node in topological_map.nodes:
        if node.kind is NodeKind.ROOM:
            axes.annotate(
                node.id,
                (node.x_m, node.y_m),
                textcoords="offset points",
                xytext=(4, 3),
                fontsize=6,
                color="0.15",
                zorder=8,
                annotation_clip=True,
                bbox={"facecolor": "white", "alpha": 0.6, "edgecolor": "none", "pad": 0.3},
            )


def _draw_legend(axes: Axes, topological_map: TopologicalMap, plan: Plan | None) -> None:
    used = {edge.behavior for edge in topological_map.edges}
    handles = [
        Line2D([], [], color=color, label=behavior.value.replace("_", " "))
        for behavior, color in BEHAVIOR_COLORS.items()
        if behavior in used
    ]
    kinds = {node.kind for node in topological_map.nodes}
    handles += [
        Line2D([], [], color="black", marker=marker, linestyle="", markersize=5,
               label=f"{kind.value.replace('_', ' ')} node")
        for kind, (marker, _) in _MARKERS.items()
        if kind in kinds
    ]  # fmt: skip
    if plan is not None:
        handles.append(Line2D([], [], color=_PLAN_COLOR, linewidth=5, label="plan"))
    axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8, frameon=False
    )
