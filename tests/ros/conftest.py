"""What the tests across processes share: a ROS domain, a floor, and one agent for all of them."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.suite import EpisodeTask, SuiteSource, load_suite
from toponav.evaluation.worker import EpisodeWorker, RunSettings
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import save_map
from toponav.sim.simulation import Simulation
from toponav.worlds.generate.office import generate_office
from toponav.worlds.storage import save_scene

AGENT = "graphnav_pf"


@dataclass(frozen=True)
class Floor:
    """Where robots are driven.

    Attributes:
        worker: Drives without ROS.
        tasks: Its five shortest plans.
        map: What `toponav ros agent --map` takes.
        building: What `toponav data import-bag --building` takes.
    """

    worker: EpisodeWorker
    tasks: list[EpisodeTask]
    map: Path
    building: Path
    _records: dict[int, EpisodeRecord] = field(default_factory=dict)

    def without_ros(self, task: EpisodeTask) -> EpisodeRecord:
        """How a plan is driven without ROS."""
        if task.index not in self._records:
            self._records[task.index] = self.worker.run(AGENT, task.index)
        return self._records[task.index]


@pytest.fixture(scope="session")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """ROS 2 with every message package, in a domain of this process."""
    pytest.importorskip("rclpy", reason="ROS 2 is not installed; `make test-ros` installs it")
    from toponav.ros.environment import find_ros
    from toponav.ros.interfaces import load_interfaces
    from toponav.ros.runtime import ros_context

    os.environ["ROS_DOMAIN_ID"] = str(20 + os.getpid() % 70)
    os.environ["ROS_LOG_DIR"] = str(tmp_path_factory.mktemp("ros_log"))
    load_interfaces(find_ros())
    with ros_context():
        yield


@pytest.fixture(scope="session")
def office(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small office with its map."""
    folder = tmp_path_factory.mktemp("scenes") / "office"
    scene = generate_office(3, "small")
    save_scene(scene, folder)
    save_map(map_from_layout(scene), folder / "map.topo.json")
    return folder


@pytest.fixture(scope="session")
def floor(office: Path, request: pytest.FixtureRequest) -> Floor:
    """The third area of Stanford 2D-3D-S where it is here, else an office."""
    import torch

    torch.set_num_threads(1)
    try:
        areas: Path = request.getfixturevalue("areas_dir")
    except pytest.skip.Exception:
        map_ = building = office / "map.topo.json"
        source = SuiteSource(scene=office, map=map_, episodes=8)
        building = office
    else:
        map_ = building = areas / "area_3.yaml"
        source = SuiteSource(map_, areas / "area_3_plans.json")
    worker = EpisodeWorker(load_suite(source), RunSettings())
    tasks = sorted(worker.suite.tasks, key=lambda task: len(task.plan.nodes))[:5]
    return Floor(worker, tasks, map_, building)


@pytest.fixture(scope="session")
def lockstep(ros: None, floor: Floor, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The simulator here and GraphNav in another process, each waiting for the other."""
    from toponav.ros.harness import Harness
    from toponav.ros.sim_node import SimNodeConfig

    simulation = Simulation(floor.worker.suite.scene, floor.worker.settings.camera)
    agent = ["--map", str(floor.map), "--agent", AGENT]
    log = tmp_path_factory.mktemp("agent") / "agent.log"
    config = SimNodeConfig(rate=0.0, lockstep=True)
    with Harness(simulation, floor.tasks[0].start, config, agent, log) as harness:
        yield harness


@pytest.fixture
def harness(lockstep: Any) -> Any:
    """The same, with an agent that lives and a camera that works."""
    lockstep.restore()
    lockstep.revive()
    return lockstep
