"""How well a map made by machine agrees with one that a person drew of the same building."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.faults import Severity
from toponav.maps.plan import Plan, plans_for
from toponav.maps.spec import Node, TopologicalMap
from toponav.maps.validate import validate

__all__ = ["MapAgreement", "PairDifference", "behavior_sequence", "compare_maps"]

_NEAR_M = 1.0
_LANES = (NodeKind.HALLWAY, NodeKind.OPEN_SPACE)


@dataclass(frozen=True)
class PairDifference:
    """A start and goal for which the two maps give different behaviours."""

    position: int
    """Its place in the list of pairs."""
    start: str
    """Room to start in."""
    goal: str
    """Room to reach."""
    drawn: tuple[Behavior, ...]
    """Behaviours on the drawn map."""
    built: tuple[Behavior, ...] | None
    """Behaviours on the built map, or None where it has no plan."""
    through_fault: bool
    """Whether the drawn plan uses an edge that breaks a rule of the map's own specification."""


@dataclass(frozen=True)
class MapAgreement:
    """Counts of what two maps share; `drawn` is by a person, `built` by machine."""

    doors_drawn: int
    """Door nodes of the drawn map."""
    doors_found: int
    """Of these, with a built door node of the same room within a metre."""
    doors_built: int
    """Door nodes of the built map in rooms that the drawn map has."""
    doors_elsewhere: int
    """Door nodes of the built map in rooms that the drawn map leaves out."""
    nodes_drawn: int
    """Nodes of the drawn map."""
    nodes_built: int
    """Nodes of the built map."""
    nodes_matched: int
    """Pairs of nodes of the same kind within a metre; lanes also lead the same way."""
    edges_matched: int
    """Drawn edges between two matched nodes whose counterparts are joined as well."""
    edges_same_behavior: int
    """Of these, with the same behaviour."""
    pairs: int
    """Starts and goals for which the drawn map has a plan."""
    pairs_planned: int
    """Of these, with a plan on the built map."""
    pairs_same: int
    """Of these, with the same behaviours, repeated corridor_follow merged."""
    pairs_through_fault: int
    """Of `pairs`, with a drawn plan that uses an edge that breaks a rule: nothing can agree."""
    differences: tuple[PairDifference, ...]
    """Every pair that is planned differently."""

    @property
    def door_recall(self) -> float:
        """Share of the drawn doors that were found."""
        return _share(self.doors_found, self.doors_drawn)

    @property
    def door_precision(self) -> float:
        """Share of the built doors, in rooms that were drawn, that a person drew too."""
        return _share(self.doors_found, self.doors_built)

    @property
    def same_sequence(self) -> float:
        """Share of the pairs with the same behaviours."""
        return _share(self.pairs_same, self.pairs)

    def to_document(self) -> dict[str, Any]:
        """Counts and shares as JSON, differences in short."""
        counts = {key: value for key, value in asdict(self).items() if key != "differences"}
        differences = [
            {
                "pair": one.position,
                "start": one.start,
                "goal": one.goal,
                "drawn": [behavior.value for behavior in one.drawn],
                "built": None if one.built is None else [value.value for value in one.built],
                "through_fault": one.through_fault,
            }
            for one in self.differences
        ]
        shares = {
            "door_recall": round(self.door_recall, 4),
            "door_precision": round(self.door_precision, 4),
            "node_recall": round(_share(self.nodes_matched, self.nodes_drawn), 4),
            "edge_behavior_agreement": round(
                _share(self.edges_same_behavior, self.edges_matched), 4
            ),
            "same_sequence": round(self.same_sequence, 4),
        }
        return {**counts, **shares, "differences": differences}


