"""Where the goal is believed to be, and when that was a mistake, in two rooms."""

from dataclasses import replace

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, network, simulation
from toponav.core.geometry import Pose2
from toponav.navigation.nts.goal_finder import FinderConfig, GoalFinder
from toponav.navigation.nts.perception import PairView, Perception, View


class _Fixed(Perception):
    """Says the same of every pair."""

    chance = 0.0

    def compare(self, sources: list[View], goal: View) -> PairView:
        return replace(
            super().compare(sources, goal),
            connection=np.full(len(sources), self.chance, np.float32),
        )


def _see(perception: Perception, at: Pose2) -> View:
    simulated = simulation()
    return perception.see(*simulated.see(at)[:2])


def _finder(goal: Pose2, chance: float = 0.0, **changes: float) -> GoalFinder:
    perception = _Fixed(network())
    perception.chance = chance
    config = replace(FinderConfig(), **changes)
    return GoalFinder(perception, _see(perception, goal), config)


@pytest.mark.parametrize("chance", [0.0, 1.0])
def test_a_goal_beyond_a_nodes_radius_is_found_whatever_the_network_says(chance: float) -> None:
    start, goal = Pose2(1.0, 1.0, 0.3), Pose2(1.5, 4.9, 1.0)
    finder = _finder(goal, chance)
    finder.look(_see(finder._perception, start), start, 0)
    there = Pose2(1.2, 1.1, 0.5)
    finder.look(_see(finder._perception, there), there, 2)
    assert finder.place is not None
    assert finder.place.distance_to(goal) < 0.3


def test_a_glimpse_that_no_other_look_confirms_is_kept_for_later() -> None:
    start, goal = Pose2(1.0, 1.0, 0.3), Pose2(1.5, 4.9, 1.0)
    finder = _finder(goal, clear=2.0)
    finder.look(_see(finder._perception, start), start, 0)
    assert finder.place is None
    assert finder.take_best_guess()
    assert finder.place is not None
    assert finder.place.distance_to(goal) < 0.3


def test_a_guess_out_of_reach_is_set_aside_and_is_no_mistake() -> None:
    start, goal = Pose2(1.0, 1.0, 0.3), Pose2(1.5, 4.9, 1.0)
    finder = _finder(goal, clear=2.0)
    finder.look(_see(finder._perception, start), start, 0)
    assert finder.take_best_guess()
    finder.set_aside()
    assert finder.place is None
    assert not finder.take_best_guess()
    there = Pose2(1.2, 1.1, 0.5)
    finder.look(_see(finder._perception, there), there, 2)
    assert finder.place is not None


def test_the_network_has_its_say_about_places_near_by() -> None:
    start, goal = Pose2(2.0, 3.0, 0.0), Pose2(3.0, 4.0, 1.0)
    scores = []
    for chance in (0.0, 1.0):
        finder = _finder(goal, chance)
        finder.look(_see(finder._perception, start), start, 0)
        scores.append(finder.score)
    assert scores[1] - scores[0] == pytest.approx(2 * FinderConfig().network_share, abs=0.02)


def test_a_place_that_does_not_agree_from_near_by_is_given_up_for_good() -> None:
    finder = _finder(Pose2(8.0, 3.0, 0.0), found=0.9)
    wrong = Pose2(4.0, 3.0, 0.0)
    finder.place, finder.score = wrong, 0.5
    for step in range(4):
        at = Pose2(2.0 + 0.2 * step, 3.0, 0.0)
        finder.look(_see(finder._perception, at), at, step)
    assert finder.place is None
    assert finder._is_mistake(wrong, 0.5)


def test_turning_on_the_spot_gives_nothing_up() -> None:
    finder = _finder(Pose2(8.0, 3.0, 0.0), found=0.9)
    finder.place, finder.score = Pose2(4.0, 3.0, 0.0), 0.5
    for step in range(4):
        at = replace_yaw(START, 0.2 * step)
        finder.look(_see(finder._perception, at), at, step)
    assert finder.place is not None


def replace_yaw(pose: Pose2, yaw_rad: float) -> Pose2:
    """The same place with another heading."""
    return Pose2(pose.x_m, pose.y_m, yaw_rad)
