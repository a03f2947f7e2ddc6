"""What image-goal agents and robots exchange."""

import math

import pytest

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    DIRECTIONS,
    Action,
    ImageNavEpisode,
    bin_of_direction,
    direction_of_bin,
)


def test_bins_run_counter_clockwise_from_forward() -> None:
    assert bin_of_direction(0.0) == 0
    assert bin_of_direction(math.pi / 2) == 3
    assert bin_of_direction(math.pi) == bin_of_direction(-math.pi) == 6
    assert bin_of_direction(-math.pi / 2) == 9


def test_the_middle_of_a_bin_lies_in_it() -> None:
    for number in range(DIRECTIONS):
        assert bin_of_direction(direction_of_bin(number)) == number
        assert bin_of_direction(direction_of_bin(number) + math.radians(14.9)) == number
        assert bin_of_direction(direction_of_bin(number) - math.radians(14.9)) == number


def test_actions_have_the_numbers_of_the_environment() -> None:
    assert [action.name for action in Action] == ["STOP", "FORWARD", "LEFT", "RIGHT"]
    assert Action.STOP == 0


def test_an_episode_has_a_name_of_its_own() -> None:
    pose = Pose2(0.0, 0.0, 0.0)
    assert ImageNavEpisode("homes-test", 2000, pose, pose, 2.0, "easy", 7).id == (
        "homes-test/easy/0007"
    )


def test_an_episode_without_a_path_is_refused() -> None:
    pose = Pose2(0.0, 0.0, 0.0)
    with pytest.raises(InputError, match="longer than zero"):
        ImageNavEpisode("homes-test", 2000, pose, pose, 0.0, "easy")
