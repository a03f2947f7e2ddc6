import itertools
from collections import Counter
from dataclasses import replace
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from tests.maps.small_buildings import building, corridor
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.agreement import behavior_sequence, compare_maps
from toponav.maps.construct import map_from_layout, map_from_scene
from toponav.maps.formats.canvas import load_area_map
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import TopologicalMap
from toponav.maps.validate import Building, has_errors, validate
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.home import generate_home
from toponav.worlds.generate.office import generate_office
from toponav.worlds.load.stanford import load_area, load_pairs
from toponav.worlds.scene import Scene

CF, FD = Behavior.CORRIDOR_FOLLOW, Behavior.FIND_DOOR
TL, TR, S = Behavior.TURN_LEFT, Behavior.TURN_RIGHT, Behavior.STRAIGHT


def sequence(topological_map: TopologicalMap, start: str, goal: str) -> tuple[Behavior, ...]:
    return behavior_sequence(topological_map, shortest_plan(topological_map, start, goal))


def assert_good(scene: Scene, built: TopologicalMap) -> None:
    """No fault that is an error, and a plan between any two rooms."""
    facts = Building(
        rooms={room.name: room.kind for room in scene.rooms} or None,
        room_at=scene.room_at if scene.rooms else None,
        is_free=FreeSpace.of(scene, 0.18).is_free,
    )
    faults = validate(built, facts)
    assert not has_errors(faults), [fault for fault in faults if fault.severity == "error"]
    rooms = [node.id for node in built.nodes if node.kind is NodeKind.ROOM]
    graph = built.to_networkx()
    for room in rooms:
        assert set(rooms) <= nx.descendants(graph, room) | {room}


def test_doors_far_apart_have_their_own_lanes() -> None:
    built = map_from_scene(corridor(("a", 4.0, "n"), ("b", 12.0, "n"), ("c", 17.0, "s")))
    assert_good(corridor(("a", 4.0, "n"), ("b", 12.0, "n"), ("c", 17.0, "s")), built)
    assert sequence(built, "a", "b") == (FD, TL, CF, TL)
    assert sequence(built, "b", "a") == (FD, TR, CF, TR)
    assert sequence(built, "a", "c") == (FD, TL, CF, TR)
    door = built.node("b_door")
    assert (door.x_m, door.y_m) == pytest.approx((12.0, 6.75), abs=0.4)


def test_neighbouring_doors_share_a_pair_of_nodes() -> None:
    built = map_from_scene(corridor(("a", 8.0, "n"), ("b", 9.9, "n"), ("c", 14.0, "n")))
    assert sequence(built, "a", "b") == (FD, TL, TL)
    assert sequence(built, "b", "c") == (FD, TL, CF, TL)


@pytest.mark.parametrize(("aside_m", "behaviors"), [(0.5, (FD, S)), (1.5, (FD, TL, TR))])
def test_doors_face_each_other_within_a_metre(aside_m: float, behaviors) -> None:
    built = map_from_scene(corridor(("a", 10.0, "n"), ("b", 10.0 + aside_m, "s")))
    assert sequence(built, "a", "b") == behaviors


def test_a_bend_is_a_turn() -> None:
    scene = building(
        (14.0, 14.0),
        ("H", 1.0, 1.0, 12.0, 2.6), ("H", 10.4, 1.0, 12.0, 13.0),
        ("a", 2.1, 2.9, 3.9, 5.0), (" ", 2.6, 2.6, 3.4, 2.9),
        ("b", 6.0, 9.0, 10.1, 11.0), (" ", 10.1, 9.6, 10.4, 10.4),
    )  # fmt: skip
    built = map_from_scene(scene)
    assert_good(scene, built)
    assert sequence(built, "a", "b") == (FD, TL, CF, TL, CF, TL)


