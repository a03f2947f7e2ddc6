"""What was searched, what is left, and which of it become ghosts, in two rooms."""

import math

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, network, simulation
from toponav.core.geometry import Pose2
from toponav.core.imagenav import PanoramaObservation
from toponav.maps.image_graph import GhostNode, ImageGraph
from toponav.navigation.nts.ghost_update import update_ghosts
from toponav.navigation.nts.local_policy import LocalPolicy
from toponav.navigation.nts.perception import Perception
from toponav.navigation.nts.searched_floor import SearchConfig, SearchedFloor

_HERE = Pose2(0.0, 0.0, 0.0)
_DOOR = (3.0, 0.0)
"""The doorway in the frame of the start."""


def _seen(at: Pose2 = START) -> PanoramaObservation:
    simulated = simulation()
    simulated.reset(at, at, 0)
    return simulated.observe()


def _searched(config: SearchConfig | None = None) -> tuple[LocalPolicy, SearchedFloor]:
    """After one look from the start."""
    seen, policy = _seen(), LocalPolicy()
    policy.observe(seen, _HERE)
    floor = SearchedFloor(policy.map, config)
    floor.look(Perception(network()).see(seen.rgb, seen.depth_m), _HERE)
    return policy, floor


def test_what_is_in_sight_and_near_is_searched_and_the_other_room_is_not() -> None:
    _, floor = _searched()
    assert floor.is_searched(1.0, 0.5)
    assert not floor.is_searched(5.0, 1.5)
    assert not floor.is_searched(6.0, 0.0)


def test_the_doorway_is_what_is_left_to_search() -> None:
    _, floor = _searched()
    found = floor.openings(_HERE)
    assert [one.drive_m for one in found] == sorted(one.drive_m for one in found)
    assert all(one.unseen_m2 >= SearchConfig().least_m2 for one in found)
    nearest_m = min(math.dist(_DOOR, (one.x_m, one.y_m)) for one in found)
    assert nearest_m < 1.3
    for one in found:
        assert one.drive_m >= 0.9 * math.hypot(one.x_m, one.y_m) - 0.2
        assert floor.drive_m(one.x_m, one.y_m) == pytest.approx(one.drive_m, abs=0.3)


def test_what_was_given_up_is_left_alone_until_it_is_searched_closely() -> None:
    _, floor = _searched()
    before = floor.openings(_HERE)
    for one in before:
        floor.give_up(one.x_m, one.y_m)
    assert not floor.openings(_HERE)
    assert floor.search_closely()
    assert floor.openings(_HERE)
    assert not floor.search_closely()


def test_nothing_is_searched_for_another_goal() -> None:
    _, floor = _searched()
    floor.forget()
    assert not floor.is_searched(1.0, 0.5)
    assert not floor.openings(_HERE)


def _graph() -> ImageGraph:
    graph = ImageGraph()
    graph.add_node(_HERE, 0)
    return graph


def test_an_edge_of_the_searched_floor_becomes_a_ghost_and_stays_the_same_one() -> None:
    policy, floor = _searched()
    graph = _graph()
    update_ghosts(graph, floor, policy.map, _HERE)
    assert graph.ghosts
    before = list(graph.ghosts)
    for ghost in before:
        assert ghost.unseen_m2 is not None
        ghost.score = 0.5
    update_ghosts(graph, floor, policy.map, _HERE)
    assert all(one is other for one, other in zip(before, graph.ghosts, strict=True))
    assert all(ghost.score == 0.5 for ghost in graph.ghosts)


def test_a_ghost_in_searched_floor_goes_and_one_at_the_doorway_stays() -> None:
    policy, floor = _searched()
    (opening, *_) = sorted(
        floor.openings(_HERE), key=lambda one: math.dist(_DOOR, (one.x_m, one.y_m))
    )
    graph = _graph()
    bearing = math.atan2(opening.y_m, opening.x_m)
    away_m = math.hypot(opening.x_m, opening.y_m)
    at_door = GhostNode(0, 0, away_m, bearing_rad=bearing)
    assert floor.is_searched(-1.0, 0.0)
    behind = GhostNode(0, 6, 1.0)
    graph.ghosts += [at_door, behind]
    update_ghosts(graph, floor, policy.map, _HERE)
    assert any(ghost is at_door for ghost in graph.ghosts)
    assert not any(ghost is behind for ghost in graph.ghosts)


def test_a_clear_line_is_told_from_one_through_a_wall() -> None:
    policy, _ = _searched()
    assert policy.map.is_clear((0.0, 0.0), (2.0, 0.0))
    row, col = np.argwhere(policy.map.evidence > 0)[0].tolist()
    assert not policy.map.is_clear((0.0, 0.0), policy.map.center_of(row, col))
