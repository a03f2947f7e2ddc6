"""Gazebo worlds: poses, includes, shapes, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from tests.worlds.building_files import dae_text, one_mesh, sdf_text
from toponav.core.errors import InputError
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.gazebo import read_gazebo
from toponav.worlds.load.importer import ImportOptions, import_building
from toponav.worlds.load.mesh_parts import MeshPart, Notes


def _model(folder: Path, name: str, body: str) -> Path:
    (folder / name).mkdir(parents=True)
    (folder / name / "model.config").write_text(
        "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.6'>model.sdf</sdf></model>"
    )
    (folder / name / "model.sdf").write_text(
        f"<sdf version='1.6'><model name='{name}'>{body}</model></sdf>"
    )
    return folder / name


def _world(path: Path, body: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"<sdf version='1.6'><world name='w'>{body}</world></sdf>")
    return path


def _mesh(uri: str, more: str = "") -> str:
    return (
        f"<link name='l'><visual name='v'><geometry><mesh><uri>{uri}</uri>{more}</mesh>"
        "</geometry></visual></link>"
    )


def _bounds(parts: list[MeshPart]) -> tuple[list[float], list[float]]:
    at = np.concatenate([part.vertices for part in parts])
    return at.min(axis=0).round(3).tolist(), at.max(axis=0).round(3).tolist()


def test_boxes_in_turned_links_on_a_plane_become_two_rooms(tmp_path: Path) -> None:
    path = tmp_path / "rooms.world"
    path.write_text(sdf_text())
    found = import_building(path)
    assert len(found.scene.rooms) == 2
    assert "ground around the building left out of the rooms" in found.notes
    assert len(found.scene.doors) == 1
    assert found.scene.room_at(3.0, 1.0) not in (None, found.scene.room_at(6.0, 1.0))


def test_an_included_mesh_in_centimetres_comes_out_in_metres(tmp_path: Path) -> None:
    folder = _model(tmp_path / "models", "rooms", _mesh("model://rooms/meshes/a.dae"))
    (folder / "meshes").mkdir()
    (folder / "meshes" / "a.dae").write_text(dae_text(0.01))
    world = _world(
        tmp_path / "worlds" / "a.world",
        "<include><uri>model://rooms</uri><pose>3 4 0 0 0 0.5</pose></include>",
    )
    scene = import_building(world).scene
    assert len(scene.rooms) == 2
    assert FreeSpace.of(scene, 0.18).is_free(3 + np.cos(0.5), 4 + np.sin(0.5) + 0.5)


def test_poses_nest_and_scale_stretches(tmp_path: Path) -> None:
    folder = _model(
        tmp_path / "models",
        "rooms",
        "<pose>9 9 9 0 0 0</pose>" + _mesh("meshes/a.stl", "<scale>2 1 1</scale>"),
    )
    (folder / "meshes").mkdir()
    one_mesh().export(folder / "meshes" / "a.stl")
    world = _world(
        tmp_path / "a.world",
        "<model name='m'><pose>10 0 0 0 0 1.5707963267948966</pose>"
        "<include><uri>model://rooms</uri><pose>1 0 0 0 0 0</pose></include></model>",
    )
    low, high = _bounds(read_gazebo(world, [], Notes()))
    # x of the mesh, doubled and moved by 1, runs along y of the world; y runs along -x.
    assert low == pytest.approx([10 - 4.1, 1 - 0.2, -0.1], abs=0.01)
    assert high == pytest.approx([10 + 0.1, 1 + 16.2, 2.6], abs=0.01)


def test_shapes_have_their_sizes(tmp_path: Path) -> None:
    shapes = {
        "<box><size>1 2 3</size></box>": (1, 2, 3),
        "<cylinder><radius>0.5</radius><length>2</length></cylinder>": (1, 1, 2),
        "<sphere><radius>0.5</radius></sphere>": (1, 1, 1),
        "<capsule><radius>0.5</radius><length>1</length></capsule>": (1, 1, 2),
        "<ellipsoid><radii>1 2 3</radii></ellipsoid>": (2, 4, 6),
        "<polyline><point>0 0</point><point>2 0</point><point>2 1</point><point>0 1</point>"
        "<height>3</height></polyline>": (2, 1, 3),
    }
    for text, size in shapes.items():
        link = f"<link name='l'><visual name='v'><geometry>{text}</geometry></visual></link>"
        world = _world(tmp_path / "a.world", f"<model name='m'>{link}</model>")
        low, high = _bounds(read_gazebo(world, [], Notes()))
        assert np.subtract(high, low) == pytest.approx(size, abs=0.05), text


def test_links_may_stand_relative_to_each_other(tmp_path: Path) -> None:
    box = "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry></visual>"
    world = _world(
        tmp_path / "a.world",
        "<model name='m'><link name='a'><pose>5 0 0 0 0 0</pose></link>"
        f"<link name='b'><pose relative_to='a' degrees='true'>1 0 0 0 0 90</pose>{box}</link>"
        "</model>",
    )
    low, _ = _bounds(read_gazebo(world, [], Notes()))
    assert low == [5.5, -0.5, -0.5]


def test_what_is_wrong_is_one_clear_error(tmp_path: Path) -> None:
    models = tmp_path / "models"
    _model(models, "a", "<include><uri>model://b</uri></include>")
    _model(models, "b", "<include><uri>model://a</uri></include>")
    box = "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry></visual>"
    cases = {
        "<include><uri>model://a</uri></include>": "includes itself: a > b > a",
        "<include><uri>model://../../etc</uri></include>": "must lie in the given folders",
        "<include><uri>model://nobody</uri></include>": "no model 'nobody'",
        "<include><uri>/etc/passwd</uri></include>": "must lie in the given folders",
        "<include><uri>file:///etc/passwd</uri></include>": "must lie in the given folders",
        f"<model name='m'>{_mesh('model://a/../../../etc/passwd')}</model>": "given folders",
        f"<model name='m'>{_mesh('model://a/nothing.dae')}</model>": "no such file",
        "<model name='m'><pose>1 2 three 0 0 0</pose></model>": "must be 6 numbers",
        "<model name='m'><pose>1e300 0 0 0 0 0</pose></model>": "must be 6 numbers",
        "<model name='m'><link name='a'><pose relative_to='b'>0 0 0 0 0 0</pose></link>"
        "<link name='b'><pose relative_to='a'>0 0 0 0 0 0</pose></link></model>": "in a circle",
        f"<model name='m'><link name='l'>{box.replace('1 1 1', '0 -1 1')}</link></model>": "size",
        "": "holds no shapes",
    }
    for body, says in cases.items():
        world = _world(tmp_path / "w.world", body)
        with pytest.raises(InputError, match=says):
            read_gazebo(world, [models], Notes())


def test_nothing_is_fetched_from_the_network(tmp_path: Path) -> None:
    world = _world(
        tmp_path / "w.world",
        "<include><uri>https://fuel.gazebosim.org/1.0/x/models/y</uri></include>"
        "<model name='m'><link name='l'><visual name='v'><geometry><box><size>3 3 1</size></box>"
        "</geometry></visual></link></model>",
    )
    notes = Notes()
    assert len(read_gazebo(world, [], notes)) == 1
    assert "network" in notes.lines[0]


def test_entities_are_refused(tmp_path: Path) -> None:
    bomb = (
        "<!DOCTYPE sdf [<!ENTITY a 'aaaaaaaaaa'>"
        + "".join(
            f"<!ENTITY {name} '{'&' + before + ';'}{'&' + before + ';'}'>"
            for before, name in zip("abcdefgh", "bcdefghi", strict=True)
        )
        + "]><sdf>&i;</sdf>"
    )
    outside = "<!DOCTYPE sdf SYSTEM 'file:///etc/passwd'><sdf/>"
    for text in (bomb, outside, "<sdf>" * 300, "<sdf", "not xml"):
        (tmp_path / "w.world").write_text(text)
        with pytest.raises(InputError, match="is not"):
            read_gazebo(tmp_path / "w.world", [], Notes())


def test_the_small_house_is_19_by_11_m_furnished_and_drivable(areas_dir: Path) -> None:
    world = areas_dir.parent / "small_house" / "worlds" / "small_house.world"
    if not world.is_file():
        pytest.skip(f"no small house at {world}; set TOPONAV_DATA")
    scene = import_building(world, ImportOptions()).scene
    left, right, bottom, top = scene.grid.extent_m
    assert right - left == pytest.approx(19.0, abs=0.3)
    assert top - bottom == pytest.approx(11.4, abs=0.3)
    kinds = {str(room.kind) for room in scene.rooms}
    assert {"bedroom", "living_room"} <= kinds
    classes = {SemanticClass(int(value)) for value in np.unique(scene.semantics)}
    assert {SemanticClass.CHAIR, SemanticClass.SOFA, SemanticClass.TABLE} <= classes
    assert sum(material.texture is not None for material in scene.mesh.materials) > 20
    space = FreeSpace.of(scene, 0.18)
    free = space.free
    assert free.sum() * 0.05**2 > 80
    assert (space.component == 1).sum() > 0.97 * free.sum()
    # From the bed to the kitchen and to the exercise room, on one's own wheels.
    goal = space.geodesic_m((7.0, -1.5))
    for start in ((-5.0, 0.0), (-6.0, -3.5), (0.0, 2.0)):
        assert 5.0 < goal[space.nearest_free(*start)] < 25.0
