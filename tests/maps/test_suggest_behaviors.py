import math
from dataclasses import replace
from pathlib import Path

import pytest

from tests.maps.small_maps import office_floor
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.formats.canvas import load_area_map
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.suggest_behaviors import suggest_behaviors


def _all_straight(drawn: TopologicalMap) -> TopologicalMap:
    edges = tuple(replace(edge, behavior=Behavior.STRAIGHT) for edge in drawn.edges)
    return replace(drawn, edges=edges)


def _mirrored(drawn: TopologicalMap) -> TopologicalMap:
    return replace(
        drawn,
        nodes=tuple(replace(node, y_m=-node.y_m) for node in drawn.nodes),
        edges=tuple(replace(edge, yaw_rad=-edge.yaw_rad) for edge in drawn.edges),
    )


def test_small_floor_gets_the_behaviors_drawn_by_hand() -> None:
    assert suggest_behaviors(_all_straight(office_floor())) == office_floor()


def test_mirrored_floor_swaps_left_and_right() -> None:
    swapped = {
        Behavior.TURN_LEFT: Behavior.TURN_RIGHT,
        Behavior.TURN_RIGHT: Behavior.TURN_LEFT,
    }
    suggested = suggest_behaviors(_mirrored(office_floor()))
    for drawn, edge in zip(office_floor().edges, suggested.edges, strict=True):
        assert edge.behavior is swapped.get(drawn.behavior, drawn.behavior), edge.id


def test_only_named_edges_change() -> None:
    suggested = suggest_behaviors(_all_straight(office_floor()), ["office_4->office_4_door"])
    assert suggested.edge("office_4->office_4_door").behavior is Behavior.FIND_DOOR
    others = {edge.behavior for edge in suggested.edges if edge.source != "office_4"}
    assert others == {Behavior.STRAIGHT}


def test_unknown_edge_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'office_4->office_4_door'"):
        suggest_behaviors(office_floor(), ["office_4->office_4_dor"])


def test_node_on_top_of_another_is_no_turn() -> None:
    nodes = tuple(Node(name, NodeKind.HALLWAY, 1.0, 1.0) for name in "ab")
    edge = edge_along(nodes[0], nodes[1], Behavior.TURN_LEFT)
    drawn = TopologicalMap("dot", MapFrame(), nodes, (edge,))
    assert suggest_behaviors(drawn).edges[0].behavior is Behavior.CORRIDOR_FOLLOW


def test_bent_corridor_is_followed_and_its_corner_turned() -> None:
    def corridor(bend_rad: float) -> TopologicalMap:
        nodes = (
            Node("a", NodeKind.HALLWAY, -5.0, 0.0),
            Node("b", NodeKind.HALLWAY, 0.0, 0.0),
            Node("c", NodeKind.HALLWAY, math.cos(bend_rad), math.sin(bend_rad)),
        )
        edges = (
            edge_along(nodes[0], nodes[1], Behavior.STRAIGHT),
            edge_along(nodes[1], nodes[2], Behavior.STRAIGHT),
        )
        return suggest_behaviors(TopologicalMap("corridor", MapFrame(), nodes, edges))

    assert corridor(math.radians(30)).edge("b->c").behavior is Behavior.CORRIDOR_FOLLOW
    assert corridor(math.radians(60)).edge("b->c").behavior is Behavior.TURN_LEFT
    assert corridor(math.radians(-60)).edge("b->c").behavior is Behavior.TURN_RIGHT


@pytest.mark.parametrize("area", ["area_1", "area_3", "area_5b", "area_6"])
def test_suggestions_agree_with_the_authors(areas_dir: Path, area: str) -> None:
    drawn = load_area_map(areas_dir / f"{area}.yaml")
    suggested = suggest_behaviors(_all_straight(drawn))
    same = sum(
        one.behavior is other.behavior
        for one, other in zip(drawn.edges, suggested.edges, strict=True)
    )
    assert same / len(drawn.edges) >= 0.965
