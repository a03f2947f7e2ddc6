"""The particle filter over map nodes that turns GraphNav into GraphNavPF (appendix A-C)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from toponav.maps.spec import TopologicalMap

__all__ = ["NodeParticleFilter", "ParticleFilterConfig"]


@dataclass(frozen=True)
class ParticleFilterConfig:
    """Settings of the particle filter; the defaults are the paper's where it gives them."""

    stay_probability: float = 0.8
    """p(x_t = x_{t-1} | x_{t-1}); the rest is shared equally by the neighbours."""
    particles: int = 1000
    """Number of particles (the paper does not say)."""
    floor: float = 1e-3
    """Least weight of a node, so that one wrong prediction cannot empty the filter."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.stay_probability <= 1.0:
            raise ValueError(f"stay_probability must be in [0, 1], got {self.stay_probability}")
        if self.particles < 1:
            raise ValueError(f"particles must be at least 1, got {self.particles}")
        if not 0.0 < self.floor < 1.0:
            raise ValueError(f"floor must be in (0, 1), got {self.floor}")


class NodeParticleFilter:
    """A belief over the map's nodes, kept by particles.

    Each step moves the particles by the motion model, weighs them with the localization
    network's outgoing edge probabilities summed per node, and resamples systematically.
    The neighbours of a node are those that an edge joins it to, in either direction: a robot
    only moves along edges, but a belief that ran ahead has to find its way back.

    Args:
        map_: The topological map.
        start_node: Where the robot is when the episode begins.
        config: Motion model and particle count.
        rng: Source of randomness; the same generator state gives the same beliefs.

    Reference:
        GraphNav, appendix A-C; Dellaert et al. 1999.
    """

    def __init__(
        self,
        map_: TopologicalMap,
        start_node: str,
        config: ParticleFilterConfig,
        rng: np.random.Generator,
    ) -> None:
        self._config = config
        self._rng = rng
        self._names = [node.id for node in map_.nodes]
        self._index = {name: index for index, name in enumerate(self._names)}
        self._moves = _moves(map_, self._index)
        self._source = {edge.id: self._index[edge.source] for edge in map_.edges}
        self._particles = np.full(config.particles, self._index[start_node])

    def update(self, edge_probability: Mapping[str, float]) -> str:
        """Move, weigh and resample; the node that then holds most particles.

        Args:
            edge_probability: The localization network's probability by edge id. Edges outside
                its crop are absent and count as zero.
        """
        self._move()
        likelihood = np.zeros(len(self._names))
        for edge, probability in edge_probability.items():
            likelihood[self._source[edge]] += probability
        weights = likelihood[self._particles] + self._config.floor
        self._resample(weights / weights.sum())
        return self._names[int(np.argmax(self._counts()))]

    def node_probability(self) -> dict[str, float]:
        """The share of the particles at each node that holds any."""
        counts = self._counts()
        held = np.nonzero(counts)[0]
        return {self._names[i]: float(counts[i]) / len(self._particles) for i in held}

    def _counts(self) -> Int[np.ndarray, " nodes"]:
        return np.bincount(self._particles, minlength=len(self._names))

    def _move(self) -> None:
        """p(x_t | x_{t-1}): stay, or go to one of the neighbours at random."""
        leaves = self._rng.random(len(self._particles)) >= self._config.stay_probability
        movers = self._particles[leaves]
        choice = self._rng.random(len(movers))
        targets, starts, degrees = self._moves
        picked = starts[movers] + np.floor(choice * degrees[movers]).astype(int)
        self._particles = self._particles.copy()
        self._particles[leaves] = targets[picked]

    def _resample(self, weights: Float[np.ndarray, " particles"]) -> None:
        """Systematic resampling: one random offset, evenly spaced picks."""
        count = len(self._particles)
        positions = (self._rng.random() + np.arange(count)) / count
        cumulative = np.cumsum(weights)
        cumulative[-1] = 1.0
        self._particles = self._particles[np.searchsorted(cumulative, positions)]


def _moves(
    map_: TopologicalMap, index: Mapping[str, int]
) -> tuple[Int[np.ndarray, " moves"], Int[np.ndarray, " nodes"], Int[np.ndarray, " nodes"]]:
    """Neighbours of each node in one flat array, where they start and how many there are.

    A node without edges is its own only neighbour.
    """
    targets: list[int] = []
    starts, degrees = [], []
    for node in map_.nodes:
        reached = sorted(
            {index[edge.target] for edge in map_.out_edges(node.id)}
            | {index[edge.source] for edge in map_.in_edges(node.id)}
        )
        starts.append(len(targets))
        targets.extend(reached or [index[node.id]])
        degrees.append(max(len(reached), 1))
    return np.array(targets), np.array(starts), np.array(degrees)