def test_a_junction_has_two_turns_and_a_way_straight_on() -> None:
    scene = building(
        (22.0, 14.0),
        ("H", 1.0, 5.0, 21.0, 6.6), ("H", 10.2, 1.0, 11.8, 5.0),
        ("a", 2.1, 6.9, 3.9, 9.0), (" ", 2.6, 6.6, 3.4, 6.9),
        ("b", 17.1, 6.9, 18.9, 9.0), (" ", 17.6, 6.6, 18.4, 6.9),
        ("c", 12.1, 1.0, 15.0, 3.0), (" ", 11.8, 1.6, 12.1, 2.4),
    )  # fmt: skip
    built = map_from_scene(scene)
    assert_good(scene, built)
    assert sequence(built, "a", "b") == (FD, TL, CF, TL)
    assert sequence(built, "a", "c") == (FD, TL, CF, TR, CF, TL)
    assert sequence(built, "b", "c") == (FD, TR, CF, TL, CF, TL)


@pytest.mark.parametrize(("deep_m", "drawn"), [(0.7, False), (2.0, True)])
def test_a_room_behind_a_room_is_drawn_unless_it_is_a_cupboard(deep_m: float, drawn: bool) -> None:
    scene = building(
        (22.0, 14.0),
        ("H", 1.0, 1.0, 21.0, 2.6),
        ("a", 2.0, 2.9, 6.0, 6.0), (" ", 3.6, 2.6, 4.4, 2.9),
        ("b", 12.0, 2.9, 16.0, 6.0), (" ", 13.6, 2.6, 14.4, 2.9),
        ("c", 2.0, 6.3, 4.0, 6.3 + deep_m), (" ", 2.6, 6.0, 3.4, 6.3),
    )  # fmt: skip
    built = map_from_scene(scene)
    assert_good(scene, built)
    assert ("c" in built.rooms) is drawn


def test_a_broad_place_that_leads_to_rooms_is_a_hall_on_a_bare_grid() -> None:
    scene = building(
        (22.0, 14.0),
        ("H", 10.3, 6.0, 21.0, 7.6), ("x", 4.0, 4.0, 10.0, 10.0), (" ", 10.0, 6.4, 10.3, 7.2),
        ("a", 1.0, 5.0, 3.7, 8.0), (" ", 3.7, 6.0, 4.0, 6.8),
        ("b", 4.0, 1.0, 6.5, 3.7), (" ", 4.6, 3.7, 5.4, 4.0),
        ("c", 7.0, 1.0, 9.5, 3.7), (" ", 7.6, 3.7, 8.4, 4.0),
        ("d", 5.0, 10.3, 8.0, 13.0), (" ", 6.0, 10.0, 6.8, 10.3),
        ("e", 12.0, 7.9, 15.0, 11.0), (" ", 13.0, 7.6, 13.8, 7.9),
        ("f", 17.0, 7.9, 20.0, 11.0), (" ", 18.0, 7.6, 18.8, 7.9),
    )  # fmt: skip
    bare = replace(scene, rooms=(), room_index=np.full_like(scene.room_index, -1))
    built = map_from_scene(bare)
    assert not validate(built)
    kinds = Counter(node.kind for node in built.nodes)
    assert kinds[NodeKind.ROOM] == kinds[NodeKind.DOOR] == 6


def test_a_lounge_between_two_hallways_is_crossed() -> None:
    scene = building(
        (22.0, 16.0),
        ("H", 1.0, 1.0, 21.0, 2.6), ("H", 1.0, 11.0, 21.0, 12.6), ("L", 8.0, 2.6, 14.0, 11.0),
        ("a", 2.1, 2.9, 3.9, 5.0), (" ", 2.6, 2.6, 3.4, 2.9),
        ("b", 17.1, 8.0, 18.9, 10.7), (" ", 17.6, 10.7, 18.4, 11.0),
    )  # fmt: skip
    built = map_from_scene(scene)
    assert_good(scene, built)
    assert sequence(built, "a", "b") == (FD, TL, CF, TL, CF, TR, CF, TR)
    crossed = [node for node in built.nodes if node.kind is NodeKind.OPEN_SPACE]
    assert len(crossed) >= 2
    assert {node.room for node in crossed} == {"L"}


