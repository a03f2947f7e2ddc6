import pytest

from toponav.core.episode import Velocity
from toponav.navigation.graphnav.dead_reckoning import DeadReckoning


def drive(reckoning: DeadReckoning, node: str, steps: int) -> float:
    driven_m = 0.0
    for _ in range(steps):
        reckoning.advance(Velocity(0.5, 0.0))
        driven_m = reckoning.since(node).driven_m
    return driven_m


def test_commands_add_up_since_the_start() -> None:
    reckoning = DeadReckoning()
    reckoning.reset("a")
    assert drive(reckoning, "a", 10) == pytest.approx(1.0)


def test_a_new_node_starts_from_zero() -> None:
    reckoning = DeadReckoning()
    reckoning.reset("a")
    drive(reckoning, "a", 10)
    assert reckoning.since("b").driven_m == 0.0


def test_a_flicker_does_not_restart_the_count() -> None:
    reckoning = DeadReckoning()
    reckoning.reset("a")
    drive(reckoning, "a", 10)
    drive(reckoning, "b", 3)
    assert reckoning.since("a").driven_m == pytest.approx(1.3)


def test_a_node_seen_long_ago_starts_from_zero() -> None:
    reckoning = DeadReckoning()
    reckoning.reset("a")
    drive(reckoning, "b", 40)
    assert reckoning.since("a").driven_m == 0.0
