"""What learned policies are told: the same from a small camera and from a whole panorama."""

import numpy as np
import pytest

from tests.training.image_goals.corridor import corridor
from toponav.core.camera import PanoramaCamera
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import image_goal_preset
from toponav.navigation.baselines.image_goal_agent import ImageGoalAgent
from toponav.navigation.baselines.senses import EgocentricMap, Senses
from toponav.sim.imagenav import ImageNavSimulation
from toponav.training.image_goals.homes import camera_of

CONFIG = image_goal_preset("metric_rl", "compact", depth=True)
START, GOAL = Pose2(1.5, 0.7, 0.4), Pose2(6.0, 0.7, 0.0)


def driven(camera: PanoramaCamera) -> dict[str, np.ndarray]:
    simulation = ImageNavSimulation(corridor(), camera, noise=None)
    senses = Senses(CONFIG)
    senses.reset(simulation.reset(START, GOAL))
    inputs = senses.observe(simulation.observe(), None)
    for action in (Action.RIGHT, Action.RIGHT, Action.FORWARD, Action.FORWARD):
        simulation.step(action)
        inputs = senses.observe(simulation.observe(), action)
    return inputs


def test_a_compact_camera_shows_what_is_left_of_a_whole_panorama() -> None:
    small, whole = driven(camera_of(CONFIG)), driven(PanoramaCamera())
    for name in ("image", "goal"):
        difference = np.abs(small[name].astype(int) - whole[name].astype(int))
        assert np.median(difference) <= 3
        turned = np.abs(np.roll(small[name], 4, -1).astype(int) - whole[name].astype(int))
        assert difference.mean() < 0.6 * turned.mean()
    assert (small["map"] == whole["map"]).mean() > 0.97


def test_the_last_action_and_contact_are_felt() -> None:
    sensors = driven(camera_of(CONFIG))["sensors"]
    assert sensors.tolist() == [0.0, 1.0, 0.0, 0.0, 0.0]


def test_the_map_shows_walls_beside_the_robot_and_floor_ahead() -> None:
    simulation = ImageNavSimulation(corridor(), camera_of(CONFIG), noise=None)
    senses = Senses(CONFIG)
    senses.reset(simulation.reset(Pose2(3.0, 0.7, 0.0), GOAL))
    near = senses.observe(simulation.observe(), None)["map"]
    obstacle, free = near[0] > 0, near[1] > 0
    # 0.2 m a cell, the robot between cells 15 and 16; the corridor is 1 m wide.
    assert free[15:17, 16:20].all()
    assert obstacle[13, 14:18].any()
    assert obstacle[18, 14:18].any()
    assert not free[20:].any()


def test_a_map_forgets() -> None:
    seen = EgocentricMap()
    seen.add(np.full((32, 144), 100, np.uint8), Pose2(0, 0, 0))
    assert seen.around(Pose2(0, 0, 0)).any()
    seen.reset()
    assert not seen.around(Pose2(0, 0, 0)).any()


@pytest.mark.parametrize("sampled", [True, False])
def test_an_agent_repeats_itself_given_its_seed(sampled: bool) -> None:
    simulation = ImageNavSimulation(corridor(), camera_of(CONFIG), noise=None)
    agent = ImageGoalAgent(ImageGoalNetwork(CONFIG), sampled=sampled)
    runs = []
    for _ in range(2):
        agent.reseed(5)
        agent.reset(simulation.reset(START, GOAL))
        runs.append([agent.act(simulation.observe()) for _ in range(6)])
    assert runs[0] == runs[1]
