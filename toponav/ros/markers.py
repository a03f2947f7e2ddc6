"""The topological map and the agent's belief as markers. Import after `runtime.start`."""

from typing import Any

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from toponav.core.episode import Belief
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask

__all__ = ["belief_markers", "map_markers"]

_GREY, _BLUE, _RED = (0.5, 0.5, 0.5, 0.8), (0.2, 0.4, 0.8, 1.0), (0.8, 0.2, 0.2, 1.0)


def map_markers(map_: TopologicalMap, frame: str) -> MarkerArray:
    """Nodes as dots, edges as lines."""
    nodes = _marker(frame, "nodes", Marker.SPHERE_LIST, 0.25, _GREY)
    nodes.points = [_point(node.x_m, node.y_m) for node in map_.nodes]
    edges = _marker(frame, "edges", Marker.LINE_LIST, 0.04, _GREY)
    for edge in map_.edges:
        for name in (edge.source, edge.target):
            node = map_.node(name)
            edges.points.append(_point(node.x_m, node.y_m))
    return MarkerArray(markers=[nodes, edges])


def belief_markers(task: NavigationTask, belief: Belief, frame: str) -> MarkerArray:
    """The plan as a line, and the node that the agent believes itself at."""
    plan = _marker(frame, "plan", Marker.LINE_STRIP, 0.08, _BLUE)
    for name in task.plan.nodes:
        node = task.map.node(name)
        plan.points.append(_point(node.x_m, node.y_m))
    here = _marker(frame, "belief", Marker.SPHERE, 0.5, _RED)
    if belief.node is None or belief.node not in task.map:
        here.action = Marker.DELETE
    else:
        node = task.map.node(belief.node)
        here.pose.position.x, here.pose.position.y = node.x_m, node.y_m
    return MarkerArray(markers=[plan, here])


def _marker(
    frame: str, name: str, kind: int, size_m: float, color: tuple[float, float, float, float]
) -> Any:
    marker = Marker(ns=name, type=kind, action=Marker.ADD)
    marker.header.frame_id = frame
    marker.scale.x = marker.scale.y = marker.scale.z = size_m
    marker.pose.orientation.w = 1.0
    marker.color = ColorRGBA(r=color[0], g=color[1], b=color[2], a=color[3])
    return marker


def _point(x_m: float, y_m: float) -> Point:
    return Point(x=float(x_m), y=float(y_m), z=0.05)
