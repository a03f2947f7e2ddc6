"""The last word before the wheels."""

import math

import numpy as np
import pytest

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.models.graphnav.metric.profile import bin_azimuths_rad
from toponav.models.graphnav.presets import profile_image
from toponav.navigation.graphnav.avoidance import AvoidanceConfig, CollisionAvoidance

IMAGE = profile_image()
AHEAD = Velocity(0.5, 0.0)


def profile_of(depth_m: float, left: float = math.inf, right: float = -math.inf) -> np.ndarray:
    """A wall across at a depth, between two azimuths (left is positive)."""
    out = np.full((2, IMAGE.cols), 255, np.uint8)
    azimuth = bin_azimuths_rad(IMAGE)
    out[:, (azimuth < left) & (azimuth > right)] = round(depth_m / 3.5 * 254)
    return out


@pytest.fixture
def avoidance() -> CollisionAvoidance:
    return CollisionAvoidance(IMAGE)


def drive(avoidance: CollisionAvoidance, wall_m: float, command: Velocity) -> float:
    """Metres driven towards a wall across the way."""
    driven = 0.0
    for _ in range(60):
        avoidance.insert(profile_of(max(wall_m - driven, 0.01)))
        checked = avoidance.checked(command)
        step = np.array([0.2 * checked.linear_m_s, 0.0, 0.0])
        avoidance.advance(step)
        driven += step[0]
    return driven


def test_free_way_leaves_the_command_alone(avoidance):
    assert avoidance.checked(AHEAD) == AHEAD
    avoidance.insert(profile_of(1.1))
    assert avoidance.checked(AHEAD) == AHEAD


def test_robot_stops_before_a_wall(avoidance):
    assert 0.6 < drive(avoidance, 1.0, AHEAD) <= 1.0 - AvoidanceConfig().radius_m


def test_post_beside_the_way_bends_it(avoidance):
    avoidance.insert(profile_of(0.35, left=0.75, right=0.4))
    checked = avoidance.checked(AHEAD)
    assert checked.angular_rad_s < 0.0
    assert checked.linear_m_s > 0.2


def test_what_left_the_view_is_remembered(avoidance):
    avoidance.insert(profile_of(0.3))
    avoidance.advance(np.array([0.0, 0.0, math.pi]))
    avoidance.insert(np.full((2, IMAGE.cols), 255, np.uint8))
    assert avoidance.checked(AHEAD) == AHEAD, "the wall is behind"
    avoidance.advance(np.array([0.0, 0.0, math.pi]))
    assert avoidance.checked(AHEAD).linear_m_s < 0.2
    avoidance.clear()
    assert avoidance.checked(AHEAD) == AHEAD


def test_robot_may_leave_a_wall_that_it_stands_at(avoidance):
    avoidance.insert(profile_of(0.15))
    avoidance.advance(np.array([0.0, 0.0, math.pi]))
    assert avoidance.checked(AHEAD).linear_m_s == AHEAD.linear_m_s


def test_turning_and_backing_are_never_changed(avoidance):
    avoidance.insert(profile_of(0.2))
    for command in (Velocity(0.0, 1.0), Velocity(-0.1, 0.2)):
        assert avoidance.checked(command) == command


def test_robot_that_stands_blocked_turns_to_one_side(avoidance):
    turned = []
    for step in range(20):
        avoidance.insert(profile_of(0.19))
        checked = avoidance.checked(Velocity(0.3, 0.2 if step % 2 else -0.2))
        turned.append(checked.angular_rad_s)
        assert checked.linear_m_s < 0.05
    assert len({np.sign(turn) for turn in turned[:7]}) == 2
    assert len(set(turned[8:])) == 1
    assert abs(turned[-1]) > 0.5


def test_settings_must_be_positive():
    with pytest.raises(InputError, match="positive"):
        AvoidanceConfig(margin_m=-1.0)
