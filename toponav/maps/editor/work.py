"""What the editor's page asks about a map: its faults, behaviours, plans, and one by machine."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

from toponav.core.errors import InputError
from toponav.maps.plan import shortest_plans
from toponav.maps.repair import repair
from toponav.maps.spec import TopologicalMap, map_to_document
from toponav.maps.suggest_behaviors import suggest_behavior
from toponav.maps.validate import Building, validate_document

__all__ = ["Workshop"]

_MOST_EDGES_ASKED = 500_000
_MOST_PLANS = 3


class Workshop:
    """The Python side of the editor: answers questions, changes nothing.

    Args:
        building: What is known of the building, for the checks.
        construct: Draws the building's map by machine; None where no building is known.
    """

    def __init__(
        self,
        building: Building | None = None,
        construct: Callable[[], TopologicalMap] | None = None,
    ) -> None:
        self._building = building
        self._construct = construct

    @property
    def can_construct(self) -> bool:
        """Whether a building is known that a map can be drawn of."""
        return self._construct is not None

    def faults(self, document: Any) -> list[dict[str, Any]]:
        """Every fault of a map as JSON, with the numbers of the paper's rules."""
        return [
            fault.to_document() | {"paper_rule": fault.rule.paper_number}
            for fault in validate_document(document, self._building)[1]
        ]

    def suggestions(
        self, drawn: TopologicalMap, edges: Sequence[str] | None
    ) -> list[dict[str, str]]:
        """Edges whose geometry suggests another behaviour than they have.

        Args:
            drawn: Map to look at.
            edges: Ids of the edges to look at; all when not given.

        Raises:
            InputError: If there is no such edge.
        """
        asked = drawn.edges if edges is None else [drawn.edge(edge) for edge in edges]
        suggested = ((edge, suggest_behavior(drawn, edge)) for edge in asked)
        return [
            {"edge": edge.id, "behavior": edge.behavior.value, "suggested": better.value}
            for edge, better in suggested
            if better is not edge.behavior
        ]

    def repaired(self, drawn: TopologicalMap) -> dict[str, Any]:
        """The map without the faults that need no decision, and how many those were."""
        done = repair(drawn, self._building)
        return {"map": map_to_document(done.topological_map), "fixed": len(done.fixed)}

    def plans(self, drawn: TopologicalMap, start: str, goal: str) -> list[dict[str, Any]]:
        """The shortest plans between two nodes, each with its behaviours in order.

        Raises:
            InputError: If a node is missing or no walk leads from one to the other.
        """
        return [
            {
                "nodes": list(plan.nodes),
                "edges": list(plan.edges),
                "length": plan.length_m(drawn),
                "difficulty": plan.difficulty.value,
                "behaviors": [
                    {"behavior": behavior, "count": len(list(same))}
                    for behavior, same in groupby(
                        behavior.value for behavior in plan.behaviors(drawn)
                    )
                ],
            }
            for plan in shortest_plans(drawn, start, goal, _MOST_PLANS)
        ]

    def construct(self, like: TopologicalMap) -> dict[str, Any]:
        """The map that a machine draws of the building, as JSON, with the name and frame given.

        Raises:
            InputError: If no building is known, or it cannot be drawn.
        """
        if self._construct is None:
            raise InputError(
                "a map is built from a building, and none is known",
                where=f"map '{like.name}'",
                remedy="start the editor with --scene, --area or --plan",
            )
        made = self._construct()
        return map_to_document(replace(made, name=like.name, frame=like.frame))


def ids_of(value: Any, where: str) -> list[str] | None:
    """A list of ids that a request may leave out.

    Raises:
        InputError: If it is anything else.
    """
    if value is None:
        return None
    if (
        isinstance(value, list)
        and len(value) <= _MOST_EDGES_ASKED
        and all(isinstance(one, str) for one in value)
    ):
        return value
    raise InputError("must be a list of ids", where=where, remedy="reload the page")
