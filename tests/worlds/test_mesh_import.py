"""Meshes in every format become the same building."""

from pathlib import Path

import numpy as np
import pytest

from tests.worlds.building_files import BOXES, dae_text, obj_text, one_mesh, write_glb
from toponav.core.errors import InputError
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.importer import ImportOptions, import_building
from toponav.worlds.load.level_kernels import fill_columns
from toponav.worlds.load.levels import columns_over
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Scene
from toponav.worlds.simplify import simplify_mesh
from toponav.worlds.storage import load_scene, save_scene


def assert_two_rooms(scene: Scene, *, open_ceiling: bool = False) -> None:
    """What every format of `building_files` must give, whatever its frame."""
    left, right, bottom, top = scene.grid.extent_m
    short_m, long_m = sorted((right - left, top - bottom))
    assert 8.1 <= long_m <= 8.4, scene.grid
    assert 4.1 <= short_m <= 4.4, scene.grid
    assert len(scene.rooms) == 2
    assert len(scene.doors) == 1
    assert scene.doors[0].width_m == pytest.approx(0.9, abs=0.11)
    assert set(scene.doors[0].rooms) == {room.name for room in scene.rooms}
    if not open_ceiling:
        assert scene.ceiling_m == pytest.approx(2.5, abs=0.06)
    sizes = sorted(np.bincount(scene.room_index[scene.room_index >= 0]) * 0.05**2)
    assert sizes == pytest.approx([2.95 * 4 - 0.48, 4.95 * 4], rel=0.06)
    space = FreeSpace.of(scene, 0.18)
    assert space.component.max() == 1, "one can drive from room to room"


def test_every_format_gives_the_same_two_rooms(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(obj_text())
    one_mesh().export(tmp_path / "b.ply")
    one_mesh().export(tmp_path / "c.stl")
    (tmp_path / "d.dae").write_text(dae_text(0.01))
    (tmp_path / "e.dae").write_text(dae_text(0.0254, "Y_UP"))
    write_glb(tmp_path / "f.glb")
    for name in ("a.obj", "b.ply", "c.stl", "d.dae", "e.dae", "f.glb"):
        assert_two_rooms(import_building(tmp_path / name).scene)


def test_a_table_can_be_driven_under_and_a_chest_cannot(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(obj_text())
    scene = import_building(tmp_path / "a.obj").scene
    assert not scene.occupied[scene.grid.cell_of(2.0, 3.0)]
    chest = scene.grid.cell_of(7.5, 3.6)
    assert scene.occupied[chest]
    assert scene.heights_m[chest] == pytest.approx(0.8, abs=0.06)


def test_names_tell_classes_and_else_the_position_does(tmp_path: Path) -> None:
    (tmp_path / "named.obj").write_text(obj_text({name: name for name in BOXES}))
    named = import_building(tmp_path / "named.obj").scene
    (tmp_path / "bare.obj").write_text(obj_text())
    bare = import_building(tmp_path / "bare.obj").scene
    for scene in (named, bare):
        found = {SemanticClass(int(value)) for value in np.unique(scene.mesh.face_semantic)}
        assert {SemanticClass.FLOOR, SemanticClass.WALL, SemanticClass.CEILING} <= found
        assert scene.semantics[scene.grid.cell_of(5.0, 0.5)] == SemanticClass.WALL
        assert scene.semantics[scene.grid.cell_of(7.5, 3.6)] == SemanticClass.FURNITURE
    assert SemanticClass.TABLE in named.mesh.face_semantic


def test_units_and_up_can_be_told(tmp_path: Path) -> None:
    mesh = one_mesh()
    mesh.apply_scale(100)
    turned = mesh.copy()
    turned.apply_transform([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    turned.export(tmp_path / "a.ply")
    with pytest.raises(InputError, match="--units"):
        import_building(tmp_path / "a.ply")
    found = import_building(tmp_path / "a.ply", ImportOptions(units="cm", up="x"))
    assert_two_rooms(found.scene)
    guessed = import_building(tmp_path / "a.ply", ImportOptions(units="cm"))
    assert guessed.scene.content_hash == found.scene.content_hash
    assert any("which way is up: x" in note for note in guessed.notes)


def test_the_largest_storey_is_taken_or_the_one_asked_for(tmp_path: Path) -> None:
    small = one_mesh()
    small.apply_translation([0, 0, 3.0])
    small = small.slice_plane([4.9, 0, 0], [-1, 0, 0])
    both = one_mesh() + small
    both.export(tmp_path / "a.stl")
    lower = import_building(tmp_path / "a.stl").scene
    assert_two_rooms(lower)
    upper = import_building(tmp_path / "a.stl", ImportOptions(floor_height_m=3.0)).scene
    assert len(upper.rooms) == 1
    assert upper.grid.cols * 0.05 == pytest.approx(5.0, abs=0.3)
    assert upper.mesh.vertices_m[:, 2].max() < 3.0


def test_textures_and_materials_survive_saving(tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb")
    scene = import_building(tmp_path / "a.glb").scene
    red = [one for one in scene.mesh.materials if one.texture is not None]
    assert len(red) == 1
    assert red[0].texture is not None
    assert red[0].texture[0, 0].tolist() == [200, 10, 10]
    assert load_scene(save_scene(scene, tmp_path / "out")).content_hash == scene.content_hash


def test_columns_agree_with_sampled_triangles() -> None:
    rng = np.random.default_rng(4)
    vertices = rng.uniform(-0.1, 2.6, (60, 3)).astype(np.float32)
    faces = rng.integers(0, 60, (40, 3)).astype(np.int32)
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])]
    columns = columns_over(vertices, faces, 0.0, np.zeros(2), np.full(2, 2.5), 0.1)
    weights = rng.dirichlet(np.ones(3), 4000)
    marked = 0
    for face in faces:
        points = weights @ vertices[face].astype(np.float64)
        col, row = np.floor(points[:, :2].T / 0.1).astype(int)
        layer = np.floor((points[:, 2] + 0.15) / 0.05).astype(int)
        inside = (col >= 0) & (row >= 0) & (col < 25) & (row < 25) & (layer >= 0) & (layer < 64)
        bits = columns.layers[row[inside], col[inside]] >> layer[inside].astype(np.uint64)
        assert (bits & np.uint64(1)).all()
        marked += int(inside.sum())
    assert marked > 10_000
    # Nothing but the triangles: far from all of them no bit is set.
    assert not columns_over(
        vertices[:3], faces[:0], 0.0, np.zeros(2), np.ones(2), 0.1
    ).layers.any()
    assert fill_columns is not None


def test_a_simpler_mesh_keeps_its_size_and_labels() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(5)
    count = len(ball.faces)
    kinds = (np.asarray(ball.triangles_center)[:, 2] > 0).astype(np.uint8)
    mesh = SceneMesh(
        np.asarray(ball.vertices, np.float32),
        np.asarray(ball.faces, np.int32),
        kinds,
        np.zeros(count, np.int32),
    )
    simple = simplify_mesh(mesh, 1000)
    assert 500 <= len(simple.faces) <= 1000
    assert np.abs(np.ptp(simple.vertices_m, axis=0) - 2.0).max() < 0.1
    up = simple.vertices_m[simple.faces].mean(axis=1)[:, 2] > 0.1
    assert (simple.face_semantic[up] == 1).all()
    assert simplify_mesh(mesh, count) is mesh
