import networkx as nx
import pytest

from tests.maps.small_maps import NODES, office_floor
from toponav.core.errors import InputError
from toponav.maps.subgraph import crop


@pytest.mark.parametrize("center", NODES)
@pytest.mark.parametrize(("ahead", "behind"), [(3, 2), (1, 0), (0, 2), (0, 0)])
def test_a_crop_holds_what_is_near_enough_and_every_edge_between(center, ahead, behind) -> None:
    floor = office_floor()
    graph = floor.to_networkx()
    forward = nx.single_source_shortest_path_length(graph, center, cutoff=ahead)
    backward = nx.single_source_shortest_path_length(graph.reverse(), center, cutoff=behind)
    part = crop(floor, center, ahead, behind)
    assert set(part.nodes) == set(forward) | set(backward)
    assert len(part.nodes) == len(set(part.nodes))
    assert part.center == part.nodes[0] == center
    inside = graph.subgraph(part.nodes).edges
    assert {(floor.edge(e).source, floor.edge(e).target) for e in part.edges} == set(inside)
    assert list(part.edges) == sorted(part.edges)
    distances = [forward[node] for node in part.nodes if node in forward]
    assert distances == sorted(distances)


def test_a_crop_is_kept() -> None:
    floor = office_floor()
    assert crop(floor, "office_4") is crop(floor, "office_4", 3, 2)
    assert crop(floor, "office_4") == crop(office_floor(), "office_4")


def test_a_crop_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'office_4'"):
        crop(office_floor(), "offce_4")
