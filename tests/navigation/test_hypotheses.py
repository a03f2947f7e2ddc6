"""Where in its first room a robot may be."""

import numpy as np
import pytest
import torch

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.pose_filter import PoseFilterConfig
from toponav.models.graphnav.metric.pose_network import PoseNetwork
from toponav.models.graphnav.metric.presets import PictureConfig, PoseConfig
from toponav.navigation.graphnav.hypotheses import HypothesesConfig, PoseHypotheses

VIEW = np.full((64, 64), 0x77, np.uint8)


def task() -> NavigationTask:
    nodes = (
        Node("a", NodeKind.ROOM, 0.0, 0.0, room="a"),
        Node("a_door", NodeKind.DOOR, 0.3, 0.0, room="a"),
        Node("hall", NodeKind.HALLWAY, 2.0, 0.0),
    )
    edges = (
        edge_along(nodes[0], nodes[1], Behavior.FIND_DOOR),
        edge_along(nodes[1], nodes[2], Behavior.STRAIGHT),
    )
    topological_map = TopologicalMap("t", MapFrame(), nodes, edges)
    return NavigationTask(topological_map, shortest_plan(topological_map, "a", "hall"))


class Knows(PoseNetwork):
    """Sees a pose that only it knows from any belief."""

    truth = np.array([-3.0, 1.0, 0.0])
    beliefs: "PoseHypotheses"

    def forward(self, local_map, map_picture):
        away = self.truth - self.beliefs.filters.pose
        away[:, 2] = 0.0
        mean = torch.from_numpy(away).float()
        return mean, torch.full_like(mean, -1.0)


@pytest.fixture
def hypotheses() -> PoseHypotheses:
    network = Knows(PoseConfig(picture=PictureConfig((4,), 4, 0.0))).eval()
    made = PoseHypotheses(task(), network, PoseFilterConfig())
    network.beliefs = made
    return made


def test_hypotheses_begin_on_the_rooms_side(hypotheses):
    x_m = hypotheses.filters.pose[:, 0]
    assert len(hypotheses) > 10
    assert (x_m <= 1e-9).all(), "the hall is ahead, the room behind"
    assert x_m.min() < -6.0
    assert hypotheses.best == 0, "before anything is seen the node itself is likeliest"


def test_few_hypotheses_are_left_where_the_network_sees_the_robot(hypotheses):
    for _ in range(25):
        hypotheses.predict(np.array([0.0, 0.0, 0.1]))
        hypotheses.filters.pose[:, 2] = 0.0
        hypotheses.correct(VIEW)
    assert len(hypotheses) <= 5
    assert hypotheses.pose[:2] == pytest.approx(Knows.truth[:2], abs=0.3)


def test_answers_that_are_not_finite_change_nothing(hypotheses):
    hypotheses._network.truth = np.array([np.nan, 0.0, 0.0])
    before = hypotheses.filters.pose.copy()
    hypotheses.correct(VIEW)
    assert np.array_equal(hypotheses.filters.pose, before)


def test_settings_must_be_positive():
    with pytest.raises(InputError, match="positive"):
        HypothesesConfig(give_up=0.0)
