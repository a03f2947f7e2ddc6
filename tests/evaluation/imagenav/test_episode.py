"""One search: how it ends, what counts, and several goals in a row."""

from dataclasses import replace

import pytest

from tests.evaluation.imagenav.searches import GOAL, Scripted, episode, simulation
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action
from toponav.data.nts.shortest_path import ShortestPathAgent
from toponav.evaluation.imagenav.episode import StepView, run_episode
from toponav.navigation.baselines.random_walk import RandomWalkAgent

AHEAD = [Action.FORWARD] * 8


def test_who_knows_the_floor_plan_takes_the_shortest_path() -> None:
    through_the_door = episode(goal=Pose2(7.0, 3.0, 0.0), length_m=5.0)
    found = run_episode(simulation(), ShortestPathAgent(), through_the_door, label="a", seed=0)
    (goal,) = found.goals
    assert goal.outcome == "success"
    assert goal.spl == pytest.approx(1.0, abs=0.03)
    assert goal.reason == "at the goal"
    assert found.rooms == 2


def test_the_floor_plan_helps_against_noise_too() -> None:
    through_the_door = episode(goal=Pose2(8.5, 1.0, 0.0), length_m=6.8)
    noisy = simulation(noise="locobot")
    for seed in range(3):
        found = run_episode(noisy, ShortestPathAgent(), through_the_door, label="a", seed=seed)
        assert found.goals[0].success


def test_stopping_too_early_is_wrong() -> None:
    agent = Scripted([Action.FORWARD, Action.STOP])
    found = run_episode(simulation(), agent, episode(), label="a", seed=0)
    (goal,) = found.goals
    assert (goal.outcome, goal.steps) == ("wrong_stop", 2)
    assert goal.distance_m == pytest.approx(1.75, abs=0.05)
    assert goal.spl == 0.0


def test_who_never_stops_runs_out_of_time() -> None:
    agent = Scripted(AHEAD)
    found = run_episode(simulation(max_steps=9), agent, episode(), label="a", seed=0)
    assert found.goals[0].outcome == "timeout"
    assert len(found.steps) == 9
    assert found.steps[0].x_m == pytest.approx(2.0)


def test_without_stop_it_is_over_when_it_is_there_and_saying_so_wrongly_is_denied() -> None:
    agent = Scripted([Action.STOP, *AHEAD])
    found = run_episode(simulation(stop=False), agent, episode(), label="a", seed=0)
    assert found.goals[0].outcome == "success"
    assert agent.denied == 1
    assert found.goals[0].path_m == pytest.approx(1.0, abs=0.26)


def test_the_next_goal_is_sought_from_where_the_last_search_ended() -> None:
    agent = Scripted([Action.FORWARD] * 5 + [Action.STOP])
    found = run_episode(
        simulation(), agent, episode(), label="a", seed=0, more_goals=[Pose2(4.5, 3.0, 0.0)]
    )
    first, second = found.goals
    assert (first.outcome, second.outcome) == ("success", "success")
    assert second.geodesic_m == pytest.approx(1.25, abs=0.05)
    assert second.path_m == pytest.approx(1.25)
    assert agent.resets == [False, True]
    assert [step.goal for step in found.steps] == [0] * 6 + [1] * 6


def test_a_lost_goal_does_not_end_the_episode() -> None:
    agent = Scripted([Action.STOP])
    found = run_episode(simulation(), agent, episode(), label="a", seed=0, more_goals=[GOAL, GOAL])
    assert [goal.outcome for goal in found.goals] == ["wrong_stop"] * 3


def test_the_same_seed_gives_the_same_record() -> None:
    records = []
    for _ in range(2):
        agent = RandomWalkAgent(seed=3, stop_chance=0.0)
        noisy = simulation(noise="locobot", max_steps=12)
        found = run_episode(noisy, agent, episode(), label="a", seed=5)
        steps = tuple(replace(step, act_ms=0.0) for step in found.steps)
        records.append(replace(found, steps=steps, wall_s=0.0))
    assert records[0] == records[1]


def test_what_is_shown_of_a_step_is_what_led_to_it() -> None:
    views: list[StepView] = []
    agent = Scripted([Action.FORWARD, Action.STOP])
    run_episode(simulation(), agent, episode(), label="a", seed=0, on_step=views.append)
    assert [view.action for view in views] == [Action.FORWARD, Action.STOP]
    assert views[1].pose.x_m == pytest.approx(2.25)
    assert views[0].goal_pose == GOAL
    assert views[0].goal_image.rgb.shape == views[0].observation.rgb.shape
