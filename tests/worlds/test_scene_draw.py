import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.worlds.test_scene import small_scene
from toponav.core.vocabulary import RoomKind
from toponav.worlds.draw import ROOM_COLORS, draw_plan, plan_image, room_anchors_m


def test_every_kind_of_room_has_a_light_colour():
    assert set(ROOM_COLORS) == set(RoomKind)
    assert all(
        int(color[at : at + 2], 16) > 200 for color in ROOM_COLORS.values() for at in (1, 3)
    )


def test_plan_image_darkens_walls_and_shades_furniture_by_height():
    image = plan_image(small_scene()).astype(int).sum(axis=2)
    assert image[0, 0] < image[1, 2] < image[1, 0]


def test_names_stand_inside_their_rooms():
    scene = small_scene()
    for room, anchor in zip(scene.rooms, room_anchors_m(scene), strict=True):
        assert scene.room_at(*anchor.tolist()) == room.name


def test_drawn_plan_is_in_metres_and_names_the_rooms():
    ax = Figure().add_subplot()
    draw_plan(ax, small_scene())
    assert [text.get_text() for text in ax.texts] == ["hallway_1", "office_1"]
    assert ax.get_images()[0].get_extent() == pytest.approx([-1.0, 2.0, 2.0, 4.0])
    assert ax.get_aspect() == 1.0
    quiet = Figure().add_subplot()
    draw_plan(quiet, small_scene(), names=False)
    assert not quiet.texts


def test_room_without_cells_has_no_anchor():
    scene = small_scene(room_index=np.zeros((4, 6)))
    assert np.isnan(room_anchors_m(scene)[1]).all()
