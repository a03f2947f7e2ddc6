"""Plans: which nodes to pass and which behaviours to do, from a start to a goal."""

import functools
import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import networkx as nx

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, Difficulty
from toponav.maps.spec import TopologicalMap

__all__ = ["Plan", "plans_for", "shortest_plan", "shortest_plans"]

# An edge costs 1; its metres only choose between plans with the same number of edges.
_METRES_PER_EDGE = 1e6


@dataclass(frozen=True)
class Plan:
    """A walk through a map.

    Args:
        nodes: Ids of the nodes to pass, the start first and the goal last.
        edges: Ids of the edges between them, one fewer.

    Raises:
        InputError: If the numbers do not fit.
    """

    nodes: tuple[str, ...]
    edges: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.nodes or len(self.edges) != len(self.nodes) - 1:
            raise InputError(
                "a plan has one edge fewer than nodes, and at least one node; "
                f"got {len(self.nodes)} nodes and {len(self.edges)} edges",
                where="Plan",
                remedy="make plans with shortest_plan",
            )

    @functools.cached_property
    def _edge_from(self) -> Mapping[str, str]:
        return dict(zip(self.nodes, self.edges, strict=False))

    @functools.cached_property
    def _position(self) -> Mapping[str, int]:
        return {node: position for position, node in reversed(list(enumerate(self.nodes)))}

    def __contains__(self, node_id: object) -> bool:
        return node_id in self._position

    def edge_from(self, node_id: str) -> str | None:
        """The edge to take at a node: None at the goal and off the plan."""
        return self._edge_from.get(node_id)

    def position(self, node_id: str) -> int | None:
        """How many nodes come before this one, or None off the plan."""
        return self._position.get(node_id)

    def completion(self, last_node: str | None) -> float:
        """The fraction of the plan's nodes reached, the start included, as the authors count."""
        position = None if last_node is None else self.position(last_node)
        return 0.0 if position is None else (position + 1) / len(self.nodes)

    def behaviors(self, topological_map: TopologicalMap) -> tuple[Behavior, ...]:
        """The behaviour of each edge in order."""
        return tuple(topological_map.edge(edge).behavior for edge in self.edges)

    def length_m(self, topological_map: TopologicalMap) -> float:
        """Metres to drive."""
        return sum((topological_map.edge(edge).length_m for edge in self.edges), 0.0)

    @property
    def difficulty(self) -> Difficulty:
        """Its length class (GraphNav, appendix C)."""
        return Difficulty.of_plan(len(self.nodes))


def shortest_plan(topological_map: TopologicalMap, start: str, goal: str) -> Plan:
    """The plan with the fewest behaviours; of those, the one with the fewest metres.

    The authors also count edges, not metres, but leave ties to the order of drawing.

    Args:
        topological_map: Map to plan on.
        start: Id of the node to start from.
        goal: Id of the node to reach.

    Raises:
        InputError: If a node is not in the map (offers the nearest name) or no walk leads
            from start to goal.

    Reference:
        GraphNav, section IV: "composing a minimal length sequence of behaviors".
    """
    topological_map.node(start)
    topological_map.node(goal)
    try:
        nodes = nx.dijkstra_path(_planning_graph(topological_map), start, goal, weight="cost")
    except nx.NetworkXNoPath:
        raise InputError(
            f"no sequence of edges leads from '{start}' to '{goal}'",
            where=f"map '{topological_map.name}'",
            remedy=f"{_dead_end(topological_map, start, goal)}; `toponav map check` lists faults",
        ) from None
    return _plan_through(topological_map, nodes)


def shortest_plans(
    topological_map: TopologicalMap, start: str, goal: str, count: int
) -> tuple[Plan, ...]:
    """Up to `count` plans without loops, the shortest first.

    Raises:
        InputError: As `shortest_plan` does.
    """
    shortest_plan(topological_map, start, goal)
    walks = nx.shortest_simple_paths(_planning_graph(topological_map), start, goal, weight="cost")
    return tuple(_plan_through(topological_map, walk) for walk in itertools.islice(walks, count))


def plans_for(
    topological_map: TopologicalMap, pairs: Iterable[tuple[str, str]]
) -> tuple[dict[int, Plan], dict[int, str]]:
    """The plan of each pair that has one, and why each other pair has none, by position.

    Args:
        topological_map: Map to plan on.
        pairs: Start and goal node ids; published pairs give room names, which are node ids.
    """
    plans: dict[int, Plan] = {}
    reasons: dict[int, str] = {}
    for position, (start, goal) in enumerate(pairs):
        try:
            plans[position] = shortest_plan(topological_map, start, goal)
        except InputError as error:
            reasons[position] = error.rule
    return plans, reasons


def _planning_graph(topological_map: TopologicalMap) -> "nx.DiGraph[str]":
    """A graph whose edges cost one plus a little for their metres; kept with the map."""
    kept: nx.DiGraph[str] | None = topological_map.__dict__.get("_planning_graph")
    if kept is None:
        kept = topological_map.to_networkx()
        for _, _, attributes in kept.edges(data=True):
            attributes["cost"] = 1.0 + attributes["length_m"] / _METRES_PER_EDGE
        topological_map.__dict__["_planning_graph"] = kept
    return kept


def _plan_through(topological_map: TopologicalMap, nodes: Sequence[str]) -> Plan:
    edges = []
    for source, target in itertools.pairwise(nodes):
        edge = topological_map.edge_between(source, target)
        assert edge is not None
        edges.append(edge.id)
    return Plan(tuple(nodes), tuple(edges))


def _dead_end(topological_map: TopologicalMap, start: str, goal: str) -> str:
    if not topological_map.out_edges(start):
        return f"no edge leaves '{start}': add one"
    if not topological_map.in_edges(goal):
        return f"no edge reaches '{goal}': add one"
    reached = len(nx.descendants(_planning_graph(topological_map), start))
    return f"add edges: '{start}' leads to {reached} of {len(topological_map.nodes)} nodes only"
