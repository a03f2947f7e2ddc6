"""GraphNav and GraphNavPF: localize on the map, look up the behaviour, drive."""

import math

import numpy as np

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Belief, Observation, Velocity
from toponav.maps.subgraph import crop
from toponav.maps.task import NavigationTask
from toponav.models.checkpoints import load_weights
from toponav.models.graphnav.graph_tensors import encode_subgraph
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.navigation.graphnav.behavior_selection import BehaviorSelector
from toponav.navigation.graphnav.dead_reckoning import DeadReckoning
from toponav.navigation.graphnav.driver import BehaviorDriver
from toponav.navigation.graphnav.particle_filter import NodeParticleFilter, ParticleFilterConfig

__all__ = ["GraphNavAgent", "load_agent"]


class GraphNavAgent:
    """Drives a plan from depth images and the map alone (GraphNav, section V, figure 3).

    Each step the localization network says which edge of the map around the last location the
    robot is on; the plan says which behaviour leaves that edge's source; that behaviour's
    network drives. With a particle filter (GraphNavPF, appendix A-C) the network's edge
    probabilities are the measurement and the filter's most likely node is the location.

    Args:
        localization: The graph localization network.
        driver: Runs the behaviour networks and keeps the frames.
        particle_filter: Settings of the filter; None for plain GraphNav.
        seed: Seed of the particle filter.
    """

    def __init__(
        self,
        localization: LocalizationNetwork,
        driver: BehaviorDriver,
        particle_filter: ParticleFilterConfig | None = None,
        seed: int = 0,
    ) -> None:
        self._localization = localization.eval()
        self._driver = driver
        self._filter_config = particle_filter
        self._seed = seed
        self._filter: NodeParticleFilter | None = None
        self._task: NavigationTask | None = None
        self._reckoning = DeadReckoning()
        self._belief = Belief()

    def reseed(self, seed: int) -> None:
        """Use this seed from the next `reset` on."""
        self._seed = seed

    def reset(self, task: NavigationTask) -> None:
        """Begin at the plan's first node: all that the robot is ever told."""
        self._task = task
        self._selector = BehaviorSelector(task)
        self._driver.reset()
        self._reckoning.reset(task.start_node)
        self._belief = Belief(task.start_node, task.plan.edges[0])
        if self._filter_config is not None:
            rng = np.random.default_rng(self._seed)
            self._filter = NodeParticleFilter(task.map, task.start_node, self._filter_config, rng)

    def act(self, observation: Observation) -> Velocity:
        """The command for this step; zero when the frame cannot be trusted."""
        assert self._task is not None, "reset the agent first"
        last = self._belief
        if not self._driver.observe(observation):
            return self._stop(self._driver.stopped_because)
        probability = self._edge_probability(self._task, last)
        if not all(map(math.isfinite, probability.values())):
            return self._stop("the localization network gave probabilities that are not finite")
        node, edge = self._locate(self._task, probability)
        behavior = self._selector.select(node)
        command = self._driver.command(behavior)
        self._reckoning.advance(command)
        self._belief = Belief(node, edge, behavior, probability, self._driver.stopped_because)
        return command

    def belief(self) -> Belief:
        """Where it thinks it is, with the probability of each edge it considered."""
        return self._belief

    def _stop(self, because: str) -> Velocity:
        last = self._belief
        self._belief = Belief(last.node, last.edge, last.behavior, {}, because)
        return Velocity(0.0, 0.0)

    def _edge_probability(self, task: NavigationTask, last: Belief) -> dict[str, float]:
        assert last.node is not None
        config = self._localization.config
        around = crop(task.map, last.node, config.ahead, config.behind)
        if not around.edges:
            return {}
        motion = self._reckoning.since(last.node)
        graph = encode_subgraph(task.map, around, task.plan, last.edge, config, motion)
        frames = self._driver.stack(config.frame_offsets)
        probability = self._localization.edge_probabilities(frames, graph)
        return dict(zip(graph.edge_ids, probability.tolist(), strict=True))

    def _locate(
        self, task: NavigationTask, probability: dict[str, float]
    ) -> tuple[str, str | None]:
        """The node to act on, and the edge that leaves it."""
        last = self._belief
        assert last.node is not None
        if not probability:
            return last.node, last.edge
        if self._filter is None:
            edge = max(probability, key=probability.__getitem__)
            return task.map.edge(edge).source, edge
        node = self._filter.update(probability)
        return node, _likeliest_exit(task, node, probability)


def _likeliest_exit(task: NavigationTask, node: str, probability: dict[str, float]) -> str | None:
    """Of the edges that leave a node, the plan's when it has one, else the likeliest."""
    position = task.plan.position(node)
    if position is not None and position < len(task.plan.edges):
        return task.plan.edges[position]
    exits = [edge.id for edge in task.map.out_edges(node)]
    return max(exits, key=lambda edge: probability.get(edge, 0.0)) if exits else None


def load_agent(
    weights: str | None,
    *,
    particle_filter: bool,
    camera: PinholeCamera,
    seed: int = 0,
) -> GraphNavAgent:
    """GraphNav, or GraphNavPF, with the networks of a folder or of a shipped preset.

    Args:
        weights: A folder of checkpoints, the name of a shipped preset, or None for `compact`.
        particle_filter: Whether to filter the localization (GraphNavPF).
        camera: The camera that the robot carries.
        seed: Seed of the particle filter.

    Raises:
        InputError: The weights cannot be read, or the camera does not suit them.

    Example:
        >>> agent = load_agent(None, particle_filter=True, camera=PinholeCamera())
    """
    loaded = load_weights(weights or "compact")
    localization = loaded.localization
    driver = BehaviorDriver(
        loaded.behaviors, camera, history=max(localization.config.frame_offsets) + 1
    )
    config = ParticleFilterConfig() if particle_filter else None
    return GraphNavAgent(localization, driver, config, seed)
