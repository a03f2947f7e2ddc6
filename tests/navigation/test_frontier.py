"""Frontier exploration and the adaptation of Active Neural SLAM, in two rooms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, network, simulation
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageGoal
from toponav.navigation.baselines.ans import ActiveNeuralSlamAgent
from toponav.navigation.baselines.frontier import FrontierAgent, frontiers
from toponav.navigation.nts.local_policy import LocalPolicy
from toponav.navigation.nts.perception import Perception

AGENTS = [FrontierAgent, ActiveNeuralSlamAgent]


def test_the_unseen_room_is_a_frontier_and_the_nearest_comes_first() -> None:
    simulated = simulation()
    simulated.reset(START, START, 0)
    policy = LocalPolicy()
    policy.observe(simulated.observe(), Pose2(0.0, 0.0, 0.0))
    _, found = frontiers(policy, Pose2(0.0, 0.0, 0.0))
    drives_m = [frontier.drive_m for frontier in found]
    assert drives_m == sorted(drives_m)
    # The doorway is 3 m ahead of the start; something behind it is still to be seen.
    assert any(frontier.at[0] > 2.5 for frontier in found)
    for frontier in found:
        assert frontier.drive_m >= 0.9 * math.hypot(*frontier.at) - 0.2


@pytest.mark.parametrize("make", AGENTS)
def test_a_goal_in_sight_is_reached(make: type) -> None:
    simulated = simulation(max_steps=40)
    agent = make(Perception(network()))
    agent.reset(simulated.reset(START, Pose2(3.5, 4.0, 2.0), 0))
    while not simulated.state.done:
        simulated.step(agent.act(simulated.observe()))
    assert simulated.state.success
    assert agent.belief().mode == "stop"
    assert agent.belief().stopped_because == "at the goal"


@pytest.mark.parametrize("make", AGENTS)
def test_a_goal_that_is_no_picture_ends_the_episode_with_a_reason(make: type) -> None:
    agent = make(Perception(network()))
    agent.reset(ImageGoal(np.zeros((64, 64, 3), np.uint8)))
    simulated = simulation()
    simulated.reset(START, START, 0)
    assert agent.act(simulated.observe()) is Action.STOP
    assert "128x512" in agent.belief().stopped_because


@pytest.mark.parametrize("make", AGENTS)
def test_dead_cameras_and_broken_odometry_raise_nothing(make: type) -> None:
    simulated = simulation()
    goal = simulated.reset(START, Pose2(8.0, 3.0, 0.0), 0)
    agent = make(Perception(network()))
    agent.reset(goal)
    seen = simulated.observe()
    assert seen.depth_m is not None
    broken = [
        replace(seen, rgb=np.zeros_like(seen.rgb)),
        replace(seen, depth_m=np.zeros_like(seen.depth_m)),
        replace(seen, depth_m=np.full_like(seen.depth_m, np.nan)),
        replace(seen, odometry=Pose2(math.nan, 0.0, 0.0)),
        replace(seen, odometry=Pose2(50.0, 0.0, 0.0)),
    ]
    for observation in broken:
        assert agent.act(observation) in Action
        pose = agent.belief().pose
        assert math.isfinite(pose.x_m)
        assert math.hypot(pose.x_m, pose.y_m) < 2.0


def test_laying_pictures_over_each_other_takes_back_drift() -> None:
    simulated = simulation(noise="locobot")
    agents = [make(Perception(network())) for make in AGENTS]
    off_m = []
    for agent in agents:
        goal = simulated.reset(START, Pose2(8.0, 3.0, 0.0), 4)
        agent.reset(goal)
        for number in range(24):
            agent.act(simulated.observe())
            agent._action = Action.FORWARD if number % 6 == 5 else Action.LEFT
            simulated.step(agent._action)
        agent.act(simulated.observe())
        believed = START.compose(agent.belief().pose)
        off_m.append(believed.distance_to(simulated.state.pose))
    assert off_m[1] < off_m[0]
    assert off_m[1] < 0.15
