import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from tests.maps.small_maps import CF, FD, NODES, TL, TR, S, edge, office_floor, plus, without
from toponav.core.vocabulary import NodeKind, RoomKind
from toponav.maps.spec import Node, TopologicalMap, map_to_document
from toponav.maps.validate import (
    Building,
    Fault,
    Rule,
    Severity,
    check_file,
    has_errors,
    validate,
    validate_document,
)


def _broken(
    topological_map: TopologicalMap, building: Building | None = None
) -> dict[Rule, Fault]:
    return {fault.rule: fault for fault in validate(topological_map, building)}


def test_a_good_map_has_no_faults() -> None:
    assert validate(office_floor()) == ()


def test_the_papers_rules_come_first_and_are_numbered() -> None:
    assert [rule.paper_number for rule in Rule][:7] == [1, 2, 3, 4, 5, 6, None]


def test_rule_1_two_nodes_in_a_room_are_found() -> None:
    second = Node("office_4_b", NodeKind.ROOM, 5.5, 2.0, "office_4")
    floor = plus(office_floor(), second)
    floor = plus(floor, replace(edge("hallway_1-1r", "office_4", TL), id="b1", target=second.id))
    floor = plus(floor, replace(edge("office_4", "office_4_door", FD), id="b2", source=second.id))
    fault = _broken(floor)[Rule.ONE_NODE_PER_ROOM]
    assert fault.message == "room office_4 has 2 room nodes: office_4, office_4_b"
    assert fault.element == "node office_4"
    assert fault.place_m == (5.0, 2.0)
    assert fault.severity is Severity.ERROR


def test_rule_1_a_room_without_its_node_is_found() -> None:
    fault = _broken(without(office_floor(), "office_4"))[Rule.ONE_NODE_PER_ROOM]
    assert fault.message == "room office_4 has no room node"


def test_rule_1_rooms_of_the_building_that_are_not_drawn_are_warned_of() -> None:
    rooms = {node.room: RoomKind.OFFICE for node in NODES.values()}
    rooms |= {"hallway_1": RoomKind.HALLWAY, "hallway_2": RoomKind.HALLWAY}
    rooms |= {"storage_1": RoomKind.STORAGE, "office_9": RoomKind.OFFICE}
    building = Building(rooms=rooms, rooms_left_out=frozenset({"office_9"}))
    (fault,) = validate(office_floor(), building)
    assert fault.message == "room storage_1 of the building has no node"
    assert fault.severity is Severity.WARNING


def test_rule_2_a_room_without_door_node_is_found() -> None:
    fault = _broken(without(office_floor(), "office_4_door"))[Rule.DOOR_HAS_NODE]
    assert fault.message == "room office_4 has no door node"


def test_rule_3_find_door_elsewhere_is_found() -> None:
    floor = plus(office_floor(), edge("hallway_1-0r", "hallway_1-1r", FD))
    fault = _broken(floor)[Rule.FIND_DOOR]
    assert "find_door leads from hallway_1-0r (hallway of hallway_1)" in fault.message
    assert fault.place_m == (2.0, -0.1)


def test_rule_3_another_behavior_to_the_door_is_found() -> None:
    faults = validate(plus(office_floor(), edge("office_4", "office_4_door", S)))
    assert [fault.rule for fault in faults] == [Rule.FIND_DOOR, Rule.FIND_DOOR]
    assert {fault.fixable for fault in faults} == {True, False}


def test_rule_4_a_missing_lane_is_found() -> None:
    fault = _broken(without(office_floor(), "hallway_1-2l->hallway_1-1l"))[Rule.TWO_LANES]
    assert fault.element == "edge hallway_1-1r->hallway_1-2r"


def test_rule_4_one_lane_for_both_directions_is_found() -> None:
    floor = plus(office_floor(), edge("hallway_1-1r", "hallway_1-0r", CF))
    fault = _broken(floor)[Rule.TWO_LANES]
    assert "hallway_1-0r and hallway_1-1r serve both directions" in fault.message
    assert fault.severity is Severity.ERROR


def test_rule_5_entering_at_a_door_node_is_found() -> None:
    floor = plus(office_floor(), edge("hallway_1-1r", "office_4_door", TL))
    fault = _broken(floor)[Rule.ENTER_AT_ROOM]
    assert fault.message == "it enters room office_4 at the door node office_4_door"


def test_rule_6_leaving_from_the_room_node_is_found() -> None:
    floor = plus(office_floor(), edge("office_4", "hallway_1-2r", TL))
    fault = _broken(floor)[Rule.EXIT_AT_DOOR]
    assert fault.element == "edge office_4->hallway_1-2r"


@pytest.mark.parametrize(
    ("change", "rule", "severity"),
    [
        (edge("hallway_1-1r", "hallway_1-1r", CF), Rule.NO_SELF_LOOP, Severity.ERROR),
        (edge("office_4", "office_4_door", FD, id="zz"), Rule.ONE_EDGE_PER_PAIR, Severity.ERROR),
        (edge("hallway_1-1r", "office_4", TL, length_m=0.0), Rule.POSITIVE_LENGTH, Severity.ERROR),
        (edge("hallway_1-1r", "office_4", TL, length_m=0.5), Rule.LENGTH_FITS, Severity.WARNING),
        (edge("hallway_1-1r", "office_4", TL, length_m=50.0), Rule.LENGTH_FITS, Severity.WARNING),
        (edge("hallway_1-1r", "office_4", TL, yaw_rad=3.0), Rule.YAW_FITS, Severity.ERROR),
        (edge("hallway_1-1r", "office_4", TR), Rule.BEHAVIOR_FITS, Severity.WARNING),
        (edge("hallway_1-2l", "office_4", TL), Rule.BEHAVIOR_FITS, Severity.WARNING),
    ],
)
def test_a_bad_edge_is_found(change, rule, severity) -> None:
    fault = _broken(plus(office_floor(), change))[rule]
    assert fault.severity is severity
    assert fault.element == f"edge {change.id}"
    assert fault.remedy


