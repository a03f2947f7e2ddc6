"""The truth of the four functions, and the agent that is told it."""

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, episode, network, simulation
from toponav.core.geometry import Pose2
from toponav.core.imagenav import DIRECTIONS, bin_of_direction
from toponav.evaluation.imagenav.episode import run_episode
from toponav.evaluation.imagenav.oracle import FUNCTIONS, OracleAgent, TruePerception
from toponav.navigation.nts.perception import Perception

BEHIND_THE_DOOR = Pose2(8.0, 3.0, 0.0)


def perception(truths=FUNCTIONS) -> TruePerception:  # type: ignore[no-untyped-def]
    simulated = simulation()
    simulated.reset(START, BEHIND_THE_DOOR, 0)
    told = TruePerception(network(), truths)
    told.simulation = simulated
    return told


def views(told: TruePerception):  # type: ignore[no-untyped-def]
    """Of the start and of the goal."""
    assert told.simulation is not None
    here = told.see(*told.simulation.see(START))
    told.sees_goal = True
    there = told.see(*told.simulation.see(BEHIND_THE_DOOR))
    told.sees_goal = False
    return here, there


def test_a_wall_parts_nodes_and_a_doorway_does_not() -> None:
    told = perception()
    assert told.is_same_node(Pose2(4.0, 3.0, 0.0), Pose2(6.0, 3.0, 0.0))
    assert not told.is_same_node(Pose2(4.0, 1.0, 0.0), Pose2(6.0, 1.0, 0.0))
    assert not told.is_same_node(START, BEHIND_THE_DOOR)


def test_the_way_to_the_goal_leads_through_the_door() -> None:
    told = perception()
    here, there = views(told)
    assert here.explorable.shape == (DIRECTIONS,)
    ahead = bin_of_direction(0.0)
    assert here.explorable[ahead] == 1.0
    pair = told.compare([here], there)
    assert pair.score[0].argmax() == ahead
    # 6 m straight through the door.
    assert pair.score[0, ahead] == pytest.approx(np.exp(-6.0 / 5.0), rel=0.08)
    assert pair.connection[0] == 0.0
    assert pair.distance_m[0] == pytest.approx(6.0)


def test_what_is_not_told_is_the_networks() -> None:
    told = perception({"score"})
    here, there = views(told)
    pair, own = told.compare([here], there), Perception(network()).compare([here], there)
    assert np.array_equal(pair.connection, own.connection)
    assert np.array_equal(pair.distance_m, own.distance_m)
    assert not np.array_equal(pair.score, own.score)


@pytest.mark.parametrize("truths", [FUNCTIONS, ("localization",), ("relative_pose",)])
def test_told_the_truth_an_untrained_network_finds_a_goal_in_sight(truths: tuple) -> None:  # type: ignore[type-arg]
    agent = OracleAgent(network(), truths)
    found = run_episode(simulation(max_steps=60), agent, episode(), label="oracle", seed=0)
    assert found.goals[0].success
    assert found.goals[0].distance_m < 0.6


def test_told_everything_it_goes_through_the_door_at_once() -> None:
    agent = OracleAgent(network())
    behind = episode(goal=BEHIND_THE_DOOR, length_m=6.0)
    found = run_episode(simulation(max_steps=120), agent, behind, label="oracle", seed=0)
    assert found.goals[0].success
    assert found.goals[0].spl > 0.75
