"""Which ghost is chosen, by its score, its way and the floor behind it."""

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, network, simulation
from toponav.core.geometry import Pose2
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.global_policy import GlobalPolicy, GlobalPolicyConfig
from toponav.navigation.nts.perception import Perception

_HERE = Pose2(0.0, 0.0, 0.0)


def _policy(config: GlobalPolicyConfig) -> GlobalPolicy:
    perception = Perception(network())
    goal = perception.see(*simulation().see(START)[:2])
    return GlobalPolicy(perception, goal, config, np.random.default_rng(0))


def _graph(*ghosts: GhostNode) -> ImageGraph:
    graph = ImageGraph()
    graph.add_node(_HERE, 0)
    graph.ghosts.extend(ghosts)
    return graph


@pytest.mark.parametrize("by_floor", [True, False])
def test_of_equal_ghosts_the_better_scored_is_chosen(by_floor: bool) -> None:
    worse, better = GhostNode(0, 0, score=0.1), GhostNode(0, 6, score=0.3)
    policy = _policy(GlobalPolicyConfig(by_floor=by_floor))
    assert policy.choose(_graph(worse, better), 0, _HERE) is better


def test_by_floor_the_most_for_each_metre_of_driving_is_chosen() -> None:
    much = GhostNode(0, 0, score=0.2, unseen_m2=8.0)
    little = GhostNode(0, 6, score=0.2, unseen_m2=1.0)
    policy = _policy(GlobalPolicyConfig(by_floor=True))
    assert policy.choose(_graph(little, much), 0, _HERE, lambda x_m, _: 3.0) is much
    # Nine times the way for eight times the floor.
    policy = _policy(GlobalPolicyConfig(by_floor=True))
    far = lambda x_m, _: 26.0 if x_m > 0.0 else 1.0  # noqa: E731
    assert policy.choose(_graph(little, much), 0, _HERE, far) is little


def test_floor_behind_a_direction_counts_like_floor_behind_an_edge() -> None:
    edge = GhostNode(0, 0, score=0.2, unseen_m2=2.0)
    direction = GhostNode(0, 6, score=0.2, behind_m2=9.0)
    assert (edge.floor_m2, direction.floor_m2) == (2.0, 9.0)
    assert GhostNode(0, 3).floor_m2 is None
    policy = _policy(GlobalPolicyConfig(by_floor=True))
    assert policy.choose(_graph(edge, direction), 0, _HERE, lambda *_: 3.0) is direction


def test_a_choice_is_kept_until_another_is_clearly_better() -> None:
    first = GhostNode(0, 0, score=0.2, unseen_m2=5.0)
    policy = _policy(GlobalPolicyConfig(by_floor=True))
    graph = _graph(first)
    assert policy.choose(graph, 0, _HERE, lambda *_: 3.0) is first
    graph.ghosts.append(GhostNode(0, 6, score=0.2, unseen_m2=6.0))
    graph.add_node(Pose2(0.5, 0.0, 0.0), 1)
    assert policy.choose(graph, 0, _HERE, lambda *_: 3.0) is first
    much = GhostNode(0, 6, score=0.2, unseen_m2=15.0)
    graph.ghosts.append(much)
    graph.add_node(Pose2(0.7, 0.0, 0.0), 2)
    assert policy.choose(graph, 0, _HERE, lambda *_: 3.0) is much
