"""What goes wrong with goals, cameras and wheels ends a search with a reason, or at its limit."""

from dataclasses import replace

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import GOAL, START, episode, network, simulation
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageGoal, ImageNavAgent, PanoramaObservation
from toponav.evaluation.imagenav.episode import GoalRecord, run_episode
from toponav.navigation.baselines.ans import ActiveNeuralSlamAgent
from toponav.navigation.baselines.frontier import FrontierAgent
from toponav.navigation.nts.agent import NTSAgent, NTSAgentConfig
from toponav.navigation.nts.goal_finder import FinderConfig
from toponav.navigation.nts.perception import Perception
from toponav.sim.imagenav import ImageNavSimulation
from toponav.worlds.scene import scene_from_heights

_STEPS = 24
_AGENTS = ("nts_rgbd", "nts_rgb", "frontier_rgbd", "ans_rgb")


def _agent(name: str) -> ImageNavAgent:
    depth = name.endswith("rgbd")
    if name.startswith("nts"):
        return NTSAgent(network(depth))
    kind = FrontierAgent if name.startswith("frontier") else ActiveNeuralSlamAgent
    return kind(Perception(network(depth)))


class _Faulty(ImageNavSimulation):
    """A simulation whose goal picture, cameras or wheels are broken."""

    fault = ""

    def reset(self, start: Pose2, goal: Pose2, seed: int = 0) -> ImageGoal:
        image = super().reset(start, goal, seed)
        self._first = super().observe()
        if self.fault == "goal of the wrong size":
            return ImageGoal(image.rgb[::2, ::2].copy(), None)
        if self.fault == "goal that is no place here":
            rng = np.random.default_rng(0)
            noise = rng.integers(0, 255, image.rgb.shape, np.uint8)
            return ImageGoal(noise, None if image.depth_m is None else image.depth_m[::-1].copy())
        return image

    def observe(self) -> PanoramaObservation:
        seen = super().observe()
        if seen.step < 4:
            return seen
        if self.fault == "dead cameras":
            depth_m = None if seen.depth_m is None else np.zeros_like(seen.depth_m)
            return replace(seen, rgb=np.zeros_like(seen.rgb), depth_m=depth_m)
        if self.fault == "frozen cameras":
            return replace(seen, rgb=self._first.rgb, depth_m=self._first.depth_m)
        if self.fault == "odometry that jumps" and seen.step % 5 == 0:
            return replace(seen, odometry=Pose2(300.0 * seen.step, -1e6, 2.0))
        if self.fault == "odometry that is no number" and seen.step % 3 == 0:
            return replace(seen, odometry=Pose2(float("nan"), 0.0, float("inf")))
        return seen


def _search(name: str, fault: str, *, doorway: bool = True) -> GoalRecord:
    built = simulation().scene
    if not doorway:
        heights_m = np.where(np.arange(100)[None] // 2 == 49 // 2, 2.7, built.heights_m)
        built = scene_from_heights(
            "walled", built.grid, heights_m, room_index=built.room_index, rooms=built.rooms
        )
    robot = _Faulty(built, depth=name.endswith("rgbd"), max_steps=_STEPS)
    robot.fault = fault
    goal = GOAL if doorway else Pose2(8.0, 3.0, 0.0)
    return run_episode(robot, _agent(name), episode(goal=goal), label=name, seed=0).goals[0]


@pytest.mark.parametrize("name", _AGENTS)
def test_goal_of_the_wrong_size_ends_the_search_with_a_reason(name: str) -> None:
    found = _search(name, "goal of the wrong size")
    assert found.steps == 1
    assert found.outcome == "wrong_stop"
    assert "128x512" in found.reason


@pytest.mark.parametrize("name", _AGENTS)
@pytest.mark.parametrize(
    "fault",
    [
        "goal that is no place here",
        "dead cameras",
        "frozen cameras",
        "odometry that jumps",
        "odometry that is no number",
    ],
)
def test_a_search_with_a_fault_ends_with_a_reason_or_at_its_limit(name: str, fault: str) -> None:
    found = _search(name, fault)
    assert found.steps == _STEPS or found.reason
    if fault == "goal that is no place here":
        assert found.outcome == "timeout"


def test_a_goal_that_cannot_be_reached_is_sought_to_the_limit() -> None:
    found = _search("nts_rgbd", "goal that is no place here", doorway=False)
    assert found.outcome == "timeout"
    assert found.steps == _STEPS
    assert np.isinf(found.distance_m)


def test_a_robot_that_sees_nothing_any_more_still_moves() -> None:
    robot = _Faulty(simulation().scene, max_steps=_STEPS)
    robot.fault = "dead cameras"
    never = NTSAgentConfig(finder=FinderConfig(found=9.0))
    agent = NTSAgent(network(), never)
    agent.reset(robot.reset(START, GOAL))
    actions = []
    while not robot.state.done:
        actions.append(agent.act(robot.observe()))
        robot.step(actions[-1])
    assert agent.belief().mode == "recover"
    assert Action.STOP not in actions
    assert Action.FORWARD in actions
