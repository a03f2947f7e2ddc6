import networkx as nx
import pytest

from tests.maps.small_maps import CF, NODES, edge, office_floor, plus, without
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, Difficulty, NodeKind
from toponav.maps.plan import Plan, plans_for, shortest_plan, shortest_plans
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.task import NavigationTask


def test_a_plan_names_nodes_and_behaviors() -> None:
    floor = office_floor()
    plan = shortest_plan(floor, "office_4", "office_41")
    assert plan.nodes == (
        "office_4", "office_4_door", "hallway_1-2r", "hallway_1-3r", "office_41",
    )  # fmt: skip
    assert plan.behaviors(floor) == (
        Behavior.FIND_DOOR, Behavior.TURN_LEFT, Behavior.CORRIDOR_FOLLOW, Behavior.STRAIGHT,
    )  # fmt: skip
    expected = sum(
        NODES[a].distance_to(NODES[b]) for a, b in zip(plan.nodes, plan.nodes[1:], strict=False)
    )
    assert plan.length_m(floor) == pytest.approx(expected)
    assert plan.difficulty is Difficulty.I
    task = NavigationTask(floor, plan)
    assert (task.start_node, task.goal_node) == ("office_4", "office_41")


def test_a_plan_has_the_fewest_edges_and_then_the_fewest_metres() -> None:
    names = {"a": (0.0, 0.0), "b": (5.0, 50.0), "c": (5.0, 1.0), "d": (10.0, 0.0), "e": (9.0, 0.0)}
    nodes = {name: Node(name, NodeKind.HALLWAY, *xy) for name, xy in names.items()}
    pairs = [("a", "b"), ("b", "d"), ("a", "c"), ("c", "d"), ("c", "e"), ("e", "d")]
    edges = tuple(edge_along(nodes[s], nodes[t], CF) for s, t in pairs)
    two_ways = TopologicalMap("ways", MapFrame(), tuple(nodes.values()), edges)
    assert shortest_plan(two_ways, "a", "d").nodes == ("a", "c", "d")
    long_way = TopologicalMap(
        "ways", MapFrame(), tuple(nodes.values()), tuple(e for e in edges if e.id != "c->d")
    )
    assert shortest_plan(long_way, "a", "d").nodes == ("a", "b", "d")


def test_plans_have_as_few_edges_as_breadth_first_search_finds() -> None:
    floor = office_floor()
    lengths = dict(nx.all_pairs_shortest_path_length(floor.to_networkx()))
    for start in NODES:
        for goal in NODES:
            plan = shortest_plan(floor, start, goal)
            assert len(plan.edges) == lengths[start][goal]
            for name, source, target in zip(plan.edges, plan.nodes, plan.nodes[1:], strict=False):
                assert (floor.edge(name).source, floor.edge(name).target) == (source, target)


def test_a_plan_that_starts_at_its_goal_has_no_edges() -> None:
    plan = shortest_plan(office_floor(), "WC_1", "WC_1")
    assert plan == Plan(("WC_1",), ())
    assert plan.edge_from("WC_1") is None
    assert plan.completion("WC_1") == 1.0


def test_a_plan_answers_where_a_node_is() -> None:
    plan = shortest_plan(office_floor(), "office_4", "office_41")
    assert plan.edge_from("office_4_door") == "office_4_door->hallway_1-2r"
    assert plan.edge_from("office_41") is None
    assert plan.edge_from("WC_1") is None
    assert plan.position("hallway_1-2r") == 2
    assert plan.position("WC_1") is None
    assert "hallway_1-2r" in plan
    assert plan.completion("office_4") == pytest.approx(0.2)
    assert plan.completion("WC_1") == 0.0
    assert plan.completion(None) == 0.0


def test_a_node_that_is_not_there_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"no node 'office_14'.*did you mean 'office_"):
        shortest_plan(office_floor(), "office_14", "WC_1")
    with pytest.raises(InputError, match=r"no node 'wc_1'.*did you mean 'WC_1'"):
        shortest_plan(office_floor(), "office_4", "wc_1")


@pytest.mark.parametrize(
    ("removed", "start", "goal", "remedy"),
    [
        (("office_4->office_4_door",), "office_4", "WC_1", "no edge leaves 'office_4'"),
        (("hallway_1-0l->WC_1",), "office_4", "WC_1", "no edge reaches 'WC_1'"),
        (("hallway_1-2l->hallway_1-1l", "office_4_door->hallway_1-1l"), "office_4", "WC_1",
         "'office_4' leads to "),
    ],
)  # fmt: skip
def test_a_goal_without_a_way_is_said_so(removed, start, goal, remedy) -> None:
    with pytest.raises(InputError, match=remedy) as caught:
        shortest_plan(without(office_floor(), *removed), start, goal)
    assert f"no sequence of edges leads from '{start}' to '{goal}'" in str(caught.value)


def test_pairs_without_a_plan_are_listed() -> None:
    pairs = [("office_4", "WC_1"), ("office_29", "WC_1"), ("WC_1", "office_41")]
    plans, reasons = plans_for(office_floor(), pairs)
    assert sorted(plans) == [0, 2]
    assert reasons == {1: "there is no node 'office_29'"}


def test_other_plans_come_in_order_of_length() -> None:
    floor = plus(office_floor(), edge("hallway_1-1r", "hallway_1-3r", CF))
    plans = shortest_plans(floor, "WC_1", "office_41", 3)
    assert [len(plan.nodes) for plan in plans] == [6, 7, 9]
    assert plans[0] == shortest_plan(floor, "WC_1", "office_41")


def test_a_plan_whose_numbers_do_not_fit_is_refused() -> None:
    for nodes, edges in (((), ()), (("a",), ("e",)), (("a", "b"), ())):
        with pytest.raises(InputError, match="one edge fewer than nodes"):
            Plan(nodes, edges)


def test_three_areas_have_all_their_plans_and_one_lacks_25(areas_dir) -> None:
    import json

    from toponav.maps.formats.canvas import load_area_map

    counts = {}
    for area in ("1", "3", "5b", "6"):
        pairs = json.loads((areas_dir / f"area_{area}_plans.json").read_text())
        names = [(pair["start_room"], pair["end_room"]) for pair in pairs]
        plans, reasons = plans_for(load_area_map(areas_dir / f"area_{area}.yaml"), names)
        counts[area] = (len(plans), len(reasons))
    assert counts == {"1": (100, 0), "3": (100, 0), "5b": (75, 25), "6": (100, 0)}
