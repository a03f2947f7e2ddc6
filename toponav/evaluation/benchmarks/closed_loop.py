"""How much faster than real time physics, camera and agent run together, and in what memory."""

import time
from dataclasses import dataclass

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, Belief, Observation, Velocity
from toponav.core.errors import InputError
from toponav.evaluation.agents import AGENTS, AgentContext, check_agent_name, make_agent
from toponav.evaluation.benchmarks.building import benchmark_suite
from toponav.evaluation.benchmarks.record import Benchmark, peak_memory_mb
from toponav.evaluation.suite import Suite
from toponav.maps.task import NavigationTask
from toponav.sim.simulation import CONTROL_PERIOD_S, Simulation

__all__ = ["ConstantAgent", "LoopTimes", "measure_closed_loop", "time_closed_loop"]

_STEPS_PER_TASK = 50
_WEIGHTS = {"closed_loop": "compact", "best_closed_loop": "best"}
"""Shipped weights that are timed, by the name of their figures."""


class ConstantAgent:
    """Drives a gentle curve whatever it sees: the loop without an agent's thinking."""

    def reset(self, task: NavigationTask) -> None:
        """Nothing to prepare."""

    def act(self, observation: Observation) -> Velocity:
        """Forward, a little to the left."""
        return Velocity(0.3, 0.1)

    def belief(self) -> Belief:
        """Nothing is believed."""
        return Belief()


@dataclass(frozen=True, eq=False)
class LoopTimes:
    """Times of each control step, in processor seconds.

    Attributes:
        physics_s: Driving the robot for one control period.
        camera_s: Rendering what it sees.
        agent_s: Deciding what to do.
    """

    physics_s: np.ndarray
    camera_s: np.ndarray
    agent_s: np.ndarray

    def real_time_factor(self, *, agent: bool = True) -> float:
        """Simulated seconds per processor second."""
        spent_s = self.physics_s.sum() + self.camera_s.sum()
        if agent:
            spent_s += self.agent_s.sum()
        return float(len(self.physics_s) * CONTROL_PERIOD_S / spent_s)


def measure_closed_loop(
    agent_name: str = "graphnav_pf", steps: int = 300, repeats: int = 3
) -> Benchmark:
    """Real-time factor per core of the closed loop with both shipped weights, and its memory.

    Figures that include the agent are left out, and `settings` says why, where its weights are
    not there.

    Args:
        agent_name: A name of the registry, or `module:factory`.
        steps: Control steps per repeat.
        repeats: How often the loop is timed; the median counts.

    Raises:
        InputError: If there is no such agent, or it needs to be shown the truth.
    """
    _check_agent(agent_name)
    suite = benchmark_suite()
    camera = PinholeCamera()
    settings = {
        "building": suite.name,
        "camera": f"{camera.width}x{camera.height}",
        "agent": agent_name,
        "steps_per_repeat": steps,
        "repeats": repeats,
        "per_core": "simulated seconds per second of processor time, one thread",
    }
    runs: dict[str, Agent[NavigationTask]] = {"simulator": ConstantAgent()}
    for name, weights in _WEIGHTS.items():
        try:
            runs[name] = _learned_agent(agent_name, weights, suite, camera)
        except (InputError, ImportError) as error:
            settings["left_out"] = f"{agent_name}: {error}"
    simulation = Simulation(suite.scene, camera)
    for agent in runs.values():
        time_closed_loop(simulation, agent, suite, 20)
    factors: dict[str, list[float]] = {name: [] for name in runs}
    agent_ms: dict[str, list[float]] = {name: [] for name in runs if name in _WEIGHTS}
    for _ in range(repeats):
        for name, agent in runs.items():
            times = time_closed_loop(simulation, agent, suite, steps)
            factors[name].append(times.real_time_factor())
            if name in agent_ms:
                agent_ms[name] += (times.agent_s * 1e3).tolist()
    metrics = {
        f"{name}_real_time_factor_per_core": float(np.median(values))
        for name, values in factors.items()
    }
    for name, times_ms in agent_ms.items():
        prefix = name.removesuffix("closed_loop")
        metrics[f"{prefix}agent_ms_p50"] = float(np.percentile(times_ms, 50))
        metrics[f"{prefix}agent_ms_p99"] = float(np.percentile(times_ms, 99))
    metrics["peak_memory_mb_per_worker"] = peak_memory_mb()
    return Benchmark("closed_loop", metrics, settings)


def _check_agent(name: str) -> None:
    check_agent_name(name)
    if name in AGENTS and AGENTS[name].is_privileged:
        raise InputError(
            f"'{name}' is shown the truth, which the benchmark does not compute",
            where="--agent",
            remedy="name an agent that drives by what it sees, such as graphnav_pf",
        )


def _learned_agent(
    name: str, weights: str, suite: Suite, camera: PinholeCamera
) -> Agent[NavigationTask]:
    import torch

    torch.set_num_threads(1)
    return make_agent(name, AgentContext(suite.scene, suite.map, camera, weights=weights))


def time_closed_loop(
    simulation: Simulation, agent: Agent[NavigationTask], suite: Suite, steps: int
) -> LoopTimes:
    """Times of so many control steps, over the suite's plans in turn.

    A plan is left after ten seconds or at the first contact; putting the robot down again
    is not timed.
    """
    spent_s = np.empty((steps, 3))
    done = 0
    for round_ in range(steps):
        task = suite.tasks[round_ % len(suite.tasks)]
        agent.reset(NavigationTask(suite.map, task.plan))
        simulation.reset(task.start)
        for _ in range(_STEPS_PER_TASK):
            if done == steps:
                return LoopTimes(*spent_s.T[[2, 0, 1]])
            marks = [time.process_time()]
            observation = simulation.observe()
            marks.append(time.process_time())
            command = agent.act(observation)
            marks.append(time.process_time())
            state = simulation.step(command)
            marks.append(time.process_time())
            spent_s[done] = np.diff(marks)
            done += 1
            if state.contact is not None:
                break
    return LoopTimes(*spent_s[:done].T[[2, 0, 1]])
