"""Where in its first room a robot may be."""

import numpy as np
import pytest
import torch

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.map_picture import MapArrays
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


def asked_about(beliefs: PoseHypotheses) -> np.ndarray:
    """The numbers of the hypotheses in a batch: the followed one first."""
    others = [k for k in range(len(beliefs)) if k != beliefs.followed]
    return np.array([beliefs.followed, *others])


class Knows(PoseNetwork):
    """Sees a pose that only it knows from any belief."""

    truth = np.array([-3.0, 1.0, 0.0])
    beliefs: "PoseHypotheses"

    def judged(self, local_map, map_picture):
        away = self.truth - self.beliefs.filters.pose[asked_about(self.beliefs)]
        away[:, 2] = 0.0
        mean = torch.from_numpy(away).float()
        return mean, torch.full_like(mean, -1.0), None


@pytest.fixture
def hypotheses() -> PoseHypotheses:
    network = Knows(PoseConfig(picture=PictureConfig((4,), 4, 0.0))).eval()
    return search(network, HypothesesConfig(at_once=100))


def search(network: "Knows", config: HypothesesConfig | None = None) -> PoseHypotheses:
    told = task()
    arrays = MapArrays.of(told.map, told.plan)
    made = PoseHypotheses(arrays, told, network, PoseFilterConfig(), config)
    network.beliefs = made
    return made


class Judges(Knows):
    """Sees no offset, and only says how near the truth each belief is."""

    truth = np.array([-4.8, 0.0, 0.0])

    def judged(self, local_map, map_picture):
        pose = self.beliefs.filters.pose[asked_about(self.beliefs)]
        mean = torch.zeros((len(pose), 3))
        away_m = np.hypot(*(pose[:, :2] - self.truth[:2]).T)
        log_odds = torch.from_numpy(np.where(away_m < 1.0, 3.0, -3.0)).float()
        return mean, torch.full_like(mean, 1.0), log_odds


@pytest.fixture
def judged() -> PoseHypotheses:
    network = Judges(PoseConfig(picture=PictureConfig((4,), 4, 0.0), judges=True)).eval()
    return search(network, HypothesesConfig(rest_steps=3, at_once=100))


def drive(hypotheses: PoseHypotheses, steps: int, step_m: float = 0.1) -> None:
    for _ in range(steps):
        hypotheses.predict(np.array([step_m, 0.0, 0.0]))
        hypotheses._network.truth = hypotheses._network.truth + np.array([step_m, 0.0, 0.0])
        hypotheses.correct(VIEW)


def test_hypotheses_begin_on_the_rooms_side(hypotheses):
    x_m = hypotheses.filters.pose[:, 0]
    assert len(hypotheses) > 10
    assert (x_m <= 1e-9).all(), "the hall is ahead, the room behind"
    assert x_m.min() < -6.0
    assert hypotheses.followed == 0, "before anything is seen the node itself is likeliest"


def test_few_hypotheses_are_left_where_the_network_sees_the_robot(hypotheses):
    for _ in range(25):
        hypotheses.predict(np.array([0.0, 0.0, 0.1]))
        hypotheses.filters.pose[:, 2] = 0.0
        hypotheses.correct(VIEW)
    assert len(hypotheses) <= 5
    assert hypotheses.pose[:2] == pytest.approx(Knows.truth[:2], abs=0.3)


def test_hypothesis_is_followed_until_another_is_clearly_likelier():
    class Wavers(Judges):
        likelier: tuple[int, float] = (0, 0.0)

        def judged(self, local_map, map_picture):
            mean = torch.zeros((len(local_map), 3))
            which, by = self.likelier
            log_odds = torch.from_numpy(by * (asked_about(self.beliefs) == which))
            return mean, torch.full_like(mean, 1.0), log_odds

    network = Wavers(PoseConfig(picture=PictureConfig((4,), 4, 0.0), judges=True)).eval()
    made = search(network, HypothesesConfig(at_once=100, kept=1.0))
    made._log_weight[:] = 0.0
    place = made.filters.pose[3].copy()
    network.likelier = (3, 0.5)
    made.predict(np.array([0.3, 0.0, 0.0]))
    made.correct(VIEW)
    assert made.followed != made._log_weight.argmax(), "hardly likelier: not followed"
    network.likelier = (int(made._log_weight.argmax()), 4.0)
    made.predict(np.array([0.3, 0.0, 0.0]))
    made.correct(VIEW)
    assert made.followed == made._log_weight.argmax()
    assert made.pose[0] == pytest.approx(place[0] + 0.6, abs=0.05)


def test_hypothesis_that_is_judged_to_be_near_wins_though_all_see_no_offset(judged):
    drive(judged, 10)
    assert len(judged) < 5
    assert np.hypot(*(judged.pose - judged._network.truth)[:2]) < 1.0


def test_search_begins_anew_where_the_belief_is_judged_to_be_elsewhere(judged):
    drive(judged, 10)
    judged._network.truth = judged._network.truth + np.array([3.2, 0.0, 0.0])
    drive(judged, 25)
    assert judged.restarts >= 1
    assert np.hypot(*(judged.pose - judged._network.truth)[:2]) < 1.0


def test_a_frame_corrects_some_hypotheses_and_the_others_wait_their_turn():
    class Counts(PoseNetwork):
        asked = 0

        def judged(self, local_map, map_picture):
            self.asked += len(local_map)
            mean = torch.zeros((len(local_map), 3))
            return mean, torch.full_like(mean, 1.5), torch.zeros(len(local_map))

    network = Counts(PoseConfig(picture=PictureConfig((4,), 4, 0.0), judges=True))
    told = task()
    arrays = MapArrays.of(told.map, told.plan)
    made = PoseHypotheses(arrays, told, network, PoseFilterConfig(), HypothesesConfig(at_once=5))
    begun = len(made)
    first_std = made.filters.std_in_robot[:, 0].copy()
    for step in range(8):
        made.correct(VIEW)
        assert network.asked == 5 * (step + 1)
    assert len(made) == begun, "none is unlikely, and none have met"
    assert (made.filters.std_in_robot[:, 0] < first_std).all(), "each has had its turn"


def test_robot_is_inside_until_its_likeliest_pose_has_come_by_the_door(judged):
    judged._network.truth = np.array([0.0, 0.0, 0.0])
    judged.begin_anew()
    drive(judged, 1, 0.0)
    assert not judged.is_inside, "the node is less than a metre from its door"
    far = search(judged._network, judged.config)
    judged._network.truth = np.array([-4.8, 0.0, 0.0])
    drive(far, 6, 0.0)
    assert far.is_inside
    assert far.progress_m <= 0.3 + 1e-9, "no farther than the door"
    drive(far, 45)
    assert not far.is_inside


def test_answers_that_are_not_finite_change_nothing(hypotheses):
    hypotheses._network.truth = np.array([np.nan, 0.0, 0.0])
    before = hypotheses.filters.pose.copy()
    hypotheses.correct(VIEW)
    assert np.array_equal(hypotheses.filters.pose, before)


def test_settings_must_be_positive():
    with pytest.raises(InputError, match="positive"):
        HypothesesConfig(give_up=0.0)
