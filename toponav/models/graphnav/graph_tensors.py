"""Crops of a topological map as numbers: the one encoding that training and agents share."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32, Int64
from torch import Tensor

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.maps.subgraph import Subgraph
from toponav.models.graphnav.presets import LocalizationConfig, Preset

__all__ = [
    "EDGE_FEATURES",
    "MOTION_FEATURES",
    "GraphBatch",
    "GraphTensors",
    "Motion",
    "batch_graphs",
    "edge_feature_count",
    "encode_subgraph",
    "mirror_graph",
]

_PLAN_ORDERS = (-2, -1, 0, 1, 2, 3)

EDGE_FEATURES = (
    "length",
    "log_length",
    "turn_sine",
    "turn_cosine",
    "leaves_center",
    "is_previous",
    "is_on_plan",
    *(f"plan_order_{order:+d}" for order in _PLAN_ORDERS),
)
"""What each edge carries beside its behaviour, in order (`edge_features` presets only).

Turns are the edge's heading relative to the previous edge's. `plan_order_+k` says that the
plan takes the edge k edges after the previous one; farther edges count as the ends.
"""

MOTION_FEATURES = ("driven", "driven_share", "turned_sine", "turned_cosine")
"""What the robot has commanded since it took itself to be on the previous edge.

The same for each edge of a crop (`motion_features` presets only).
"""

_TURNED_SINE = len(EDGE_FEATURES) + MOTION_FEATURES.index("turned_sine")
_TURN_SINE = EDGE_FEATURES.index("turn_sine")
_IS_ON_PLAN = EDGE_FEATURES.index("is_on_plan")
_FIRST_ORDER = _IS_ON_PLAN + 1
_BEHAVIORS = {behavior: index for index, behavior in enumerate(Behavior)}
_MIRRORED = np.array(
    [
        _BEHAVIORS[
            {
                Behavior.TURN_LEFT: Behavior.TURN_RIGHT,
                Behavior.TURN_RIGHT: Behavior.TURN_LEFT,
            }.get(behavior, behavior)
        ]
        for behavior in Behavior
    ]
)
_NODE_KINDS = {
    3: {
        NodeKind.ROOM: 0,
        NodeKind.DOOR: 0,
        NodeKind.HALLWAY: 1,
        NodeKind.OPEN_SPACE: 2,
    },
    4: {kind: index for index, kind in enumerate(NodeKind)},
}


@dataclass(frozen=True)
class Motion:
    """Dead reckoning from the robot's own commands, since it came to the previous edge.

    It is no ego-motion from outside: the robot only adds up what it told its wheels.

    Attributes:
        driven_m: Metres driven.
        turned_rad: Turn, counter-clockwise.
    """

    driven_m: float
    turned_rad: float


@dataclass(frozen=True)
class GraphTensors:
    """One crop, edges in the order of `edge_ids`.

    Attributes:
        node_kind: Index of each node's embedding.
        edge_index: Row of the source and of the target node of each edge.
        edge_kind: Index of each edge's behaviour in `Behavior`.
        edge_attr: `EDGE_FEATURES` and `MOTION_FEATURES` of each edge, as the preset has them.
        edge_ids: Id of each edge in the map.
    """

    node_kind: Int64[np.ndarray, " nodes"]
    edge_index: Int64[np.ndarray, "2 edges"]
    edge_kind: Int64[np.ndarray, " edges"]
    edge_attr: Float32[np.ndarray, "edges features"]
    edge_ids: tuple[str, ...]


@dataclass(frozen=True)
class GraphBatch:
    """Several crops side by side, as PyTorch Geometric lays them out.

    Attributes:
        node_kind: Index of each node's embedding.
        edge_index: Row of the source and of the target node of each edge, over all graphs.
        edge_kind: Index of each edge's behaviour.
        edge_attr: Features of each edge.
        batch: Graph that each node belongs to.
        edge_batch: Graph that each edge belongs to, ascending.
        graphs: Number of graphs.
    """

    node_kind: Int64[Tensor, " nodes"]
    edge_index: Int64[Tensor, "2 edges"]
    edge_kind: Int64[Tensor, " edges"]
    edge_attr: Float32[Tensor, "edges features"]
    batch: Int64[Tensor, " nodes"]
    edge_batch: Int64[Tensor, " edges"]
    graphs: int


@dataclass(frozen=True)
class _Crop:
    """What does not depend on the plan or on the last location."""

    graph: GraphTensors
    yaw_rad: Float32[np.ndarray, " edges"]
    edge_row: dict[str, int]


def encode_subgraph(
    topological_map: TopologicalMap,
    subgraph: Subgraph,
    plan: Plan | None,
    previous_edge: str | None,
    config: Preset | LocalizationConfig,
    motion: Motion | None = None,
) -> GraphTensors:
    """The crop as the localization network sees it; the same at training and on the robot.

    What does not depend on the plan or the last location is kept with the map.

    Args:
        topological_map: The map.
        subgraph: A crop of it.
        plan: The plan followed, or None to leave it out: training drops it now and then so
            that the network does not trust it blindly.
        previous_edge: The edge last predicted (its source is the crop's centre), or None.
            At the start: the plan's first edge.
        config: The network's configuration, or its preset.
        motion: What the robot did since it came to the previous edge; None for nothing yet.
    """
    if isinstance(config, Preset):
        config = config.localization
    fixed = _fixed_crop(topological_map, subgraph, config)
    if not config.edge_features:
        return fixed.graph
    features = fixed.graph.edge_attr.copy()
    if previous_edge is not None:
        turn_rad = fixed.yaw_rad - topological_map.edge(previous_edge).yaw_rad
        np.sin(turn_rad, out=features[:, _TURN_SINE])
        np.cos(turn_rad, out=features[:, _TURN_SINE + 1])
        row = fixed.edge_row.get(previous_edge)
        if row is not None:
            features[row, _IS_ON_PLAN - 1] = 1.0
    if config.motion_features and motion is not None and previous_edge is not None:
        _write_motion(features, motion, topological_map.edge(previous_edge).length_m)
    if plan is not None:
        _write_plan(features, topological_map, subgraph, plan, previous_edge, fixed.edge_row)
    graph = fixed.graph
    return GraphTensors(
        graph.node_kind, graph.edge_index, graph.edge_kind, features, graph.edge_ids
    )


def edge_feature_count(config: LocalizationConfig) -> int:
    """How many numbers each edge carries beside its behaviour."""
    if not config.edge_features:
        return 0
    return len(EDGE_FEATURES) + (len(MOTION_FEATURES) if config.motion_features else 0)


def _write_motion(
    features: Float32[np.ndarray, "edges features"], motion: Motion, length_m: float
) -> None:
    features[:, len(EDGE_FEATURES) :] = (
        min(motion.driven_m / 5.0, 3.0),
        min(motion.driven_m / max(length_m, 0.5), 3.0),
        math.sin(motion.turned_rad),
        math.cos(motion.turned_rad),
    )


def _write_plan(
    features: Float32[np.ndarray, "edges features"],
    topological_map: TopologicalMap,
    subgraph: Subgraph,
    plan: Plan,
    previous_edge: str | None,
    edge_row: dict[str, int],
) -> None:
    """Mark the plan's edges, and how far ahead of the previous edge each comes."""
    center = subgraph.center
    if previous_edge is not None:
        center = topological_map.edge(previous_edge).source
    here = plan.position(center)
    lowest, highest = _PLAN_ORDERS[0], _PLAN_ORDERS[-1]
    for position, edge_id in enumerate(plan.edges):
        row = edge_row.get(edge_id)
        if row is None:
            continue
        features[row, _IS_ON_PLAN] = 1.0
        if here is not None:
            order = min(max(position - here, lowest), highest)
            features[row, _FIRST_ORDER + order - lowest] = 1.0


def _fixed_crop(
    topological_map: TopologicalMap, subgraph: Subgraph, config: LocalizationConfig
) -> _Crop:
    kept: dict[tuple[Subgraph, int, int], _Crop] = topological_map.__dict__.setdefault(
        "_encoded_crops", {}
    )
    key = (subgraph, config.node_kinds, edge_feature_count(config))
    found = kept.get(key)
    if found is None:
        found = kept[key] = _encode_fixed(topological_map, subgraph, config)
    return found


def _encode_fixed(
    topological_map: TopologicalMap, subgraph: Subgraph, config: LocalizationConfig
) -> _Crop:
    node_row = {node: row for row, node in enumerate(subgraph.nodes)}
    kinds = _NODE_KINDS[config.node_kinds]
    edges = [topological_map.edge(edge) for edge in subgraph.edges]
    columns = edge_feature_count(config)
    features = np.zeros((len(edges), columns), np.float32)
    if columns:
        length_m = np.array([edge.length_m for edge in edges], np.float32)
        features[:, 0] = np.minimum(length_m / 10.0, 3.0)
        features[:, 1] = np.log(np.maximum(length_m, 0.1))
        features[:, 4] = [edge.source == subgraph.center for edge in edges]
    index = np.array(
        [
            [node_row[edge.source] for edge in edges],
            [node_row[edge.target] for edge in edges],
        ],
        np.int64,
    )
    graph = GraphTensors(
        node_kind=np.array(
            [kinds[topological_map.node(node).kind] for node in subgraph.nodes], np.int64
        ),
        edge_index=index.reshape(2, len(edges)),
        edge_kind=np.array([_BEHAVIORS[edge.behavior] for edge in edges], np.int64),
        edge_attr=features,
        edge_ids=subgraph.edges,
    )
    yaw_rad = np.array([edge.yaw_rad for edge in edges], np.float32)
    return _Crop(graph, yaw_rad, {edge: row for row, edge in enumerate(subgraph.edges)})


def mirror_graph(graph: GraphTensors) -> GraphTensors:
    """The crop of the mirrored building: left turns become right turns and back."""
    features = graph.edge_attr
    if features.shape[1]:
        features = features.copy()
        features[:, _TURN_SINE] *= -1.0
        features[:, _TURNED_SINE : _TURNED_SINE + 1] *= -1.0
    return GraphTensors(
        graph.node_kind,
        graph.edge_index,
        _MIRRORED[graph.edge_kind],
        features,
        graph.edge_ids,
    )


def batch_graphs(graphs: Sequence[GraphTensors]) -> GraphBatch:
    """Several crops side by side; a graph's edges stay together and in order."""
    nodes = np.array([len(graph.node_kind) for graph in graphs])
    edges = np.array([len(graph.edge_kind) for graph in graphs])
    number = np.arange(len(graphs))
    edge_batch = np.repeat(number, edges)
    first_node = np.cumsum(nodes) - nodes
    edge_index = np.concatenate([graph.edge_index for graph in graphs], axis=1)
    edge_index = edge_index + first_node[edge_batch]
    return GraphBatch(
        node_kind=torch.from_numpy(np.concatenate([graph.node_kind for graph in graphs])),
        edge_index=torch.from_numpy(edge_index),
        edge_kind=torch.from_numpy(np.concatenate([graph.edge_kind for graph in graphs])),
        edge_attr=torch.from_numpy(np.concatenate([graph.edge_attr for graph in graphs])),
        batch=torch.from_numpy(np.repeat(number, nodes)),
        edge_batch=torch.from_numpy(edge_batch),
        graphs=len(graphs),
    )
