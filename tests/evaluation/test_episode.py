from dataclasses import dataclass

import numpy as np

from tests.evaluation.tiny_building import PLAN, tiny_map
from toponav.core.episode import Belief, Observation, Velocity
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior
from toponav.evaluation.agents import GroundTruthLocationAgent
from toponav.evaluation.episode import EpisodeRecord, StepView, run_episode
from toponav.evaluation.protocol import EpisodeJudge, Truth
from toponav.maps.plan import shortest_plan
from toponav.maps.task import NavigationTask

MAP = tiny_map()
TASK = NavigationTask(MAP, shortest_plan(MAP, "office_1", "office_2"))
START = Pose2(0.0, 0.0, 0.0)


@dataclass
class State:
    pose: Pose2
    velocity: Velocity
    contact: str | None
    time_s: float


class Rail:
    """A robot on a line: the command's speed moves it along x."""

    def __init__(self) -> None:
        self.looks = 0

    def reset(self, pose: Pose2) -> State:
        self.state = State(pose, Velocity(0.0, 0.0), None, 0.0)
        return self.state

    def step(self, command: Velocity) -> State:
        x_m = self.state.pose.x_m + 0.2 * command.linear_m_s
        self.state = State(Pose2(x_m, 0.0, 0.0), command, None, self.state.time_s + 0.2)
        return self.state

    def observe(self) -> Observation:
        self.looks += 1
        return Observation(np.ones((2, 2), np.float32), self.state.time_s)


class EveryMetre:
    """The plan's nodes, a metre apart along x."""

    def node_at(self, pose: Pose2) -> str:
        return PLAN[min(int(pose.x_m), len(PLAN) - 1)]


class Blind:
    """Drives on, and believes in the plan's first edge and another."""

    def reset(self, task: NavigationTask) -> None:
        self.task = task

    def act(self, observation: Observation) -> Velocity:
        return Velocity(0.5, 0.0)

    def belief(self) -> Belief:
        edge = self.task.plan.edges[0]
        astray = "office_1_door->hallway_1-1l"
        return Belief("office_1", edge, Behavior.STRAIGHT, {edge: 0.75, astray: 0.25})


class Driver:
    """Notes which behaviours it was asked for."""

    def __init__(self) -> None:
        self.asked: list[Behavior] = []
        self.stopped_because = ""

    def reset(self) -> None:
        self.asked.clear()

    def drive(self, behavior: Behavior, observation: Observation) -> Velocity:
        self.asked.append(behavior)
        return Velocity(0.5, 0.0)


def drive(agent: object, views: list[StepView] | None = None) -> EpisodeRecord:
    judge = EpisodeJudge(MAP, TASK.plan, EveryMetre(), START)
    on_step = None if views is None else views.append
    return run_episode(Rail(), agent, TASK, START, judge, name="a", index=3, on_step=on_step)


def test_the_record_holds_one_step_per_decision() -> None:
    record = drive(Blind())
    assert (record.agent, record.index) == ("a", 3)
    assert record.strict.success
    assert len(record.steps) == record.strict.step == 40
    assert [step.time_s for step in record.steps][:3] == [0.0, 0.2, 0.4]
    assert record.behaviors == TASK.plan.behaviors(MAP)


def test_each_step_holds_the_truth_before_the_command_and_the_belief_after_it() -> None:
    record = drive(Blind())
    first, last = record.steps[0], record.steps[-1]
    assert (first.true_node, first.true_behavior) == ("office_1", "find_door")
    assert last.true_node == "hallway_1-2r"
    assert first.behavior == "straight"
    assert first.plan_probability == (0.75, 0.0, 0.0, 0.0)
    assert first.elsewhere_probability == 0.25


def test_the_distance_driven_is_the_length_of_the_path() -> None:
    assert abs(drive(Blind()).driven_m - 39 * 0.1) < 1e-9


def test_a_watcher_sees_what_the_agent_saw() -> None:
    views: list[StepView] = []
    record = drive(Blind(), views)
    assert len(views) == len(record.steps)
    assert views[0].observation.depth_m.shape == (2, 2)
    assert views[0].truth.pose == START


def test_only_agents_that_ask_are_shown_the_truth() -> None:
    class Curious(Blind):
        seen: list[Truth] = []  # noqa: RUF012

        def observe_truth(self, truth: Truth) -> None:
            self.seen.append(truth)

    agent = Curious()
    record = drive(agent)
    assert [truth.node for truth in agent.seen] == [step.true_node for step in record.steps]


def test_gtl_drives_the_behaviour_that_the_plan_wants_at_the_true_node() -> None:
    driver = Driver()
    record = drive(GroundTruthLocationAgent(driver))
    assert [str(behavior) for behavior in driver.asked] == [
        step.true_behavior for step in record.steps
    ]
    assert all(step.behavior == step.true_behavior for step in record.steps)


def test_gtl_keeps_the_last_valid_behaviour_off_the_plan_and_where_no_node_fits() -> None:
    driver = Driver()
    agent = GroundTruthLocationAgent(driver)
    agent.reset(TASK)
    judge = EpisodeJudge(MAP, TASK.plan, EveryMetre(), START)
    image = Observation(np.ones((2, 2), np.float32), 0.0)
    for node in ("hallway_1-1r", "hallway_1-1l", None):
        judge.node = node
        agent.observe_truth(judge.truth(START, Velocity(0.0, 0.0)))
        agent.act(image)
    assert driver.asked == [Behavior.CORRIDOR_FOLLOW] * 3