def test_a_room_that_cannot_be_reached_is_found() -> None:
    floor = without(office_floor(), "hallway_1-1r->office_4", "hallway_1-2l->office_4")
    fault = _broken(floor)[Rule.REACHABLE]
    assert fault.message == "it cannot be reached from the main part of the map"


def test_a_room_that_cannot_be_left_is_found() -> None:
    floor = without(office_floor(), "office_4_door->hallway_1-2r", "office_4_door->hallway_1-1l")
    faults = _broken(floor)
    assert faults[Rule.REACHABLE].message == "it cannot be left to the main part of the map"
    assert faults[Rule.CONNECTED].element == "node office_4_door"


def test_a_corridor_may_end_where_its_drawing_does() -> None:
    floor = without(office_floor(), "WC_1", "WC_1_door")
    assert not floor.in_edges("hallway_1-0r")
    assert not floor.out_edges("hallway_1-0l")
    assert validate(floor) == ()
    fault = _broken(without(floor, "hallway_1-0l", "hallway_1-1l"))[Rule.CONNECTED]
    assert fault.element == "node hallway_1-0r"
    assert fault.message == "no edge reaches it"


def test_a_node_without_edges_is_found() -> None:
    alone = Node("hallway_9-1l", NodeKind.HALLWAY, 3.0, 9.0, "hallway_9")
    fault = _broken(plus(office_floor(), alone))[Rule.CONNECTED]
    assert fault.message == "no edge reaches or leaves it"


def test_places_are_checked_against_the_building() -> None:
    rooms = {name: RoomKind.OFFICE for name in ("office_4", "office_41", "WC_1", "hallway_1")}
    building = Building(
        rooms=rooms,
        room_at=lambda x_m, y_m: "office_4" if y_m > 1.6 else "hallway_1",
        is_free=lambda x_m, y_m: x_m < 11.9,
    )
    faults = {(fault.rule, fault.element): fault for fault in validate(office_floor(), building)}
    assert (Rule.IN_FREE_SPACE, "node office_41") in faults
    assert faults[Rule.IN_ITS_ROOM, "node office_41"].severity is Severity.ERROR
    assert faults[Rule.IN_ITS_ROOM, "node office_4_door"].severity is Severity.WARNING
    assert (Rule.IN_ITS_ROOM, "node office_4") not in faults


def test_a_room_that_the_building_lacks_is_found() -> None:
    building = Building(rooms={"hallway_1": RoomKind.HALLWAY, "office_41": RoomKind.OFFICE})
    elements = {fault.element for fault in validate(office_floor(), building)}
    assert {"node office_4", "node WC_1"} <= elements
    assert "node office_41" not in elements


def test_all_faults_of_a_file_are_reported_at_once(tmp_path: Path) -> None:
    document = map_to_document(plus(office_floor(), edge("office_4", "hallway_1-2r", TL)))
    document["nodes"].append(document["nodes"][0] | {"x": 3.0})
    document["edges"].append(document["edges"][0] | {"target": "nowhere", "id": "lost"})
    document["edges"].append(document["edges"][0])
    path = tmp_path / "broken.topo.json"
    path.write_text(json.dumps(document))
    loaded, faults = check_file(path)
    assert loaded is None
    assert {fault.rule for fault in faults if fault.severity is Severity.ERROR} == {
        Rule.EXIT_AT_DOOR,
        Rule.UNIQUE_ID,
        Rule.EDGE_HAS_NODES,
    }
    assert [fault.rule for fault in faults].count(Rule.UNIQUE_ID) == 2
    assert has_errors(faults)


def test_breaches_of_the_schema_are_all_reported() -> None:
    document = map_to_document(office_floor())
    document["nodes"][0]["x"] = "far"
    document["edges"][3]["behavior"] = "jump"
    loaded, faults = validate_document(document)
    assert loaded is None
    assert [fault.rule for fault in faults] == [Rule.DOCUMENT, Rule.DOCUMENT]
    assert "nodes[0]" in faults[0].element
    assert "edges[3]" in faults[1].element


def test_a_file_without_faults_gives_its_map(tmp_path: Path) -> None:
    loaded, faults = validate_document(map_to_document(office_floor()))
    assert loaded == office_floor()
    assert faults == ()
    assert not has_errors(faults)


def test_a_map_without_nodes_has_no_faults() -> None:
    assert validate(replace(office_floor(), nodes=(), edges=())) == ()


def test_a_fault_is_json() -> None:
    fault = next(iter(validate(without(office_floor(), "office_4_door"))))
    document = json.loads(json.dumps(fault.to_document()))
    assert document["rule"] == "door-has-node"
    assert document["place"] == [5.0, 2.0]
    assert math.isfinite(document["place"][0])
