from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.evaluation.records import PLAN, STEP, record, verdict
from toponav.core.vocabulary import Outcome
from toponav.evaluation.metrics import agent_results, suite_results, wilson_interval

GOOD = verdict(Outcome.SUCCESS, 5)
LOST = verdict(Outcome.DEVIATED, 3)


@pytest.mark.parametrize(("successes", "trials"), [(34, 72), (1, 3), (499, 500)])
def test_wilson_bounds_are_where_the_normal_test_just_rejects(successes: int, trials: int) -> None:
    interval = wilson_interval(successes, trials)
    assert interval is not None
    for bound in interval:
        deviation = abs(successes / trials - bound)
        assert deviation == pytest.approx(1.959964 * (bound * (1 - bound) / trials) ** 0.5)


def test_wilson_interval_without_failures_reaches_one() -> None:
    # The rule of z^2 / (n + z^2): 1 - 3.8415 / 13.8415.
    assert wilson_interval(10, 10) == pytest.approx((0.72246, 1.0), abs=1e-5)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.27754), abs=1e-5)


def test_nothing_tried_has_no_interval() -> None:
    assert wilson_interval(0, 0) is None


@given(st.integers(1, 2000), st.data())
def test_wilson_interval_holds_the_rate(trials: int, data: st.DataObject) -> None:
    successes = data.draw(st.integers(0, trials))
    interval = wilson_interval(successes, trials)
    assert interval is not None
    assert 0.0 <= interval[0] <= successes / trials <= interval[1] <= 1.0


def test_success_and_completion_are_those_of_the_strict_rule_at_the_top() -> None:
    results = agent_results([record(), record(index=1, strict=LOST, tolerant=GOOD)])
    assert results["episodes"] == 2
    assert results["success_rate"] == 0.5
    assert results["plan_completion"] == pytest.approx((1.0 + 0.6) / 2)
    assert results["tolerant"]["success_rate"] == 1.0
    assert results["outcomes"]["deviated"] == 1
    assert sum(results["outcomes"].values()) == 2


def test_a_failed_episode_charges_exactly_one_edge() -> None:
    by_behavior = agent_results([record(), record(index=1, strict=LOST)])["by_behavior"]
    attempts = sum(numbers["attempts"] for numbers in by_behavior.values())
    passed = sum(n["attempts"] * n["success_rate"] for n in by_behavior.values() if n["attempts"])
    assert attempts == 4 + 3
    assert attempts - passed == pytest.approx(1)
    following = by_behavior["corridor_follow"]
    assert (following["attempts"], following["success_rate"]) == (2, 0.5)
    assert by_behavior["straight"]["success_rate"] is None


def test_transitions_are_counted_like_behaviours() -> None:
    by_transition = agent_results([record(strict=LOST)])["by_transition"]
    assert by_transition["within office"]["success_rate"] == 1.0
    assert by_transition["within hallway"] == {
        "attempts": 1,
        "success_rate": 0.0,
        "success_ci95": [0.0, pytest.approx(0.79345, abs=1e-5)],
    }
    assert "hallway->office" not in by_transition


def test_accuracy_counts_only_steps_with_a_true_edge() -> None:
    steps = (
        STEP,
        replace(STEP, behavior="turn_left", believed_edge="office_1_door->hallway_1-1r"),
        replace(STEP, true_edge=None, true_behavior=None, behavior="straight"),
    )
    results = agent_results([record(strict=verdict(Outcome.DEVIATED, 1, 3), steps=steps)])
    find_door = results["by_behavior"]["find_door"]
    assert (find_door["prediction_steps"], find_door["prediction_accuracy"]) == (2, 0.5)
    assert results["localization_accuracy"] == 0.5
    assert results["node_localization_accuracy"] == 1.0


def test_strict_accuracy_leaves_out_what_came_after_the_strict_verdict() -> None:
    steps = (STEP, replace(STEP, behavior="straight"))
    early = verdict(Outcome.DEVIATED, 1, 1)
    results = agent_results([record(strict=early, tolerant=GOOD, steps=steps)])
    assert results["by_behavior"]["find_door"]["prediction_accuracy"] == 1.0
    tolerant = results["tolerant"]["by_behavior"]["find_door"]
    assert tolerant["prediction_accuracy"] == 0.5


def test_success_on_what_the_expert_passes_needs_the_expert() -> None:
    mine = [record("gtl", 0), record("gtl", 1, LOST), record("gtl", 2, LOST)]
    expert = [record("expert", 0), record("expert", 1), record("expert", 2, LOST, GOOD)]
    agents = suite_results([*mine, *expert])["agents"]
    assert list(agents) == ["gtl", "expert"]
    assert agents["gtl"]["success_on_expert_feasible"] == 0.5
    assert agents["gtl"]["tolerant"]["success_on_expert_feasible"] == pytest.approx(1 / 3)
    alone = suite_results(mine)["agents"]["gtl"]
    assert "success_on_expert_feasible" not in alone


def test_an_agent_that_never_says_where_it_is_has_no_localization() -> None:
    silent = replace(STEP, believed_node=None, believed_edge=None)
    results = agent_results([record(steps=(silent, silent))])
    assert results["localization_accuracy"] is None
    assert results["node_localization_accuracy"] is None
    assert results["localization_ci95"] is None
    assert results["localization_steps"] == 0
    wrong = replace(STEP, believed_node="nowhere", believed_edge=None)
    assert agent_results([record(steps=(wrong, silent))])["localization_accuracy"] == 0.0


def test_difficulty_is_by_plan_nodes() -> None:
    by_difficulty = agent_results([record()])["by_difficulty"]
    assert len(PLAN.nodes) <= 10
    assert by_difficulty["I"]["episodes"] == 1
    assert by_difficulty["III"]["success_rate"] is None


def test_results_have_what_the_schema_names() -> None:
    results = suite_results([record(), record("expert")])
    assert (results["schema"], results["suite"]) == (1, "graphnav")
    assert results["agents"]["gtl"].keys() >= {
        *("episodes", "success_rate", "success_ci95", "plan_completion", "tolerant"),
        *("success_on_expert_feasible", "outcomes", "by_difficulty", "by_behavior"),
        *("localization_accuracy", "steps_per_second", "act_ms_p50", "act_ms_p99"),
    }
    assert results["agents"]["gtl"]["steps_per_second"] == 4.0
