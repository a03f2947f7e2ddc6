import dataclasses

import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.rooms import outline_m
from toponav.worlds.scene import (
    Door,
    GridFrame,
    Provenance,
    Room,
    Scene,
    SceneMesh,
    SemanticClass,
    scene_from_heights,
)

GRID = GridFrame(0.5, (-1.0, 2.0), rows=4, cols=6)


def small_scene(**changes) -> Scene:
    heights = np.zeros(GRID.shape)
    heights[0], heights[-1], heights[1, 2] = 2.5, 2.5, 0.7
    room_index = np.full(GRID.shape, -1)
    room_index[1:3, :3], room_index[1:3, 3:] = 0, 1
    given = dict(
        ceiling_m=2.5,
        room_index=room_index,
        rooms=[Room("hallway_1", RoomKind.HALLWAY), Room("office_1", RoomKind.OFFICE)],
        doors=[Door("door_1", np.array([[0.5, 2.5], [0.5, 3.5]]), 1.0, ("hallway_1", "office_1"))],
        provenance=Provenance("test", seed=3),
    )
    return scene_from_heights("small", GRID, heights, **{**given, **changes})


def test_cell_and_center_are_inverse_and_row_zero_is_lowest():
    assert GRID.center_of(0, 0) == (-0.75, 2.25)
    for row in range(GRID.rows):
        for col in range(GRID.cols):
            assert GRID.cell_of(*GRID.center_of(row, col)) == (row, col)
    assert GRID.contains(-1.0, 2.0)
    assert not GRID.contains(2.0, 2.0)
    assert not GRID.contains(0.0, 1.99)
    assert GRID.extent_m == (-1.0, 2.0, 2.0, 4.0)


@pytest.mark.parametrize(
    "bad",
    [
        {"resolution_m": 0.0},
        {"resolution_m": float("nan")},
        {"origin_m": (float("inf"), 0.0)},
        {"rows": 0},
        {"rows": 10**6, "cols": 10**6},
    ],
)
def test_impossible_grids_are_refused(bad):
    with pytest.raises(InputError):
        dataclasses.replace(GRID, **bad)


def test_room_at_names_the_room_of_the_cell():
    scene = small_scene()
    assert scene.room_at(-0.9, 3.0) == "hallway_1"
    assert scene.room_at(1.9, 3.0) == "office_1"
    assert scene.room_at(0.0, 2.1) is None
    assert scene.room_at(50.0, 50.0) is None
    assert scene.room("office_1").kind is RoomKind.OFFICE
    with pytest.raises(InputError, match="did you mean 'office_1'"):
        scene.room("ofice_1")


def test_default_semantics_are_walls_to_the_ceiling_and_furniture_below():
    semantics = small_scene().semantics
    assert semantics[0, 0] == SemanticClass.WALL
    assert semantics[1, 2] == SemanticClass.FURNITURE
    assert semantics[1, 0] == SemanticClass.FLOOR


def test_heights_above_the_ceiling_become_the_ceiling():
    heights = np.full(GRID.shape, 9.0)
    assert scene_from_heights("high", GRID, heights, ceiling_m=2.5).heights_m.max() == 2.5


def test_arrays_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        small_scene().heights_m[0, 0] = 0


def test_content_hash_is_the_same_everywhere():
    # The literal was computed once: another machine, numpy or Python must agree with it.
    expected = "cfe1b294c967935038370c18fa4ea446d1849b7a1b2b0914bf269e6be5d71c95"
    assert small_scene().content_hash == expected


@pytest.mark.parametrize(
    "change",
    [
        {"ceiling_m": 2.6},
        {"rooms": [Room("hallway_1", RoomKind.HALLWAY), Room("office_2", RoomKind.OFFICE)]},
        {"doors": []},
        {"provenance": Provenance("test", seed=4)},
        {"room_index": np.full(GRID.shape, 1)},
        {"semantics": np.zeros(GRID.shape)},
    ],
)
def test_content_hash_notices_every_change(change):
    assert small_scene(**change).content_hash != small_scene().content_hash


def test_negative_zero_does_not_change_the_hash():
    plus, minus = np.zeros(GRID.shape), np.full(GRID.shape, -0.0)
    hashes = {scene_from_heights("z", GRID, heights).content_hash for heights in (plus, minus)}
    assert len(hashes) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"room_index": np.full(GRID.shape, 2)}, "room_index must lie in -1..1, got 2..2"),
        ({"semantics": np.full(GRID.shape, 99)}, "SemanticClass values, got 99"),
        ({"rooms": [Room("a", RoomKind.WC), Room("a", RoomKind.WC)]}, "names must be unique"),
        ({"ceiling_m": 0.0}, "ceiling_m must lie in"),
        ({"ceiling_m": float("nan")}, "ceiling_m must lie in"),
    ],
)
def test_what_does_not_fit_is_named(change, message):
    with pytest.raises(InputError, match=message):
        small_scene(**change)


def test_arrays_of_another_size_than_the_grid_are_refused():
    with pytest.raises(InputError, match="must cover the grid of"):
        scene_from_heights("small", GRID, np.zeros((3, 3)))


@pytest.mark.parametrize("value", [float("nan"), -0.1])
def test_impossible_heights_are_named_with_their_cell(value):
    heights = np.zeros(GRID.shape)
    heights[2, 5] = value
    with pytest.raises(InputError, match=r"cell \(2, 5\)"):
        scene_from_heights("bad", GRID, heights)


def test_mesh_with_impossible_faces_is_refused():
    vertices = np.zeros((3, 3), np.float32)
    labels = np.zeros(1, np.uint8), np.zeros(1, np.int32)
    with pytest.raises(InputError, match="faces index 3 vertices"):
        SceneMesh(vertices, np.array([[0, 1, 3]], np.int32), *labels)
    broken = vertices.copy()
    broken[1] = np.nan
    with pytest.raises(InputError, match="vertex 1"):
        SceneMesh(broken, np.array([[0, 1, 2]], np.int32), *labels)


def test_outline_of_a_rectangle_is_its_corners_counter_clockwise():
    cells = np.zeros(GRID.shape, bool)
    cells[1:3, 1:5] = True
    expected = [[-0.5, 2.5], [1.5, 2.5], [1.5, 3.5], [-0.5, 3.5]]
    assert outline_m(cells, GRID).tolist() == expected


def test_outline_is_that_of_the_largest_piece_without_its_holes():
    cells = np.ones((5, 5), bool)
    cells[2, 2] = False
    cells[4, :] = cells[:, 4] = False
    cells[4, 4] = True
    outline = outline_m(cells, GridFrame(1.0, (0.0, 0.0), 5, 5))
    assert outline.tolist() == [[0, 0], [4, 0], [4, 4], [0, 4]]


def test_outline_of_no_cells_is_none():
    assert outline_m(np.zeros(GRID.shape, bool), GRID) is None
