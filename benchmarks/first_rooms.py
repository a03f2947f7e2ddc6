"""Whether GraphNavPF gets out of its first room when it starts far from the room's node.

    python benchmarks/first_rooms.py [--starts 80] [--weights best]

What most of its failures came from. Robots start at least 2.5 m from their room's node in
validation offices, as they are (`offices-val`) and with partitions in 65 % of their rooms (seeds
31000 on), and drive for at most 300 steps: out by the plan's door, off the plan for a second,
stuck (less than 0.5 m and 20 degrees in 10 s), or still inside at the end. Writes
benchmarks/results/first_rooms.json: shares of starts, for the whole agent and without parts.
"""

import argparse
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import torch

from toponav.core.camera import PinholeCamera
from toponav.core.vocabulary import NodeKind
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.evaluation.suite import EpisodeTask, suite_of
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask
from toponav.navigation.graphnav.metric_agent import MetricGraphNavAgent, load_metric_agent
from toponav.sim.oracle import TruthLocalizer
from toponav.sim.simulation import Simulation
from toponav.worlds.generate.office import generate_office
from toponav.worlds.generate.suites import suite
from toponav.worlds.scene import Scene

RESULTS = Path(__file__).parent / "results"
FAR_M, STEPS, OFF_STEPS, STUCK_STEPS, IN_A_BUILDING = 2.5, 300, 5, 50, 5
WITHOUT = {"whole": (), "without_room_search": ("room_search",), "one_filter": ("hypotheses",)}


def main() -> None:
    """Measure, and write the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--starts", type=int, default=80, help="of each kind of office")
    parser.add_argument("--weights", default="best")
    parser.add_argument("--out", type=Path, default=RESULTS)
    given = parser.parse_args()
    torch.set_num_threads(1)
    camera = PinholeCamera()
    kinds = {
        "plain": [(seed, 0.0) for seed in suite("offices-val").seeds[10:]],
        "partitioned": [(seed, 0.65) for seed in range(31000, 31040)],
    }
    metrics = {}
    for name, parts in WITHOUT.items():
        agent = load_metric_agent(given.weights, pose_filter=True, camera=camera, without=parts)
        for kind, buildings in kinds.items():
            ends: Counter[str] = Counter()
            for scene, map_, task in far_starts(buildings, given.starts):
                ends[drive(agent, scene, map_, task)] += 1
            print(name, kind, dict(ends), flush=True)
            for end in ("out", "deviated", "stuck", "inside"):
                metrics[f"{name}_{kind}_{end}_share"] = ends[end] / ends.total()
    settings = {"starts": given.starts, "weights": given.weights, "seed": 0, "far_m": FAR_M}
    print(write_benchmark(Benchmark("first_rooms", metrics, settings), given.out))


def far_starts(
    buildings: list[tuple[int, float]], starts: int
) -> Iterator[tuple[Scene, TopologicalMap, EpisodeTask]]:
    """Plans that begin far from their room's node and leave it by a door."""
    found = 0
    for seed, partitions in buildings:
        scene = generate_office(seed, partitions=partitions)
        map_ = map_from_layout(scene)
        here = 0
        for task in suite_of(scene, map_, 60, 0).tasks:
            first, door = (map_.node(node) for node in task.plan.nodes[:2])
            far_m = math.hypot(first.x_m - task.start.x_m, first.y_m - task.start.y_m)
            is_door = door.kind is NodeKind.DOOR and len(task.plan.nodes) > 3
            if far_m < FAR_M or not is_door or here >= IN_A_BUILDING:
                continue
            if found == starts:
                return
            here, found = here + 1, found + 1
            yield scene, map_, task


def drive(
    agent: MetricGraphNavAgent, scene: Scene, map_: TopologicalMap, task: EpisodeTask
) -> str:
    """How the robot's stay in its first room ended."""
    simulation = Simulation(scene, PinholeCamera())
    truth = TruthLocalizer(map_, scene, any_heading_in_rooms=True)
    state = simulation.reset(task.start)
    agent.reset(NavigationTask(map_, task.plan))
    off, trail = 0, []
    for _ in range(STEPS):
        node = truth.node_at(state.pose)
        off = off + 1 if node is not None and node not in task.plan.nodes else 0
        if off >= OFF_STEPS:
            return "deviated"
        if node in task.plan.nodes[3:]:
            return "out"
        trail.append(state.pose)
        if len(trail) > STUCK_STEPS:
            now, then = trail[-1], trail[-1 - STUCK_STEPS]
            turned_rad = abs(math.remainder(now.yaw_rad - then.yaw_rad, 2.0 * math.pi))
            if now.distance_to(then) < 0.5 and turned_rad < math.radians(20.0):
                return "stuck"
        state = simulation.step(agent.act(simulation.observe()))
    return "inside"


if __name__ == "__main__":
    main()
