"""What a goal message means on a map."""

import itertools
from collections.abc import Sequence

from toponav.core.errors import InputError, did_you_mean
from toponav.maps.plan import Plan, shortest_plan
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask

__all__ = ["task_of_goal"]


def task_of_goal(
    map_: TopologicalMap, *, start: str = "", goal: str = "", nodes: Sequence[str] = ()
) -> NavigationTask:
    """The plan that a goal asks for.

    Args:
        map_: The map.
        start: Node that the robot stands at.
        goal: Node to reach, or the name of a room: then the nearest of its nodes.
        nodes: The whole plan, in place of start and goal.

    Raises:
        InputError: A node or room is not in the map, or there is no such plan.
    """
    if nodes:
        return NavigationTask(map_, _plan_through(map_, nodes))
    for name, value in (("start_node", start), ("goal", goal)):
        if not value:
            raise InputError(
                f"{name} is empty",
                where="FollowPlan goal",
                remedy="give start_node and goal, or every node of the plan",
            )
    if goal in map_:
        found = [shortest_plan(map_, start, goal)]
    else:
        found = _plans_to_room(map_, start, goal)
    plan = min(found, key=lambda each: (len(each.nodes), each.length_m(map_)))
    if not plan.edges:
        raise InputError(
            f"the robot is at {start} already",
            where="FollowPlan goal",
            remedy="give another goal",
        )
    return NavigationTask(map_, plan)


def _plans_to_room(map_: TopologicalMap, start: str, goal: str) -> list[Plan]:
    if goal not in map_.rooms:
        names = [*map_.rooms, *map_.node_index]
        raise InputError(
            f"map '{map_.name}' has no node and no room '{goal}'",
            where="FollowPlan goal",
            remedy=did_you_mean(goal, names),
        )
    found, faults = [], []
    for node in map_.rooms[goal]:
        try:
            found.append(shortest_plan(map_, start, node.id))
        except InputError as error:
            faults.append(error)
    if not found:
        raise faults[0]
    return found


def _plan_through(map_: TopologicalMap, nodes: Sequence[str]) -> Plan:
    edges = []
    for source, target in itertools.pairwise(nodes):
        map_.node(source)
        map_.node(target)
        edge = map_.edge_between(source, target)
        if edge is None:
            raise InputError(
                f"no edge leads from '{source}' to '{target}'",
                where="FollowPlan goal, nodes",
                remedy="give neighbouring nodes, or start_node and goal alone",
            )
        edges.append(edge.id)
    if not edges:
        raise InputError(
            "a plan has at least two nodes", where="FollowPlan goal, nodes", remedy="give more"
        )
    return Plan(tuple(nodes), tuple(edges))
