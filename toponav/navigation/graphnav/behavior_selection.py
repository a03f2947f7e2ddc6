"""From a localization to the behaviour to execute."""

from toponav.core.vocabulary import Behavior
from toponav.maps.task import NavigationTask

__all__ = ["BehaviorSelector"]


class BehaviorSelector:
    """Looks up what the plan says to do at a node.

    A node that is not on the plan, and the goal, at which nothing is left to do, keep the
    behaviour from the last valid position.

    Reference:
        GraphNav, section V: "In the case that a localization estimate is not part of the plan,
        the module continues selecting the behavior from the last valid position".
    """

    def __init__(self, task: NavigationTask) -> None:
        behaviors = task.plan.behaviors(task.map)
        if not behaviors:
            raise ValueError("a plan needs at least one edge to have a behaviour")
        self._behavior_at = dict(zip(task.plan.nodes[:-1], behaviors, strict=True))
        self._current = behaviors[0]

    def select(self, node: str | None) -> Behavior:
        """The behaviour to execute when the robot is believed to be at `node`."""
        if node is not None:
            self._current = self._behavior_at.get(node, self._current)
        return self._current
