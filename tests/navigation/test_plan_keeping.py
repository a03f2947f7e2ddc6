"""Robots stay at their plan's nodes, by the map alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.task import NavigationTask
from toponav.models.graphnav.metric.kept_way import ALIGNMENT_RAD, kept_way, node_headings
from toponav.models.graphnav.metric.map_picture import MapArrays
from toponav.models.graphnav.metric.way_kernels import margin
from toponav.navigation.graphnav.plan_keeping import PlanKeeping, PlanKeepingConfig

STD = np.array([0.05, 0.05, 0.02])
SURE = (-math.inf, math.inf)
ALIGNED = math.cos(ALIGNMENT_RAD)


def corridor(door_y_m: float = 0.9) -> NavigationTask:
    """Along x from 0 to 8, past a door at x = 4 whose edge back leads along the corridor."""
    hall = [Node(f"hall_{n}", NodeKind.HALLWAY, 4.0 * n, 0.0, room="hallway_1") for n in range(3)]
    door = Node("office_door", NodeKind.DOOR, 2.0, door_y_m, room="office")
    office = Node("office", NodeKind.ROOM, 2.0, door_y_m + 1.0, room="office")
    cf = Behavior.CORRIDOR_FOLLOW
    edges = [edge_along(hall[0], hall[1], cf), edge_along(hall[1], hall[2], cf)]
    edges.append(edge_along(office, door, Behavior.FIND_DOOR))
    edges.append(edge_along(door, hall[1], Behavior.TURN_LEFT))
    nodes = (*hall, door, office)
    topological_map = TopologicalMap("corridor", MapFrame(), nodes, tuple(edges))
    return NavigationTask(topological_map, shortest_plan(topological_map, "hall_0", "hall_2"))


def room_along(task: NavigationTask, *, bent: bool) -> float:
    """How much nearer other nodes come than the plan's, over all of the line; metres."""
    way = kept_way(task.map, task.plan, bent=bent)
    arrays = replace(MapArrays.of(task.map, task.plan), kept=way)
    points, arc = arrays.way()
    at = np.linspace(0.0, arc[-1], 81)
    line = np.stack([np.interp(at, arc, points[:, k]) for k in range(2)], axis=1)
    yaw = np.arctan2(*np.diff(line, axis=0).T[::-1])
    everything, sizes = np.arange(len(task.map.nodes)), np.ones(len(task.map.nodes))
    headings = node_headings(task.map)
    short = [
        margin(x, y, turn, everything, arrays.node_xy, sizes, arrays.on_plan, *headings, ALIGNED)
        for (x, y), turn in zip(line[1:], yaw, strict=True)
    ]
    return float(np.maximum(-np.array(short), 0.0).sum())


def test_line_keeps_away_from_a_door_that_is_too_near():
    task = corridor()
    straight, bent = (room_along(task, bent=bent) for bent in (False, True))
    assert straight > 2.0
    assert bent < 0.3 * straight
    assert np.abs(kept_way(task.map, task.plan).shift_m).max() <= 0.8


def test_line_is_straight_where_nothing_is_near():
    task = corridor(door_y_m=3.5)
    way = kept_way(task.map, task.plan)
    assert not way.shift_m.any()
    assert len(way.share) == len(task.plan.nodes)


def test_line_passes_its_first_and_last_node():
    task = corridor()
    arrays = MapArrays.of(task.map, task.plan)
    points, arc = arrays.way()
    assert points[0] == pytest.approx([0.0, 0.0])
    assert points[-1] == pytest.approx([8.0, 0.0])
    assert arrays.stops_m()[-1] == pytest.approx(arc[-1])


def driven(task: NavigationTask, keeping: PlanKeeping | None) -> float:
    """The least margin of a robot that would drive straight on past the door."""
    arrays = MapArrays.of(task.map, task.plan)
    x, y, yaw, last, least = 0.0, 0.15, 0.0, 0.0, math.inf
    sizes = np.ones(len(task.map.nodes))
    headings = node_headings(task.map)
    for _ in range(60):
        command = Velocity(0.5, -0.6 * yaw)
        if keeping is not None:
            pose = np.array([x, y, yaw])
            command = keeping.checked(command, last, pose, STD, arrays.progress_m(x, y, 0.0, 8.0))
        last = command.angular_rad_s
        yaw += 0.2 * last
        x, y = x + 0.1 * math.cos(yaw), y + 0.1 * math.sin(yaw)
        everything = np.arange(len(sizes))
        here = margin(
            x, y, yaw, everything, arrays.node_xy, sizes, arrays.on_plan, *headings, ALIGNED
        )
        least = min(least, float(here))
    return least


def test_robot_that_would_pass_too_near_is_bent_away():
    task = corridor()
    keeping = PlanKeeping(task, MapArrays.of(task.map, task.plan), SURE)
    assert driven(task, None) < -0.3
    assert driven(task, keeping) > driven(task, None) + 0.25


def test_robots_that_stand_or_are_lost_or_in_rooms_are_left_alone():
    task = corridor()
    arrays = MapArrays.of(task.map, task.plan)
    keeping, pose = PlanKeeping(task, arrays, SURE), np.array([1.5, 0.2, 0.0])
    ahead, slow = Velocity(0.5, 0.0), Velocity(0.05, 0.0)
    assert keeping.checked(ahead, 0.0, pose, STD, 1.5) != ahead
    assert keeping.checked(slow, 0.0, pose, STD, 1.5) == slow
    assert keeping.checked(ahead, 0.0, pose, 20.0 * STD, 1.5) == ahead
    inside = PlanKeeping(task, arrays, (3.0, math.inf))
    assert inside.checked(ahead, 0.0, pose, STD, 1.5) == ahead


def test_settings_must_be_positive():
    with pytest.raises(InputError, match="positive"):
        PlanKeepingConfig(horizon_s=0.0)
