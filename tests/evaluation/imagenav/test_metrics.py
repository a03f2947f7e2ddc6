"""Success, SPL and their intervals, by hand."""

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import record
from toponav.evaluation.imagenav.metrics import agent_results, bootstrap_interval, suite_results

VARIANT = {"noise": True, "stop": True, "sliding": False, "goals": 1}


def test_a_detour_of_twice_the_way_halves_spl() -> None:
    numbers = agent_results([record("a", 0, "s", path_m=4.0), record("a", 1, "w")])
    assert numbers["success_rate"] == 0.5
    assert numbers["spl"] == pytest.approx(0.25)


def test_driving_less_than_the_shortest_path_is_not_rewarded() -> None:
    # One may stop a metre before the goal.
    assert agent_results([record("a", 0, "s", path_m=1.2)])["spl"] == 1.0


def test_intervals_of_a_coin_are_as_wide_as_theory_has_them() -> None:
    values = np.array([0.0, 1.0] * 200)
    low, high = bootstrap_interval(values) or (0.0, 0.0)
    expected = 1.96 * 0.5 / np.sqrt(400)
    assert low == pytest.approx(0.5 - expected, abs=0.01)
    assert high == pytest.approx(0.5 + expected, abs=0.01)


def test_what_differs_between_groups_alone_has_no_interval() -> None:
    values = np.array([0.0] * 50 + [1.0] * 50)
    assert bootstrap_interval(values, ["hard"] * 50 + ["easy"] * 50) == (0.5, 0.5)
    low, high = bootstrap_interval(values) or (0.0, 0.0)
    assert high - low > 0.1


def test_one_episode_has_no_interval_and_certainty_has_wilsons() -> None:
    assert agent_results([record("a", 0, "w")])["success_ci95"] is None
    every = agent_results([record("a", number, "s") for number in range(10)])
    low, high = every["success_ci95"]
    assert high == 1.0
    assert low == pytest.approx(0.722, abs=0.001)


def test_difficulties_and_outcomes_are_counted_apart() -> None:
    records = [
        record("a", 0, "s"),
        record("a", 1, "t"),
        record("a", 0, "w", level="hard", length_m=7.0),
    ]
    results = suite_results(records, VARIANT)
    numbers = results["agents"]["a"]
    assert numbers["by_difficulty"]["easy"]["success_rate"] == 0.5
    assert numbers["by_difficulty"]["hard"]["success_rate"] == 0.0
    assert "medium" not in numbers["by_difficulty"]
    assert numbers["outcomes"] == {"success": 1, "wrong_stop": 1, "timeout": 1}
    assert numbers["variant"] == VARIANT
    assert results["episodes"]["hard"]["geodesic_m_mean"] == 7.0
    assert results["episodes"]["easy"]["rooms_range"] == [5, 5]


def test_sequential_goals_count_as_shares_of_what_was_reached() -> None:
    numbers = agent_results([record("a", 0, "sst"), record("a", 1, "stt")])
    assert [goal["success_rate"] for goal in numbers["by_goal"]] == [1.0, 0.5, 0.0]
    upto = [goal["up_to"]["success_rate"] for goal in numbers["by_goal"]]
    assert upto == pytest.approx([1.0, 0.75, 0.5])
    assert numbers["success_rate"] == pytest.approx(0.5)


def test_agents_are_compared_on_the_episodes_that_both_ran() -> None:
    ours = [record("a", number, "s") for number in range(4)]
    theirs = [record("b", number, "sw"[number % 2]) for number in range(1, 4)]
    (pair,) = suite_results([*ours, *theirs], VARIANT)["paired"]
    assert (pair["agent"], pair["than"], pair["episodes"]) == ("a", "b", 3)
    assert pair["success_difference"]["mean"] == pytest.approx(2 / 3)
    assert pair["success_ratio"] == pytest.approx(3.0)
