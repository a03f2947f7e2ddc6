import itertools
import math

import numpy as np
import pytest

from toponav.core.episode import Belief, Observation, Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask
from toponav.ros.agent_loop import STOP, DriveConfig, DriveLoop
from toponav.ros.faults import FaultInjector, FaultSpec, parse_faults
from toponav.ros.image_loop import ActionStep
from toponav.ros.simulated_robot import TICK_S, Pace, SimulatedRobot
from toponav.ros.tasks import task_of_goal
from toponav.ros.watchdog import Watchdog
from toponav.sim.simulation import Simulation
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.office import generate_office
from toponav.worlds.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return generate_office(3, "small")


@pytest.fixture(scope="module")
def office(scene: Scene) -> TopologicalMap:
    return map_from_layout(scene)


@pytest.fixture(scope="module")
def task(office: TopologicalMap) -> NavigationTask:
    rooms = [node.id for node in office.nodes if str(node.kind) == "room"]
    return task_of_goal(office, start=rooms[0], goal=rooms[1])


DRIVING = Velocity(0.4, 0.1)


class Scripted:
    """Drives straight on, believes what it is told to, and notes what happens to it."""

    def __init__(self, command: Velocity = DRIVING) -> None:
        self.command, self.node = command, ""
        self.times: list[float] = []
        self.overrules: list[Velocity] = []

    def reset(self, task: NavigationTask) -> None:
        self.node = task.start_node

    def act(self, observation: Observation) -> Velocity:
        self.times.append(observation.time_s)
        return self.command

    def overruled(self, command: Velocity) -> None:
        self.overrules.append(command)

    def belief(self) -> Belief:
        return Belief(self.node)


def frame(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.5, 3.0, (24, 32)).astype(np.float32)


def loop_of(agent: Scripted, task: NavigationTask, **config: float) -> DriveLoop:
    watchdog = Watchdog()
    watchdog.start(10.0)
    return DriveLoop(agent, task, DriveConfig(**config), watchdog)


def step(loop: DriveLoop, stamp_s: float, depth_m: np.ndarray | None = None) -> Velocity:
    depth_m = frame(round(100 * stamp_s)) if depth_m is None else depth_m
    return loop.step(depth_m, stamp_s, lambda: stamp_s + 0.01).command


def test_commands_pass_within_the_limits_and_the_agent_is_told_of_others(
    task: NavigationTask,
) -> None:
    agent = Scripted(Velocity(0.4, 0.1))
    loop = loop_of(agent, task, limits=VelocityLimits(linear_m_s=0.3))
    assert step(loop, 10.0) == Velocity(0.3, 0.1)
    assert agent.overrules == [Velocity(0.3, 0.1)]
    agent.command = Velocity(math.nan, 0.0)
    assert step(loop, 10.2) == STOP


def test_frames_that_come_too_soon_are_left_out(task: NavigationTask) -> None:
    loop = loop_of(Scripted(), task)
    step(loop, 10.0)
    assert [loop.wants(stamp) for stamp in (10.03, 10.1, 10.19, 10.2)] == [
        False,
        False,
        True,
        True,
    ]


def test_a_lost_frame_is_stood_in_for(task: NavigationTask) -> None:
    agent = Scripted()
    loop = loop_of(agent, task)
    step(loop, 10.0)
    step(loop, 10.4)
    assert agent.times == pytest.approx([0.0, 0.2, 0.4])


def test_nan_stops_and_a_good_frame_drives_on(task: NavigationTask) -> None:
    agent = Scripted()
    loop = loop_of(agent, task)
    assert step(loop, 10.0) == agent.command
    assert step(loop, 10.2, np.full((24, 32), np.nan, np.float32)) == STOP
    assert "NaN" in loop.stopped_because
    assert step(loop, 10.4) == agent.command
    assert STOP in agent.overrules


def test_an_answer_that_comes_too_late_is_not_driven(task: NavigationTask) -> None:
    loop = loop_of(Scripted(), task)
    now = iter([10.0, 10.0, 10.9])
    assert loop.step(frame(0), 10.0, lambda: next(now)).command == STOP
    assert loop.stopped_because


