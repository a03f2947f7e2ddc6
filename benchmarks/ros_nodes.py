"""Measures the ROS 2 nodes: simulator here, agent in another process, on area 3.

    python benchmarks/ros_nodes.py outcomes   the same five plans with and without ROS
    python benchmarks/ros_nodes.py latency    depth stamp to cmd_vel, five minutes of real time
    python benchmarks/ros_nodes.py soak       half an hour of it: deadlines and memory
    python benchmarks/ros_nodes.py faults     lost, late, NaN, frozen frames; kill -9

Writes benchmarks/results/ros_<what>.json (latency and soak: and a histogram, .png; docs/ros.md
shows the soak's). Needs ROS 2: run it with the Python of .venv-ros (`make test-ros` makes it).
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.episode import Velocity
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.evaluation.protocol import EpisodeJudge
from toponav.evaluation.suite import EpisodeTask, SuiteSource, load_suite, seed_of
from toponav.evaluation.worker import EpisodeWorker, RunSettings
from toponav.ros.runtime import ros_context, start
from toponav.sim.simulation import SimState, Simulation

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results"
DATA = Path(os.environ.get("TOPONAV_DATA", ROOT.parent / "shared" / "data")) / "graphnav_areas"
AGENT = "graphnav_pf"
FAULTS = {
    "clean": (),
    "dropped_20_percent": ("drop:0.2",),
    "delayed_300_ms": ("delay:0.3",),
    "nan_20_percent": ("nan:0.2",),
    "frozen_20_percent": ("frozen:0.2",),
}


def main() -> int:
    """Run one of the benchmarks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["outcomes", "latency", "soak", "faults"])
    parser.add_argument("--seconds", type=float, help="length of latency (300) or soak (1800)")
    parser.add_argument("--plans", type=int, default=5)
    parser.add_argument("--rate", type=float, default=4.0, help="of faults: how fast, at most")
    options = parser.parse_args()
    start()
    from toponav.ros.harness import pin_threads

    pin_threads()
    source = SuiteSource(DATA / "area_3.yaml", DATA / "area_3_plans.json", episodes=options.plans)
    worker = EpisodeWorker(load_suite(source), RunSettings())
    with ros_context():
        if options.what == "outcomes":
            found = outcomes(worker)
        elif options.what == "latency":
            found = latency(worker, "ros_latency", options.seconds or 300.0)
        elif options.what == "soak":
            found = latency(worker, "ros_soak", options.seconds or 1800.0)
        else:
            found = faults(worker, options.rate)
    name, metrics, details = found
    write_benchmark(Benchmark(name, metrics, details), RESULTS)
    for key, value in metrics.items():
        print(f"{key}: {value:g}")
    return 0


def harness_of(worker: EpisodeWorker, task: EpisodeTask, **config: Any) -> Any:
    """Simulator here, agent there."""
    from toponav.ros.harness import Harness
    from toponav.ros.sim_node import SimNodeConfig

    simulation = Simulation(worker.suite.scene, worker.settings.camera)
    agent = ["--map", str(DATA / "area_3.yaml"), "--agent", AGENT]
    log = Path(tempfile.mkdtemp()) / "agent.log"
    return Harness(simulation, task.start, SimNodeConfig(**config), agent, log)


def drive(
    harness: Any, worker: EpisodeWorker, task: EpisodeTask, stop: Callable[[], bool]
) -> tuple[EpisodeJudge, list[tuple[float, float]]]:
    """The judge after one plan, and the commands of each judged step."""
    from toponav.ros.harness import ControlSteps

    judge = EpisodeJudge(worker.suite.map, task.plan, worker.localizer, task.start)
    commands: list[tuple[float, float]] = []

    def note(command: Velocity, state: SimState) -> None:
        if not judge.finished:
            commands.append((command.linear_m_s, command.angular_rad_s))
            judge.update(state.pose, state.contact, state.time_s)

    harness.drive(
        task.plan,
        task.start,
        seed=seed_of("episode", 0, AGENT, task.index),
        until=lambda: judge.finished or stop(),
        on_step=ControlSteps(note),
    )
    return judge, commands


