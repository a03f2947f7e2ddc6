"""Ghosts and the searched floor: what was explored in passing goes, what was missed is added."""

import math

from toponav.core.geometry import Pose2
from toponav.core.imagenav import bin_of_direction
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.local_map import LocalMap
from toponav.navigation.nts.searched_floor import Opening, SearchedFloor

__all__ = ["update_ghosts"]

_EXPLORED_M = 1.2
_SAME_M = 1.0
_BEHIND_M = 1.5
_HANGS_M = 6.0
_CANDIDATES = 4


def update_ghosts(graph: ImageGraph, floor: SearchedFloor, seen: LocalMap, pose: Pose2) -> None:
    """Takes ghosts away behind which nothing is left to search, and adds what has no ghost.

    An edge of the searched floor hangs on the nearest node that sees it, so F_S says how
    promising it is like any other ghost. One that moved because more was seen stays the same.

    Args:
        graph: The map.
        floor: What was searched.
        seen: Occupancy.
        pose: Where the robot is.
    """
    openings = floor.openings(pose)
    told = [ghost for ghost in graph.ghosts if ghost.unseen_m2 is None]
    told = [ghost for ghost in told if not _is_explored(graph, ghost, floor, openings)]
    places = [graph.pose_of_ghost(ghost) for ghost in told]
    before = [ghost for ghost in graph.ghosts if ghost.unseen_m2 is not None]
    edges = []
    for ghost, place in zip(told, places, strict=True):
        nearest = min(openings, key=lambda one: _apart_m(place, one), default=None)
        is_near = nearest is not None and _apart_m(place, nearest) < _BEHIND_M
        ghost.behind_m2 = nearest.unseen_m2 if nearest is not None and is_near else None
    for opening in openings:
        if any(_apart_m(place, opening) < _SAME_M for place in places):
            continue
        near = [
            (away_m, k)
            for k, ghost in enumerate(before)
            if (away_m := _apart_m(graph.pose_of_ghost(ghost), opening)) < _SAME_M
        ]
        ghost = before.pop(min(near)[1]) if near else GhostNode(-1, 0, unseen_m2=0.0)
        _hang(graph, seen, ghost, opening)
        edges.append(ghost)
    graph.ghosts[:] = told + edges


def _is_explored(
    graph: ImageGraph, ghost: GhostNode, floor: SearchedFloor, openings: list[Opening]
) -> bool:
    place = graph.pose_of_ghost(ghost)
    if not floor.is_searched(place.x_m, place.y_m):
        return False
    return all(_apart_m(place, opening) >= _EXPLORED_M for opening in openings)


def _hang(graph: ImageGraph, seen: LocalMap, ghost: GhostNode, opening: Opening) -> None:
    """Puts a ghost where an opening is."""
    at = Pose2(opening.x_m, opening.y_m, 0.0)
    near = [number for _, number in graph.nodes_near(at, _HANGS_M)[:_CANDIDATES]]
    if not near:
        near = [min(graph.nodes, key=lambda node: node.pose.distance_to(at)).number]
    place = (opening.x_m, opening.y_m)
    in_sight = (
        k for k in near if seen.is_clear((graph.nodes[k].pose.x_m, graph.nodes[k].pose.y_m), place)
    )
    number = next(in_sight, near[0])
    relative = at.relative_to(graph.nodes[number].pose)
    bearing = math.atan2(relative.y_m, relative.x_m)
    direction = bin_of_direction(bearing)
    if (number, direction) != (ghost.node, ghost.direction):
        ghost.score = None
    ghost.node, ghost.direction, ghost.bearing_rad = number, direction, bearing
    ghost.distance_m = math.hypot(relative.x_m, relative.y_m)
    ghost.unseen_m2 = opening.unseen_m2


def _apart_m(place: Pose2, opening: Opening) -> float:
    return math.hypot(place.x_m - opening.x_m, place.y_m - opening.y_m)
