"""The part of a map around a node that a localization network looks at."""

from collections.abc import Callable
from dataclasses import dataclass

from toponav.maps.spec import Edge, TopologicalMap

__all__ = ["Subgraph", "crop"]


@dataclass(frozen=True)
class Subgraph:
    """A part of a map.

    Args:
        nodes: Ids of its nodes, the centre first, then by distance ahead, then behind.
        edges: Ids of all edges of the map between them, sorted.
    """

    nodes: tuple[str, ...]
    edges: tuple[str, ...]

    @property
    def center(self) -> str:
        """The node that it was cropped around."""
        return self.nodes[0]


def crop(
    topological_map: TopologicalMap, center_node: str, ahead: int = 3, behind: int = 2
) -> Subgraph:
    """The nodes within some edges ahead of and behind a node, with all edges between them.

    Crops are kept with the map: asking again costs a dictionary look-up.

    Args:
        topological_map: Map to crop.
        center_node: Id of the node to crop around.
        ahead: Edges to follow forwards.
        behind: Edges to follow backwards.

    Raises:
        InputError: If the map has no such node.

    Reference:
        GraphNav, appendix A-A1; the authors also keep every edge between the kept nodes.
    """
    kept: dict[tuple[str, int, int], Subgraph] = topological_map.__dict__.setdefault("_crops", {})
    found = kept.get((center_node, ahead, behind))
    if found is None:
        found = kept[center_node, ahead, behind] = _crop(
            topological_map, center_node, ahead, behind
        )
    return found


def _crop(topological_map: TopologicalMap, center: str, ahead: int, behind: int) -> Subgraph:
    topological_map.node(center)
    # A dictionary is an ordered set here: the order of discovery is the order of the nodes.
    nodes = dict.fromkeys(
        _within(center, ahead, lambda node: _targets(topological_map.out_edges(node)))
    )
    nodes |= dict.fromkeys(
        _within(center, behind, lambda node: _sources(topological_map.in_edges(node)))
    )
    edges = sorted(
        edge.id
        for node in nodes
        for edge in topological_map.out_edges(node)
        if edge.target in nodes
    )
    return Subgraph(tuple(nodes), tuple(edges))


def _within(center: str, distance: int, step: Callable[[str], list[str]]) -> list[str]:
    """Nodes in breadth-first order, each level sorted."""
    seen = {center: None}
    frontier = [center]
    for _ in range(distance):
        frontier = sorted({near for node in frontier for near in step(node)} - seen.keys())
        seen |= dict.fromkeys(frontier)
    return list(seen)


def _targets(edges: tuple[Edge, ...]) -> list[str]:
    return [edge.target for edge in edges]


def _sources(edges: tuple[Edge, ...]) -> list[str]:
    return [edge.source for edge in edges]
