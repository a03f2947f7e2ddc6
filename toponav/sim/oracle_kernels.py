"""Compiled loops of the truth localizer: nearest aligned node, and tracking along edges."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

__all__ = ["NO_NODE", "LocalizerArrays", "nearest_node", "nearest_nodes", "track_nodes"]

NO_NODE = -1


class LocalizerArrays(NamedTuple):
    """A map and the rooms of its building, as the loops read them.

    Headings are those of all edges at a node, incoming and outgoing; those of node n are
    `first_heading[n]` to `first_heading[n + 1]`. `node_room` indexes the building's rooms.
    """

    node_x_m: np.ndarray
    node_y_m: np.ndarray
    inverse_size_squared: np.ndarray
    first_heading: np.ndarray
    heading_cos: np.ndarray
    heading_sin: np.ndarray
    node_room: np.ndarray
    room_node: np.ndarray
    room_is_enclosed: np.ndarray
    room_index: np.ndarray
    origin_x_m: float
    origin_y_m: float
    resolution_m: float
    has_rooms: bool
    aligned_cos: float


@njit(cache=True)
def nearest_node(arrays, allowed, x_m, y_m, yaw_rad):  # type: ignore[no-untyped-def]
    """Index of the nearest node that is aligned with the robot and not in another room, or -1.

    `allowed` says which nodes count; when empty, all do.
    """
    room, enclosed = -1, False
    if arrays.has_rooms:
        rows, cols = arrays.room_index.shape
        row = (y_m - arrays.origin_y_m) / arrays.resolution_m
        col = (x_m - arrays.origin_x_m) / arrays.resolution_m
        # Written so that NaN is outside too.
        if not (0.0 <= row < rows and 0.0 <= col < cols):
            return NO_NODE
        room = arrays.room_index[int(row), int(col)]
        if room < 0:
            return NO_NODE
        enclosed = arrays.room_is_enclosed[room]
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    best, best_distance = NO_NODE, np.inf
    for node in range(arrays.node_x_m.shape[0]):
        if enclosed and arrays.node_room[node] != room:
            continue
        if allowed.shape[0] > 0 and not allowed[node]:
            continue
        dx, dy = arrays.node_x_m[node] - x_m, arrays.node_y_m[node] - y_m
        distance = (dx * dx + dy * dy) * arrays.inverse_size_squared[node]
        if distance >= best_distance:
            continue
        for heading in range(arrays.first_heading[node], arrays.first_heading[node + 1]):
            along = arrays.heading_cos[heading] * cosine + arrays.heading_sin[heading] * sine
            if along > arrays.aligned_cos:
                best, best_distance = node, distance
                break
    if best == NO_NODE and enclosed:
        node = arrays.room_node[room]
        if node != NO_NODE and (allowed.shape[0] == 0 or allowed[node]):
            return node
    return best


@njit(cache=True)
def nearest_nodes(arrays, allowed, x_m, y_m, yaw_rad):  # type: ignore[no-untyped-def]
    """`nearest_node` of each pose."""
    result = np.empty(x_m.shape[0], dtype=np.int64)
    for query in range(x_m.shape[0]):
        result[query] = nearest_node(arrays, allowed, x_m[query], y_m[query], yaw_rad[query])
    return result


@njit(cache=True)
def track_nodes(candidates, first_out, out_target, out_edge):  # type: ignore[no-untyped-def]
    """Node and edge per frame when the robot can only move along edges; -1 where unknown.

    A frame keeps its candidate if that is the node of the last labelled frame or a direct
    successor of it, else it has none. Frames at A before a frame at B have the edge A -> B.
    """
    frames = candidates.shape[0]
    nodes = np.full(frames, NO_NODE, dtype=np.int64)
    edges = np.full(frames, NO_NODE, dtype=np.int64)
    last, since = NO_NODE, 0
    for frame in range(frames):
        candidate = candidates[frame]
        if candidate == NO_NODE:
            continue
        if candidate != last and last != NO_NODE:
            edge = NO_NODE
            for out in range(first_out[last], first_out[last + 1]):
                if out_target[out] == candidate:
                    edge = out_edge[out]
                    break
            if edge == NO_NODE:
                continue
            for earlier in range(since, frame):
                if nodes[earlier] == last:
                    edges[earlier] = edge
        if candidate != last:
            last, since = candidate, frame
        nodes[frame] = candidate
    return nodes, edges
