"""The map of panoramas: nodes, edges, ghosts, storage."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.maps.image_graph import GhostNode, ImageGraph


def _graph() -> ImageGraph:
    graph = ImageGraph()
    picture = np.arange(8 * 32 * 3, dtype=np.uint8).reshape(8, 32, 3)
    for number, pose in enumerate([(0, 0, 0), (3, 0, 0), (3, 3, math.pi / 2), (9, 9, 0)]):
        graph.add_node(Pose2(*map(float, pose)), number * 10, picture if number == 0 else None)
    graph.add_edge(0, 1)
    graph.add_edge(1, 2)
    graph.ghosts += [GhostNode(2, 3), GhostNode(0, 6, 2.0, 0.25)]
    return graph


def test_shortest_path_follows_the_edges() -> None:
    graph = _graph()
    assert graph.shortest_path(0, 2) == [0, 1, 2]
    assert graph.distances_m(0)[0][2] == pytest.approx(6.0)
    assert graph.shortest_path(0, 3) == []


def test_edges_are_kept_once_in_either_direction() -> None:
    graph = _graph()
    graph.add_edge(1, 0)
    graph.add_edge(2, 2)
    assert len(graph.edges) == 2
    assert sorted(graph.neighbours(1)) == [(0, 3.0), (2, 3.0)]


def test_ghosts_lie_in_their_direction_from_the_node() -> None:
    graph = _graph()
    place = graph.pose_of_ghost(graph.ghosts[0])
    assert (place.x_m, place.y_m) == pytest.approx((0.0, 3.0))
    patch = graph.patch_of_ghost(graph.ghosts[1])
    assert patch is not None
    assert patch.shape[0] == 8


def test_saved_graph_loads_the_same(tmp_path) -> None:  # type: ignore[no-untyped-def]
    graph = _graph()
    graph.save(tmp_path)
    loaded = ImageGraph.load(tmp_path)
    assert [node.pose for node in loaded.nodes] == [node.pose for node in graph.nodes]
    assert loaded.edges == graph.edges
    assert loaded.ghosts == graph.ghosts
    assert np.array_equal(loaded.nodes[0].panorama, graph.nodes[0].panorama)
    assert len(loaded.draw().axes) == 1


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("schema", 7),
        ("nodes", {}),
        ("nodes", [{"pose": [0, 0], "step": 0, "panorama": None}]),
        ("nodes", [{"pose": [0, 0, 0], "step": 0, "panorama": "../secret.png"}]),
        ("edges", [{"source": 0, "target": 99, "relative": [0, 0, 0]}]),
        ("ghosts", [{"node": 0, "direction": 12, "distance_m": 1.0, "score": None}]),
        ("ghosts", [{}]),
    ],
)
def test_broken_graphs_are_refused(tmp_path, part, value) -> None:  # type: ignore[no-untyped-def]
    _graph().save(tmp_path)
    document = json.loads((tmp_path / "graph.json").read_text())
    document[part] = value
    (tmp_path / "graph.json").write_text(json.dumps(document))
    with pytest.raises(InputError):
        ImageGraph.load(tmp_path)


def test_nodes_near_a_place_are_found_nearest_first() -> None:
    graph = ImageGraph()
    for number in range(60):
        graph.add_node(Pose2(3.0 * number - 90.0, -0.5 * number, 0.0), 0)
    here = Pose2(2.0, -15.2, 0.0)
    for reach_m in (0.5, 3.9, 9.0):
        everywhere = sorted((here.distance_to(node.pose), node.number) for node in graph.nodes)
        assert graph.nodes_near(here, reach_m) == [one for one in everywhere if one[0] < reach_m]


def test_a_ghost_lies_at_its_bearing_and_keeps_it(tmp_path: Path) -> None:
    graph = ImageGraph()
    graph.add_node(Pose2(1.0, 0.0, 0.0), 0)
    graph.ghosts.append(GhostNode(0, 3, 2.0, bearing_rad=1.4))
    graph.save(tmp_path / "graph")
    (ghost,) = ImageGraph.load(tmp_path / "graph").ghosts
    place = graph.pose_of_ghost(ghost)
    assert (place.x_m, place.y_m) == pytest.approx((1 + 2 * math.cos(1.4), 2 * math.sin(1.4)))
