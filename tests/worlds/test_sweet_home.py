"""Homes of Sweet Home 3D."""

from pathlib import Path

import numpy as np
import pytest

from tests.worlds.building_files import home_xml, write_sh3d
from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.importer import import_building
from toponav.worlds.scene import Scene


def _home(path: Path, more: str = "", **files: bytes) -> Scene:
    write_sh3d(path, home_xml(more), **files)
    return import_building(path).scene


def test_a_home_keeps_its_rooms_doors_and_furniture(tmp_path: Path) -> None:
    scene = _home(tmp_path / "a.sh3d")
    assert {room.name: room.kind for room in scene.rooms} == {
        "Kitchen": RoomKind.KITCHEN,
        "Bedroom": RoomKind.BEDROOM,
    }
    # y is down in the file: the kitchen is at x 0..4, y -4..0 here.
    assert scene.room_at(1.0, -1.0) == "Kitchen"
    assert scene.room_at(7.0, -3.0) == "Bedroom"
    (door,) = scene.doors
    assert door.width_m == pytest.approx(0.9)
    assert np.sort(door.segment_m[:, 1]) == pytest.approx([-2.45, -1.55])
    assert not scene.occupied[scene.grid.cell_of(4.0, -2.0)], "the door stands open"
    assert scene.occupied[scene.grid.cell_of(4.0, -1.0)]
    assert scene.semantics[scene.grid.cell_of(1.0, -2.75)] == SemanticClass.CHAIR
    assert scene.ceiling_m == pytest.approx(2.5, abs=0.06)
    assert [entry.creator for entry in scene.attribution] == ["A. Maker"]


def test_a_window_is_a_hole_with_a_window_in_it_and_wall_below(tmp_path: Path) -> None:
    mesh = _home(tmp_path / "a.sh3d").mesh
    middle = mesh.vertices_m[mesh.faces].mean(axis=1)
    near = (np.abs(middle[:, 0] - 2.0) < 0.55) & (np.abs(middle[:, 1]) < 0.06)
    at_window = near & (middle[:, 2] > 0.95) & (middle[:, 2] < 1.85)
    assert (mesh.face_semantic[at_window] == SemanticClass.WINDOW).all()
    assert at_window.any()
    walls = mesh.face_semantic == SemanticClass.WALL
    assert mesh.vertices_m[mesh.faces[walls & near]][:, :, 2].min() == 0.0
    assert mesh.vertices_m[mesh.faces[walls & near]][:, :, 2].max() == pytest.approx(2.5)


def test_a_piece_is_turned_clockwise_as_on_paper(tmp_path: Path) -> None:
    piece = (
        "<pieceOfFurniture name='Bench' x='650' y='100' width='150' depth='20' height='50' "
        "angle='0.7853982'/>"
    )
    scene = _home(tmp_path / "a.sh3d", piece)
    # On paper it runs down to the right; with y up that is towards -y.
    assert scene.occupied[scene.grid.cell_of(6.5 + 0.4, -1.0 - 0.4)]
    assert not scene.occupied[scene.grid.cell_of(6.5 + 0.4, -1.0 + 0.4)]


def test_a_round_wall_bends_to_its_side(tmp_path: Path) -> None:
    wall = (
        "<wall xStart='500' yStart='300' xEnd='700' yEnd='300' height='250' thickness='10' "
        "arcExtent='{}'/>"
    )
    bent = {}
    for extent in (1.5707964, -1.5707964):
        scene = _home(tmp_path / "a.sh3d", wall.format(extent))
        col = scene.grid.cell_of(6.0, -3.0)[1]
        rows = [scene.grid.cell_of(6.0, y)[0] for y in (-2.6, -3.0, -3.4)]
        bent[extent > 0] = [bool(scene.occupied[row - 1 : row + 2, col].any()) for row in rows]
    assert bent[True][1] == bent[False][1] == False  # noqa: E712
    assert sorted([bent[True], bent[False]]) == [[False, False, True], [True, False, False]]


def test_a_home_without_drawn_rooms_is_cut_at_its_doors(tmp_path: Path) -> None:
    text = home_xml()
    bare = text[: text.index("<room")] + text[text.rindex("</room>") + len("</room>") :]
    write_sh3d(tmp_path / "a.sh3d", bare)
    found = import_building(tmp_path / "a.sh3d")
    assert len(found.scene.rooms) == 2
    assert any("no rooms drawn" in note for note in found.notes)


def test_a_model_that_cannot_be_read_becomes_a_box(tmp_path: Path) -> None:
    piece = (
        "<pieceOfFurniture name='Sofa' x='600' y='350' width='150' depth='60' height='80' "
        "model='{}'/>"
    )
    for model in ("7/gone.obj", "../../etc/passwd.obj", "0/model.3ds"):
        write_sh3d(tmp_path / "a.sh3d", home_xml(piece.format(model)))
        found = import_building(tmp_path / "a.sh3d")
        assert found.scene.semantics[found.scene.grid.cell_of(6.0, -3.25)] == SemanticClass.SOFA
        assert any("replaced by a box" in note for note in found.notes)


def test_old_files_are_never_unpickled(tmp_path: Path) -> None:
    import zipfile

    with zipfile.ZipFile(tmp_path / "a.sh3d", "w") as archive:
        archive.writestr("Home", b"\xac\xed\x00\x05sr")
    with pytest.raises(InputError, match=r"serialised Java object.*save it again"):
        import_building(tmp_path / "a.sh3d")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<home", "is not XML"),
        ("<house/>", "must be a <home>"),
        ("<!DOCTYPE home [<!ENTITY a 'b'>]><home>&a;</home>", "is not read"),
        ("<home/>", "neither walls nor rooms"),
        (home_xml("<wall xStart='a' yStart='0' xEnd='1' yEnd='1'/>"), "must be a number"),
        (home_xml("<wall xStart='1e9' yStart='0' xEnd='1' yEnd='1'/>"), "must be a number"),
        (
            home_xml("<pieceOfFurniture x='0' y='0' width='99999' depth='1' height='1'/>"),
            "up to 50 m large",
        ),
    ],
)
def test_a_broken_home_is_one_clear_error(tmp_path: Path, text: str, says: str) -> None:
    write_sh3d(tmp_path / "a.sh3d", text)
    with pytest.raises(InputError, match=says):
        import_building(tmp_path / "a.sh3d")
