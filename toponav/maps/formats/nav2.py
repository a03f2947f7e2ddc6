"""Route graphs of Nav2's route server, in GeoJSON: lossless both ways."""

import json
from collections.abc import Mapping
from typing import Any

from toponav.core.errors import InputError
from toponav.maps.elements import Edge, MapFrame, Node
from toponav.maps.formats._draft import MapDraft
from toponav.maps.formats._values import Place, is_name
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.spec import TopologicalMap

__all__ = ["map_from_nav2", "map_to_nav2"]

_LARGEST_ID = 65_535
_LARGEST_READ_ID = 2**32 - 1
_OURS_OF_NODES = frozenset({"name", "kind", "room", "size"})
_OURS_OF_EDGES = frozenset({"name", "behavior", "yaw", "length"})
_LINES = ("LineString", "MultiLineString")


def map_to_nav2(topological_map: TopologicalMap) -> tuple[str, ConversionReport]:
    """The GeoJSON text of a map, and what Nav2 will not like about it.

    Ids are numbers from 0, first nodes, then edges; names, kinds, rooms, sizes, behaviours, yaws
    and lengths are metadata, and nothing is null, as the route server needs it.

    Raises:
        InputError: If it has more nodes and edges than Nav2's messages have ids.

    Reference:
        https://docs.nav2.org/configuration/packages/configuring-route-server.html
    """
    nodes, edges = topological_map.nodes, topological_map.edges
    if len(nodes) + len(edges) > _LARGEST_ID + 1:
        raise InputError(
            f"Nav2 has ids for {_LARGEST_ID + 1:,} nodes and edges, "
            f"the map has {len(nodes) + len(edges):,}",
            where=f"map '{topological_map.name}'",
            remedy="export a part of the map",
        )
    notes = Notes()
    if not nodes or not edges:
        notes.changed("the graph", "Nav2 refuses one without nodes or without edges")
    frame = topological_map.frame
    ours: dict[str, Any] = {"version": 1, "frame": frame.name}
    if frame.plan is not None:
        ours["plan"] = frame.plan
    features = [
        *(_node_feature(number, node, frame.name) for number, node in enumerate(nodes)),
        *(
            _edge_feature(number, edge, topological_map)
            for number, edge in enumerate(edges, start=len(nodes))
        ),
    ]
    lines = ",\n".join(f"  {_compact(feature)}" for feature in features)
    text = (
        '{\n"type": "FeatureCollection",\n'
        f'"name": {_compact(topological_map.name)},\n'
        f'"toponav": {_compact(ours)},\n'
        '"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}},\n'
        f'"features": [\n{lines}\n]\n}}\n'
    )
    return text, notes.report()


def map_from_nav2(document: Any, where: str, name: str) -> tuple[TopologicalMap, ConversionReport]:
    """The map of a route graph, and what was dropped or guessed.

    Args:
        document: The JSON document.
        where: The file that it came from, for messages.
        name: Name of the map where the file has none.

    Raises:
        InputError: If it is no route graph; names the feature.
    """
    root, notes = Place(where), Notes()
    collection = root.mapping(document)
    if collection.get("type") != "FeatureCollection":
        raise root.key("type").fault("must be FeatureCollection")
    points, lines = [], []
    for number, raw in enumerate(root.key("features").sequence(collection.get("features"))):
        place = root.key("features").index(number)
        feature = place.mapping(raw)
        geometry = place.key("geometry").mapping(feature.get("geometry"))
        properties = place.key("properties").mapping(feature.get("properties"))
        if geometry.get("type") == "Point":
            points.append((place, geometry, properties))
        elif geometry.get("type") in _LINES:
            lines.append((place, geometry, properties))
        else:
            notes.dropped("features", "are neither points nor lines", str(number))
    draft = MapDraft(root, _map_name(collection, name), _frame(root, collection, points), notes)
    names: dict[int, str] = {}
    for place, geometry, properties in points:
        node_id = _add_node(draft, place, geometry, properties, names)
        _note_unheld(notes, properties, _OURS_OF_NODES, node_id, "nodes")
    for place, geometry, properties in lines:
        _add_edge(draft, place, properties, names)
        label = str(properties.get("id"))
        _note_unheld(notes, properties, _OURS_OF_EDGES, label, "edges")
        if _has_bends(geometry):
            notes.dropped("bends of edges", "our edges are straight", label)
    return draft.finish()


