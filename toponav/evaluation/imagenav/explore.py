"""Maps a building with the agent of Neural Topological SLAM: no goal, every ghost in turn."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import IMAGE_NAV_ROBOT_RADIUS_M, Action, ImageGoal, ImageNavBelief
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.evaluation.imagenav.explored_map import map_of_floor, seen_floor
from toponav.maps.image_graph import ImageGraph
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.suggest_behaviors import suggest_behaviors
from toponav.models.nts.network import NTSNetwork
from toponav.navigation.nts.agent import NTSAgent, NTSAgentConfig
from toponav.navigation.nts.exploration import ExplorationConfig
from toponav.navigation.nts.global_policy import GlobalPolicyConfig
from toponav.navigation.nts.goal_finder import FinderConfig
from toponav.navigation.nts.local_map import MapConfig
from toponav.navigation.nts.local_policy import LocalPolicyConfig
from toponav.sim.imagenav import LOCOBOT, ImageNavSimulation
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["ExploreConfig", "Explored", "explore_building", "map_of_graph"]

_NEVER = 9.0
_SEEN_M = 3.0


@dataclass(frozen=True)
class ExploreConfig:
    """How a building is explored."""

    steps: int = 3000
    """Actions at most."""
    noise: bool = True
    """Whether motions and odometry are as bad as a LoCoBot's."""
    seed: int = 0
    """Seed of the noise, and of the start where none is given."""
    start: Pose2 | None = None
    """Where to start; by default anywhere."""
    idle_steps: int = 12
    """It ends where nothing was left to explore for so long."""

    def __post_init__(self) -> None:
        if not 1 <= self.steps <= 100_000 or self.seed < 0:
            raise InputError(
                f"steps must be 1 to 100,000 and the seed not negative, got {self.steps} and "
                f"{self.seed}",
                where="toponav explore",
                remedy="1000 steps cover most homes, 3000 an office",
            )


@dataclass(frozen=True, eq=False)
class Explored:
    """What an exploration found.

    Attributes:
        graph: The image graph, in the frame of the start.
        map: The topological map, laid at the true start.
        floor: The floor plan that was seen, with the rooms that the map names where it has any.
        path: True poses.
        start: Where it started.
        belief: What the agent thought at the end.
        covered: Share of the floor that came within 3 m of the robot.
        off_m: How far from where it was the agent thought that it was, at the end.
        steps: Actions taken.
        why_no_rooms: Why the map has no rooms and doors; empty where it has.
    """

    graph: ImageGraph
    map: TopologicalMap
    floor: Scene
    path: tuple[Pose2, ...]
    start: Pose2
    belief: ImageNavBelief
    covered: float
    off_m: float
    steps: int
    why_no_rooms: str


def explore_building(
    scene: Scene,
    network: NTSNetwork,
    config: ExploreConfig,
    progress: Callable[[int, int], None] | None = None,
) -> Explored:
    """Drives from ghost to ghost, the nearest first, and then to what is left at the map's edges.

    The map is made from the occupancy that the robot saw, as any floor plan's is: rooms, doors,
    two lanes down corridors, and a behaviour an edge. Where what was seen falls into no rooms,
    the map is the image graph: open spaces, joined both ways.

    Args:
        scene: The building.
        network: The multi-task network.
        config: How.
        progress: Told how many steps are done, and of how many at most.

    Raises:
        InputError: If the robot cannot be at the start, or nowhere in the building.
    """
    simulation = ImageNavSimulation(
        scene,
        depth=network.config.depth,
        noise=LOCOBOT if config.noise else None,
        max_steps=config.steps + 1,
    )
    start = config.start or _anywhere(simulation.free_space, config.seed)
    # The goal is what it sees at first; that it is never found makes it explore to the end.
    goal: ImageGoal = simulation.reset(start, start, config.seed)
    agent = _explorer(scene, network, config.seed)
    agent.reset(goal)
    path, idle = [start], 0
    while simulation.state.step < config.steps and idle < config.idle_steps:
        action = agent.act(simulation.observe())
        if action == Action.STOP:
            break
        path.append(simulation.step(action).pose)
        idle = idle + 1 if agent.belief_in_brief().mode == "wander" else 0
        if progress is not None:
            progress(simulation.state.step, config.steps)
    believed = agent.belief_in_brief().pose
    assert believed is not None
    drawn, floor, why = _map_of(agent, start, scene.name)
    return Explored(
        agent.graph,
        drawn,
        floor,
        tuple(path),
        start,
        agent.belief(),
        _covered(simulation.free_space, path),
        start.compose(believed).distance_to(simulation.state.pose),
        simulation.state.step,
        why,
    )


