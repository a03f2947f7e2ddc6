import dataclasses
import itertools
import math

import networkx as nx
import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.construct import map_from_layout
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import TopologicalMap
from toponav.maps.validate import has_errors, validate
from toponav.worlds.generate.office import generate_office
from toponav.worlds.layout import HallwayLayout
from toponav.worlds.scene import Scene

Drawn = list[tuple[Scene, TopologicalMap]]


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    scenes = [generate_office(seed) for seed in (0, 3, 24)]
    return [(scene, map_from_layout(scene)) for scene in scenes]


def test_the_six_rules_hold(drawn: Drawn) -> None:
    for _, topological_map in drawn:
        assert not has_errors(validate(topological_map))


def test_the_same_scene_gives_the_same_map(drawn: Drawn) -> None:
    scene, topological_map = drawn[1]
    assert map_from_layout(scene) == topological_map


def test_a_saved_layout_gives_the_same_map(drawn: Drawn) -> None:
    scene, topological_map = drawn[1]
    assert scene.layout is not None
    loaded = dataclasses.replace(scene, layout=HallwayLayout.from_json(scene.layout.to_json()))
    assert map_from_layout(loaded) == topological_map


def test_every_room_has_a_room_node_and_a_door_node(drawn: Drawn) -> None:
    for scene, topological_map in drawn:
        enclosed = {room.name for room in scene.rooms if room.kind.is_enclosed}
        for kind in (NodeKind.ROOM, NodeKind.DOOR):
            rooms = [node.room for node in topological_map.nodes if node.kind is kind]
            assert sorted(str(room) for room in rooms) == sorted(enclosed)


def test_nodes_stand_on_free_floor_of_their_room(drawn: Drawn) -> None:
    for scene, topological_map in drawn:
        for node in topological_map.nodes:
            assert not scene.occupied[scene.grid.cell_of(node.x_m, node.y_m)], node.id
            if node.kind in (NodeKind.ROOM, NodeKind.DOOR):
                assert scene.room_at(node.x_m, node.y_m) == node.room


def test_a_plan_leads_from_every_room_to_every_other(drawn: Drawn) -> None:
    for scene, topological_map in drawn:
        graph = nx.DiGraph((edge.source, edge.target) for edge in topological_map.edges)
        rooms = [room.name for room in scene.rooms if room.kind.is_enclosed]
        reached = {room: nx.descendants(graph, room) for room in rooms}
        for start, goal in itertools.permutations(rooms, 2):
            assert goal in reached[start]


def test_plans_start_by_finding_the_door(drawn: Drawn) -> None:
    _, topological_map = drawn[1]
    behaviors = shortest_plan(topological_map, "office_1", "office_2").behaviors(topological_map)
    assert behaviors[0] is Behavior.FIND_DOOR


def test_turns_turn_to_the_side_that_they_name(drawn: Drawn) -> None:
    signs = {Behavior.TURN_LEFT: 1.0, Behavior.TURN_RIGHT: -1.0}
    for _, topological_map in drawn:
        for edge in topological_map.edges:
            if edge.behavior not in signs:
                continue
            source = topological_map.node(edge.source)
            if source.kind is not NodeKind.DOOR:
                continue
            out = topological_map.in_edges(edge.source)[0].yaw_rad
            turn = math.remainder(edge.yaw_rad - out, math.tau)
            assert turn * signs[edge.behavior] > 0, edge.id


def test_hallways_are_driven_on_the_right(drawn: Drawn) -> None:
    for _, topological_map in drawn:
        aside = []
        for node in topological_map.nodes:
            pair = node.id[:-1] + {"r": "l", "u": "d"}.get(node.id[-1], "")
            if node.kind is NodeKind.HALLWAY and pair in topological_map.node_index:
                other = topological_map.node(pair)
                east, north = node.x_m - other.x_m, node.y_m - other.y_m
                aside.append(-north if node.id.endswith("r") else east)
        assert 0.15 < float(np.median(aside)) < 0.35


def test_few_corridor_edges_pass_nearest_to_a_strange_node(drawn: Drawn) -> None:
    assert strange_share(drawn[1][1]) < 0.05


def strange_share(topological_map: TopologicalMap) -> float:
    """Corridor edges along which an aligned node other than their ends is nearest."""
    strange = 0
    edges = [e for e in topological_map.edges if e.behavior is Behavior.CORRIDOR_FOLLOW]
    for edge in edges:
        a, b = topological_map.node(edge.source), topological_map.node(edge.target)
        usual = {edge.source, edge.target}
        usual |= {e.target for e in topological_map.out_edges(edge.target)}
        usual |= {e.source for e in topological_map.in_edges(edge.source)}
        aligned = [
            node
            for node in topological_map.nodes
            if is_aligned(topological_map, node.id, edge.yaw_rad)
        ]
        for share in np.linspace(0.0, 1.0, 12):
            x, y = a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)
            near = min(aligned, key=lambda n: math.hypot(n.x_m - x, n.y_m - y) / n.size)
            if near.id not in usual:
                strange += 1
                break
    return strange / len(edges)


def is_aligned(topological_map: TopologicalMap, node: str, yaw_rad: float) -> bool:
    edges = [*topological_map.out_edges(node), *topological_map.in_edges(node)]
    return any(abs(math.remainder(e.yaw_rad - yaw_rad, math.tau)) < 0.2 * math.pi for e in edges)


def test_a_scene_without_a_layout_is_refused(drawn: Drawn) -> None:
    scene = dataclasses.replace(drawn[1][0], layout=None)
    with pytest.raises(InputError, match="hallway layout"):
        map_from_layout(scene)
