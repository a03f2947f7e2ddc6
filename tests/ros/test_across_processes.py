"""Real rclpy: the simulator in this process, the agent in another."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.protocol import EpisodeJudge
from toponav.evaluation.suite import SuiteSource, load_suite, seed_of
from toponav.evaluation.worker import EpisodeWorker, RunSettings
from toponav.sim.simulation import Simulation

pytestmark = [
    pytest.mark.ros,
    # lark, on import, which the wheels' message generators bring.
    pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning"),
]

PLANS = 5


@pytest.fixture(scope="module")
def worker(areas_dir: Path) -> EpisodeWorker:
    import torch

    torch.set_num_threads(1)
    plans = areas_dir / "area_3_plans.json"
    suite = load_suite(SuiteSource(areas_dir / "area_3.yaml", plans))
    return EpisodeWorker(suite, RunSettings())


@pytest.fixture(scope="module")
def tasks(worker: EpisodeWorker) -> list[Any]:
    """The five shortest plans."""
    return sorted(worker.suite.tasks, key=lambda task: len(task.plan.nodes))[:PLANS]


@pytest.fixture(scope="module")
def context(ros: None) -> Iterator[None]:
    from toponav.ros.runtime import ros_context

    with ros_context():
        yield


def harness_of(
    worker: EpisodeWorker, areas_dir: Path, log: Path, start: Any, **config: Any
) -> Any:
    from toponav.ros.harness import Harness
    from toponav.ros.sim_node import SimNodeConfig

    simulation = Simulation(worker.suite.scene, worker.settings.camera)
    agent = ["--map", str(areas_dir / "area_3.yaml"), "--agent", "graphnav_pf"]
    return Harness(simulation, start, SimNodeConfig(**config), agent, log)


def commands_of(record: EpisodeRecord) -> list[tuple[float, float]]:
    return [(step.linear_m_s, step.angular_rad_s) for step in record.steps]


def test_five_plans_end_as_they_do_without_ros_command_for_command(
    context: None,
    worker: EpisodeWorker,
    tasks: list[Any],
    areas_dir: Path,
    tmp_path: Path,
) -> None:
    with harness_of(
        worker, areas_dir, tmp_path / "agent.log", tasks[0].start, lockstep=True
    ) as harness:
        for task in tasks:
            record = worker.run("graphnav_pf", task.index)
            judge = EpisodeJudge(worker.suite.map, task.plan, worker.localizer, task.start)
            commands = []

            def note(seen: Any, judge: EpisodeJudge = judge, commands: Any = commands) -> None:
                if not judge.finished:
                    told = seen.command
                    commands.append((told.linear_m_s, told.angular_rad_s))
                    judge.update(seen.state.pose, seen.state.contact, seen.state.time_s)

            harness.drive(
                task.plan,
                task.start,
                seed=seed_of("episode", 0, "graphnav_pf", task.index),
                until=lambda judge=judge: judge.finished,
                on_step=note,
            )
            assert commands == commands_of(record), (tmp_path / "agent.log").read_text()[-2000:]
            assert (judge.strict, judge.tolerant) == (record.strict, record.tolerant)


def test_the_robot_stops_soon_after_the_agent_is_killed(
    context: None, worker: EpisodeWorker, tasks: list[Any], areas_dir: Path, tmp_path: Path
) -> None:
    task = max(tasks, key=lambda task: len(task.plan.nodes))
    seen_speeds: list[tuple[int, float]] = []
    killed_ns: list[int] = []
    log = tmp_path / "agent.log"
    with harness_of(worker, areas_dir, log, task.start, rate=0.5) as harness:

        def note(seen: Any) -> None:
            seen_speeds.append((seen.time_ns, abs(seen.state.velocity.linear_m_s)))
            if not killed_ns and seen_speeds[-1][1] > 0.2:
                harness.agent.kill()
                killed_ns.append(seen.time_ns)

        harness.drive(task.plan, task.start, on_step=note, until=lambda: bool(killed_ns))
        assert killed_ns, log.read_text()[-2000:]
        harness.watch(note)
        harness.node.run(lambda: seen_speeds[-1][0] > killed_ns[0] + 1_000_000_000)
    moving = [time_ns for time_ns, speed in seen_speeds if speed > 0.02]
    assert (moving[-1] - killed_ns[0]) / 1e9 < 0.6
