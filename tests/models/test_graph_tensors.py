import time

import numpy as np
import pytest

from tests.models.graphs import office_map
from toponav.core.vocabulary import Behavior
from toponav.maps.plan import shortest_plan
from toponav.maps.subgraph import crop
from toponav.models.graphnav.graph_tensors import (
    EDGE_FEATURES,
    MOTION_FEATURES,
    Motion,
    batch_graphs,
    encode_subgraph,
    mirror_graph,
)
from toponav.models.graphnav.presets import get_preset

COMPACT, PAPER = get_preset("compact"), get_preset("paper")


def _encode(previous="e1->e2", with_plan=True, preset=COMPACT):
    topological_map = office_map()
    plan = shortest_plan(topological_map, "e0", "office_1") if with_plan else None
    center = topological_map.edge(previous).source if previous else "e1"
    return encode_subgraph(topological_map, crop(topological_map, center), plan, previous, preset)


def _row(graph, edge):
    names = (*EDGE_FEATURES, *MOTION_FEATURES)
    return dict(zip(names, graph.edge_attr[graph.edge_ids.index(edge)], strict=True))


def test_features_say_where_an_edge_leads_and_when():
    graph = _encode()
    turn = _row(graph, "e2->office_1")
    assert np.isclose(turn["turn_sine"], 1.0)
    assert np.isclose(turn["turn_cosine"], 0.0, atol=1e-6)
    assert turn["is_on_plan"] == 1.0
    assert turn["plan_order_+1"] == 1.0
    assert np.isclose(turn["log_length"], np.log(4.0))
    previous = _row(graph, "e1->e2")
    assert previous["is_previous"] == previous["leaves_center"] == 1.0
    assert previous["plan_order_+0"] == 1.0
    assert _row(graph, "e0->e1")["plan_order_-1"] == 1.0
    aside = _row(graph, "e2->e3")
    assert not any(aside[key] for key in EDGE_FEATURES if "plan" in key)


def test_plan_can_be_left_out():
    graph = _encode(with_plan=False)
    assert not graph.edge_attr[:, EDGE_FEATURES.index("is_on_plan") : len(EDGE_FEATURES)].any()
    assert _row(graph, "e1->e2")["is_previous"] == 1.0


def test_without_a_last_edge_only_the_map_speaks():
    graph = _encode(previous=None)
    assert _row(graph, "e1->e2")["leaves_center"] == 1.0
    assert not graph.edge_attr[:, EDGE_FEATURES.index("is_previous")].any()
    assert _row(graph, "e1->e2")["is_on_plan"] == 1.0


def test_paper_sees_kinds_and_behaviors_only():
    graph = _encode(preset=PAPER)
    assert graph.edge_attr.shape[1] == 0
    topological_map = office_map()
    nodes = crop(topological_map, "e1").nodes
    kinds = {node: int(kind) for node, kind in zip(nodes, graph.node_kind, strict=True)}
    assert kinds["office_1"] == kinds["office_1_door"] == 0
    assert kinds["e1"] == 1


def test_mirror_swaps_turns_twice_back():
    graph = _encode()
    mirrored = mirror_graph(graph)
    order = list(Behavior)
    for edge, kind, other in zip(graph.edge_ids, graph.edge_kind, mirrored.edge_kind, strict=True):
        swapped = {"turn_left": "turn_right", "turn_right": "turn_left"}
        assert order[other] == swapped.get(order[kind], order[kind]), edge
    assert _row(mirrored, "e2->office_1")["turn_sine"] == -1.0
    again = mirror_graph(mirrored)
    np.testing.assert_array_equal(again.edge_attr, graph.edge_attr)
    np.testing.assert_array_equal(again.edge_kind, graph.edge_kind)


def test_encoding_leaves_what_is_kept_with_the_map_alone():
    topological_map = office_map()
    plan = shortest_plan(topological_map, "e0", "office_1")
    around = crop(topological_map, "e1")
    first = encode_subgraph(topological_map, around, plan, "e1->e2", COMPACT)
    before = first.edge_attr.copy()
    encode_subgraph(topological_map, around, None, "e2->e3", COMPACT)
    again = encode_subgraph(topological_map, around, plan, "e1->e2", COMPACT.localization)
    np.testing.assert_array_equal(first.edge_attr, before)
    np.testing.assert_array_equal(again.edge_attr, before)


def test_batch_keeps_graphs_apart():
    graphs = [_encode(), _encode("office_1->office_1_door"), _encode("e4->e5")]
    batch = batch_graphs(graphs)
    assert batch.graphs == 3
    assert (batch.batch[batch.edge_index[0]] == batch.edge_batch).all()
    assert (batch.batch[batch.edge_index[1]] == batch.edge_batch).all()
    shift = len(graphs[0].node_kind)
    second = batch.edge_index[:, batch.edge_batch == 1].numpy() - shift
    np.testing.assert_array_equal(second, graphs[1].edge_index)


def test_encoding_is_quick():
    topological_map = office_map()
    plan = shortest_plan(topological_map, "e0", "office_1")
    around = crop(topological_map, "e1")
    times = []
    for _ in range(50):
        began = time.perf_counter()
        encode_subgraph(topological_map, around, plan, "e1->e2", COMPACT)
        times.append(time.perf_counter() - began)
    assert np.median(times[5:]) < 1e-3


def test_motion_stands_on_every_edge_and_mirrors_its_turn():
    topological_map = office_map()
    around = crop(topological_map, "e1")
    motion = Motion(driven_m=2.5, turned_rad=0.5)
    graph = encode_subgraph(topological_map, around, None, "e1->e2", COMPACT, motion)
    for edge in graph.edge_ids:
        assert _row(graph, edge)["driven"] == pytest.approx(0.5)
        assert _row(graph, edge)["turned_sine"] == pytest.approx(np.sin(0.5))
        assert _row(mirror_graph(graph), edge)["turned_sine"] == pytest.approx(-np.sin(0.5))
        assert _row(mirror_graph(graph), edge)["turned_cosine"] == pytest.approx(np.cos(0.5))
