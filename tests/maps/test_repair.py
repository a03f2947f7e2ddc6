from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tests.maps.small_maps import CF, FD, TL, TR, S, edge, office_floor, plus, without
from toponav.core.vocabulary import Behavior
from toponav.maps.faults import Building, Rule
from toponav.maps.repair import repair
from toponav.maps.spec import Edge, TopologicalMap
from toponav.maps.validate import validate


def _changed(old: str, **changes) -> TopologicalMap:
    floor = office_floor()
    return plus(without(floor, old), replace(floor.edge(old), **changes))


BROKEN = {
    Rule.YAW_FITS: _changed("hallway_1-0r->hallway_1-1r", yaw_rad=2.0),
    Rule.LENGTH_FITS: _changed("hallway_1-0r->hallway_1-1r", length_m=40.0),
    Rule.FIND_DOOR: _changed("office_4->office_4_door", behavior=S),
    Rule.NO_SELF_LOOP: plus(office_floor(), Edge("x", "office_4", "office_4", FD, 0.0, 1.0)),
    Rule.ONE_EDGE_PER_PAIR: plus(office_floor(), edge("office_4", "office_4_door", FD, id="z")),
    Rule.ENTER_AT_ROOM: plus(office_floor(), edge("hallway_1-1r", "office_4_door", TL)),
    Rule.EXIT_AT_DOOR: plus(office_floor(), edge("office_4", "hallway_1-2r", TL)),
}


@pytest.mark.parametrize("rule", BROKEN)
def test_a_fixable_fault_is_fixed(rule: Rule) -> None:
    faults = validate(BROKEN[rule])
    assert any(fault.rule is rule and fault.fixable for fault in faults)
    repaired = repair(BROKEN[rule])
    assert not repaired.left
    assert rule in {fault.rule for fault in repaired.fixed}


def test_a_missing_find_door_edge_is_added() -> None:
    broken = without(office_floor(), "office_4->office_4_door")
    assert repair(broken).topological_map == office_floor()


def test_a_good_map_stays_as_it_is() -> None:
    repaired = repair(office_floor())
    assert repaired.topological_map is not None
    assert repaired.topological_map == office_floor()
    assert repaired.fixed == ()


def test_a_node_in_a_wall_moves_to_where_the_robot_fits() -> None:
    building = Building(is_free=lambda x, y: not (3.9 < x < 4.2 and y < 0.0))
    repaired = repair(office_floor(), building)
    node = repaired.topological_map.node("hallway_1-1r")
    assert building.is_free is not None
    assert building.is_free(node.x_m, node.y_m)
    assert node.distance_to(office_floor().node("hallway_1-1r")) < 0.5
    assert not repaired.left


def test_what_needs_a_decision_is_left() -> None:
    broken = plus(office_floor(), edge("office_4", "office_4_door", TR, id="z"))
    repaired = repair(broken)
    assert len(repaired.topological_map.edges) >= len(office_floor().edges)
    assert all(not fault.fixable or fault in validate(broken) for fault in repaired.left)


_NODES = [node.id for node in office_floor().nodes]
_EDGES = [one.id for one in office_floor().edges]
_BREAKS = st.one_of(
    st.tuples(st.just("drop"), st.sampled_from(_EDGES + _NODES)),
    st.tuples(st.just("yaw"), st.sampled_from(_EDGES), st.floats(-3.0, 3.0)),
    st.tuples(st.just("length"), st.sampled_from(_EDGES), st.floats(0.0, 50.0)),
    st.tuples(st.just("behavior"), st.sampled_from(_EDGES), st.sampled_from(list(Behavior))),
    st.tuples(
        st.just("add"), st.sampled_from(_NODES), st.sampled_from(_NODES),
        st.sampled_from([CF, FD, TL, TR, S]),
    ),
)  # fmt: skip


def _broken(breaks) -> TopologicalMap:
    made = office_floor()
    for number, (what, *rest) in enumerate(breaks):
        if what == "drop":
            made = without(made, rest[0])
        elif what == "add":
            if {rest[0], rest[1]} <= set(made.node_index):
                made = plus(made, edge(rest[0], rest[1], rest[2], id=f"added {number}"))
        elif rest[0] in made.edge_index:
            field = {"yaw": "yaw_rad", "length": "length_m", "behavior": "behavior"}[what]
            made = plus(made, replace(made.edge(rest[0]), **{field: rest[1]}))
    return made


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(_BREAKS, min_size=1, max_size=5))
@example([("yaw", "hallway_1-2l->office_4", 0.0), ("yaw", "hallway_1-3l->hallway_1-2l", 0.0)])
def test_a_repair_never_makes_a_new_fault(breaks) -> None:
    broken = _broken(breaks)
    before = Counter((fault.rule, fault.element) for fault in validate(broken))
    repaired = repair(broken)
    after = Counter((fault.rule, fault.element) for fault in validate(repaired.topological_map))
    assert not after - before
    assert after == Counter((fault.rule, fault.element) for fault in repaired.left)
    assert sum(after.values()) <= sum(before.values()) - len(repaired.fixed)
    assert repair(repaired.topological_map).fixed == ()
