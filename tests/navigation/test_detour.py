"""A robot that gets nowhere plans its way on."""

import math

import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.navigation.graphnav.detour import Detour, DetourConfig

STAND = np.zeros(3)
DRIVE = np.array([0.1, 0.0, 0.0])
FREE, UNKNOWN, OCCUPIED = 0x00, 0x77, 0xFF


def view_of(*walls: tuple[float, float, float, float]) -> np.ndarray:
    """Free but for rectangles: forward from, to, left from, to; metres."""
    cells, cell_m = Detour.view_shape()
    view = np.full((cells, cells), FREE, np.uint8)
    at = (np.arange(cells) - (cells - 1) / 2.0) * cell_m
    for low_x, high_x, low_y, high_y in walls:
        rows, cols = (at >= low_x) & (at <= high_x), (at >= low_y) & (at <= high_y)
        view[np.ix_(rows, cols)] = OCCUPIED
    return view


def watched(step: np.ndarray, steps: int) -> Detour:
    detour = Detour()
    for _ in range(steps):
        detour.advance(step)
    return detour


def test_robot_that_drives_is_left_alone():
    assert not watched(DRIVE, 60).is_on


def test_robot_that_stands_goes_on_a_detour_which_ends():
    detour = watched(STAND, DetourConfig().soon_steps + 1)
    assert detour.is_on
    for _ in range(DetourConfig().least_steps):
        detour.advance(DRIVE)
    assert not detour.is_on


def test_detour_lasts_until_it_has_led_the_robot_on():
    """Ended sooner, the network turns it back to where it got nowhere."""
    detour = watched(STAND, DetourConfig().soon_steps + 1)
    for _ in range(DetourConfig().least_steps + 1):
        detour.advance(STAND)
    assert detour.is_on
    for _ in range(9):
        detour.advance(DRIVE)
    assert not detour.is_on


def test_detour_that_leads_nowhere_ends():
    detour = watched(STAND, DetourConfig().soon_steps + 1)
    steps = 0
    while detour.is_on:
        detour.advance(STAND)
        steps += 1
    assert steps == DetourConfig().most_steps


def test_robot_that_drives_in_a_small_circle_gets_nowhere():
    assert watched(np.array([0.05, 0.0, 0.35]), DetourConfig().late_steps + 1).is_on


def test_an_episode_begins_without_a_detour():
    detour = watched(STAND, 30)
    detour.clear()
    assert not detour.is_on


def test_free_way_is_driven_straight():
    velocity = Detour().velocity(view_of(), np.array([2.0, 0.0]))
    assert velocity is not None
    assert velocity.linear_m_s == pytest.approx(DetourConfig().speed_m_s)
    assert abs(velocity.angular_rad_s) < 0.2


def test_wall_before_the_target_is_driven_round():
    left_open = view_of((0.7, 0.9, -4.0, 0.6))
    right_open = view_of((0.7, 0.9, -0.6, 4.0))
    target = np.array([2.0, 0.0])
    left, right = (Detour().velocity(view, target) for view in (left_open, right_open))
    assert left is not None
    assert right is not None
    assert left.angular_rad_s > 0.2
    assert right.angular_rad_s < -0.2


def test_way_once_chosen_is_kept_where_another_is_about_as_long():
    """As more is seen, now one is shorter and now the other: the robot would turn to and fro."""
    a_little_right = view_of((0.7, 0.9, -1.3, 1.5))
    a_little_left = view_of((0.7, 0.9, -1.5, 1.3))
    target = np.array([2.0, 0.0])
    detour = Detour()
    fresh = detour.velocity(a_little_left, target)
    assert fresh is not None
    assert fresh.angular_rad_s > 0.2
    detour.clear()
    assert detour.velocity(a_little_right, target).angular_rad_s < -0.2
    detour.advance(STAND)
    assert detour.velocity(a_little_left, target).angular_rad_s < -0.2
    detour.advance(STAND)
    detour.advance(STAND)
    assert detour.velocity(a_little_left, target).angular_rad_s > 0.2


def test_point_close_ahead_is_left_to_one_side():
    """The grid is too coarse to say how to get round a chair's leg that is nearly touched."""
    leg = np.array([[0.17, 0.12]])
    velocity = Detour().velocity(view_of(), np.array([2.0, 1.0]), leg)
    assert velocity is not None
    assert velocity.angular_rad_s < -0.3


def test_no_way_is_found_out_of_a_closed_room():
    walls = [(-1.2, 1.2, 1.0, 1.3), (-1.2, 1.2, -1.3, -1.0), (1.0, 1.3, -1.3, 1.3)]
    walls.append((-1.3, -1.0, -1.3, 1.3))
    assert Detour().velocity(view_of(*walls), np.array([4.0, 0.0])) is None


def test_settings_must_be_positive():
    with pytest.raises(InputError, match="positive"):
        DetourConfig(speed_m_s=-math.inf)