def test_believing_in_the_goal_three_times_is_arrival(task: NavigationTask) -> None:
    agent = Scripted()
    loop = loop_of(agent, task)
    agent.node = task.goal_node
    ends = []
    for number in range(3):
        step(loop, 10 + 0.2 * number)
        ends.append(loop.ended(10 + 0.2 * number))
    assert [end is None for end in ends] == [True, True, False]
    assert ends[2] is not None
    assert (ends[2].outcome, ends[2].share) == ("reached", 1.0)


def test_a_fault_that_lasts_and_time_that_runs_out_end_a_drive(task: NavigationTask) -> None:
    loop = loop_of(Scripted(), task, fault_s=1.0)
    for number in range(6):
        step(loop, 10 + 0.2 * number, np.full((24, 32), np.nan, np.float32))
    ended = loop.ended(11.0)
    assert ended is not None
    assert (ended.outcome, "NaN" in ended.reason) == ("fault", True)
    loop = loop_of(Scripted(), task, timeout_s=1.0)
    step(loop, 10.0)
    ended = loop.ended(11.0)
    assert ended is not None
    assert ended.outcome == "timeout"


def test_goals_are_nodes_rooms_or_whole_plans(
    office: TopologicalMap, task: NavigationTask
) -> None:
    room = next(node.room for node in office.nodes if node.id == task.goal_node)
    assert room is not None
    assert task_of_goal(office, start=task.start_node, goal=room).goal_node == task.goal_node
    assert task_of_goal(office, nodes=task.plan.nodes).plan == task.plan


