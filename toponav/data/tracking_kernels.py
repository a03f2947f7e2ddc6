"""Kernels of the expert's local planner: speeds along a path, and the next velocity on it."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from toponav.data.path_kernels import chord_clearance, sample_bilinear

__all__ = [
    "FollowSettings",
    "Ground",
    "PathArrays",
    "curvature",
    "follow",
    "nearest_on_path",
    "rehearse",
    "speed_profile",
]


class Ground(NamedTuple):
    """Distance to the nearest obstacle per cell, from the grid's lower-left corner."""

    clearance_m: np.ndarray
    resolution_m: float


class PathArrays(NamedTuple):
    """Points [n, 2] every few centimetres, the speed at each, and the heading at the end."""

    points: np.ndarray
    speed: np.ndarray
    final_yaw: float


class FollowSettings(NamedTuple):
    """How a path is followed."""

    lag_s: float
    """Steer from where the robot will be after this."""
    reach_m: float
    """How far ahead on the path it steers at."""
    gain: float
    """Turn rate per angle to that point."""
    pivot_angle_rad: float
    """From this angle on it turns on the spot."""
    left_angle_rad: float
    """From this angle on it turns left wherever the point is: what it steers at is out of sight,
    and a learner that sees only depth could not tell which side is shorter."""
    turn_rad_s: float
    """Turns at most this fast."""
    hard_m: float
    """Clearance that no command may take from it where the path has more."""
    least_m: float
    """Clearance that no command may take from it anywhere."""


@njit(cache=True)
def _wrap(angle):  # type: ignore[no-untyped-def]
    return (angle + math.pi) % (2 * math.pi) - math.pi


@njit(cache=True)
def curvature(points, reach):  # type: ignore[no-untyped-def]
    """Unsigned curvature of the polyline, from the turn over `reach` points to either side."""
    count = points.shape[0]
    out = np.zeros(count)
    for i in range(1, count - 1):
        a, b = max(0, i - reach), min(count - 1, i + reach)
        before = math.atan2(points[i, 1] - points[a, 1], points[i, 0] - points[a, 0])
        after = math.atan2(points[b, 1] - points[i, 1], points[b, 0] - points[i, 0])
        length = 0.5 * (
            math.hypot(points[i, 0] - points[a, 0], points[i, 1] - points[a, 1])
            + math.hypot(points[b, 0] - points[i, 0], points[b, 1] - points[i, 1])
        )
        if length > 1e-6:
            out[i] = abs(_wrap(after - before)) / length
    return out


@njit(cache=True)
def speed_profile(  # type: ignore[no-untyped-def]
    points, clearance, resolution_m, top_m_s, turn_rad_s, slow_m_s, tight_m, brake_m_s2
):
    """Speed at each point: slower where the path bends or is tight, braking in time."""
    count = points.shape[0]
    bends = curvature(points, 3)
    speed = np.full(count, top_m_s)
    for i in range(count):
        if bends[i] > 1e-6:
            speed[i] = min(speed[i], max(slow_m_s, turn_rad_s / bends[i]))
        near = sample_bilinear(clearance, resolution_m, points[i, 0], points[i, 1])
        if near < tight_m:
            share = max(0.0, (near - 0.18) / (tight_m - 0.18))
            speed[i] = min(speed[i], slow_m_s + share * (top_m_s - slow_m_s))
    for i in range(count - 2, -1, -1):
        step = math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
        speed[i] = min(speed[i], math.sqrt(speed[i + 1] ** 2 + 2 * brake_m_s2 * step))
    return speed


