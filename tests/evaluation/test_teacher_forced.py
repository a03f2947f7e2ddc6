from collections.abc import Mapping

import numpy as np
import pytest

from tests.evaluation.tiny_building import tiny_map, tiny_scene
from toponav.core.camera import PinholeCamera
from toponav.core.episode import Belief, Observation, Velocity
from toponav.core.geometry import Pose2
from toponav.evaluation.agents import (
    AGENTS,
    AgentContext,
    ExpertAgent,
    make_agent,
    probes_of,
)
from toponav.evaluation.protocol import Truth
from toponav.evaluation.teacher_forced import CropPredictor, OwnBeliefAgent, TeacherForcedAgent
from toponav.maps.plan import Plan, shortest_plan
from toponav.maps.task import NavigationTask

MAP = tiny_map()
PLAN = shortest_plan(MAP, "office_1", "office_2")
TASK = NavigationTask(MAP, PLAN)
IMAGE = Observation(np.ones((2, 2), np.float32), 0.0)


class Straight:
    """A planner that drives straight ahead."""

    def reset(self, plan: Plan, pose: Pose2) -> None:
        pass

    def act(self, pose: Pose2, velocity: Velocity) -> Velocity:
        return Velocity(0.25, 0.0)


class Echo:
    """Says what it is told, and remembers it."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.driven: list[Velocity] = []

    def reset(self, task: NavigationTask) -> None:
        self.told.clear()

    def predict(self, observation: Observation, last_edge: str) -> Mapping[str, float]:
        self.told.append(last_edge)
        return {last_edge: 0.75, PLAN.edges[-1]: 0.25}

    def advance(self, command: Velocity) -> None:
        self.driven.append(command)


def truth(edge: str | None) -> Truth:
    return Truth(Pose2(2.0, 1.8, 0.0), Velocity(0.0, 0.0), None, None, edge, None)


def test_the_network_is_told_the_true_edge_of_the_step_before() -> None:
    echo = Echo()
    agent = TeacherForcedAgent(ExpertAgent(Straight()), echo)
    agent.reset(TASK)
    for edge in (PLAN.edges[0], PLAN.edges[1], None, PLAN.edges[2]):
        agent.observe_truth(truth(edge))
        assert agent.act(IMAGE) == Velocity(0.25, 0.0)
    assert echo.told == [PLAN.edges[0], PLAN.edges[0], PLAN.edges[1], PLAN.edges[1]]
    assert echo.driven == [Velocity(0.25, 0.0)] * 4
    assert agent.belief().edge == PLAN.edges[1]
    assert agent.belief().node == PLAN.nodes[1]


def test_a_frame_that_cannot_be_trusted_is_a_wrong_answer() -> None:
    predictor = CropPredictor(None, PinholeCamera())
    predictor.reset(TASK)
    blind = Observation(np.zeros((240, 320), np.float32), 0.0)
    assert predictor.predict(blind, PLAN.edges[0]) == {}


@pytest.mark.parametrize("frames", [3])
def test_the_shipped_network_answers_with_edges_of_the_crop(frames: int) -> None:
    camera = PinholeCamera()
    agent = make_agent("teacher_forced", AgentContext(tiny_scene(), MAP, camera))
    agent.reset(TASK)
    rng = np.random.default_rng(0)
    for _ in range(frames):
        agent.observe_truth(truth(PLAN.edges[0]))
        depth_m = rng.uniform(0.5, 3.0, (camera.height, camera.width)).astype(np.float32)
        agent.act(Observation(depth_m, 0.0))
    belief = agent.belief()
    assert belief.edge in belief.edge_probability
    assert sum(belief.edge_probability.values()) == pytest.approx(1.0, abs=1e-4)


class Dreamer:
    """Believes what it is told that it did."""

    def __init__(self) -> None:
        self.carried_out: list[Velocity] = []

    def reset(self, task: NavigationTask) -> None:
        self.carried_out.clear()

    def act(self, observation: Observation) -> Velocity:
        return Velocity(-0.1, 1.0)

    def belief(self) -> Belief:
        return Belief(PLAN.nodes[1], PLAN.edges[1])

    def overruled(self, command: Velocity) -> None:
        self.carried_out.append(command)


def test_an_agent_that_is_only_asked_learns_what_the_expert_did() -> None:
    dreamer = Dreamer()
    agent = OwnBeliefAgent(ExpertAgent(Straight()), dreamer)
    agent.reset(TASK)
    agent.observe_truth(truth(PLAN.edges[0]))
    assert agent.act(IMAGE) == Velocity(0.25, 0.0)
    assert dreamer.carried_out == [Velocity(0.25, 0.0)]
    assert agent.belief().edge == PLAN.edges[1]


def test_probes_are_no_drivers_of_their_own() -> None:
    probes = [name for name, spec in AGENTS.items() if spec.is_probe]
    assert probes == ["teacher_forced", "own_belief"]
    assert probes_of("compact") == ("teacher_forced",)
