import json
import math
import os
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.maps.map_strategy import map_contents, map_of
from tests.maps.small_maps import NODES, office_floor
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.schema import map_schema, map_schema_faults
from toponav.maps.spec import (
    Edge,
    MapFrame,
    Node,
    TopologicalMap,
    edge_along,
    load_map,
    map_from_document,
    map_to_document,
    save_map,
)


@settings(max_examples=40, deadline=None)
@given(contents=map_contents())
def test_a_saved_map_loads_as_it_was(contents: dict[str, Any], tmp_path_factory) -> None:
    original = map_of(contents)
    path = tmp_path_factory.mktemp("maps") / "map.topo.json"
    save_map(original, path)
    first = path.read_bytes()
    loaded = load_map(path)
    assert loaded == original
    assert hash(loaded) == hash(original)
    save_map(loaded, path)
    assert path.read_bytes() == first


def test_order_of_drawing_does_not_matter(tmp_path: Path) -> None:
    floor = office_floor()
    shuffled = replace(floor, nodes=floor.nodes[::-1], edges=floor.edges[::-1])
    assert shuffled == floor
    assert pickle.loads(pickle.dumps(floor)) == floor


def test_a_map_answers_by_name() -> None:
    floor = office_floor()
    assert floor.node("office_4") is NODES["office_4"]
    assert {edge.target for edge in floor.out_edges("hallway_1-1r")} == {
        "hallway_1-2r",
        "office_4",
    }
    assert {edge.source for edge in floor.in_edges("office_4")} == {"hallway_1-1r", "hallway_1-2l"}
    assert floor.neighbors("office_4_door") == {"office_4", "hallway_1-2r", "hallway_1-1l"}
    assert floor.edge("office_4->office_4_door") is floor.edge_between("office_4", "office_4_door")
    assert floor.edge_between("office_4_door", "office_4") is None
    assert "office_4" in floor
    assert "office_5" not in floor
    assert [node.id for node in floor.rooms["office_4"]] == ["office_4", "office_4_door"]
    assert floor.positions_m.shape == (14, 2)
    graph = floor.to_networkx()
    assert (len(graph), graph.size()) == (len(floor.nodes), len(floor.edges))


@pytest.mark.parametrize("method", ["node", "out_edges", "in_edges", "neighbors", "edge"])
def test_an_unknown_name_is_answered_with_the_nearest(method: str) -> None:
    name = "office_4->office_4_dor" if method == "edge" else "ofice_4"
    with pytest.raises(InputError, match="did you mean 'office_4"):
        getattr(office_floor(), method)(name)


def test_an_edge_points_from_its_source_to_its_target() -> None:
    edge = edge_along(NODES["office_4"], NODES["office_4_door"], Behavior.FIND_DOOR)
    assert edge.yaw_rad == pytest.approx(-math.pi / 2)
    assert edge.length_m == pytest.approx(0.5)


def test_defaults_of_a_document_come_from_its_geometry() -> None:
    document = map_to_document(office_floor())
    for edge in document["edges"]:
        del edge["yaw"], edge["length"]
    for node in document["nodes"]:
        del node["size"]
    assert map_from_document(document) == office_floor()


@pytest.mark.parametrize(
    ("nodes", "edges", "message"),
    [
        (("a", "a"), (), "node 'a' comes twice"),
        (("a", "b"), (("e", "a", "b"), ("e", "b", "a")), "edge 'e' comes twice"),
        (("a",), (("e", "a", "z"),), "edge 'e' has no target 'z'"),
        (("a",), (("e", "z", "a"),), "edge 'e' has no source 'z'"),
    ],
)
def test_a_map_that_is_no_graph_is_refused(nodes, edges, message) -> None:
    with pytest.raises(InputError, match=message):
        TopologicalMap(
            "broken",
            MapFrame(),
            tuple(Node(name, NodeKind.HALLWAY, 0.0, 0.0) for name in nodes),
            tuple(Edge(*ends, Behavior.STRAIGHT, 0.0, 1.0) for ends in edges),
        )


@pytest.mark.parametrize(
    "change", [{"x_m": math.nan}, {"y_m": math.inf}, {"size": 0.0}, {"size": math.nan}]
)
def test_a_node_with_a_bad_number_is_refused(change: dict[str, float]) -> None:
    node = replace(Node("a", NodeKind.HALLWAY, 0.0, 0.0), **change)
    with pytest.raises(InputError, match="node 'a' must have a"):
        TopologicalMap("broken", MapFrame(), (node,), ())


def test_a_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch) -> None:
    path = save_map(office_floor(), tmp_path / "map.topo.json")
    before = path.read_bytes()

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(InputError, match="No space left on device"):
        save_map(replace(office_floor(), name="other"), path)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["map.topo.json"]


