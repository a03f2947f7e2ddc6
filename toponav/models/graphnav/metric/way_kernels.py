"""The line to drive along a plan so that the robot stays at the plan's nodes, compiled."""

import math

import numpy as np
from numba import njit

__all__ = ["bend", "margin"]

_WOBBLE = ((-0.2, 0.25), (0.0, 0.5), (0.2, 0.25))
_MOST_SHORT_M = 0.5
_SHORT, _ASIDE, _SLOPE = 16.0, 0.3, 0.2
_NEVER = 1e9


@njit(cache=True)
def margin(
    x: float,
    y: float,
    yaw: float,
    near: np.ndarray,
    node_xy: np.ndarray,
    node_size: np.ndarray,
    on_plan: np.ndarray,
    heading_at: np.ndarray,
    heading_xy: np.ndarray,
    aligned_cos: float,
) -> float:
    """How much nearer the plan's nodes are than others, for a robot heading that way; metres."""
    forward_x, forward_y = math.cos(yaw), math.sin(yaw)
    on, off = 1e3, 1e3
    for node in near:
        away = math.hypot(node_xy[node, 0] - x, node_xy[node, 1] - y) / node_size[node]
        if away >= (on if on_plan[node] else off):
            continue
        for k in range(heading_at[node], heading_at[node + 1]):
            if heading_xy[k, 0] * forward_x + heading_xy[k, 1] * forward_y > aligned_cos:
                if on_plan[node]:
                    on = away
                else:
                    off = away
                break
    return off - on


@njit(cache=True)
def _near(x: float, y: float, reach_m: float, node_xy: np.ndarray) -> np.ndarray:
    return np.flatnonzero((np.abs(node_xy - np.array([x, y])) < reach_m).sum(axis=1) == 2)


@njit(cache=True)
def bend(
    points: np.ndarray,
    yaw: np.ndarray,
    is_free: np.ndarray,
    spacing_m: np.ndarray,
    offsets_m: np.ndarray,
    margin_m: float,
    reach_m: float,
    node_xy: np.ndarray,
    node_size: np.ndarray,
    on_plan: np.ndarray,
    heading_at: np.ndarray,
    heading_xy: np.ndarray,
    aligned_cos: float,
) -> np.ndarray:
    """How far to the left of each point of a line [points, 2] the robot should drive, in metres.

    The cheapest choice among `offsets_m`, which are evenly spaced: what a robot on its way from
    one offset to the next is short of the margin counts squared, and so do offsets and slopes.
    `yaw` [points] is the line's heading before each point, `spacing_m` what lies between a point
    and the last; where `is_free` is not set the offset is zero. `heading_xy` holds the headings of
    the edges at node n from `heading_at[n]` to `heading_at[n + 1]`.
    """
    count, choices = points.shape[0], offsets_m.shape[0]
    straight = int(np.argmin(np.abs(offsets_m)))
    total = np.full((count, choices), _NEVER)
    came = np.full((count, choices), straight, np.int64)
    total[0, straight] = 0.0
    step_m = offsets_m[1] - offsets_m[0]
    for i in range(1, count):
        if not is_free[i] and not is_free[i - 1]:
            total[i, straight] = total[i - 1, straight]
            continue
        near = _near(points[i, 0], points[i, 1], reach_m, node_xy)
        reach = max(1, int(0.7 * spacing_m[i] / step_m))
        left_x, left_y = -math.sin(yaw[i]), math.cos(yaw[i])
        for k in range(choices):
            if not is_free[i] and k != straight:
                continue
            x = points[i, 0] + left_x * offsets_m[k]
            y = points[i, 1] + left_y * offsets_m[k]
            for j in range(max(0, k - reach), min(choices, k + reach + 1)):
                if total[i - 1, j] >= _NEVER:
                    continue
                slope = (offsets_m[k] - offsets_m[j]) / spacing_m[i]
                cost = total[i - 1, j] + _ASIDE * offsets_m[k] ** 2 + _SLOPE * slope * slope
                if cost >= total[i, k]:
                    continue
                for wobble, share in _WOBBLE:
                    ahead = margin(
                        x,
                        y,
                        yaw[i] + math.atan(slope) + wobble,
                        near,
                        node_xy,
                        node_size,
                        on_plan,
                        heading_at,
                        heading_xy,
                        aligned_cos,
                    )
                    short = min(max(margin_m - ahead, 0.0), _MOST_SHORT_M)
                    cost += share * _SHORT * short * short
                if cost < total[i, k]:
                    total[i, k], came[i, k] = cost, j
    out = np.zeros(count)
    k = int(np.argmin(total[count - 1]))
    for i in range(count - 1, -1, -1):
        out[i] = offsets_m[k]
        k = came[i, k]
    return out