def outcomes(worker: EpisodeWorker) -> tuple[str, dict[str, float], dict[str, Any]]:
    """The same plans with ROS in lock-step and without."""
    rows = []
    with harness_of(worker, worker.suite.tasks[0], lockstep=True, rate=0.0) as harness:
        for task in worker.suite.tasks:
            record = worker.run(AGENT, task.index)
            judge, commands = drive(harness, worker, task, lambda: False)
            without = [(each.linear_m_s, each.angular_rad_s) for each in record.steps]
            row = {
                "plan": task.index,
                "nodes": len(task.plan.nodes),
                "strict": str(record.strict.outcome),
                "strict_with_ros": str(judge.strict.outcome),
                "tolerant": str(record.tolerant.outcome),
                "tolerant_with_ros": str(judge.tolerant.outcome),
                "steps": len(without),
                "same_commands": without == commands,
            }
            rows.append(row)
            print(row, file=sys.stderr)
    same = [
        row["strict"] == row["strict_with_ros"] and row["tolerant"] == row["tolerant_with_ros"]
        for row in rows
    ]
    metrics = {
        "plans": float(len(rows)),
        "plans_with_same_outcomes": float(sum(same)),
        "plans_with_same_commands": float(sum(row["same_commands"] for row in rows)),
        "steps_compared": float(sum(row["steps"] for row in rows)),
    }
    return "ros_outcomes", metrics, {"agent": AGENT, "weights": "best", "plans": rows}


