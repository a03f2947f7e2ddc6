"""Where one panorama was taken, seen from another: loops over all poses, compiled."""

import math

import numpy as np
from numba import njit

__all__ = ["alike", "refine", "search"]

_HIDDEN_WEIGHT = 0.25


@njit(cache=True, fastmath=True)
def alike(one: np.ndarray, other: np.ndarray, spread: float) -> np.ndarray:
    """How alike the colours of all pairs of directions are, 0..1."""
    count, others = one.shape[0], other.shape[0]
    out = np.empty((count, others), np.float32)
    for i in range(count):
        for j in range(others):
            total = 0.0
            for k in range(one.shape[1]):
                off = one[i, k] - other[j, k]
                total += off * off
            out[i, j] = math.exp(-total / (2.0 * spread * spread))
    return out


@njit(cache=True, fastmath=True)
def _seen(
    range_m: np.ndarray, x_m: float, y_m: float, distance: np.ndarray, bearing: np.ndarray
) -> None:
    """Distance and bearing of every point that the source sees, from another place."""
    count = range_m.shape[0]
    step = 2.0 * math.pi / count
    for i in range(count):
        dx = range_m[i] * math.cos(i * step) - x_m
        dy = range_m[i] * math.sin(i * step) - y_m
        distance[i] = math.sqrt(dx * dx + dy * dy)
        bearing[i] = math.atan2(dy, dx)


@njit(cache=True, fastmath=True)
def _agreement(
    distance: np.ndarray,
    bearing: np.ndarray,
    goal_m: np.ndarray,
    colour: np.ndarray,
    yaw_rad: float,
    far_m: float,
    every: int,
) -> float:
    """Share of what should be seen from the goal that is, colours and ranges."""
    count = distance.shape[0]
    step = 2.0 * math.pi / count
    good = 0.0
    weight = 1e-6
    for i in range(0, count, every):
        if distance[i] > far_m or distance[i] < 0.1:
            continue
        j = math.floor((bearing[i] - yaw_rad) / step + 0.5) % count
        off = distance[i] - goal_m[j]
        slack = 0.12 + 0.06 * distance[i]
        if off > 2.0 * slack:
            weight += _HIDDEN_WEIGHT
        else:
            weight += 1.0
            share = off / slack
            good += math.exp(-0.5 * share * share) * (0.25 + 0.75 * colour[i, j])
    return good / weight


@njit(cache=True, fastmath=True)
def search(
    range_m: np.ndarray,
    goal_m: np.ndarray,
    colour: np.ndarray,
    reach_m: float,
    pitch_m: float,
    far_m: float,
    hint: np.ndarray,
    best: np.ndarray,
) -> None:
    """Fills `best` (rows: score, x, y, yaw), the best yaw of the best places, high to low.

    Places are those that the source sees over: a grid of `pitch_m` within `reach_m`. A hint
    (x, y, pull) takes from the scores of places away from it, `pull` from a metre on.
    """
    count = range_m.shape[0]
    step = 2.0 * math.pi / count
    distance = np.empty(count)
    bearing = np.empty(count)
    best[:, 0] = -1.0
    kept = best.shape[0]
    cells = int(reach_m / pitch_m)
    for row in range(-cells, cells + 1):
        for col in range(-cells, cells + 1):
            x_m = col * pitch_m
            y_m = row * pitch_m
            away = math.sqrt(x_m * x_m + y_m * y_m)
            if away > reach_m:
                continue
            i = math.floor(math.atan2(y_m, x_m) / step + 0.5) % count
            if away > 0.0 and away > range_m[i] - 0.1:
                continue
            _seen(range_m, x_m, y_m, distance, bearing)
            top = -1.0
            top_yaw = 0.0
            for k in range(count):
                value = _agreement(distance, bearing, goal_m, colour, k * step, far_m, 2)
                if value > top:
                    top = value
                    top_yaw = k * step
            top -= hint[2] * min(1.0, math.hypot(x_m - hint[0], y_m - hint[1]))
            if top > best[kept - 1, 0]:
                place = kept - 1
                while place > 0 and best[place - 1, 0] < top:
                    best[place] = best[place - 1]
                    place -= 1
                best[place, 0] = top
                best[place, 1] = x_m
                best[place, 2] = y_m
                best[place, 3] = top_yaw


@njit(cache=True, fastmath=True)
def refine(
    range_m: np.ndarray,
    goal_m: np.ndarray,
    colour: np.ndarray,
    far_m: float,
    pose: np.ndarray,
    step_m: float,
    step_rad: float,
    halvings: int,
) -> float:
    """Climbs from `pose` (x, y, yaw), in place, to the best agreement near it; returns that."""
    count = range_m.shape[0]
    distance = np.empty(count)
    bearing = np.empty(count)
    _seen(range_m, pose[0], pose[1], distance, bearing)
    best = _agreement(distance, bearing, goal_m, colour, pose[2], far_m, 1)
    for _ in range(halvings):
        for _ in range(6):
            found = best
            x_m, y_m, yaw = pose[0], pose[1], pose[2]
            for dx in range(-1, 2):
                for dy in range(-1, 2):
                    _seen(range_m, pose[0] + dx * step_m, pose[1] + dy * step_m, distance, bearing)
                    for turn in range(-2, 3):
                        heading = pose[2] + turn * 0.5 * step_rad
                        value = _agreement(distance, bearing, goal_m, colour, heading, far_m, 1)
                        if value > found + 1e-5:
                            found = value
                            x_m = pose[0] + dx * step_m
                            y_m = pose[1] + dy * step_m
                            yaw = heading
            if found <= best + 1e-5:
                break
            best = found
            pose[0], pose[1], pose[2] = x_m, y_m, yaw
        step_m *= 0.5
        step_rad *= 0.5
    return best