def compare_maps(
    drawn: TopologicalMap, built: TopologicalMap, pairs: Sequence[tuple[str, str]] = ()
) -> MapAgreement:
    """What a built map shares with a drawn one.

    Args:
        drawn: The map that a person drew.
        built: The map that a machine built, in the same frame.
        pairs: Rooms to start from and to reach; those without a plan on the drawn map are
            left out.

    Example:
        >>> agreement = compare_maps(drawn, drawn, [("office_1", "WC_1")])  # doctest: +SKIP
        >>> agreement.door_recall, agreement.same_sequence  # doctest: +SKIP
        (1.0, 1.0)
    """
    matched = _matched_nodes(drawn, built)
    doors = _matched_nodes(drawn, built, (NodeKind.DOOR,))
    rooms = {node.room for node in drawn.nodes if node.kind is NodeKind.DOOR}
    built_doors = [node for node in built.nodes if node.kind is NodeKind.DOOR]
    both = [
        (edge.behavior, counterpart.behavior)
        for edge in drawn.edges
        if edge.source in matched
        and edge.target in matched
        and (counterpart := built.edge_between(matched[edge.source], matched[edge.target]))
    ]
    wanted, _ = plans_for(drawn, pairs)
    given, _ = plans_for(built, pairs)
    slips = _edges_at_fault(drawn)
    differences = tuple(_differences(drawn, built, pairs, wanted, given, slips))
    inside = sum(node.room in rooms for node in built_doors)
    return MapAgreement(
        doors_drawn=sum(node.kind is NodeKind.DOOR for node in drawn.nodes),
        doors_found=len(doors),
        doors_built=inside,
        doors_elsewhere=len(built_doors) - inside,
        nodes_drawn=len(drawn.nodes),
        nodes_built=len(built.nodes),
        nodes_matched=len(matched),
        edges_matched=len(both),
        edges_same_behavior=sum(first is second for first, second in both),
        pairs=len(wanted),
        pairs_planned=sum(position in given for position in wanted),
        pairs_same=len(wanted) - len(differences),
        pairs_through_fault=sum(bool(slips & set(plan.edges)) for plan in wanted.values()),
        differences=differences,
    )


def behavior_sequence(topological_map: TopologicalMap, plan: Plan) -> tuple[Behavior, ...]:
    """The behaviours of a plan with each run of corridor_follow merged into one."""
    merged: list[Behavior] = []
    for behavior, run in itertools.groupby(plan.behaviors(topological_map)):
        count = 1 if behavior is Behavior.CORRIDOR_FOLLOW else len(list(run))
        merged += [behavior] * count
    return tuple(merged)


def _differences(
    drawn: TopologicalMap,
    built: TopologicalMap,
    pairs: Sequence[tuple[str, str]],
    wanted: dict[int, Plan],
    given: dict[int, Plan],
    slips: set[str],
) -> Iterable[PairDifference]:
    for position, plan in wanted.items():
        expected = behavior_sequence(drawn, plan)
        other = given.get(position)
        got = None if other is None else behavior_sequence(built, other)
        if got != expected:
            start, goal = pairs[position]
            through = bool(slips & set(plan.edges))
            yield PairDifference(position, start, goal, expected, got, through)


def _edges_at_fault(topological_map: TopologicalMap) -> set[str]:
    """Edges that break a rule."""
    return {
        fault.element.removeprefix("edge ")
        for fault in validate(topological_map)
        if fault.severity is Severity.ERROR and fault.element.startswith("edge ")
    }


def _matched_nodes(
    drawn: TopologicalMap, built: TopologicalMap, kinds: tuple[NodeKind, ...] = tuple(NodeKind)
) -> dict[str, str]:
    """Built nodes by the drawn node that they stand for; each is used once."""
    found: dict[str, str] = {}
    for kind in kinds:
        first = [node for node in drawn.nodes if node.kind is kind]
        second = [node for node in built.nodes if node.kind is kind]
        if not first or not second:
            continue
        away_m = np.array([[a.distance_to(b) for b in second] for a in first])
        allowed = away_m < _NEAR_M
        if kind in _LANES:
            allowed &= _directions(drawn, first) @ _directions(built, second).T > 0
        else:
            allowed &= np.array([[a.room == b.room for b in second] for a in first])
        rows, cols = linear_sum_assignment(np.where(allowed, away_m, 1e3))
        for row, col in zip(rows.tolist(), cols.tolist(), strict=True):
            if allowed[row, col]:
                found[first[row].id] = second[col].id
    return found


def _directions(
    topological_map: TopologicalMap, nodes: Sequence[Node]
) -> Float[np.ndarray, "nodes 2"]:
    """The way that the edges of each node lead on the whole."""
    ways = []
    for node in nodes:
        edges = (*topological_map.in_edges(node.id), *topological_map.out_edges(node.id))
        x = sum(math.cos(edge.yaw_rad) for edge in edges)
        y = sum(math.sin(edge.yaw_rad) for edge in edges)
        ways.append((x, y))
    return np.array(ways)


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 1.0
