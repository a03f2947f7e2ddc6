"""The topological map drawn around a believed pose, compiled."""

import math

import numpy as np
from numba import njit

__all__ = [
    "CHANNELS",
    "arc_lengths",
    "draw_map",
    "follow_progress",
    "path_features",
    "progress_on",
    "way_points",
]

CHANNELS = 7
"""Rooms, doors, halls, edges along, edges against, the plan ahead, the plan's nodes."""
_NODE_M = 0.4
_EDGE_M = 0.25
_PLAN_M = 0.3
_AHEAD_M = 8.0
_BEHIND_M = 1.0


@njit(cache=True, fastmath=True)
def _blob(
    channel: np.ndarray, x: float, y: float, radius: float, value: float, cell_m: float
) -> None:
    """A cone at (x forward, y left) metres from the robot."""
    rows, cols = channel.shape
    row, col = x / cell_m + rows / 2 - 0.5, y / cell_m + cols / 2 - 0.5
    reach = radius / cell_m
    for i in range(max(0, math.ceil(row - reach)), min(rows, math.floor(row + reach) + 1)):
        for j in range(max(0, math.ceil(col - reach)), min(cols, math.floor(col + reach) + 1)):
            away = math.sqrt((i - row) ** 2 + (j - col) ** 2) / reach
            if away < 1.0:
                channel[i, j] = max(channel[i, j], np.float32(value * (1.0 - away)))


@njit(cache=True, fastmath=True)
def _line(
    channel: np.ndarray,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    radius: float,
    value_a: float,
    value_b: float,
    cell_m: float,
) -> None:
    """A ridge from a to b whose height goes from value_a to value_b."""
    rows, cols = channel.shape
    r0, c0 = ax / cell_m + rows / 2 - 0.5, ay / cell_m + cols / 2 - 0.5
    r1, c1 = bx / cell_m + rows / 2 - 0.5, by / cell_m + cols / 2 - 0.5
    reach = radius / cell_m
    dr, dc = r1 - r0, c1 - c0
    length2 = dr * dr + dc * dc
    low_i, high_i = math.ceil(min(r0, r1) - reach), math.floor(max(r0, r1) + reach)
    for i in range(max(0, low_i), min(rows, high_i + 1)):
        # The columns of this row that can be within reach.
        if abs(dr) > 1e-6:
            t0, t1 = (i - reach - r0) / dr, (i + reach - r0) / dr
            if t0 > t1:
                t0, t1 = t1, t0
            t0, t1 = min(max(t0, 0.0), 1.0), min(max(t1, 0.0), 1.0)
            ca, cb = c0 + t0 * dc, c0 + t1 * dc
        else:
            ca, cb = c0, c1
        low_j, high_j = math.ceil(min(ca, cb) - reach), math.floor(max(ca, cb) + reach)
        for j in range(max(0, low_j), min(cols, high_j + 1)):
            t = 0.0
            if length2 > 1e-9:
                t = ((i - r0) * dr + (j - c0) * dc) / length2
                t = min(max(t, 0.0), 1.0)
            away = math.sqrt((i - r0 - t * dr) ** 2 + (j - c0 - t * dc) ** 2) / reach
            if away < 1.0:
                value = (value_a + t * (value_b - value_a)) * (1.0 - away)
                channel[i, j] = max(channel[i, j], np.float32(value))


@njit(cache=True)
def way_points(
    node_xy: np.ndarray, ends: np.ndarray, share: np.ndarray, shift_m: np.ndarray
) -> np.ndarray:
    """Points [points, 2] a share of the way between two nodes [points, 2], moved by a shift."""
    out = np.empty((ends.shape[0], 2))
    for i in range(ends.shape[0]):
        a, b = ends[i, 0], ends[i, 1]
        for k in range(2):
            across = node_xy[b, k] - node_xy[a, k]
            out[i, k] = node_xy[a, k] + share[i] * across + shift_m[i, k]
    return out


@njit(cache=True)
def arc_lengths(path: np.ndarray) -> np.ndarray:
    """Metres along a polyline [points, 2] at each of its points."""
    out = np.zeros(path.shape[0])
    for i in range(1, path.shape[0]):
        out[i] = out[i - 1] + math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    return out


@njit(cache=True)
def progress_on(
    path: np.ndarray, arc: np.ndarray, x: float, y: float, low_m: float, high_m: float
) -> float:
    """Metres along the path at its point nearest to (x, y), sought between two arc lengths."""
    best, best_away = low_m, 1e18
    for i in range(path.shape[0] - 1):
        if arc[i + 1] < low_m or arc[i] > high_m:
            continue
        length = arc[i + 1] - arc[i]
        if length < 1e-9:
            continue
        dx, dy = (path[i + 1, 0] - path[i, 0]) / length, (path[i + 1, 1] - path[i, 1]) / length
        t = (x - path[i, 0]) * dx + (y - path[i, 1]) * dy
        t = min(max(t, max(0.0, low_m - arc[i])), min(length, high_m - arc[i]))
        away = math.hypot(path[i, 0] + t * dx - x, path[i, 1] + t * dy - y)
        if away < best_away:
            best_away, best = away, arc[i] + t
    return best


