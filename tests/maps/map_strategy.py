"""Arbitrary valid maps for property tests: any names, positions, behaviours, parallel edges."""

import math
from typing import Any

from hypothesis import strategies as st

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap

_CONTROL = "".join(map(chr, (*range(32), 127)))
# U+FFFE and U+FFFF are no characters: XML has no way to write them.
_name = st.text(
    st.characters(exclude_categories=("Cs",), exclude_characters=_CONTROL + "\ufffe\uffff"),
    min_size=1,
    max_size=20,
) | st.sampled_from(["null", "true", "1e5", "010", "- a", "a: b", " ", "<&>\"'", "\x85", "\u2028"])
_metres = st.floats(-1e6, 1e6, allow_nan=False)


@st.composite
def map_contents(draw: st.DrawFn) -> dict[str, Any]:
    """What a map is made of; `map_of` makes it, outside, as checks of classes draw numbers."""
    ids = draw(st.lists(_name, min_size=1, max_size=6, unique=True))
    end, room = st.sampled_from(ids), st.none() | _name
    kind, behavior = st.sampled_from(list(NodeKind)), st.sampled_from(list(Behavior))
    node = st.tuples(kind, _metres, _metres, room, st.floats(0.001, 1000.0))
    edge = st.tuples(end, end, behavior, st.floats(-math.pi, math.pi), st.floats(0, 1e6))
    return {
        "name": draw(_name),
        "frame": (draw(_name), draw(room)),
        "nodes": [(node_id, *draw(node)) for node_id in ids],
        "edges": draw(st.dictionaries(_name, edge, max_size=8)),
    }


def map_of(contents: dict[str, Any]) -> TopologicalMap:
    """The map that is made of these."""
    return TopologicalMap(
        contents["name"],
        MapFrame(*contents["frame"]),
        tuple(Node(*node) for node in contents["nodes"]),
        tuple(Edge(edge_id, *edge) for edge_id, edge in contents["edges"].items()),
    )
