"""The line to drive along a plan so that the robot stays at the plan's nodes, compiled."""

import math

import numpy as np
from numba import njit

__all__ = ["bend"]


@njit(cache=True)
def _margin(
    x: float,
    y: float,
    forward_x: float,
    forward_y: float,
    node_xy: np.ndarray,
    node_size: np.ndarray,
    on_plan: np.ndarray,
    heading_at: np.ndarray,
    heading_xy: np.ndarray,
    aligned_cos: float,
) -> float:
    """How much nearer the plan's nodes are than others, for a robot heading that way; metres."""
    on, off = 1e9, 1e9
    for node in range(node_xy.shape[0]):
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
def bend(
    points: np.ndarray,
    forward: np.ndarray,
    is_free: np.ndarray,
    offsets_m: np.ndarray,
    margin_m: float,
    stiffness: float,
    node_xy: np.ndarray,
    node_size: np.ndarray,
    on_plan: np.ndarray,
    heading_at: np.ndarray,
    heading_xy: np.ndarray,
    aligned_cos: float,
) -> np.ndarray:
    """How far to the left of each point of a line [points, 2] the robot should drive, in metres.

    The cheapest choice among `offsets_m`: what is short of the margin counts squared, and so do
    offsets and, `stiffness` times, what they change by from point to point. `forward` [points, 2]
    is the heading at each point; where `is_free` is not set the offset is zero. `heading_xy` holds
    the headings of the edges at node n from `heading_at[n]` to `heading_at[n + 1]`.
    """
    count, choices = points.shape[0], offsets_m.shape[0]
    cost = np.zeros((count, choices))
    came = np.zeros((count, choices), np.int64)
    straight = int(np.argmin(np.abs(offsets_m)))
    for i in range(count):
        for k in range(choices):
            if not is_free[i]:
                cost[i, k] = 0.0 if k == straight else 1e9
                continue
            x = points[i, 0] - forward[i, 1] * offsets_m[k]
            y = points[i, 1] + forward[i, 0] * offsets_m[k]
            margin = _margin(
                x,
                y,
                forward[i, 0],
                forward[i, 1],
                node_xy,
                node_size,
                on_plan,
                heading_at,
                heading_xy,
                aligned_cos,
            )
            short = min(max(margin_m - margin, 0.0), 1.0)
            cost[i, k] = 4.0 * short * short + 0.25 * offsets_m[k] ** 2
        if i:
            for k in range(choices):
                best, least = 0, 1e18
                for j in range(choices):
                    change = offsets_m[k] - offsets_m[j]
                    total = cost[i - 1, j] + stiffness * change * change
                    if total < least:
                        best, least = j, total
                came[i, k] = best
                cost[i, k] += least
    out = np.zeros(count)
    k = int(np.argmin(cost[count - 1])) if count else 0
    for i in range(count - 1, -1, -1):
        out[i] = offsets_m[k]
        k = came[i, k]
    return out