def _explorer(scene: Scene, network: NTSNetwork, seed: int) -> NTSAgent:
    """The agent with a map as large as the building can be, and no goal that it could find."""
    side_m = 2.0 * scene.grid.resolution_m * math.hypot(scene.grid.rows, scene.grid.cols)
    config = NTSAgentConfig(
        finder=FinderConfig(found=_NEVER),
        ghosts=GlobalPolicyConfig(score_trust=0.0),
        # A map needs all that can be seen, not only what a goal would be found from.
        exploration=ExplorationConfig(search=None),
        local=LocalPolicyConfig(map=MapConfig(side_m=max(side_m, MapConfig().side_m))),
    )
    return NTSAgent(network, config, seed=seed)


def _map_of(agent: NTSAgent, start: Pose2, name: str) -> tuple[TopologicalMap, Scene, str]:
    """The map, the floor that it is of, and why it has no rooms where it has none."""
    floor = seen_floor(agent.seen, start, name)
    try:
        return *map_of_floor(floor), ""
    except InputError as error:
        return map_of_graph(agent.graph, start, name), floor, error.rule


def map_of_graph(graph: ImageGraph, start: Pose2, name: str) -> TopologicalMap:
    """An image graph as a topological map: open spaces, joined both ways, behaviours by angles.

    Args:
        graph: In the frame of the start.
        start: Where that frame lies in the map's.
        name: Name of the building.
    """
    nodes = []
    for node in graph.nodes:
        pose = start.compose(node.pose)
        nodes.append(Node(f"place_{node.number}", NodeKind.OPEN_SPACE, pose.x_m, pose.y_m))
    edges = [
        edge_along(nodes[source], nodes[target], Behavior.CORRIDOR_FOLLOW)
        for edge in graph.edges
        for source, target in ((edge.source, edge.target), (edge.target, edge.source))
    ]
    drawn = TopologicalMap(name, MapFrame(), tuple(nodes), tuple(edges))
    return suggest_behaviors(drawn) if edges else drawn


def _anywhere(space: FreeSpace, seed: int) -> Pose2:
    cells = np.argwhere(
        (space.component == 1) & (space.clearance_m > 2 * IMAGE_NAV_ROBOT_RADIUS_M)
    )
    if not len(cells):
        raise InputError(
            "there is no room for the robot in this building",
            where="toponav explore",
            remedy="choose a building with doors and floor for a robot of 0.36 m",
        )
    rng = np.random.default_rng(seed)
    row, col = cells[rng.integers(len(cells))].tolist()
    return Pose2(*space.grid.center_of(row, col), float(rng.uniform(-math.pi, math.pi)))


def _covered(space: FreeSpace, path: list[Pose2]) -> float:
    cells = np.argwhere(space.component == 1)
    centers = (cells[:, ::-1] + 0.5) * space.grid.resolution_m + np.asarray(space.grid.origin_m)
    near = np.zeros(len(centers), bool)
    for pose in path[::4]:
        near |= np.hypot(centers[:, 0] - pose.x_m, centers[:, 1] - pose.y_m) < _SEEN_M
    return float(near.mean())
