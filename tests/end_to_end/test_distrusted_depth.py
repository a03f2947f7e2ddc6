"""Depth that cannot be trusted never becomes a velocity, and the robot goes on afterwards."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch

from tests.data.small_office import make_map, make_plan, make_scene
from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, Observation, Velocity
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior
from toponav.evaluation.agents import GroundTruthLocationAgent
from toponav.evaluation.protocol import Truth
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import get_preset
from toponav.navigation.graphnav.agent import GraphNavAgent
from toponav.navigation.graphnav.driver import BehaviorDriver
from toponav.navigation.graphnav.particle_filter import ParticleFilterConfig
from toponav.sim.simulation import Simulation

CAMERA = PinholeCamera(80, 60)
START = Pose2(2.0, 3.7, -math.pi / 2)
STOP = Velocity(0.0, 0.0)

Frame = Callable[[np.ndarray], object]


def _with(value: float) -> Frame:
    def spoil(depth_m: np.ndarray) -> np.ndarray:
        depth_m[7, 9] = value
        return depth_m

    return spoil


BAD_FRAMES: dict[str, tuple[Frame, str]] = {
    "NaN": (_with(np.nan), "1 depth values are NaN"),
    "infinite": (_with(np.inf), "1 infinite"),
    "negative": (_with(-0.1), "cannot be negative"),
    "all NaN": (lambda depth: np.full_like(depth, np.nan), "4800 depth values are NaN"),
    "all zero": (np.zeros_like, "all zero"),
    "transposed": (lambda depth: depth.T.copy(), "60x80 pixels, expected 80x60"),
    "empty": (lambda depth: depth[:0], "80x0 pixels, expected 80x60"),
    "colour": (lambda depth: np.stack([depth] * 3, -1), "3x80x60 pixels"),
    "millimetres": (lambda depth: (depth * 1000).astype(np.uint16), "uint16, expected metres"),
    "double": (lambda depth: depth.astype(np.float64), "float64, expected metres"),
    "objects": (lambda depth: depth.astype(object), "object, expected metres"),
    "complex": (lambda depth: depth.astype(np.complex64), "complex64, expected metres"),
    "missing": (lambda depth: None, "a NoneType, expected an array"),
    "a list": (lambda depth: depth.tolist(), "a list, expected an array"),
}


class Walk:
    """Frames of a robot that is carried through an office, each a little different."""

    def __init__(self) -> None:
        self._simulation = Simulation(make_scene(), CAMERA)
        self._steps = 0

    def frame(self) -> np.ndarray:
        self._steps += 1
        self._simulation.reset(START._replace(y_m=START.y_m - 0.01 * self._steps))
        return self._simulation.observe().depth_m.copy()


def _observation(depth_m: object) -> Observation:
    """Also one that its own type forbids: drivers of cameras do not read our types."""
    observation = Observation(np.ones((60, 80), np.float32), 0.0)
    object.__setattr__(observation, "depth_m", depth_m)
    return observation


def _agent(name: str) -> Agent[NavigationTask]:
    torch.manual_seed(1)
    preset = get_preset("compact")
    networks = {config.behavior: BehaviorNetwork(config) for config in preset.behaviors}
    localization = LocalizationNetwork(preset.localization)
    history = max(localization.config.frame_offsets) + 1
    driver = BehaviorDriver(networks, CAMERA, history)
    if name == "gtl":
        return GroundTruthLocationAgent(driver)
    particles = ParticleFilterConfig(particles=50) if name == "graphnav_pf" else None
    return GraphNavAgent(localization, driver, particles)


def _act(agent: Agent[NavigationTask], depth_m: object) -> Velocity:
    if isinstance(agent, GroundTruthLocationAgent):
        find_door = Behavior.FIND_DOOR
        agent.observe_truth(Truth(START, STOP, "office_1", 0, make_plan().edges[0], find_door))
    return agent.act(_observation(depth_m))


def _drives(agent: Agent[NavigationTask], command: Velocity) -> bool:
    return (
        agent.belief().stopped_because == ""
        and math.isfinite(command.linear_m_s + command.angular_rad_s)
        and command != STOP
    )


@pytest.fixture(scope="module", params=["graphnav", "graphnav_pf", "gtl"])
def agent(request: pytest.FixtureRequest) -> Agent[NavigationTask]:
    return _agent(request.param)


@pytest.fixture(scope="module")
def walk() -> Walk:
    return Walk()


@pytest.mark.parametrize("kind", BAD_FRAMES)
def test_a_bad_frame_stops_the_robot_and_a_good_one_lets_it_go_on(
    agent: Agent[NavigationTask], walk: Walk, kind: str
) -> None:
    spoil, says = BAD_FRAMES[kind]
    agent.reset(NavigationTask(make_map(), make_plan()))
    assert _drives(agent, _act(agent, walk.frame()))
    for _ in range(3):
        assert _act(agent, spoil(walk.frame())) == STOP
        assert says in agent.belief().stopped_because
    assert _drives(agent, _act(agent, walk.frame()))


def test_a_bad_first_frame_stops_the_robot(agent: Agent[NavigationTask], walk: Walk) -> None:
    agent.reset(NavigationTask(make_map(), make_plan()))
    assert _act(agent, np.full((60, 80), np.inf, np.float32)) == STOP
    assert _drives(agent, _act(agent, walk.frame()))


def test_a_frozen_sensor_stops_the_robot_within_a_second(
    agent: Agent[NavigationTask], walk: Walk
) -> None:
    agent.reset(NavigationTask(make_map(), make_plan()))
    frozen = walk.frame()
    commands = [_act(agent, frozen) for _ in range(12)]
    assert all(command != STOP for command in commands[:5])
    assert commands[5:] == [STOP] * 7
    assert "it is frozen" in agent.belief().stopped_because
    assert _drives(agent, _act(agent, walk.frame()))


def test_frames_written_to_the_same_place_are_not_taken_for_frozen(
    agent: Agent[NavigationTask], walk: Walk
) -> None:
    agent.reset(NavigationTask(make_map(), make_plan()))
    place = np.empty((60, 80), np.float32)
    for _ in range(12):
        place[:] = walk.frame()
        assert _drives(agent, _act(agent, place))


def test_floor_and_ceiling_alone_are_not_taken_for_frozen(agent: Agent[NavigationTask]) -> None:
    agent.reset(NavigationTask(make_map(), make_plan()))
    rows = np.linspace(1.0, 3.5, 60, dtype=np.float32)
    planes = np.repeat(rows[:, None], 80, axis=1)
    for _ in range(12):
        assert _drives(agent, _act(agent, planes))


def test_networks_that_overflow_stop_the_robot(walk: Walk) -> None:
    for name in ("graphnav", "graphnav_pf", "gtl"):
        agent = _agent(name)
        networks = (
            [agent._localization] if isinstance(agent, GraphNavAgent) else _networks_of(agent)
        )
        with torch.no_grad():
            for network in networks:
                for weights in network.parameters():
                    weights.fill_(torch.finfo(torch.float32).max)
        agent.reset(NavigationTask(make_map(), make_plan()))
        assert _act(agent, walk.frame()) == STOP
        assert "not finite" in agent.belief().stopped_because


def _networks_of(agent: GroundTruthLocationAgent) -> list[BehaviorNetwork]:
    driver = agent._driver
    assert isinstance(driver, BehaviorDriver)
    return list(driver._networks.values())
