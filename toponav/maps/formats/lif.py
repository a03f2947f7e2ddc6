"""VDMA Layout Interchange Format (LIF) 1.0, for the master controls of vehicle fleets."""

import json
from datetime import datetime
from typing import Any

from toponav.core.vocabulary import NodeKind
from toponav.maps.elements import Edge, Node
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.spec import TopologicalMap

__all__ = ["map_to_lif"]

_VEHICLE = "toponav"
_NO_PLACE = "LIF has no place for it"


def map_to_lif(topological_map: TopologicalMap, written: datetime) -> tuple[str, ConversionReport]:
    """The LIF text of a map: one layout, a station for each room, and what LIF cannot hold.

    The behaviour of an edge is an optional action of that name; its description is the kind of
    a node. Sizes, rooms of other nodes, the floor plan, and lengths that are not straight
    distances are reported as dropped.

    Args:
        topological_map: Map to write.
        written: When, in UTC; the format asks for it.

    Reference:
        VDMA, LIF - Layout Interchange Format, version 1.0.0, March 2024;
        https://github.com/continua-systems/vdma-lif
    """
    notes = Notes()
    document = {
        "metaInformation": {
            "projectIdentification": topological_map.name,
            "creator": "toponav",
            "exportTimestamp": written.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "lifVersion": "1.0.0",
        },
        "layouts": [
            {
                "layoutId": topological_map.name,
                "layoutName": topological_map.name,
                "layoutVersion": "1",
                "layoutLevelId": topological_map.frame.name,
                "nodes": [_node(node, topological_map, notes) for node in topological_map.nodes],
                "edges": [_edge(edge, topological_map, notes) for edge in topological_map.edges],
                "stations": _stations(topological_map),
            }
        ],
    }
    if topological_map.frame.plan is not None:
        notes.dropped("floor plan", _NO_PLACE, topological_map.frame.plan)
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n", (
        notes.report()
    )


def _node(node: Node, topological_map: TopologicalMap, notes: Notes) -> dict[str, Any]:
    if node.size != 1.0:
        notes.dropped("sizes of nodes", _NO_PLACE, node.id)
    if node.room is not None and node.kind is not NodeKind.ROOM:
        notes.dropped("rooms of nodes that are not room nodes", _NO_PLACE, node.id)
    return {
        "nodeId": node.id,
        "nodeName": node.id,
        "nodeDescription": node.kind.value,
        "mapId": topological_map.frame.name,
        "nodePosition": {"x": node.x_m + 0.0, "y": node.y_m + 0.0},
        "vehicleTypeNodeProperties": [{"vehicleTypeId": _VEHICLE}],
    }


def _edge(edge: Edge, topological_map: TopologicalMap, notes: Notes) -> dict[str, Any]:
    source, target = topological_map.node(edge.source), topological_map.node(edge.target)
    if abs(source.distance_to(target) - edge.length_m) > 0.01:
        notes.dropped("lengths that are not straight distances", _NO_PLACE, edge.id)
    notes.changed("behaviours of edges", "are optional actions of that name", edge.id)
    return {
        "edgeId": edge.id,
        "startNodeId": edge.source,
        "endNodeId": edge.target,
        "vehicleTypeEdgeProperties": [
            {
                "vehicleTypeId": _VEHICLE,
                "orientationType": "TANGENTIAL",
                "vehicleOrientation": 0.0,
                "rotationAllowed": False,
                "actions": [
                    {
                        "actionType": edge.behavior.value,
                        "actionDescription": "Behaviour of the robot along this edge",
                        "requirementType": "OPTIONAL",
                        "blockingType": "NONE",
                        "actionParameters": [
                            {"key": "yaw_rad", "value": repr(float(edge.yaw_rad))}
                        ],
                    }
                ],
            }
        ],
    }


def _stations(topological_map: TopologicalMap) -> list[dict[str, Any]]:
    """A station for each room that has a room node, which is where a vehicle interacts."""
    stations = []
    for room, nodes in topological_map.rooms.items():
        inside = [node for node in nodes if node.kind is NodeKind.ROOM]
        if inside:
            stations.append(
                {
                    "stationId": room,
                    "stationName": room,
                    "interactionNodeIds": [node.id for node in inside],
                    "stationPosition": {"x": inside[0].x_m + 0.0, "y": inside[0].y_m + 0.0},
                }
            )
    return stations
