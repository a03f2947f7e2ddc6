"""The turn that keeps a robot at its plan's nodes, sought among short manoeuvres, compiled."""

import math

import numpy as np
from numba import njit

from toponav.models.graphnav.metric.way_kernels import margin

__all__ = ["kept_turn"]

_MOST_SHORT_M = 0.4
_FREE_M = 0.3
_BESIDE, _ASKEW, _CHANGE, _BACK = 3.0, 1.0, 0.25, 0.02


@njit(cache=True)
def _way_at(way: np.ndarray, arc: np.ndarray, at_m: float) -> tuple[float, float, float]:
    """The point of a way [points, 2] at that many metres, and the heading there."""
    i = min(max(int(np.searchsorted(arc, at_m, side="right")) - 1, 0), way.shape[0] - 2)
    dx, dy = way[i + 1, 0] - way[i, 0], way[i + 1, 1] - way[i, 1]
    share = (at_m - arc[i]) / max(arc[i + 1] - arc[i], 1e-9)
    return way[i, 0] + share * dx, way[i, 1] + share * dy, math.atan2(dy, dx)


@njit(cache=True)
def kept_turn(
    pose: np.ndarray,
    speed_m_s: float,
    turn_rad_s: float,
    last_turn_rad_s: float,
    turns_rad_s: np.ndarray,
    steps: int,
    period_s: float,
    margin_m: float,
    dearness: float,
    way: np.ndarray,
    arc: np.ndarray,
    progress_m: float,
    near: np.ndarray,
    node_xy: np.ndarray,
    node_size: np.ndarray,
    on_plan: np.ndarray,
    heading_at: np.ndarray,
    heading_xy: np.ndarray,
    aligned_cos: float,
) -> float:
    """The turn rate to command in place of `turn_rad_s`; that itself where it leads well.

    A manoeuvre turns at one rate for the first half of the steps and at another for the second;
    wheels carry out three quarters of a change at once. It costs what it comes short of
    `margin_m` at each step, squared, how far and askew of the way it ends, and the change.
    """
    best, least = turn_rad_s, 1e18
    half = steps // 2
    end_m = progress_m + speed_m_s * period_s * steps
    end_x, end_y, end_yaw = _way_at(way, arc, min(end_m, arc[-1]))
    count = turns_rad_s.shape[0]
    for first in range(-1, count):
        a = turn_rad_s if first < 0 else turns_rad_s[first]
        for second in range(count):
            b = turns_rad_s[second]
            x, y, yaw, was = pose[0], pose[1], pose[2], last_turn_rad_s
            cost = _CHANGE * (a - turn_rad_s) ** 2 + _BACK * (b - a) ** 2
            short_sum = 0.0
            for step in range(steps):
                wanted = a if step < half else b
                rate = 0.74 * wanted + 0.26 * was
                was = wanted
                middle = yaw + 0.5 * rate * period_s
                yaw += rate * period_s
                x += speed_m_s * period_s * math.cos(middle)
                y += speed_m_s * period_s * math.sin(middle)
                room_m = margin(
                    x,
                    y,
                    yaw,
                    near,
                    node_xy,
                    node_size,
                    on_plan,
                    heading_at,
                    heading_xy,
                    aligned_cos,
                )
                short = min(max(margin_m - room_m, 0.0), _MOST_SHORT_M)
                short_sum += short * short
                if cost + dearness * short_sum >= least:
                    break
            cost += dearness * short_sum
            if cost >= least:
                continue
            beside = -math.sin(end_yaw) * (x - end_x) + math.cos(end_yaw) * (y - end_y)
            away = max(abs(beside) - _FREE_M, 0.0)
            askew = math.atan2(math.sin(yaw - end_yaw), math.cos(yaw - end_yaw))
            cost += _BESIDE * away * away + _ASKEW * askew * askew
            if first < 0 and short_sum == 0.0:
                return turn_rad_s
            if cost < least:
                best, least = a, cost
    return best
