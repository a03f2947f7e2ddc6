import numpy as np
import pytest
from scipy import ndimage

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate.office import generate_office
from toponav.worlds.generate.suites import DEMO_OFFICE_SEED, SUITES, suite
from toponav.worlds.grid import SemanticClass
from toponav.worlds.layout import HallwayLayout
from toponav.worlds.scene import Scene

ROBOT_RADIUS_M = 0.18


@pytest.fixture(scope="module")
def offices() -> list[Scene]:
    return [generate_office(seed) for seed in (0, 3, 24, 1061)]


def unreachable_rooms(scene: Scene) -> list[str]:
    """Rooms without a cell that the robot can reach from the largest free region."""
    clearance_m = ndimage.distance_transform_edt(~scene.occupied) * scene.grid.resolution_m
    inside = scene.room_index >= 0
    regions, count = ndimage.label((clearance_m > ROBOT_RADIUS_M + 0.025) & inside)
    largest = 1 + int(np.argmax(ndimage.sum_labels(inside, regions, range(1, count + 1))))
    home = regions == largest
    return [
        room.name
        for number, room in enumerate(scene.rooms)
        if (home & (scene.room_index == number)).sum() < 60
    ]


def test_the_same_seed_makes_the_same_bytes() -> None:
    assert generate_office(3).content_hash == generate_office(3).content_hash


def test_seeds_and_sizes_make_different_buildings(offices: list[Scene]) -> None:
    hashes = {scene.content_hash for scene in offices}
    hashes.add(generate_office(3, size="medium").content_hash)
    assert len(hashes) == len(offices) + 1


def test_the_robot_reaches_every_room(offices: list[Scene]) -> None:
    assert {scene.name: unreachable_rooms(scene) for scene in offices} == {
        scene.name: [] for scene in offices
    }


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 140))
def test_the_robot_reaches_every_room_in_many_buildings(seed: int) -> None:
    assert unreachable_rooms(generate_office(seed)) == []


def test_buildings_have_8_to_40_rooms_with_a_door_each(offices: list[Scene]) -> None:
    for scene in offices:
        enclosed = {room.name for room in scene.rooms if room.kind.is_enclosed}
        assert 8 <= len(enclosed) <= 40
        assert sorted(door.rooms[1] for door in scene.doors) == sorted(enclosed)


def test_doors_are_as_wide_as_real_ones(offices: list[Scene]) -> None:
    widths = [door.width_m for scene in offices for door in scene.doors]
    assert min(widths) >= 0.7
    assert max(widths) <= 1.1
    assert 0.75 <= float(np.median(widths)) <= 0.9


def test_a_door_lies_where_the_scene_has_its_opening(offices: list[Scene]) -> None:
    for scene in offices:
        for door in scene.doors:
            middle = door.segment_m.mean(axis=0)
            assert not scene.occupied[scene.grid.cell_of(*middle)], door.name
            assert scene.room_at(*middle) == door.rooms[1]


def test_floors_are_closed_by_walls_but_for_scan_holes(offices: list[Scene]) -> None:
    for scene in offices:
        floor = (scene.room_index >= 0) & ~scene.occupied
        edge = ndimage.binary_dilation(floor) & (scene.room_index < 0)
        assert scene.occupied[edge].mean() > 0.95


def test_obstacles_have_a_class_and_floor_has_none(offices: list[Scene]) -> None:
    for scene in offices:
        assert ((scene.semantics == SemanticClass.FLOOR) == ~scene.occupied).all()


def test_hallways_are_as_wide_as_the_authors(offices: list[Scene]) -> None:
    widths = [
        passage.width_m
        for scene in offices
        if scene.layout is not None
        for passage in scene.layout.passages
        if passage.kind == "hallway"
    ]
    assert 1.1 <= min(widths) <= max(widths) <= 2.8


def test_layouts_survive_json(offices: list[Scene]) -> None:
    for scene in offices:
        assert scene.layout is not None
        assert HallwayLayout.from_json(scene.layout.to_json()) == scene.layout


def test_a_broken_layout_is_refused(offices: list[Scene]) -> None:
    assert offices[0].layout is not None
    document = offices[0].layout.to_json()
    document["junctions"] = document["junctions"][1:]
    with pytest.raises(InputError, match="hallway layout"):
        HallwayLayout.from_json(document)


def test_an_unknown_size_names_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'medium'"):
        generate_office(1, size="meduim")


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(InputError, match="seed must be 0 or more"):
        generate_office(-1)


def test_suites_share_no_building_and_hold_the_demo() -> None:
    seeds = [(one.generator, seed) for one in SUITES for seed in one.seeds]
    assert len(seeds) == len(set(seeds))
    assert DEMO_OFFICE_SEED in suite("offices-test").seeds


def test_an_unknown_suite_names_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'offices-test'"):
        suite("office-test")


def test_buildings_hold_more_than_offices(offices: list[Scene]) -> None:
    kinds = {room.kind for scene in offices for room in scene.rooms}
    assert {RoomKind.OFFICE, RoomKind.HALLWAY, RoomKind.CONFERENCE_ROOM} <= kinds


def test_partitions_divide_rooms_and_leave_every_room_reachable():
    plain, divided = generate_office(24), generate_office(24, partitions=1.0)
    assert not unreachable_rooms(divided)
    assert divided.name != plain.name
    assert chambers_m2(divided) < 0.8 * chambers_m2(plain)


def chambers_m2(scene: Scene) -> float:
    """Mean area of what walls, with their gaps narrower than a metre closed, divide rooms into."""
    gap = round(0.5 / scene.grid.resolution_m)
    walls = np.isin(scene.semantics, (SemanticClass.WALL,))
    clear = ndimage.distance_transform_edt(~walls) > gap
    regions, count = ndimage.label(clear & (scene.room_index >= 0))
    areas = ndimage.sum_labels(clear, regions, range(1, count + 1))
    return float(np.mean(areas[areas > 100]) * scene.grid.resolution_m**2)


def test_share_of_partitioned_rooms_outside_0_to_1_is_refused():
    with pytest.raises(InputError, match="partitions"):
        generate_office(0, partitions=1.5)
