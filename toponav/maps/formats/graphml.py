"""Maps as GraphML with typed keys, as networkx, Gephi and yEd read it: lossless both ways."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element
from xml.sax.saxutils import escape, quoteattr

from toponav.core.errors import InputError
from toponav.core.xml_tree import parse_xml
from toponav.maps.elements import MapFrame
from toponav.maps.formats._draft import MapDraft
from toponav.maps.formats._values import Place, is_name
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.spec import TopologicalMap

__all__ = ["map_from_graphml", "map_to_graphml"]

_MOST_ELEMENTS = 400_000
_DEEPEST = 32
_KEYS: tuple[tuple[str, str, str], ...] = (
    ("graph", "name", "string"),
    ("graph", "frame", "string"),
    ("graph", "plan", "string"),
    ("node", "kind", "string"),
    ("node", "x", "double"),
    ("node", "y", "double"),
    ("node", "room", "string"),
    ("node", "size", "double"),
    ("edge", "behavior", "string"),
    ("edge", "yaw", "double"),
    ("edge", "length", "double"),
)
_OURS = {what: frozenset(name for of, name, _ in _KEYS if of == what) for what in ("node", "edge")}
_POSITIONS = (("x", "y"), ("x_m", "y_m"), ("pos_x", "pos_y"), ("posx", "posy"))
_OUTSIDE_XML = re.compile("[\u0000-\u0008\u000b\u000c\u000e-\u001f\ud800-\udfff\ufffe\uffff]")
_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<graphml xmlns="http://graphml.graphdrawing.org/xmlns"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:schemaLocation="http://graphml.graphdrawing.org/xmlns \
http://graphml.graphdrawing.org/xmlns/1.0/graphml.xsd">
"""


def map_to_graphml(topological_map: TopologicalMap) -> tuple[str, ConversionReport]:
    """The GraphML text of a map; `networkx.read_graphml` reads it with its types.

    Raises:
        InputError: If a name holds a character that XML has no way to write.

    Example:
        >>> graph = networkx.read_graphml("office.graphml")  # doctest: +SKIP
        >>> graph.nodes["office_1"]["kind"], graph.nodes["office_1"]["x"]  # doctest: +SKIP
        ('room', 2.0)
    """
    keys = [
        f' <key id="{of}_{name}" for="{of}" attr.name="{name}" attr.type="{kind}"/>\n'
        for of, name, kind in _KEYS
    ]
    frame = topological_map.frame
    of_graph = {"name": topological_map.name, "frame": frame.name, "plan": frame.plan}
    lines = [_HEAD, *keys, ' <graph id="G" edgedefault="directed">\n', _data("graph", of_graph)]
    for node in topological_map.nodes:
        values: dict[str, Any] = {"kind": node.kind.value, "x": node.x_m, "y": node.y_m}
        values |= {"room": node.room, "size": node.size}
        lines.append(f"  <node id={_quoted(node.id)}>\n{_data('node', values)}  </node>\n")
    for edge in topological_map.edges:
        values = {"behavior": edge.behavior.value, "yaw": edge.yaw_rad, "length": edge.length_m}
        ends = f"source={_quoted(edge.source)} target={_quoted(edge.target)}"
        lines.append(f"  <edge id={_quoted(edge.id)} {ends}>\n{_data('edge', values)}  </edge>\n")
    return "".join([*lines, " </graph>\n</graphml>\n"]), ConversionReport()


def map_from_graphml(
    data: bytes, where: str, name: str
) -> tuple[TopologicalMap, ConversionReport]:
    """The map of a GraphML document, and what was dropped or guessed.

    Args:
        data: The document.
        where: The file that it came from, for messages.
        name: Name of the map where the file has none.

    Raises:
        InputError: If it is no GraphML, or a node has no position; names the element.
    """
    element = parse_xml(data, where, max_depth=_DEEPEST, max_elements=_MOST_ELEMENTS)
    root = Place(where)
    if element.tag != "graphml":
        raise root.fault(f"must be a graphml element, got '{element.tag[:60]}'")
    reader = _Reader(root, Notes(), _keys_of(element, root))
    graphs = [child for child in element if child.tag == "graph"]
    if not graphs:
        raise root.fault("must hold a graph")
    reader.notes.dropped("further graphs", "one is read", count=len(graphs) - 1)
    return reader.read(graphs[0], name)


@dataclass(frozen=True)
class _Key:
    name: str
    kind: str


