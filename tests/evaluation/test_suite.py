import json
import math
from pathlib import Path

import pytest

from tests.evaluation.tiny_building import tiny_map, tiny_scene
from toponav.core.errors import InputError
from toponav.core.geometry import angle_difference
from toponav.core.vocabulary import Behavior, RoomKind
from toponav.evaluation.suite import SuiteSource, load_suite, sample_tasks, seed_of
from toponav.evaluation.transitions import edge_transition, plan_transitions
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, TopologicalMap, edge_along

SCENE, MAP = tiny_scene(), tiny_map()


def test_the_first_sampled_plans_do_not_depend_on_how_many_are_asked_for() -> None:
    assert sample_tasks(SCENE, MAP, 3, 5) == sample_tasks(SCENE, MAP, 8, 5)[:3]
    assert sample_tasks(SCENE, MAP, 3, 5) != sample_tasks(SCENE, MAP, 3, 6)


def test_a_sampled_start_lies_in_the_start_room_and_looks_along_the_first_edge() -> None:
    for task in sample_tasks(SCENE, MAP, 20, 0):
        assert SCENE.room_at(task.start.x_m, task.start.y_m) == task.plan.nodes[0]
        yaw_rad = MAP.edge(task.plan.edges[0]).yaw_rad
        assert abs(angle_difference(task.start.yaw_rad, yaw_rad)) <= math.radians(20) + 1e-9


def test_a_map_without_plans_is_refused() -> None:
    rooms = tuple(
        node for node in MAP.nodes if node.id.startswith("office_") and "_d" not in node.id
    )
    with pytest.raises(InputError, match="no two rooms are joined"):
        sample_tasks(SCENE, TopologicalMap("loose", MapFrame(), rooms, ()), 1, 0)


def test_seeds_depend_on_every_part() -> None:
    seeds = {seed_of("episode", 0, "gtl", 1), seed_of("episode", 0, "gtl", 2)}
    assert len(seeds | {seed_of("episode", 1, "gtl", 1), seed_of("episode", 0, "expert", 1)}) == 4


@pytest.mark.parametrize(
    "source",
    [
        {},
        {"area": Path("a.yaml")},
        {"scene": Path("s")},
        {"area": Path("a"), "plans": Path("p"), "scene": Path("s"), "map": Path("m")},
        {"area": Path("a"), "plans": Path("p"), "map": Path("m")},
    ],
)
def test_a_suite_is_an_area_with_pairs_or_a_scene_with_its_map(source: dict[str, Path]) -> None:
    with pytest.raises(InputError, match="an area with pairs, or a scene with its map"):
        SuiteSource(**source)


def test_pairs_without_a_plan_are_listed_and_left_out(areas_dir: Path) -> None:
    suite = load_suite(SuiteSource(areas_dir / "area_5b.yaml", areas_dir / "area_5b_plans.json"))
    assert len(suite.left_out) == 25
    assert len(suite.tasks) == 75
    assert {pair.index for pair in suite.left_out}.isdisjoint(task.index for task in suite.tasks)
    rooms = {room for pair in suite.left_out for room in (pair.start_room, pair.end_room)}
    assert rooms >= {"office_29", "office_41"}


def test_limiting_the_episodes_takes_the_first_pairs(areas_dir: Path) -> None:
    pairs = areas_dir / "area_3_plans.json"
    suite = load_suite(SuiteSource(areas_dir / "area_3.yaml", pairs, episodes=4))
    first = json.loads(pairs.read_text())[:4]
    assert [task.plan.nodes[0] for task in suite.tasks] == [pair["start_room"] for pair in first]
    assert [task.index for task in suite.tasks] == [0, 1, 2, 3]


def test_transitions_tell_entering_from_leaving_and_know_junctions() -> None:
    kinds = {room.name: room.kind for room in SCENE.rooms}
    plan = shortest_plan(MAP, "office_1", "office_2")
    assert plan_transitions(MAP, plan, kinds) == (
        "within office",
        "office->hallway",
        "within hallway",
        "hallway->office",
    )
    first, second = MAP.node("hallway_1-1r"), MAP.node("hallway_1-2r")
    turn = edge_along(first, second, Behavior.TURN_LEFT, edge_id="turn")
    assert edge_transition(MAP, turn, kinds) == "junction"


def test_transitions_without_a_scene_use_the_kinds_of_the_nodes() -> None:
    plan = shortest_plan(MAP, "office_1", "office_2")
    assert plan_transitions(MAP, plan, {})[1] == "door->hallway"
    only_lobby = {"hallway_1": RoomKind.LOBBY}
    assert plan_transitions(MAP, plan, only_lobby)[1] == "door->lobby"
