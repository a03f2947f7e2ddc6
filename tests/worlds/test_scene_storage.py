import io
import json
import os
import stat
import zipfile

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from tests.worlds.test_scene import GRID, small_scene
from toponav.core.errors import InputError
from toponav.core.vocabulary import NodeKind
from toponav.worlds.layout import HallwayLayout, Junction, Passage
from toponav.worlds.load.ros_map import read_ros_map
from toponav.worlds.scene import Provenance, Scene, SceneMesh
from toponav.worlds.storage import load_scene, save_scene

LAYOUT = HallwayLayout(
    (Junction("a", 0.0, 3.0), Junction("b", 1.5, 3.0)),
    (Passage("p", "hallway_1", NodeKind.HALLWAY, "a", "b", 0.1, 0.1, 1.0),),
    (),
)


def imported_scene() -> Scene:
    mesh = SceneMesh(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]], np.float32),
        np.array([[0, 1, 2]], np.int32),
        np.array([1], np.uint8),
        np.array([7], np.int32),
    )
    flat = small_scene()
    return Scene(
        "scan",
        GRID,
        flat.heights_m,
        2.5,
        flat.room_index,
        flat.rooms,
        (),
        flat.semantics,
        Provenance("scan"),
        imported_mesh=mesh,
    )


@pytest.mark.parametrize("make", [small_scene, lambda: small_scene(layout=LAYOUT), imported_scene])
def test_scene_comes_back_as_it_was_saved(make, tmp_path):
    scene = make()
    loaded = load_scene(save_scene(scene, tmp_path / "deep" / "scene"))
    assert loaded.content_hash == scene.content_hash
    assert loaded.grid == scene.grid
    assert loaded.provenance == scene.provenance
    assert loaded.layout == scene.layout
    assert loaded.is_extruded == scene.is_extruded
    assert [room.name for room in loaded.rooms] == ["hallway_1", "office_1"]
    np.testing.assert_array_equal(loaded.heights_m, scene.heights_m)
    np.testing.assert_array_equal(loaded.mesh.faces, scene.mesh.faces)
    np.testing.assert_array_equal(loaded.mesh.face_instance, scene.mesh.face_instance)


def test_folder_holds_the_five_files_and_other_tools_can_read_them(tmp_path):
    scene = small_scene()
    folder = save_scene(scene, tmp_path / "scene")
    names = {"scene.json", "arrays.npz", "grid.png", "map.yaml", "mesh.glb"}
    assert {path.name for path in folder.iterdir()} == names
    plan = read_ros_map(folder / "map.yaml")
    assert plan.grid == scene.grid
    np.testing.assert_array_equal(plan.occupied, scene.occupied)
    assert set(yaml.safe_load((folder / "map.yaml").read_text())) >= {"image", "resolution"}
    # The image's first row is the highest y, as ROS has it.
    assert np.asarray(Image.open(folder / "grid.png"))[2, 2] == 0
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.load(folder / "mesh.glb")
    assert set(mesh.geometry) == {"floor", "ceiling", "wall", "furniture"}
    low, high = mesh.bounds
    assert (low[1], high[1]) == pytest.approx((0, 2.5)), "glTF is y up"
    assert stat.S_IMODE(folder.stat().st_mode) & 0o500 == 0o500


def test_saving_twice_replaces_the_scene_and_keeps_other_files(tmp_path):
    folder = save_scene(small_scene(), tmp_path / "scene")
    (folder / "my_map.topo.json").write_text("mine")
    changed = small_scene(ceiling_m=3.0)
    save_scene(changed, folder)
    assert load_scene(folder / "scene.json").content_hash == changed.content_hash
    assert (folder / "my_map.topo.json").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["scene"]


def test_same_scene_is_saved_as_the_same_bytes(tmp_path):
    first = save_scene(small_scene(), tmp_path / "a")
    second = save_scene(small_scene(), tmp_path / "b")
    for name in ("scene.json", "arrays.npz", "grid.png", "map.yaml"):
        assert (first / name).read_bytes() == (second / name).read_bytes()