@pytest.mark.parametrize(
    ("goal", "says"),
    [
        ({"start": "", "goal": "x"}, "start_node is empty"),
        ({"start": "START", "goal": "nowhere"}, "no node and no room 'nowhere'"),
        ({"start": "START", "goal": "START"}, "already"),
        ({"nodes": ("START", "GOAL")}, "no edge leads"),
        ({"nodes": ("START",)}, "two nodes"),
    ],
)
def test_goals_that_cannot_be_are_refused_with_a_reason(
    goal: dict, says: str, office: TopologicalMap, task: NavigationTask
) -> None:
    names = {"START": task.start_node, "GOAL": task.goal_node}

    def named(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(names.get(each, each) for each in value)
        return names.get(str(value), value)

    with pytest.raises(InputError, match=says):
        task_of_goal(office, **{key: named(value) for key, value in goal.items()})


def robot_in(scene: Scene) -> SimulatedRobot:
    free = FreeSpace.of(scene, 0.3)
    row, col = np.unravel_index(np.argmax(free.clearance_m), free.clearance_m.shape)
    x_m, y_m = scene.grid.center_of(int(row), int(col))
    return SimulatedRobot(Simulation(scene), Pose2(x_m, y_m, 0.0))


def test_the_robot_brakes_when_commands_cease(scene: Scene) -> None:
    robot = robot_in(scene)
    for _ in range(40):
        robot.command(Velocity(0.4, 0.0))
        robot.tick()
    last_s = robot.time_ns / 1e9 - TICK_S
    speeds = []
    while robot.time_ns / 1e9 < last_s + 1.0:
        speeds.append((robot.time_ns / 1e9 - last_s, robot.tick().state.velocity.linear_m_s))
    assert min(speed for at_s, speed in speeds if at_s < 0.45) > 0.35
    assert max(abs(speed) for at_s, speed in speeds if at_s > 0.6) < 0.02


def test_fiftieths_of_a_second_add_up_to_steps(scene: Scene) -> None:
    ticking, stepping = robot_in(scene), Simulation(scene)
    stepping.reset(ticking.start)
    for _ in range(10):
        ticking.command(Velocity(0.3, 0.5))
        ticks = [ticking.tick() for _ in range(10)]
        assert [tick.frame_is_due for tick in ticks] == [*[False] * 9, True]
        assert stepping.step(Velocity(0.3, 0.5)).pose == ticks[-1].state.pose
    assert ticking.time_ns == 2_000_000_000


def test_the_pace_makes_up_for_a_little_and_gives_up_the_rest() -> None:
    now_s = 0.0
    pace = Pace(0.5, lambda: now_s)
    assert pace.left_s() == 0.0
    assert not pace.tick()
    assert pace.left_s() == pytest.approx(0.04)
    now_s = 0.1
    assert pace.tick()
    assert pace.left_s() == 0.0
    assert not pace.tick()
    assert pace.left_s() == pytest.approx(0.02)
    now_s = 100.0
    assert sum(pace.tick() for _ in range(12)) == 9
    assert pace.left_s() > 0.0
    pace.restart()
    assert pace.left_s() == 0.0
    hurried = Pace(0.0, lambda: now_s)
    assert [hurried.tick() for _ in range(3)] == [False] * 3
    assert hurried.left_s() == 0.0


def test_a_reset_puts_the_robot_back_but_not_the_clock(scene: Scene) -> None:
    robot = robot_in(scene)
    robot.command(Velocity(0.5, 0.0))
    robot.tick()
    before_ns = robot.time_ns
    assert robot.reset().pose == pytest.approx(robot.start)
    assert robot.time_ns == before_ns + 200_000_000


def test_faults_are_repeatable_and_do_what_they_say() -> None:
    frames = [(0.2 * n, frame(n)) for n in range(200)]

    def through(spec: FaultSpec, seed: int = 0) -> list:
        injector, out = FaultInjector(spec, seed), []
        for time_s, depth_m in frames:
            injector.put(depth_m, time_s)
            out += [(time_s, *each) for each in injector.due(time_s)]
        return out

    dropped = through(FaultSpec(drop_share=0.2))
    assert 140 <= len(dropped) <= 180
    assert [each[1] for each in dropped] == [
        each[1] for each in through(FaultSpec(drop_share=0.2))
    ]
    late = through(FaultSpec(delay_s=0.3))
    assert {round(now - taken, 6) for now, taken, _ in late} == {0.4}
    nan = through(FaultSpec(nan_share=0.2))
    assert 0.15 < np.mean([np.isnan(depth_m).all() for _, _, depth_m in nan]) < 0.25
    frozen = [depth_m for _, _, depth_m in through(FaultSpec(frozen_share=0.2))]
    same = [np.array_equal(a, b) for a, b in itertools.pairwise(frozen)]
    assert 0.1 < np.mean(same) < 0.25


@pytest.mark.parametrize("text", ["drop", "drop:2", "smoke:0.1", "delay:nan"])
def test_faults_that_do_not_exist_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="no fault"):
        parse_faults((text,))


@pytest.mark.parametrize("action", [Action.FORWARD, Action.LEFT, Action.RIGHT])
def test_a_step_ends_where_it_should(action: Action) -> None:
    start = Pose2(1.0, 2.0, 0.7)
    step_, pose, now_s = ActionStep(action, start, 0.0, VelocityLimits()), start, 0.0
    while (command := step_.command(pose, now_s, False)) is not None:
        moved = Pose2(command.linear_m_s * 0.05, 0.0, command.angular_rad_s * 0.05)
        pose, now_s = pose.compose(moved), now_s + 0.05
    done = pose.relative_to(start)
    wanted = {Action.FORWARD: (0.25, 0.0), Action.LEFT: (0.0, 10.0), Action.RIGHT: (0.0, -10.0)}
    assert done.x_m == pytest.approx(wanted[action][0], abs=0.03)
    assert math.degrees(done.yaw_rad) == pytest.approx(wanted[action][1], abs=1.5)
    assert not step_.blocked


def test_a_step_against_a_wall_is_blocked() -> None:
    touching = ActionStep(Action.FORWARD, Pose2(0, 0, 0), 0.0, VelocityLimits())
    assert touching.command(Pose2(0.1, 0, 0), 0.3, True) is None
    pushing = ActionStep(Action.LEFT, Pose2(0, 0, 0), 0.0, VelocityLimits())
    assert pushing.command(Pose2(0, 0, 0.01), 4.1, False) is None
    assert touching.blocked
    assert pushing.blocked
