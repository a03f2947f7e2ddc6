"""Real rclpy: the simulator in this process, the agent in another, in lock-step.

Simulated time stands still until the agent has answered, so that a slow machine changes nothing.
"""

from typing import Any

import pytest

from tests.ros.conftest import AGENT, Floor
from toponav.core.episode import Velocity
from toponav.evaluation.protocol import EpisodeJudge
from toponav.evaluation.suite import seed_of
from toponav.sim.simulation import SimState

pytestmark = [
    pytest.mark.ros,
    # lark, on import, which the wheels' message generators bring.
    pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning"),
]
_STANDING_M_S = 0.02


def drive(harness: Any, floor: Floor, task: Any) -> tuple[EpisodeJudge, list[tuple[float, float]]]:
    """The judge after a plan, and the command of each control step."""
    from toponav.ros.harness import ControlSteps

    judge = EpisodeJudge(floor.worker.suite.map, task.plan, floor.worker.localizer, task.start)
    commands: list[tuple[float, float]] = []

    def note(command: Velocity, state: SimState) -> None:
        if not judge.finished:
            commands.append((command.linear_m_s, command.angular_rad_s))
            judge.update(state.pose, state.contact, state.time_s)

    harness.drive(
        task.plan,
        task.start,
        seed=seed_of("episode", 0, AGENT, task.index),
        until=lambda: judge.finished,
        on_step=ControlSteps(note),
    )
    return judge, commands


def test_five_plans_end_as_they_do_without_ros_command_for_command(
    harness: Any, floor: Floor
) -> None:
    for task in floor.tasks:
        record = floor.without_ros(task)
        judge, commands = drive(harness, floor, task)
        wanted = [(step.linear_m_s, step.angular_rad_s) for step in record.steps]
        assert commands == wanted, harness.agent_log()
        assert (judge.strict, judge.tolerant) == (record.strict, record.tolerant)


@pytest.mark.parametrize("fault", ["drop:0.2", "delay:0.3", "nan:0.3", "frozen:0.3"])
def test_a_faulty_camera_causes_no_collision(fault: str, harness: Any, floor: Floor) -> None:
    task = floor.tasks[0]
    clean = floor.without_ros(task)
    # Time may not run away from the watchdog, where no frame comes that it would wait for.
    harness.break_camera(fault, rate=4.0)
    faulty, commands = drive(harness, floor, task)
    assert commands
    assert clean.tolerant.outcome != "collided"
    assert faulty.tolerant.outcome != "collided"


@pytest.mark.parametrize(
    ("fault", "within_s"),
    # The next frame is 0.2 s away and braking takes 0.4 s, or 0.5 s from full speed, which a robot
    # that knows of nothing may reach meanwhile. NaN is known at once; a frame is frozen when it
    # was the same for half a second, the third time. Without commands, the base brakes by itself.
    [("drop:1", 0.75), ("nan:1", 0.65), ("frozen:1", 1.3)],
)
def test_a_blind_robot_stands_still(
    fault: str, within_s: float, harness: Any, floor: Floor
) -> None:
    task = max(floor.tasks, key=lambda task: len(task.plan.nodes))
    broken_ns: list[int] = []
    speeds: list[tuple[float, float]] = []

    def note(seen: Any) -> None:
        speed = abs(seen.state.velocity.linear_m_s)
        if broken_ns:
            speeds.append(((seen.time_ns - broken_ns[0]) / 1e9, speed))
        elif speed > 0.35 and seen.ends_step:
            broken_ns.append(seen.time_ns)
            harness.break_camera(fault, rate=4.0, period_s=1000.0, at_s=seen.time_ns / 1e9)

    harness.drive(
        task.plan,
        task.start,
        on_step=note,
        until=lambda: bool(speeds) and speeds[-1][0] > 3.0,
    )
    assert max(speed for _, speed in speeds) > 0.3
    moving = [at_s for at_s, speed in speeds if speed > _STANDING_M_S]
    assert max(moving) < within_s


def test_goals_that_cannot_be_driven_are_refused_with_a_reason(harness: Any, floor: Floor) -> None:
    task = floor.tasks[0]
    refused = harness.ask(start_node=task.plan.nodes[0], goal="nowhere")
    assert (refused.success, refused.outcome) == (False, "rejected")
    assert "nowhere" in refused.reason


def test_reaching_the_goal_ends_a_drive_and_says_so(harness: Any, floor: Floor) -> None:
    for task in floor.tasks:
        if floor.without_ros(task).tolerant.outcome == "success":
            break
    else:
        pytest.fail("no plan is driven to its end even without ROS")
    seed = seed_of("episode", 0, AGENT, task.index)
    done = harness.drive(task.plan, task.start, seed=seed, until_cancelled=False)
    assert (done.success, done.outcome, done.node) == (True, "reached", task.plan.nodes[-1])
    assert done.progress == pytest.approx(1.0)


def test_the_robot_stops_within_0_6_s_of_the_agents_death(harness: Any, floor: Floor) -> None:
    task = max(floor.tasks, key=lambda task: len(task.plan.nodes))
    killed_ns: list[int] = []
    speeds: list[tuple[float, float]] = []

    def note(seen: Any) -> None:
        speed = abs(seen.state.velocity.linear_m_s)
        if killed_ns:
            speeds.append(((seen.time_ns - killed_ns[0]) / 1e9, speed))
        elif speed > 0.35:
            harness.agent.kill()
            killed_ns.append(seen.time_ns)

    harness.drive(task.plan, task.start, on_step=note, until=lambda: bool(killed_ns))
    assert killed_ns, harness.agent_log()
    harness.watch(note)
    harness.let_go()
    harness.node.run(lambda: speeds[-1:] > [(1.5, 0.0)])
    assert max(at_s for at_s, speed in speeds if speed > _STANDING_M_S) < 0.6
