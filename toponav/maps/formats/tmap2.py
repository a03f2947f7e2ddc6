"""Topological maps of LCAS's `topological_navigation` (tmap2 YAML): lossless both ways."""

import math
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import yaml

from toponav.maps.elements import Edge, MapFrame, Node
from toponav.maps.formats._draft import MapDraft
from toponav.maps.formats._values import Place, is_name
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.spec import TopologicalMap

__all__ = ["map_from_tmap2", "map_to_tmap2"]

_OURS_OF_NODES = frozenset({"kind", "room", "size", "xy_goal_tolerance", "yaw_goal_tolerance"})
_OURS_OF_EDGES = frozenset({"behavior", "yaw", "length"})
_XY_TOLERANCE_M = 0.3
_YAW_TOLERANCE_RAD = 6.28
_VERTEX_M = 0.3
_NO_ROTATION = {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}
_ORIGIN = {"x": 0.0, "y": 0.0, "z": 0.0}


def map_to_tmap2(
    topological_map: TopologicalMap, written: datetime
) -> tuple[str, ConversionReport]:
    """The YAML text of a map; behaviours, yaws, lengths, kinds, rooms and sizes are properties.

    Args:
        topological_map: Map to write.
        written: When; the format asks for it.
    """
    name, frame = topological_map.name, topological_map.frame
    ours: dict[str, Any] = {"version": 1, "frame": frame.name}
    if frame.plan is not None:
        ours["plan"] = frame.plan
    document = {
        "meta": {"last_updated": written.strftime("%d-%m-%Y_%H-%M-%S")},
        "metric_map": name,
        "name": name,
        "pointset": name,
        "toponav": ours,
        "transformation": {
            "topo_frame_id": frame.name,
            "child": frame.name,
            "parent": frame.name,
            "rotation": _NO_ROTATION,
            "translation": _ORIGIN,
        },
        "nodes": [
            {
                "meta": {"map": name, "node": node.id, "pointset": name},
                "node": _node_document(node, topological_map),
            }
            for node in topological_map.nodes
        ],
    }
    text = yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1000)
    notes = Notes()
    notes.changed(
        "actions of edges",
        "all are NavigateToPose, which topological_navigation runs; behaviours are properties",
        count=len(topological_map.edges),
    )
    return text, notes.report()


def map_from_tmap2(
    document: Any, where: str, name: str
) -> tuple[TopologicalMap, ConversionReport]:
    """The map of a tmap2 document, and what was dropped or guessed.

    Args:
        document: The YAML document.
        where: The file that it came from, for messages.
        name: Name of the map where the file has none.

    Raises:
        InputError: If it is no tmap2; names the element.
    """
    root, notes = Place(where), Notes()
    mapping = root.mapping(document)
    entries = []
    for number, raw in enumerate(root.key("nodes").sequence(mapping.get("nodes"))):
        place = root.key("nodes").index(number)
        entry = place.mapping(raw)
        entries.append((place.key("node"), place.key("node").mapping(entry.get("node"))))
    given = mapping.get("name")
    frame, moved = _frame(root, mapping, entries)
    draft = MapDraft(root, str(given) if is_name(given) else name, frame, notes)
    for place, node in entries:
        _add_node(draft, place, node, moved)
    for place, node in entries:
        for number, raw in enumerate(place.key("edges").sequence(node.get("edges") or [])):
            _add_edge(draft, place.key("edges").index(number), raw, str(node["name"]))
    if moved is not None:
        notes.changed(
            "positions", f"moved by the file's transformation to {frame.name}", count=len(entries)
        )
    if mapping.get("definitions") or mapping.get("actions"):
        notes.dropped("definitions and actions", "our maps have no place for them")
    return draft.finish()


_Motion = tuple[float, float, float]


def _add_node(
    draft: MapDraft, place: Place, node: Mapping[str, Any], moved: _Motion | None
) -> None:
    pose = place.key("pose").mapping(node.get("pose"))
    spot = place.key("pose.position")
    position = spot.mapping(pose.get("position"))
    x_m = spot.key("x").number(position.get("x"))
    y_m = spot.key("y").number(position.get("y"))
    if moved is not None:
        cosine, sine = math.cos(moved[2]), math.sin(moved[2])
        x_m, y_m = (
            moved[0] + cosine * x_m - sine * y_m,
            moved[1] + sine * x_m + cosine * y_m,
        )
    properties = _properties(place, node)
    draft.add_node(place.key("name"), node.get("name"), x_m, y_m, properties)
    label = str(node["name"])
    if not properties.keys() <= _OURS_OF_NODES:
        draft.notes.dropped("other properties of nodes", "our maps have no place for them", label)
    orientation = pose.get("orientation")
    if isinstance(orientation, dict) and orientation.get("z"):
        draft.notes.dropped("headings of nodes", "headings are those of our edges", label)
    if "kind" not in properties and node.get("verts"):
        draft.notes.dropped("influence zones (verts)", "our nodes have a size", label)
    for key in ("restrictions_planning", "restrictions_runtime"):
        if node.get(key) not in (None, "", "True", True):
            draft.notes.dropped(f"{key} of nodes", "our maps have no place for it", label)


