import pytest

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import Plan
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap
from toponav.maps.task import NavigationTask
from toponav.navigation.graphnav.behavior_selection import BehaviorSelector


def task() -> NavigationTask:
    nodes = tuple(Node(name, NodeKind.HALLWAY, 0.0, 0.0) for name in "abcx")
    edges = (
        Edge("ab", "a", "b", Behavior.FIND_DOOR, 0.0, 1.0),
        Edge("bc", "b", "c", Behavior.TURN_LEFT, 0.0, 1.0),
        Edge("bx", "b", "x", Behavior.TURN_RIGHT, 0.0, 1.0),
    )
    return NavigationTask(
        TopologicalMap("tiny", MapFrame(), nodes, edges), Plan(("a", "b", "c"), ("ab", "bc"))
    )


def test_a_node_of_the_plan_gives_the_behavior_that_leaves_it() -> None:
    selector = BehaviorSelector(task())
    assert [selector.select(node) for node in "ab"] == [Behavior.FIND_DOOR, Behavior.TURN_LEFT]


@pytest.mark.parametrize("node", ["x", "c", None])
def test_off_the_plan_and_at_the_goal_the_last_valid_behavior_stays(node: str | None) -> None:
    selector = BehaviorSelector(task())
    selector.select("b")
    assert selector.select(node) is Behavior.TURN_LEFT


def test_before_any_localization_the_first_behavior_is_executed() -> None:
    assert BehaviorSelector(task()).select(None) is Behavior.FIND_DOOR
