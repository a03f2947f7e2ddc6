"""The search of `CollisionAvoidance`, compiled."""

import math

import numpy as np
from numba import njit

__all__ = ["carry", "safest"]


@njit(cache=True)
def carry(points: np.ndarray, step: np.ndarray) -> None:
    """See points [points, 2] from where the robot is after a step [forward, left, turn]."""
    middle = 0.5 * step[2]
    dx = step[0] * math.cos(middle) - step[1] * math.sin(middle)
    dy = step[0] * math.sin(middle) + step[1] * math.cos(middle)
    c, s = math.cos(step[2]), math.sin(step[2])
    for i in range(points.shape[0]):
        x, y = points[i, 0] - dx, points[i, 1] - dy
        points[i, 0], points[i, 1] = x * c + y * s, -x * s + y * c


@njit(cache=True)
def _is_clear(
    points: np.ndarray,
    v: float,
    w: float,
    drift_m: float,
    horizon_s: float,
    radius_m: float,
    margin_m: float,
) -> bool:
    """Whether driving an arc keeps the robot clear of the points.

    Points that it does not come nearer to do not count: a robot may always leave a wall. From
    one that is nearer than the margin already it may not come nearer by more than a centimetre.
    """
    steps = 4
    for k in range(1, steps + 1):
        t = horizon_s * k / steps
        turn = w * t
        along = v * t + drift_m
        x = along * math.cos(0.5 * turn)
        y = along * math.sin(0.5 * turn)
        for i in range(points.shape[0]):
            px, py = points[i, 0], points[i, 1]
            before = px * px + py * py
            after = (px - x) ** 2 + (py - y) ** 2
            if after >= before - 1e-6:
                continue
            limit = min(radius_m + margin_m, max(radius_m, math.sqrt(before) - 0.01))
            if after < limit * limit:
                return False
    return True


@njit(cache=True)
def safest(
    points: np.ndarray,
    v: float,
    w: float,
    drift_m: float,
    radius_m: float,
    margin_m: float,
    horizon_s: float,
    shares: np.ndarray,
    turns: np.ndarray,
    slowing: float,
    turning: float,
) -> tuple[float, float]:
    """The command nearest to (v, w) whose arc keeps clear of the points.

    `shares` of the speed and `turns` added to the turn rate are tried; `slowing` and `turning`
    say how dear each is. Where nothing is clear the robot stands and turns as told.
    """
    best_v, best_w, best_cost = 0.0, w, 1e9
    for i in range(shares.shape[0]):
        for j in range(turns.shape[0]):
            cost = slowing * (1.0 - shares[i]) + turning * abs(turns[j])
            if cost >= best_cost:
                continue
            speed = v * shares[i]
            if speed <= 0.0 or _is_clear(
                points, speed, w + turns[j], drift_m, horizon_s, radius_m, margin_m
            ):
                best_v, best_w, best_cost = speed, w + turns[j], cost
    return best_v, best_w