def test_folder_with_other_files_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="holds files but no scene"):
        save_scene(small_scene(), tmp_path)
    with pytest.raises(InputError, match="is a file"):
        save_scene(small_scene(), tmp_path / "thesis.tex")
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_failed_save_leaves_nothing_behind(tmp_path, monkeypatch):
    def fail(mesh):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("toponav.worlds.storage.glb_bytes", fail)
    with pytest.raises(InputError, match="No space left"):
        save_scene(small_scene(), tmp_path / "scene")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_folder_that_may_not_be_written_is_named(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="cannot be written"):
        save_scene(small_scene(), tmp_path / "scene")


def edit(folder, change):
    path = folder / "scene.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.update(ceiling_m=2.6),
        lambda d: d["rooms"][0].update(name="hallway_9"),
        lambda d: d["provenance"].update(seed=99),
        lambda d: d.update(content_hash="0" * 64),
        lambda d: d.pop("content_hash"),
    ],
)
def test_changed_scene_does_not_load(change, tmp_path):
    folder = save_scene(small_scene(), tmp_path / "scene")
    edit(folder, change)
    with pytest.raises(InputError, match="content hash must be"):
        load_scene(folder)


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.pop("grid"),
        lambda d: d["grid"].update(rows="many"),
        lambda d: d["grid"].update(rows=10**9, cols=10**9),
        lambda d: d["grid"].update(rows=5),
        lambda d: d["grid"].update(resolution_m=1e400),
        lambda d: d["rooms"][0].update(kind="dungeon"),
        lambda d: d["rooms"].append({}),
        lambda d: d["rooms"][0].update(polygon_m=[1, 2, 3]),
        lambda d: d.update(schema=99),
        lambda d: d.update(rooms=None),
        lambda d: d.update(layout={"format": 1}),
        lambda d: d.update(is_extruded=False),
        lambda d: d.update(doors=7),
        lambda d: d.update(ceiling_m=None),
    ],
)
def test_broken_description_is_one_clear_error(change, tmp_path):
    folder = save_scene(small_scene(), tmp_path / "scene")
    edit(folder, change)
    with pytest.raises(InputError, match=str(folder)):
        load_scene(folder)


def test_missing_folder_and_missing_arrays_are_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere.scene\.json: cannot be read"):
        load_scene(tmp_path / "nowhere")
    folder = save_scene(small_scene(), tmp_path / "scene")
    (folder / "arrays.npz").unlink()
    with pytest.raises(InputError, match=r"arrays\.npz: cannot be read"):
        load_scene(folder)


@pytest.mark.parametrize("array", [np.zeros((3, 3), np.float32), np.zeros(GRID.shape), "pickle"])
def test_arrays_of_another_kind_are_refused(array, tmp_path):
    folder = save_scene(small_scene(), tmp_path / "scene")
    stream = io.BytesIO()
    if isinstance(array, str):
        np.save(stream, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    else:
        np.save(stream, array)
    with zipfile.ZipFile(folder / "arrays.npz", "w") as archive:
        archive.writestr("heights_m.npy", stream.getvalue())
    with pytest.raises(InputError, match="heights_m must be"):
        load_scene(folder)


@pytest.mark.parametrize("name", ["arrays.npz", "scene.json"])
@given(data=st.data())
@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_flipped_and_cut_files_never_load_as_another_scene(name, data, tmp_path):
    folder = save_scene(small_scene(), tmp_path / "scene")
    path = folder / name
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        content = content[:place]
    else:
        content[place] ^= 1 << data.draw(st.integers(0, 7))
    path.write_bytes(content)
    message = ""
    try:
        loaded = load_scene(folder)
    except InputError as error:
        message = str(error)
    finally:
        save_scene(small_scene(), folder)
    assert str(folder) in message or loaded.content_hash == small_scene().content_hash