def _add_edge(draft: MapDraft, place: Place, raw: Any, source: str) -> None:
    edge = place.mapping(raw)
    target = place.key("node").name(edge.get("node"))
    properties = _properties(place, edge)
    edge_id = edge.get("edge_id")
    draft.add_edge(place, source, target, edge_id if is_name(edge_id) else None, properties)
    label = f"{source}->{target}"
    if not properties.keys() <= _OURS_OF_EDGES:
        draft.notes.dropped("other properties of edges", "our maps have no place for them", label)
    if "behavior" not in properties and edge.get("action"):
        draft.notes.dropped("actions of edges", "are not our behaviours", label)
    for key in ("restrictions_planning", "restrictions_runtime"):
        if edge.get(key) not in (None, "", "True", True):
            draft.notes.dropped(f"{key} of edges", "our maps have no place for it", label)


def _properties(place: Place, element: Mapping[str, Any]) -> Mapping[str, Any]:
    properties = element.get("properties")
    return {} if properties is None else place.key("properties").mapping(properties)


def _frame(
    root: Place, mapping: Mapping[str, Any], entries: list[Any]
) -> tuple[MapFrame, _Motion | None]:
    """The frame of the map, and the motion of its nodes into it if they lie in another."""
    ours = mapping.get("toponav")
    if ours is not None:
        place = root.key("toponav")
        ours = place.mapping(ours)
        plan = ours.get("plan")
        plan = None if plan is None else place.key("plan").name(plan)
        return MapFrame(place.key("frame").name(ours.get("frame")), plan), None
    place = root.key("transformation")
    transformation = place.mapping(mapping.get("transformation") or {})
    parent = transformation.get("parent")
    parent = parent if is_name(parent) else "map"
    child = transformation.get("topo_frame_id", transformation.get("child"))
    frames = {_frame_of_node(node) for _, node in entries}
    if len(frames) > 1:
        raise root.key("nodes").fault(
            "all nodes must lie in one frame, got " + " and ".join(sorted(frames)[:3])[:200],
            "transform them into one frame",
        )
    frame = next(iter(frames), "")
    if frame.startswith("$"):
        frame = str(child)
    if frame == child and child != parent:
        return MapFrame(parent), _motion(place, transformation)
    return MapFrame(frame if is_name(frame) else parent), None


def _frame_of_node(node: Mapping[str, Any]) -> str:
    frame = node.get("parent_frame", node.get("nav_frame"))
    return frame[:200] if isinstance(frame, str) else ""


def _motion(place: Place, transformation: Mapping[str, Any]) -> _Motion | None:
    translation = place.key("translation").mapping(transformation.get("translation") or _ORIGIN)
    rotation = place.key("rotation").mapping(transformation.get("rotation") or _NO_ROTATION)
    x_m, y_m = (place.key(f"translation.{k}").number(translation.get(k, 0.0)) for k in "xy")
    w, z = (
        place.key(f"rotation.{k}").number(rotation.get(k, d)) for k, d in (("w", 1.0), ("z", 0.0))
    )
    for axis in "xy":
        if abs(place.key(f"rotation.{axis}").number(rotation.get(axis, 0.0))) > 1e-6:
            raise place.key("rotation").fault("must turn about z alone")
    yaw_rad = 2.0 * math.atan2(z, w)
    return None if x_m == y_m == yaw_rad == 0.0 else (x_m, y_m, yaw_rad)


def _node_document(node: Node, topological_map: TopologicalMap) -> dict[str, Any]:
    properties: dict[str, Any] = {
        "xy_goal_tolerance": _XY_TOLERANCE_M,
        "yaw_goal_tolerance": _YAW_TOLERANCE_RAD,
        "kind": node.kind.value,
        "size": float(node.size),
    }
    if node.room is not None:
        properties["room"] = node.room
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return {
        "edges": [_edge_document(edge) for edge in topological_map.out_edges(node.id)],
        "localise_by_topic": "",
        "name": node.id,
        "nav_frame": topological_map.frame.name,
        "parent_frame": topological_map.frame.name,
        "pose": {
            "orientation": _NO_ROTATION,
            "position": {"x": float(node.x_m), "y": float(node.y_m), "z": 0.0},
        },
        "properties": properties,
        "restrictions_planning": "True",
        "restrictions_runtime": "True",
        "verts": [{"x": _VERTEX_M * x, "y": _VERTEX_M * y} for x, y in corners],
    }


def _edge_document(edge: Edge) -> dict[str, Any]:
    return {
        "action": "NavigateToPose",
        "action_type": "geometry_msgs/PoseStamped",
        "config": [],
        "edge_id": edge.id,
        "fail_policy": "fail",
        "fluid_navigation": True,
        "goal": {
            "target_pose": {
                "header": {"frame_id": "$node.parent_frame"},
                "pose": "$node.pose",
            }
        },
        "node": edge.target,
        "properties": {
            "behavior": edge.behavior.value,
            "yaw": float(edge.yaw_rad),
            "length": float(edge.length_m),
        },
        "recovery_behaviours_config": "",
        "restrictions_planning": "True",
        "restrictions_runtime": "True",
    }


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes every value out: what another tool reads needs no anchors."""

    def ignore_aliases(self, data: Any) -> bool:
        return True