def test_the_schema_is_a_schema_and_a_map_follows_it() -> None:
    from jsonschema import Draft202012Validator

    Draft202012Validator.check_schema(map_schema())
    assert map_schema_faults(map_to_document(office_floor())) == []


def _document(**changes: object) -> str:
    return json.dumps(map_to_document(office_floor()) | changes)


_NODE = {"id": "a", "kind": "room", "x": 0, "y": 0}
_EDGE = {"id": "e", "source": "a", "target": "a", "behavior": "straight"}

HOSTILE = {
    "empty": ("", "not JSON"),
    "cut": (_document()[:300], "not JSON: .* line"),
    "list": ("[]", "a topological map is a JSON object, got list"),
    "deep": ("[" * 200_000 + "]" * 200_000, "nested too deep"),
    "nan": (_document().replace("5.0", "NaN", 1), "must be finite, got NaN"),
    "infinity": (_document().replace("5.0", "-Infinity", 1), "must be finite, got -Infinity"),
    "overflow": (_document().replace("5.0", "1e999", 1), "must be finite, got 1e999"),
    "huge integer": (_document().replace("5.0", "9" * 400, 1), "must fit 64 bits"),
    "endless integer": (_document().replace("5.0", "9" * 9000, 1), "one of 9000 digits"),
    "repeated key": ('{"version": 1, "version": 1}', "'version' comes twice"),
    "surrogate": (_document(name="\ud800"), "lone surrogate"),
    "no version": ("{}", "version: missing; this package reads version 1"),
    "future": (_document(version=2), "reads version 1, got 2: upgrade toponav"),
    "odd version": (_document(version=True), "reads version 1, got True"),
    "canvas": ('{"oval": [], "text": [], "line": []}', "toponav map build AREA.yaml"),
    "unknown key": (_document(colour=1), "document: unknown key 'colour'"),
    "nodes object": (_document(nodes={}), "nodes: must be of type array"),
    "node text": (_document(nodes=["a"]), r"\(nodes\[0\]\): must be of type object, got 'a'"),
    "missing": (_document(nodes=[{"id": "a"}]), r"node 'a' \(nodes\[0\]\): must have kind, x, y"),
    "x text": (_document(nodes=[_NODE | {"x": "1"}]), r"\.x: must be of type number, got '1'"),
    "x bool": (_document(nodes=[_NODE | {"x": True}]), r"\.x: must be of type number, got True"),
    "far away": (_document(nodes=[_NODE | {"x": 1e9}]), r"\.x: maximum is 1000000"),
    "no size": (_document(nodes=[_NODE | {"size": 0}]), r"\.size: minimum is 0.001, got 0"),
    "empty id": (_document(nodes=[_NODE | {"id": ""}]), r"\.id: must not be empty"),
    "newline": (_document(nodes=[_NODE | {"id": "a\n"}]), "must not hold control characters"),
    "kind": (_document(nodes=[_NODE | {"kind": "roof"}]), "did you mean 'room'"),
    "behavior": (
        _document(nodes=[_NODE], edges=[_EDGE | {"behavior": "turn_lft"}]),
        r"edge 'e' \(edges\[0\]\)\.behavior: must be one of .* did you mean 'turn_left'",
    ),
    "negative": (_document(nodes=[_NODE], edges=[_EDGE | {"length": -1}]), "minimum is 0"),
    "duplicate": (_document(nodes=[_NODE, _NODE], edges=[]), "node 'a' comes twice"),
    "dangling": (
        _document(nodes=[_NODE], edges=[_EDGE | {"target": "b"}]),
        "edge 'e' has no target 'b'",
    ),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_file_gives_one_clear_error(case: str, tmp_path: Path) -> None:
    text, message = HOSTILE[case]
    path = tmp_path / "map.topo.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_map(path)
    assert str(caught.value).startswith(str(path))
    assert "Remedy: " in str(caught.value)
    assert len(str(caught.value)) < 1500


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    binary = tmp_path / "binary.json"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8 at byte 0"):
        load_map(binary)
    with pytest.raises(InputError, match="no such file"):
        load_map(tmp_path / "absent.json")
    with pytest.raises(InputError, match="not a file"):
        load_map(tmp_path)
    large = tmp_path / "large.json"
    with large.open("wb") as file:
        file.truncate(65 * 1024 * 1024)
    with pytest.raises(InputError, match="the file has 68,157,440"):
        load_map(large)


@settings(max_examples=50, deadline=None)
@given(
    junk=st.recursive(
        st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
        max_leaves=8,
    ),
    key=st.sampled_from(["version", "name", "frame", "nodes", "edges"]),
    deeper=st.booleans(),
)
def test_any_junk_is_refused_with_an_input_error_or_loads(junk, key, deeper) -> None:
    from toponav.maps.validate import validate_document

    document = map_to_document(office_floor())
    if deeper and isinstance(document[key], list):
        document[key][0] = junk
    else:
        document[key] = junk
    validate_document(document)