def test_a_room_behind_a_room_is_drawn_and_other_inner_doors_are_not() -> None:
    scene = building(
        (22.0, 14.0),
        ("H", 1.0, 5.0, 21.0, 6.6),
        ("a", 2.0, 6.9, 6.0, 9.0), (" ", 3.6, 6.6, 4.4, 6.9),
        ("b", 6.3, 6.9, 10.0, 9.0), (" ", 7.6, 6.6, 8.4, 6.9), (" ", 6.0, 7.4, 6.3, 8.4),
        ("c", 2.0, 9.3, 6.0, 12.0), (" ", 3.6, 9.0, 4.4, 9.3),
    )  # fmt: skip
    built = map_from_scene(scene)
    assert_good(scene, built)
    assert sequence(built, "c", "b") == (FD, S, FD, TL, CF, TL)
    assert sequence(built, "a", "b")[1] is not S


def test_a_closed_building_is_refused_with_a_remedy() -> None:
    scene = building((10.0, 6.0), ("a", 1.0, 1.0, 4.0, 5.0), ("b", 5.0, 1.0, 9.0, 5.0))
    with pytest.raises(InputError, match="no opening of half a metre"):
        map_from_scene(scene)
    one = replace(scene, rooms=(), room_index=np.full(scene.grid.shape, -1, np.int16))
    with pytest.raises(InputError, match=r"no opening|at least two rooms"):
        map_from_scene(one)


def test_a_bare_grid_is_cut_into_rooms_first() -> None:
    scene = corridor(("a", 4.0, "n"), ("b", 12.0, "n"), ("c", 17.0, "s"))
    bare = replace(scene, rooms=(), room_index=np.full(scene.grid.shape, -1, np.int16))
    built = map_from_scene(bare)
    assert_good(bare, built)
    rooms = [node for node in built.nodes if node.kind is NodeKind.ROOM]
    assert len(rooms) == 3
    by_x = sorted(rooms, key=lambda node: node.x_m)
    assert sequence(built, by_x[0].id, by_x[1].id) == (FD, TL, CF, TL)


@pytest.mark.parametrize("seed", [1, 3])
def test_offices_are_measured_as_well_as_read_from_their_layout(seed: int) -> None:
    scene = generate_office(seed, size="small")
    assert map_from_scene(scene) == map_from_layout(scene)
    built = map_from_scene(scene, use_layout=False)
    assert_good(scene, built)
    rooms = [room.name for room in scene.rooms if room.kind.is_enclosed]
    assert {node.id for node in built.nodes if node.kind is NodeKind.ROOM} == set(rooms)
    pairs = list(itertools.permutations(rooms, 2))
    agreement = compare_maps(map_from_layout(scene), built, pairs)
    assert agreement.door_recall == 1.0
    assert agreement.pairs_planned == agreement.pairs


@pytest.mark.parametrize("seed", [2, pytest.param(1, marks=pytest.mark.slow)])
def test_homes_have_a_plan_between_any_two_rooms(seed: int) -> None:
    scene = generate_home(seed)
    built = map_from_scene(scene)
    assert_good(scene, built)
    rooms = {room.name for room in scene.rooms if room.kind.is_enclosed}
    assert {node.id for node in built.nodes if node.kind is NodeKind.ROOM} == rooms


def test_the_same_building_gives_the_same_map() -> None:
    scene = corridor(("a", 4.0, "n"), ("b", 12.0, "n"))
    assert map_from_scene(scene) == map_from_scene(scene)


def test_area_3_is_built_about_as_its_authors_drew_it(areas_dir: Path) -> None:
    area = areas_dir / "area_3.yaml"
    pairs = [(p.start_room, p.end_room) for p in load_pairs(areas_dir / "area_3_plans.json")]
    built = map_from_scene(load_area(area))
    assert not has_errors(validate(built))
    agreement = compare_maps(load_area_map(area), built, pairs)
    assert agreement.door_recall == 1.0
    assert agreement.door_precision >= 0.85
    assert agreement.pairs_planned == agreement.pairs == 100
    assert agreement.same_sequence >= 0.95