def _add_node(
    draft: MapDraft,
    place: Place,
    geometry: Mapping[str, Any],
    properties: Mapping[str, Any],
    names: dict[int, str],
) -> str:
    properties_place = place.key("properties")
    number = properties_place.key("id").whole(properties.get("id"), 0, _LARGEST_READ_ID)
    if number in names:
        raise properties_place.key("id").fault(f"{number} is the id of two nodes")
    spot = place.key("geometry.coordinates")
    at = spot.sequence(geometry.get("coordinates"), at_least=2)
    metadata = _metadata(place, properties)
    given = metadata.get("name")
    if is_name(given):
        node_id = str(given)
    else:
        node_id = draft.free_node_id(f"node_{number}")
        draft.notes.guessed("names of nodes", "from their ids", node_id)
    draft.add_node(place, node_id, spot.number(at[0]), spot.number(at[1]), metadata)
    names[number] = node_id
    return node_id


def _add_edge(
    draft: MapDraft, place: Place, properties: Mapping[str, Any], names: Mapping[int, str]
) -> None:
    ends = []
    for key in ("startid", "endid"):
        end = place.key(f"properties.{key}")
        number = end.whole(properties.get(key), 0, _LARGEST_READ_ID)
        if number not in names:
            raise end.fault(f"there is no node with the id {number}")
        ends.append(names[number])
    metadata = _metadata(place, properties)
    edge_id = metadata.get("name")
    draft.add_edge(place, ends[0], ends[1], edge_id if is_name(edge_id) else None, metadata)


def _metadata(place: Place, properties: Mapping[str, Any]) -> Mapping[str, Any]:
    if "metadata" not in properties:
        return {}
    return place.key("properties.metadata").mapping(properties["metadata"])


def _map_name(collection: Mapping[str, Any], name: str) -> str:
    given = collection.get("name")
    is_default = given == "graph" and "toponav" not in collection
    return str(given) if is_name(given) and not is_default else name


def _frame(root: Place, collection: Mapping[str, Any], points: list[Any]) -> MapFrame:
    """The frame of all nodes: ours says so once, Nav2 at every node."""
    ours = collection.get("toponav")
    if ours is not None:
        place = root.key("toponav")
        ours = place.mapping(ours)
        plan = ours.get("plan")
        return MapFrame(
            place.key("frame").name(ours.get("frame")),
            None if plan is None else place.key("plan").name(plan),
        )
    frame: str | None = None
    for place, _, properties in points:
        given = place.key("properties.frame").name(properties.get("frame", "map"))
        if frame is not None and given != frame:
            raise place.key("properties.frame").fault(
                f"all nodes must lie in one frame, got '{frame}' and '{given}'",
                "transform them into one frame",
            )
        frame = given
    return MapFrame(frame or "map")


def _note_unheld(
    notes: Notes, properties: Mapping[str, Any], ours: frozenset[str], label: str, what: str
) -> None:
    for key in ("operations", "cost", "overridable"):
        if properties.get(key):
            notes.dropped(f"{key} of {what}", "our maps have no place for it", label)
    metadata = properties.get("metadata")
    if isinstance(metadata, dict) and not metadata.keys() <= ours:
        notes.dropped(f"other metadata of {what}", "our maps have no place for it", label)


def _has_bends(geometry: Mapping[str, Any]) -> bool:
    """Whether a line has points between its ends."""
    coordinates = geometry.get("coordinates")
    if not isinstance(coordinates, list):
        return False
    if geometry["type"] == "LineString":
        return len(coordinates) > 2
    return len(coordinates) > 1 or any(isinstance(p, list) and len(p) > 2 for p in coordinates)


def _node_feature(number: int, node: Node, frame: str) -> dict[str, Any]:
    metadata: dict[str, Any] = {"name": node.id, "kind": node.kind.value, "size": node.size}
    if node.room is not None:
        metadata["room"] = node.room
    return {
        "type": "Feature",
        "properties": {"id": number, "frame": frame, "metadata": metadata},
        "geometry": {"type": "Point", "coordinates": _coordinates(node)},
    }


def _edge_feature(number: int, edge: Edge, topological_map: TopologicalMap) -> dict[str, Any]:
    ends = [edge.source, edge.target]
    index = topological_map.node_index
    line = [_coordinates(topological_map.nodes[index[end]]) for end in ends]
    return {
        "type": "Feature",
        "properties": {
            "id": number,
            "startid": index[edge.source],
            "endid": index[edge.target],
            "metadata": {
                "name": edge.id,
                "behavior": edge.behavior.value,
                "yaw": float(edge.yaw_rad),
                "length": float(edge.length_m),
            },
        },
        "geometry": {"type": "MultiLineString", "coordinates": [line]},
    }


def _coordinates(node: Node) -> list[float]:
    return [float(node.x_m), float(node.y_m)]


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
