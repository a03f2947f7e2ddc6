"""What an agent is asked to do."""

from dataclasses import dataclass

from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap

__all__ = ["NavigationTask"]


@dataclass(frozen=True)
class NavigationTask:
    """Follow a plan through a topological map, from its first node to its last.

    The robot stands at the plan's first node when the episode begins: that is all an agent
    is ever told about where it is (GraphNav, section III).
    """

    map: TopologicalMap
    plan: Plan

    @property
    def start_node(self) -> str:
        """The node that the robot stands at when the episode begins."""
        return self.plan.nodes[0]

    @property
    def goal_node(self) -> str:
        """The node at which the episode succeeds."""
        return self.plan.nodes[-1]