@dataclass
class _Reader:
    root: Place
    notes: Notes
    keys: Mapping[str, _Key]

    def read(self, graph: Element, name: str) -> tuple[TopologicalMap, ConversionReport]:
        values = self.values(graph, self.root.key("graph"), "graph")
        named, frame, plan = values.get("name"), values.get("frame"), values.get("plan")
        draft = MapDraft(
            self.root,
            named if is_name(named) else name,
            MapFrame(frame if is_name(frame) else "map", plan if is_name(plan) else None),
            self.notes,
        )
        for number, element in _numbered(graph, "node"):
            self.add_node(draft, element, self.root.key("node").index(number))
        both_ways = graph.get("edgedefault") == "undirected"
        for number, element in _numbered(graph, "edge"):
            self.add_edge(draft, element, self.root.key("edge").index(number), both_ways)
        for child in graph:
            if child.tag not in ("node", "edge", "data", "desc"):
                self.notes.dropped(f"elements '{child.tag[:40]}'", "our maps have none")
        return draft.finish()

    def add_node(self, draft: MapDraft, element: Element, place: Place) -> None:
        node_id = place.key("id").name(element.get("id"))
        values = self.values(element, place, "node")
        found = [pair for pair in _POSITIONS if all(axis in values for axis in pair)]
        if not found:
            raise place.fault(
                f"node '{node_id}' must have a position, as data with the keys x and y",
                "write the positions in metres as attributes x and y",
            )
        x_m, y_m = (place.key(axis).number(values[axis]) for axis in found[0])
        draft.add_node(place, node_id, x_m, y_m, values)
        if any(child.tag in ("graph", "port") for child in element):
            self.notes.dropped("graphs and ports in nodes", "our nodes have none", node_id)
        if not values.keys() - set(found[0]) <= _OURS["node"]:
            self.notes.dropped("other data of nodes", "our maps have no place for it", node_id)

    def add_edge(self, draft: MapDraft, element: Element, place: Place, both_ways: bool) -> None:
        source, target = (place.key(end).name(element.get(end)) for end in ("source", "target"))
        values = self.values(element, place, "edge")
        if "behaviour" in values:
            values.setdefault("behavior", values.pop("behaviour"))
        edge_id = element.get("id")
        draft.add_edge(place, source, target, edge_id if is_name(edge_id) else None, values)
        if not values.keys() <= _OURS["edge"]:
            self.notes.dropped(
                "other data of edges", "our maps have no place for it", f"{source}->{target}"
            )
        directed = element.get("directed")
        if (directed == "false" or (both_ways and directed != "true")) and source != target:
            back = {key: value for key, value in values.items() if key == "length"}
            draft.add_edge(place, target, source, None, back)
            self.notes.changed("edges without direction", "became two", f"{source}->{target}")

    def values(self, element: Element, place: Place, of: str) -> dict[str, Any]:
        """The data of an element by name."""
        found: dict[str, Any] = {}
        for child in element:
            if child.tag != "data":
                continue
            key = self.keys.get(f"{of} {child.get('key')}") or self.keys.get(
                f"all {child.get('key')}"
            )
            if key is None:
                raise place.fault(f"has data of the unknown key '{str(child.get('key'))[:60]}'")
            if len(child):
                self.notes.dropped("structured data", "such as yEd's drawings is not read")
            elif key.name in found:
                raise place.key(key.name).fault("comes twice")
            else:
                found[key.name] = _typed(child.text or "", key.kind, place.key(key.name))
        return found


def _keys_of(root: Element, place: Place) -> dict[str, _Key]:
    found: dict[str, _Key] = {}
    for number, element in _numbered(root, "key"):
        key_id = place.key("key").index(number).name(element.get("id"))
        name = element.get("attr.name") or key_id
        slot = f"{element.get('for', 'all')} {key_id}"
        if slot in found:
            raise place.key("key").index(number).fault(f"'{key_id}' comes twice")
        found[slot] = _Key(name[:200].lower(), element.get("attr.type", "string"))
    return found


def _typed(text: str, kind: str, place: Place) -> Any:
    if kind in ("int", "long", "float", "double"):
        return place.number(text.strip(), -1e300, 1e300)
    if kind == "boolean":
        return text.strip().lower() in ("true", "1")
    return text


def _numbered(element: Element, tag: str) -> Iterator[tuple[int, Element]]:
    return enumerate(child for child in element if child.tag == tag)


def _data(of: str, values: Mapping[str, Any]) -> str:
    return "".join(
        f'   <data key="{of}_{name}">{escape(_text(value))}</data>\n'
        for name, value in values.items()
        if value is not None
    )


def _quoted(text: str) -> str:
    return quoteattr(_text(text))


def _text(value: Any) -> str:
    text = value if isinstance(value, str) else repr(float(value))
    outside = _OUTSIDE_XML.search(text)
    if outside:
        raise InputError(
            f"XML cannot hold the character U+{ord(outside.group()):04X}",
            where=f"name {text[:60]!r}",
            remedy="rename it, or use another format",
        )
    return text
