"""A robot that is lost in its first room looks where it has not looked yet."""

import math

import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.navigation.graphnav.metric_config import MetricAgentConfig
from toponav.navigation.graphnav.room_search import RoomSearch, RoomSearchConfig

FREE, UNKNOWN, OCCUPIED = 0x00, 0x77, 0xFF
CELLS, CELL_M = 128, 0.1
FOUND, LOST = 3.0, -1.0


def room(**openings: tuple[float, float]) -> np.ndarray:
    """A room of 4 m by 4 m, seen whole; openings in walls `ahead`, `behind`, `left`, `right`."""
    view = np.full((CELLS, CELLS), UNKNOWN, np.uint8)
    at = (np.arange(CELLS) - (CELLS - 1) / 2.0) * CELL_M
    inner, outer = np.abs(at) < 2.0, np.abs(at) < 2.2
    view[np.ix_(outer, outer)] = OCCUPIED
    view[np.ix_(inner, inner)] = FREE
    walls = {"ahead": at >= 2.0, "behind": at <= -2.0, "left": at >= 2.0, "right": at <= -2.0}
    for name, (low, high) in openings.items():
        wall, gap = walls[name] & outer, (at > low) & (at < high)
        cells = np.ix_(wall, gap) if name in ("ahead", "behind") else np.ix_(gap, wall)
        view[cells] = FREE
    return view


def searching() -> RoomSearch:
    search = RoomSearch()
    search.consider(RoomSearchConfig().patience, LOST, is_early=True)
    return search


def test_a_robot_that_was_put_right_at_once_does_not_search():
    search = RoomSearch()
    for begun in range(RoomSearchConfig().patience):
        search.consider(begun, LOST, is_early=True)
        assert not search.is_on


def test_a_robot_that_was_wrong_again_searches_until_it_is_found():
    search = searching()
    assert search.is_on
    search.consider(RoomSearchConfig().patience, FOUND, is_early=True)
    assert not search.is_on


def test_only_the_first_room_is_searched():
    search = RoomSearch()
    search.consider(RoomSearchConfig().patience, LOST, is_early=False)
    assert not search.is_on


def test_a_search_ends_and_the_belief_is_tried_for_a_while():
    search, config = searching(), RoomSearchConfig()
    for _ in range(config.lasts_steps):
        assert search.is_on
        search.advance(np.zeros(3))
    search.consider(config.patience + 1, LOST, is_early=True)
    assert not search.is_on
    for _ in range(config.rests_steps):
        search.advance(np.zeros(3))
    search.consider(config.patience + 2, LOST, is_early=True)
    assert search.is_on


def test_an_episode_begins_without_a_search():
    search = searching()
    search.clear()
    assert not search.is_on


@pytest.mark.parametrize(
    ("wall", "bearing_deg"), [("ahead", 0.0), ("left", 90.0), ("behind", 180.0), ("right", -90.0)]
)
def test_the_only_opening_is_looked_at(wall: str, bearing_deg: float):
    target = searching().target(room(**{wall: (-0.7, 0.7)}), CELL_M)
    assert target is not None
    away = math.degrees(math.atan2(target[1], target[0])) - bearing_deg
    assert abs(math.remainder(away, 360.0)) < 25.0
    assert np.hypot(*target) == pytest.approx(2.2, abs=0.4)


def test_a_closed_room_leaves_nothing_to_look_at():
    assert searching().target(room(), CELL_M) is None


def test_a_gap_too_narrow_for_the_robot_is_no_way():
    assert searching().target(room(left=(-0.15, 0.15)), CELL_M) is None


def test_of_two_openings_the_one_ahead_costs_less_turning():
    target = searching().target(room(ahead=(-0.7, 0.7), behind=(-0.7, 0.7)), CELL_M)
    assert target is not None
    assert target[0] > 1.5


def test_what_was_chosen_stays_where_it_is_while_the_robot_moves():
    search = searching()
    before = search.target(room(ahead=(-0.7, 0.7)), CELL_M)
    search.advance(np.array([0.1, 0.0, math.radians(90.0)]))
    after = search.target(room(), CELL_M)
    assert before is not None
    assert after is not None
    assert after == pytest.approx([before[1], -(before[0] - 0.1)], abs=1e-6)


def test_the_part_can_be_left_out():
    assert MetricAgentConfig().without(["room_search"]).room_search is None


@pytest.mark.parametrize(
    "settings", [{"lasts_steps": 0}, {"found": -1.0}, {"clearance_m": math.nan}]
)
def test_settings_are_checked(settings: dict[str, float]):
    with pytest.raises(InputError, match="positive"):
        RoomSearchConfig(**settings)
