"""The plain checks of nodes and edges let pass what the JSON Schema lets pass, and no more."""

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from toponav.maps.schema import map_schema, map_schema_faults

_values = (
    st.sampled_from(["room", "straight", "a", "", "a" * 200, "a" * 201, "\x1f", "\x7f", "\x85"])
    | st.sampled_from([None, True, 0, 1, -1, 6.3, 6.31, -6.31, 0.001, 0.0009, 1e6, 1000, 1e7])
    | st.sampled_from([[], {}, 10**30])
)
_KEYS = ["id", "kind", "x", "y", "room", "size", "source", "target", "behavior", "yaw", "length"]
_NODE = {"id": "a", "kind": "room", "x": 1, "y": 2.5, "room": None, "size": 1}
_EDGE = {"id": "a", "source": "b", "target": "c", "behavior": "straight", "yaw": 0, "length": 1}
_changes = st.dictionaries(st.sampled_from([*_KEYS, "extra"]), _values, max_size=3)


def _document(nodes: list[Any], edges: list[Any]) -> dict[str, Any]:
    frame = {"name": "map"}
    return {"version": 1, "name": "a", "frame": frame, "nodes": nodes, "edges": edges}


@settings(max_examples=120, deadline=None)
@given(
    changes=_changes, left_out=st.sets(st.sampled_from(_KEYS), max_size=1), is_node=st.booleans()
)
def test_elements_pass_if_the_schema_lets_them(
    changes: dict[str, Any], left_out: set[str], is_node: bool
) -> None:
    element = {**(_NODE if is_node else _EDGE), **changes}
    element = {key: value for key, value in element.items() if key not in left_out}
    document = _document([element], []) if is_node else _document([], [element])
    expected = list(Draft202012Validator(map_schema()).iter_errors(document))
    assert bool(map_schema_faults(document)) == bool(expected)


def test_only_the_first_thousand_broken_elements_are_told() -> None:
    faults = map_schema_faults(_document([0] * 5000, []))
    assert len(faults) == 1000
    assert faults[0][0] == "(nodes[0])"


def test_too_many_elements_are_refused_at_once() -> None:
    faults = map_schema_faults(_document([0] * 100_001, []))
    assert faults == [("nodes", "maxItems is 100000, got a list of 100001")]
