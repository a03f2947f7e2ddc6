"""How long an image-goal agent thinks about a step, and what a larger graph costs it."""

import time
from dataclasses import dataclass

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import NODE_RADIUS_M, ImageNavAgent, ImageNavEpisode
from toponav.evaluation.benchmarks.record import Benchmark
from toponav.evaluation.imagenav.agents import ImageNavChoice, ImageNavContext
from toponav.evaluation.imagenav.agents import make_image_nav_agent as make_agent
from toponav.evaluation.imagenav.episode_sets import load_episode_set
from toponav.evaluation.imagenav.worker import ImageNavSettings, ImageNavWorker
from toponav.models.checkpoints import load_nts
from toponav.navigation.nts.graph_update import GraphUpdate, GraphUpdateConfig
from toponav.navigation.nts.perception import Perception
from toponav.sim.imagenav import ImageNavSimulation

__all__ = ["StepTimes", "measure_image_nav", "time_graph_update", "time_steps"]

_SUITE = "homes-val"
_AGENTS = ("nts_rgbd", "nts_rgb")
_GRAPHS = (8, 64, 512)
_MOST_STEPS = 200


@dataclass(frozen=True, eq=False)
class StepTimes:
    """Processor seconds of each step.

    Attributes:
        act_s: Deciding: perception, graph, policies.
        camera_s: Rendering what the robot sees.
    """

    act_s: np.ndarray
    camera_s: np.ndarray


def time_steps(
    agent: ImageNavAgent, simulation: ImageNavSimulation, episode: ImageNavEpisode
) -> StepTimes:
    """Times of the steps of one episode, in seconds of this thread's processor."""
    agent.reset(simulation.reset(episode.start, episode.goal, 0))
    act_s: list[float] = []
    camera_s: list[float] = []
    while not simulation.state.done and len(act_s) < _MOST_STEPS:
        began_s = time.thread_time()
        observation = simulation.observe()
        seen_s = time.thread_time()
        action = agent.act(observation)
        act_s.append(time.thread_time() - seen_s)
        camera_s.append(seen_s - began_s)
        simulation.step(action)
    return StepTimes(np.array(act_s), np.array(camera_s))


def time_graph_update(
    perception: Perception, simulation: ImageNavSimulation, nodes: int, repeats: int = 40
) -> np.ndarray:
    """Processor seconds of updates of a graph of so many nodes, all of one panorama."""
    rgb, depth_m = simulation.see(simulation.state.pose)
    view = perception.see(rgb, depth_m)
    # Never in a node that is there: an update compares with all its candidates, and adds one.
    config = GraphUpdateConfig(same_node=2.0, moved_m=0.0)
    side = int(np.ceil(np.sqrt(nodes)))
    spent_s = []
    for repeat in range(repeats + 3):
        update = GraphUpdate(perception, config, keep_panoramas=False)
        for number in range(nodes):
            row, col = divmod(number, side)
            pose = Pose2(col * NODE_RADIUS_M, row * NODE_RADIUS_M, 0.0)
            update.views.append(view)
            update.graph.add_node(pose, 0)
            if number:
                update.graph.add_edge(number - 1, number)
        began_s = time.thread_time()
        update.update(view, rgb, Pose2(1.3, 1.3, 0.0), repeat)
        spent_s.append(time.thread_time() - began_s)
    return np.array(spent_s[3:])


def measure_image_nav(episodes: int = 2) -> Benchmark:
    """Times of steps in episodes of each difficulty, and of graph updates.

    Args:
        episodes: Of each difficulty.
    """
    chosen = load_episode_set(_SUITE, ("easy", "medium", "hard"), episodes)
    worker = ImageNavWorker(ImageNavSettings(), map(ImageNavChoice.parse, _AGENTS))
    metrics: dict[str, float] = {}
    for name in _AGENTS:
        agent = make_agent(name, ImageNavContext())
        depth = worker.choices[name].depth
        found = [
            time_steps(agent, worker.simulation(episode, depth=depth), episode)
            for episode in (chosen[0], *sorted(chosen, key=lambda one: one.scene_seed))
        ][1:]  # The first compiles.
        act_ms = 1e3 * np.concatenate([one.act_s for one in found])
        camera_ms = 1e3 * np.concatenate([one.camera_s for one in found])
        metrics |= {
            f"{name}_steps": float(len(act_ms)),
            f"{name}_act_p50_ms": float(np.quantile(act_ms, 0.5)),
            f"{name}_act_p99_ms": float(np.quantile(act_ms, 0.99)),
            f"{name}_act_most_ms": float(act_ms.max()),
            f"{name}_camera_p50_ms": float(np.quantile(camera_ms, 0.5)),
        }
    simulation = worker.simulation(chosen[0], depth=True)
    simulation.reset(chosen[0].start, chosen[0].goal, 0)
    perception = Perception(load_nts("nts", depth=True))
    for nodes in _GRAPHS:
        spent_ms = 1e3 * time_graph_update(perception, simulation, nodes)
        metrics[f"graph_update_{nodes}_nodes_p50_ms"] = float(np.median(spent_ms))
    settings = {
        "building": f"homes of {_SUITE}",
        "episodes": [one.id for one in chosen],
        "most_steps": _MOST_STEPS,
        "times": "seconds of one processor, one thread",
    }
    return Benchmark("imagenav_step", metrics, settings)