@njit(cache=True)
def follow_progress(path: np.ndarray, arc: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """The progress at each of a drive's positions [steps, 2 or more], each near the last."""
    out = np.empty(positions.shape[0], np.float32)
    at = 0.0
    for i in range(positions.shape[0]):
        at = progress_on(path, arc, positions[i, 0], positions[i, 1], at - 1.0, at + 2.0)
        out[i] = at
    return out


@njit(cache=True)
def _point_at(path: np.ndarray, arc: np.ndarray, s: float, out: np.ndarray) -> None:
    last = path.shape[0] - 1
    i = int(np.searchsorted(arc, s)) - 1
    i = min(max(i, 0), max(last - 1, 0))
    length = arc[min(i + 1, last)] - arc[i]
    t = 0.0 if length < 1e-9 else min(max((s - arc[i]) / length, 0.0), 1.0)
    j = min(i + 1, last)
    out[0] = path[i, 0] + t * (path[j, 0] - path[i, 0])
    out[1] = path[i, 1] + t * (path[j, 1] - path[i, 1])


@njit(cache=True)
def path_features(
    path: np.ndarray,
    arc: np.ndarray,
    behaviors: np.ndarray,
    progress_m: float,
    pose: np.ndarray,
    ahead_m: np.ndarray,
    kinds: int,
    out: np.ndarray,
) -> None:
    """What the plan looks like from `pose`: [points ahead x 2, rest, behaviours now and ahead].

    `behaviors` [points] are those due at the path's points; behaviours are given one-hot at half a
    metre, at each fixed distance.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    point = np.zeros(2)
    at = 0
    for k in range(ahead_m.shape[0]):
        _point_at(path, arc, progress_m + ahead_m[k], point)
        dx, dy = point[0] - pose[0], point[1] - pose[1]
        out[at] = min(max((dx * c + dy * s) / 4.0, -2.0), 2.0)
        out[at + 1] = min(max((-dx * s + dy * c) / 4.0, -2.0), 2.0)
        at += 2
    out[at] = min(max(arc[-1] - progress_m, 0.0), 8.0) / 8.0
    at += 1
    for k in range(3):
        where = min(progress_m + 0.05 + k * 0.75, arc[-1] - 1e-6)
        i = int(np.searchsorted(arc, where)) - 1
        i = min(max(i, 0), max(behaviors.shape[0] - 2, 0))
        out[at + behaviors[i]] = 1.0
        at += kinds


@njit(cache=True)
def draw_map(
    node_xy: np.ndarray,
    node_kind: np.ndarray,
    node_on_plan: np.ndarray,
    edges: np.ndarray,
    path: np.ndarray,
    arc: np.ndarray,
    progress_m: float,
    pose: np.ndarray,
    cell_m: float,
    out: np.ndarray,
) -> None:
    """Fill `out` [CHANNELS, rows, cols] with the map as seen from `pose` [x, y, yaw].

    `node_kind`: 0 room, 1 door, 2 hall or open space. `edges` [edges, 2] index nodes.
    """
    out[:] = 0.0
    c, s = math.cos(pose[2]), math.sin(pose[2])
    nodes = node_xy.shape[0]
    reach = out.shape[1] * cell_m * 0.5 * 1.5 + 1.0
    local = np.empty((nodes, 2))
    for i in range(nodes):
        dx, dy = node_xy[i, 0] - pose[0], node_xy[i, 1] - pose[1]
        local[i, 0] = dx * c + dy * s
        local[i, 1] = -dx * s + dy * c
        if abs(local[i, 0]) < reach and abs(local[i, 1]) < reach:
            _blob(out[node_kind[i]], local[i, 0], local[i, 1], _NODE_M, 1.0, cell_m)
            if node_on_plan[i]:
                _blob(out[6], local[i, 0], local[i, 1], _NODE_M, 0.6, cell_m)
    for k in range(edges.shape[0]):
        a, b = edges[k, 0], edges[k, 1]
        ax, ay, bx, by = local[a, 0], local[a, 1], local[b, 0], local[b, 1]
        if (ax > reach and bx > reach) or (ax < -reach and bx < -reach):
            continue
        if (ay > reach and by > reach) or (ay < -reach and by < -reach):
            continue
        channel = 3 if bx - ax >= 0.0 else 4
        _line(out[channel], ax, ay, bx, by, _EDGE_M, 1.0, 1.0, cell_m)
    for i in range(path.shape[0] - 1):
        if arc[i + 1] < progress_m - _BEHIND_M or arc[i] > progress_m + _AHEAD_M:
            continue
        dx, dy = path[i, 0] - pose[0], path[i, 1] - pose[1]
        ax, ay = dx * c + dy * s, -dx * s + dy * c
        dx, dy = path[i + 1, 0] - pose[0], path[i + 1, 1] - pose[1]
        bx, by = dx * c + dy * s, -dx * s + dy * c
        va = 1.0 - 0.8 * min(max((arc[i] - progress_m) / _AHEAD_M, -0.1), 1.0)
        vb = 1.0 - 0.8 * min(max((arc[i + 1] - progress_m) / _AHEAD_M, -0.1), 1.0)
        _line(out[5], ax, ay, bx, by, _PLAN_M, va, vb, cell_m)
    last = path.shape[0] - 1
    dx, dy = path[last, 0] - pose[0], path[last, 1] - pose[1]
    _blob(out[6], dx * c + dy * s, -dx * s + dy * c, 0.6, 1.0, cell_m)