def latency(
    worker: EpisodeWorker, name: str, seconds: float
) -> tuple[str, dict[str, float], dict[str, Any]]:
    """Plan after plan in real time, until the time is over."""
    rows: list[dict[str, float]] = []
    began_s = time.monotonic()
    frames = 0
    with harness_of(worker, worker.suite.tasks[0]) as harness:
        node, agent = harness.node, harness.agent
        node.latencies_ms.clear()
        while time.monotonic() - began_s < seconds:
            task = worker.suite.tasks[len(rows) % len(worker.suite.tasks)]
            ticks, decisions = node.ticks, len(node.latencies_ms)
            drive(harness, worker, task, lambda: time.monotonic() - began_s >= seconds)
            # The first frame of a drive waits for the goal to be accepted.
            frames += max((node.ticks - ticks) // 10 - 2, 0)
            rows.append(
                {
                    "s": round(time.monotonic() - began_s, 1),
                    "agent_mib": round(agent.resident_kib() / 1024, 1),
                    "simulator_mib": round(own_kib() / 1024, 1),
                    "waited_for_cpu_s": round(waited_s(agent.process.pid) + waited_s(), 2),
                    "latency_ms_max": round(max(node.latencies_ms[decisions:], default=0.0), 1),
                }
            )
        found = np.array(node.latencies_ms)
        late = node.late_ticks / max(node.ticks, 1)
    histogram(name, found)
    missed = max(frames - int((found <= 200.0).sum()), 0) / max(frames, 1)
    metrics = {
        "seconds": seconds,
        "decisions": float(len(found)),
        "latency_ms_p50": float(np.percentile(found, 50)),
        "latency_ms_p99": float(np.percentile(found, 99)),
        "latency_ms_p999": float(np.percentile(found, 99.9)),
        "latency_ms_max": float(found.max()),
        "missed_deadline_share": missed,
        "late_tick_share": late,
        "agent_memory_mib_per_minute": growth(rows, "agent_mib"),
        "simulator_memory_mib_per_minute": growth(rows, "simulator_mib"),
        "waited_for_cpu_share": rows[-1]["waited_for_cpu_s"] / rows[-1]["s"],
    }
    details = {
        "agent": AGENT,
        "weights": "best",
        "load_average": os.getloadavg(),
        "cpus": len(os.sched_getaffinity(0)),
        "drives": rows,
        "histogram_ms": np.histogram(found, bins=[*range(0, 101, 2), 150, 200, 500, 1e9])[
            0
        ].tolist(),
    }
    return name, metrics, details


def growth(rows: list[dict[str, float]], key: str) -> float:
    """MiB a minute, by a straight line through what was held after the first third."""
    settled = [row for row in rows if row["s"] >= rows[-1]["s"] / 3]
    if len(settled) < 3:
        return float("nan")
    minutes = [row["s"] / 60 for row in settled]
    return float(np.polyfit(minutes, [row[key] for row in settled], 1)[0])


def waited_s(pid: int | str = "self") -> float:
    """How long the threads of a process were ready and had no CPU, because of others."""
    waited_ns = 0
    for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        with suppress(OSError):
            waited_ns += int(thread.read_text().split()[1])
    return waited_ns / 1e9


def own_kib() -> int:
    """Memory of this process."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    return 0


def histogram(name: str, latencies_ms: np.ndarray) -> None:
    """The picture of docs/ros.md."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(6.4, 2.8), constrained_layout=True)
    ax.hist(np.minimum(latencies_ms, 100), bins=100, range=(0, 100), color="#3b6ea5")
    p99 = float(np.percentile(latencies_ms, 99))
    ax.axvline(min(p99, 100), color="#c0392b", lw=1.2, label=f"99 %: {p99:.0f} ms")
    ax.axvline(60, color="#555555", lw=1.0, ls="--", label="asked: 60 ms")
    ax.set_xlabel("depth stamp to cmd_vel, ms (100: and more)")
    ax.set_ylabel("decisions")
    ax.legend(frameon=False)
    figure.savefig(RESULTS / f"{name}.png", dpi=110)


def faults(worker: EpisodeWorker, rate: float) -> tuple[str, dict[str, float], dict[str, Any]]:
    """What faulty cameras do, and a killed agent."""
    table: dict[str, list[dict[str, Any]]] = {}
    with harness_of(worker, worker.suite.tasks[0], lockstep=True, rate=rate) as harness:
        for name, texts in FAULTS.items():
            harness.break_camera(*texts, rate=rate)
            table[name] = []
            for task in worker.suite.tasks:
                contacts = len(harness.node.contacts)
                judge, commands = drive(harness, worker, task, lambda: False)
                row = {
                    "plan": task.index,
                    "strict": str(judge.strict.outcome),
                    "tolerant": str(judge.tolerant.outcome),
                    "nodes_reached": judge.tolerant.nodes_reached,
                    "steps": len(commands),
                    "touched": len(harness.node.contacts) - contacts,
                }
                table[name].append(row)
                print(name, row, file=sys.stderr)
        stops_s = [killed(harness, task) for task in worker.suite.tasks]
    clean = [row["tolerant"] == "collided" for row in table["clean"]]
    metrics = {"kill_to_standstill_s_max": max(stops_s)}
    for name, rows in table.items():
        collided = [row["tolerant"] == "collided" for row in rows]
        metrics[f"{name}_successes"] = float(sum(row["tolerant"] == "success" for row in rows))
        metrics[f"{name}_collisions"] = float(sum(collided))
        new = sum(now and not before for now, before in zip(collided, clean, strict=True))
        metrics[f"{name}_collisions_not_in_clean"] = float(new)
    details = {"agent": AGENT, "weights": "best", "rate": rate, "kill_to_standstill_s": stops_s}
    return "ros_faults", metrics, {**details, "plans": table}


def killed(harness: Any, task: EpisodeTask) -> float:
    """Simulated seconds from kill -9 at driving speed to standstill."""
    killed_ns: list[int] = []
    moving_ns: list[int] = []

    def note(seen: Any) -> None:
        speed = abs(seen.state.velocity.linear_m_s)
        if killed_ns and speed > 0.02:
            moving_ns.append(seen.time_ns)
        if not killed_ns and speed > 0.35:
            harness.agent.kill()
            killed_ns.append(seen.time_ns)

    harness.restore()
    harness.revive()
    harness.drive(task.plan, task.start, on_step=note, until=lambda: bool(killed_ns))
    harness.watch(note)
    harness.let_go()
    end_ns = killed_ns[0] + 1_500_000_000
    harness.node.run(lambda: harness.node.robot.time_ns > end_ns)
    return (moving_ns[-1] - killed_ns[0]) / 1e9


if __name__ == "__main__":
    sys.exit(main())
