from dataclasses import replace

from tests.maps.small_maps import FD, TR, edge, office_floor, plus, without
from toponav.core.vocabulary import Behavior
from toponav.maps.agreement import behavior_sequence, compare_maps
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import TopologicalMap

PAIRS = [("office_4", "WC_1"), ("WC_1", "office_41"), ("nowhere", "WC_1")]


def _moved(topological_map: TopologicalMap, name: str, by_m: float) -> TopologicalMap:
    node = topological_map.node(name)
    return plus(topological_map, replace(node, x_m=node.x_m + by_m))


def test_a_map_agrees_with_itself() -> None:
    floor = office_floor()
    agreement = compare_maps(floor, floor, PAIRS)
    assert agreement.door_recall == agreement.door_precision == agreement.same_sequence == 1.0
    assert agreement.nodes_matched == len(floor.nodes)
    assert agreement.edges_same_behavior == len(floor.edges)
    assert (agreement.pairs, agreement.differences) == (2, ())


def test_a_door_a_metre_off_is_neither_found_nor_right() -> None:
    agreement = compare_maps(office_floor(), _moved(office_floor(), "office_4_door", 1.1))
    assert (agreement.doors_drawn, agreement.doors_found, agreement.doors_built) == (3, 2, 3)
    assert agreement.door_precision == 2 / 3


def test_lanes_match_their_own_direction() -> None:
    floor = office_floor()
    agreement = compare_maps(floor, _moved(floor, "hallway_1-2r", 1.5))
    assert agreement.nodes_matched == len(floor.nodes) - 1


def test_a_missing_plan_and_another_behavior_are_differences() -> None:
    floor = office_floor()
    wrong = plus(floor, edge("office_4_door", "hallway_1-1l", Behavior.TURN_LEFT))
    agreement = compare_maps(floor, wrong, PAIRS)
    assert agreement.edges_same_behavior == agreement.edges_matched - 1
    assert [one.goal for one in agreement.differences] == ["WC_1"]
    cut = without(floor, "WC_1_door->hallway_1-0r")
    agreement = compare_maps(floor, cut, PAIRS)
    assert agreement.pairs_planned == 1
    assert agreement.differences[0].built is None
    assert agreement.to_document()["differences"][0]["built"] is None


def test_pairs_through_a_drawn_slip_are_counted() -> None:
    slipped = plus(office_floor(), edge("hallway_1-1r", "hallway_1-2r", FD))
    agreement = compare_maps(slipped, office_floor(), PAIRS)
    assert agreement.pairs_through_fault == 1
    assert agreement.differences[0].through_fault


def test_only_runs_of_corridor_follow_merge() -> None:
    floor = office_floor()
    walk = shortest_plan(floor, "WC_1", "office_41")
    assert behavior_sequence(floor, walk) == (FD, Behavior.CORRIDOR_FOLLOW, Behavior.STRAIGHT)
    twice = plus(
        floor, edge("hallway_1-1r", "hallway_1-2r", TR), edge("hallway_1-0r", "hallway_1-1r", TR)
    )
    assert behavior_sequence(twice, shortest_plan(twice, "WC_1", "office_41"))[2:4] == (TR, TR)
