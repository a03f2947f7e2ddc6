"""Rooms and doors from cells alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from toponav.core.errors import InputError
from toponav.worlds.generate.office import generate_office
from toponav.worlds.segment_rooms import RoomShapes, openings_between, segment_rooms


def _two_rooms(door_cells: int = 16) -> np.ndarray:
    plan = np.ones((82, 163), bool)
    plan[1:81, 1:81] = plan[1:81, 82:162] = False
    plan[30 : 30 + door_cells, 81] = False
    return plan


def test_a_door_parts_two_rooms_and_has_its_width_and_place() -> None:
    found = segment_rooms(_two_rooms(), 0.05, origin_m=(10.0, 20.0))
    assert found.rooms == 2
    (door,) = found.doors
    assert door.rooms == (0, 1)
    assert door.width_m == pytest.approx(0.8, abs=0.06)
    assert door.segment_m.mean(axis=0) == pytest.approx((10 + 4.075, 20 + 1.9), abs=0.12)
    assert len(np.unique(found.room_index[1:81, 1:79])) == 1


def test_a_wide_passage_parts_nothing() -> None:
    assert segment_rooms(_two_rooms(60), 0.05).rooms == 1


def test_what_counts_as_a_door_can_be_told() -> None:
    strict = RoomShapes(widest_door_m=0.5, widest_arch_m=0.5)
    assert segment_rooms(_two_rooms(), 0.05, shapes=strict).rooms == 1


def test_furniture_parts_no_room_and_belongs_to_none() -> None:
    plan = _two_rooms()
    plan[20:50, 30:34] = True  # 1.5 m long, 0.3 m from nothing
    found = segment_rooms(plan, 0.05)
    assert found.rooms == 2
    assert (found.room_index[20:50, 30:34] == -1).all()


def test_cells_outside_the_building_are_in_no_room() -> None:
    plan = np.pad(_two_rooms(), 40)
    outside = np.zeros(plan.shape, bool)
    outside[:40] = outside[-40:] = outside[:, :40] = outside[:, -40:] = True
    found = segment_rooms(plan & ~outside, 0.05, outside=outside)
    assert found.rooms == 2
    assert (found.room_index[outside] == -1).all()


def test_a_full_grid_has_no_rooms() -> None:
    assert segment_rooms(np.ones((5, 5), bool), 0.05).rooms == 0


def test_known_rooms_get_the_openings_between_them() -> None:
    plan = _two_rooms()
    rooms = np.full(plan.shape, -1, np.int16)
    rooms[1:81, 1:81], rooms[1:81, 82:162] = 0, 1
    (door,) = openings_between(rooms, plan, 0.05)
    assert door.width_m == pytest.approx(0.8, abs=0.06)


def test_rooms_of_generated_offices_are_found() -> None:
    shares = []
    for seed in (1, 2):
        scene = generate_office(seed)
        outside = (scene.room_index < 0) & ~scene.occupied
        found = segment_rooms(scene.occupied, scene.grid.resolution_m, outside=outside)
        both = (scene.room_index >= 0) & (found.room_index >= 0)
        true, ours = scene.room_index[both], found.room_index[both]
        count = np.zeros((true.max() + 1, ours.max() + 1))
        np.add.at(count, (true, ours), 1)
        union = count.sum(1, keepdims=True) + count.sum(0) - count
        shares.append(((count / union).max(axis=1) > 0.5).mean())
    assert np.mean(shares) > 0.75, shares


@settings(max_examples=60, deadline=None)
@given(arrays(bool, st.tuples(st.integers(1, 24), st.integers(1, 24))))
def test_any_grid_is_cut_into_free_cells_of_numbered_rooms(occupied: np.ndarray) -> None:
    found = segment_rooms(occupied, 0.3)
    assert found.room_index.shape == occupied.shape
    assert (found.room_index[occupied] == -1).all()
    numbers = np.unique(found.room_index[found.room_index >= 0])
    assert set(numbers) <= set(range(found.rooms))
    for door in found.doors:
        assert 0 <= door.rooms[0] < door.rooms[1]
        assert np.isfinite(door.segment_m).all()


def test_shapes_out_of_range_are_refused() -> None:
    with pytest.raises(InputError, match="narrowing"):
        RoomShapes(narrowing=0.0)