@njit(cache=True)
def nearest_on_path(points, x, y, low, high):  # type: ignore[no-untyped-def]
    """Index of the nearest point among `low..high`, and its distance."""
    best, index = math.inf, low
    for i in range(low, high):
        square = (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2
        if square < best:
            best, index = square, i
    return index, math.sqrt(best)


@njit(cache=True)
def _stop_clearance(clearance, resolution_m, x, y, yaw, v, w, to_v, to_w, limits):  # type: ignore[no-untyped-def]
    """Least clearance if a command is held for 0.3 s and the robot then brakes to a stop."""
    dt = 0.05
    least = math.inf
    for step in range(20):
        if step == 6:
            to_v = 0.0
            to_w = 0.0
        v += min(max(to_v - v, -limits[2] * dt), limits[2] * dt)
        w += min(max(to_w - w, -limits[3] * dt), limits[3] * dt)
        yaw += 0.5 * w * dt
        x += v * math.cos(yaw) * dt
        y += v * math.sin(yaw) * dt
        yaw += 0.5 * w * dt
        least = min(least, sample_bilinear(clearance, resolution_m, x, y))
        if step > 6 and v == 0.0:
            break
    return least


@njit(cache=True)
def follow(path, index, pose, velocity, ground, limits, settings):  # type: ignore[no-untyped-def]
    """The next command on the path: (linear, angular, index of the nearest point, distance).

    Steers at a point ahead, nearer when the straight line to it is not free, slows and pivots
    when that point is not ahead, and never commands what could not be braked in time.
    """
    points, speed = path.points, path.speed
    x, y, yaw = pose
    v, w = velocity
    clearance, resolution_m = ground.clearance_m, ground.resolution_m
    lag_s, reach_m, hard_m = settings.lag_s, settings.reach_m, settings.hard_m
    count = points.shape[0]
    index, away = nearest_on_path(points, x, y, max(0, index - 10), min(count, index + 30))
    # Where the robot will be when the command takes hold.
    yaw_then = yaw + w * lag_s
    x_then = x + v * math.cos(yaw + 0.5 * w * lag_s) * lag_s
    y_then = y + v * math.sin(yaw + 0.5 * w * lag_s) * lag_s
    here, _ = nearest_on_path(points, x_then, y_then, max(0, index - 5), min(count, index + 10))
    target = here
    travelled = 0.0
    while target < count - 1 and travelled < reach_m:
        travelled += math.hypot(
            points[target + 1, 0] - points[target, 0], points[target + 1, 1] - points[target, 1]
        )
        target += 1
    own = sample_bilinear(clearance, resolution_m, x_then, y_then)
    floor = min(own, hard_m + 0.02) - 0.01
    while target > here + 3:
        tx, ty = points[target]
        if chord_clearance(clearance, resolution_m, x_then, y_then, tx, ty) >= floor:
            break
        target -= 1
    tx, ty = points[target]
    distance = math.hypot(tx - x_then, ty - y_then)
    if target == count - 1 and distance < 0.1:
        spare = _wrap(path.final_yaw - yaw_then)
        return 0.0, min(max(settings.gain * spare, -limits[1]), limits[1]), index, away
    error = _wrap(math.atan2(ty - y_then, tx - x_then) - yaw_then)
    top = min(limits[1], settings.turn_rad_s)
    if error < -settings.left_angle_rad:
        # Behind on the right: no camera sees it, so the side must not depend on it.
        error += 2 * math.pi
    to_w = min(max(settings.gain * error, -top), top)
    ease = max(0.0, 1.0 - (error / settings.pivot_angle_rad) ** 2)
    to_v = min(limits[0], speed[here]) * ease
    if target == count - 1:
        to_v = min(to_v, distance)
    # Slow down until the command can be braked before anything is nearer than allowed.
    now = sample_bilinear(clearance, resolution_m, x, y)
    allowed = min(hard_m, now - 0.003)
    for i in range(here, min(count, here + 15)):
        near = sample_bilinear(clearance, resolution_m, points[i, 0], points[i, 1])
        allowed = min(allowed, max(settings.least_m, near - 0.006))
    for attempt in range(3):
        share = 1.0 - 0.25 * attempt
        least = _stop_clearance(
            clearance, resolution_m, x, y, yaw, v, w, share * to_v, to_w, limits
        )
        if least >= allowed:
            return share * to_v, to_w, index, away
    to_v, to_w = _escape(clearance, resolution_m, x, y, yaw, v, w, tx, ty, limits, allowed)
    return to_v, to_w, index, away


@njit(cache=True)
def _escape(clearance, resolution_m, x, y, yaw, v, w, tx, ty, limits, allowed):  # type: ignore[no-untyped-def]
    """The safe command that ends best towards a point: nearer, facing it, rather forwards."""
    best = math.inf
    to_v, to_w = 0.0, 0.0
    for i in range(6):
        linear = -0.1 + 0.08 * i
        for j in range(-6, 7):
            angular = 0.2 * j
            least = _stop_clearance(
                clearance, resolution_m, x, y, yaw, v, w, linear, angular, limits
            )
            if least < allowed:
                continue
            turn = yaw + angular * 0.5
            ex = x + linear * 0.8 * math.cos(turn)
            ey = y + linear * 0.8 * math.sin(turn)
            ahead = _wrap(math.atan2(ty - ey, tx - ex) - yaw - angular)
            cost = math.hypot(tx - ex, ty - ey) + 0.3 * abs(ahead)
            if linear < 0:
                cost += 0.15
            if cost < best:
                best, to_v, to_w = cost, linear, angular
    return to_v, to_w


@njit(cache=True)
def rehearse(path, pose, ground, limits, settings, most_steps, period_s):  # type: ignore[no-untyped-def]
    """Poses [steps, 3] of a drive along the whole path, by the robot's limits alone."""
    poses = np.empty((most_steps, 3))
    x, y, yaw = pose
    v, w = 0.0, 0.0
    index = 0
    dt = period_s / 10
    for step in range(most_steps):
        to_v, to_w, index, _ = follow(path, index, (x, y, yaw), (v, w), ground, limits, settings)
        if to_v == 0.0 and abs(to_w) < 0.02 and abs(v) < 0.02 and step > 5:
            return poses[:step].copy()
        for _ in range(10):
            v += min(max(to_v - v, -limits[2] * dt), limits[2] * dt)
            w += min(max(to_w - w, -limits[3] * dt), limits[3] * dt)
            yaw += 0.5 * w * dt
            x += v * math.cos(yaw) * dt
            y += v * math.sin(yaw) * dt
            yaw += 0.5 * w * dt
        poses[step] = x, y, yaw
    return poses
