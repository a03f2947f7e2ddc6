"""Real rclpy: a home in the simulator here, Neural Topological SLAM with its weights there."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    PANORAMA_SHAPE,
    SUCCESS_RADIUS_M,
    ImageGoal,
    ImageNavEpisode,
)
from toponav.data.nts.episodes import load_episodes
from toponav.sim.imagenav import IMAGE_NAV_CAMERA
from toponav.sim.simulation import Simulation
from toponav.worlds.generate.suites import suite, suite_scene

pytestmark = [
    pytest.mark.ros,
    pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning"),
]


class Home(NamedTuple):
    """A simulated robot in a home, what it is to find, and the agent that drives it."""

    node: Any
    episode: ImageNavEpisode
    agent: Any
    folder: Path

    def run(self, *words: str, while_: Callable[[Any], bool] = lambda _: True) -> tuple[int, str]:
        """Exit status and output of a `toponav ros` command, with the robot alive meanwhile."""
        from toponav.ros.harness import RosProcess

        log = self.folder / f"{words[0]}.log"
        process = RosProcess(words, log)
        try:
            self.node.run(lambda: process.is_over() or not while_(process))
            if not process.is_over():
                process.interrupt()
                self.node.run(process.is_over)
        finally:
            process.close()
        return process.process.returncode, log.read_text()


@pytest.fixture(scope="module")
def home(ros: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    from toponav.cli._ros_setup import with_panorama
    from toponav.ros.harness import RosProcess
    from toponav.ros.presets import robot_preset
    from toponav.ros.sim_node import SimNode, SimNodeConfig

    folder = tmp_path_factory.mktemp("picture")
    episode = load_episodes("homes-test", "easy", 5)[4]
    scene = suite_scene(suite(episode.scene_suite).generator, episode.scene_seed)
    simulation = Simulation(scene, IMAGE_NAV_CAMERA, modalities=("depth", "rgb"))
    config = SimNodeConfig(with_panorama(robot_preset("toponav")))
    node = SimNode(simulation, episode.goal, config)
    agent = RosProcess(["agent", "--image-agent", "nts_rgbd", "--sim-time"], folder / "agent.log")
    try:
        yield Home(node, episode, agent, folder)
    finally:
        agent.close()
        node.destroy_node()


@pytest.fixture(scope="module")
def picture(home: Home) -> Path:
    """What the robot sees at the goal."""
    home.node.reset(home.episode.start)
    x_m, y_m, yaw_rad = home.episode.goal
    status, said = home.run("put", "--", str(x_m), str(y_m), str(yaw_rad))
    assert status == 0, said
    assert home.node.robot.state.pose == pytest.approx(home.episode.goal, abs=0.01)
    path = home.folder / "goal.png"
    status, said = home.run("picture", "--out", str(path), "--depth")
    assert status == 0, said
    assert (home.folder / "goal.depth.png").is_file()
    return path


def test_the_robot_finds_the_place_of_a_picture(home: Home, picture: Path) -> None:
    home.node.reset(home.episode.start)
    home.node.contacts.clear()
    status, said = home.run("find", str(picture), "--json", "--timeout-s", "200")
    assert status == 0, said
    result = json.loads(said.splitlines()[-1])
    assert (result["success"], result["outcome"]) == (True, "stopped")
    assert "looks like this place" in result["reason"]
    assert home.node.contacts == []
    assert away_m(home.node.robot.state.pose, home.episode.goal) < SUCCESS_RADIUS_M
    assert away_m(home.episode.start, home.episode.goal) > SUCCESS_RADIUS_M


def test_an_interrupt_cancels_the_search_and_stops_the_robot(home: Home) -> None:
    from toponav.ros.pictures import write_goal

    # There is no such place: the agent goes on looking until it is told otherwise.
    noise = np.random.default_rng(0).integers(0, 256, (*PANORAMA_SHAPE, 3), dtype=np.uint8)
    nowhere = home.folder / "nowhere.png"
    write_goal(nowhere, ImageGoal(noise, np.full(PANORAMA_SHAPE, 0.5, np.float32)))
    home.node.reset(home.episode.start)

    def stands_at_start(_: Any) -> bool:
        return away_m(home.node.robot.state.pose, home.episode.start) < 0.1

    words = ("find", str(nowhere), "--json", "--timeout-s", "200")
    status, said = home.run(*words, while_=stands_at_start)
    assert status == 1, said
    assert json.loads(said.splitlines()[-1])["outcome"] == "cancelled"
    end_ns = home.node.robot.time_ns + 1_000_000_000
    home.node.run(lambda: home.node.robot.time_ns > end_ns)
    assert abs(home.node.robot.state.velocity.linear_m_s) < 0.02


def test_a_picture_without_the_depth_that_is_compared_is_refused(
    home: Home, picture: Path
) -> None:
    flat = picture.with_name("flat.png")
    flat.write_bytes(picture.read_bytes())
    status, said = home.run("find", str(flat), "--json", "--timeout-s", "200")
    assert status == 1
    result = json.loads(said.splitlines()[-1])
    assert result["outcome"] == "rejected"
    assert "the goal has none" in result["reason"]


def away_m(here: Pose2, there: Pose2) -> float:
    return float(((here.x_m - there.x_m) ** 2 + (here.y_m - there.y_m) ** 2) ** 0.5)
