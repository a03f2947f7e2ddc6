import numpy as np
import pytest

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap
from toponav.navigation.graphnav.particle_filter import NodeParticleFilter, ParticleFilterConfig


def chain(length: int) -> TopologicalMap:
    nodes = tuple(Node(f"n{i}", NodeKind.HALLWAY, float(i), 0.0, None) for i in range(length))
    edges = tuple(
        Edge(f"e{i}", f"n{i}", f"n{i + 1}", Behavior.CORRIDOR_FOLLOW, 0.0, 1.0)
        for i in range(length - 1)
    )
    return TopologicalMap("chain", MapFrame(), nodes, edges)


def filter_on(map_: TopologicalMap, seed: int = 0, **config: float) -> NodeParticleFilter:
    settings = ParticleFilterConfig(**config)  # type: ignore[arg-type]
    return NodeParticleFilter(map_, "n0", settings, np.random.default_rng(seed))


def test_without_evidence_four_fifths_stay() -> None:
    belief = filter_on(chain(3), particles=20_000)
    belief.update({})
    assert belief.node_probability()["n0"] == pytest.approx(0.8, abs=0.02)


def test_one_wild_prediction_does_not_move_the_belief() -> None:
    belief = filter_on(chain(6))
    for _ in range(5):
        belief.update({"e0": 1.0})
    assert belief.update({"e4": 1.0}) == "n0"


def test_steady_evidence_moves_the_belief_one_edge_on() -> None:
    belief = filter_on(chain(3))
    nodes = [belief.update({"e1": 0.9, "e0": 0.1}) for _ in range(6)]
    assert nodes[-1] == "n1"


def test_same_seed_gives_the_same_belief() -> None:
    first, second = filter_on(chain(4), seed=3), filter_on(chain(4), seed=3)
    for _ in range(10):
        first.update({"e0": 0.5, "e1": 0.5})
        second.update({"e0": 0.5, "e1": 0.5})
    assert first.node_probability() == second.node_probability()


def test_a_belief_that_ran_ahead_finds_its_way_back() -> None:
    belief = filter_on(chain(4))
    for _ in range(10):
        belief.update({"e1": 1.0})
    nodes = [belief.update({"e0": 0.9, "e1": 0.1}) for _ in range(10)]
    assert nodes[-1] == "n0"


def test_a_node_without_edges_keeps_its_particles() -> None:
    belief = filter_on(chain(1))
    belief.update({})
    assert belief.node_probability() == {"n0": 1.0}


def test_probability_outside_zero_and_one_is_refused() -> None:
    with pytest.raises(ValueError, match="stay_probability"):
        ParticleFilterConfig(stay_probability=1.2)
