"""What a step costs an image-goal agent."""

import numpy as np

from tests.evaluation.imagenav.searches import episode, network, simulation
from toponav.evaluation.benchmarks.imagenav import time_graph_update, time_steps
from toponav.navigation.nts.agent import NTSAgent
from toponav.navigation.nts.perception import Perception


def test_every_step_is_timed_with_its_camera() -> None:
    times = time_steps(NTSAgent(network()), simulation(max_steps=5), episode())
    assert times.act_s.shape == times.camera_s.shape == (5,)
    assert (times.act_s > 0).all()


def test_a_larger_graph_does_not_make_its_update_dearer() -> None:
    robot = simulation()
    robot.reset(episode().start, episode().goal, 0)
    small, large = (
        float(np.median(time_graph_update(Perception(network()), robot, nodes, 15)))
        for nodes in (8, 512)
    )
    assert large < 2.0 * small + 0.002
