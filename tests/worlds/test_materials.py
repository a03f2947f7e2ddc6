import json
import struct

import numpy as np
import pytest
import trimesh

from tests.worlds.test_scene import GRID, small_scene
from toponav.core.errors import InputError
from toponav.worlds.gltf import glb_bytes
from toponav.worlds.materials import Attribution, Material, distinct_textures, linear_rgb
from toponav.worlds.scene import Provenance, Scene, SceneMesh
from toponav.worlds.storage import load_scene, save_scene

CHAIR_BY = Attribution("Chair", "A. Maker", "CC BY 4.0", "furniture.sh3f")


def checkers() -> np.ndarray:
    texture = np.zeros((4, 8, 3), np.uint8)
    texture[:2, :4] = (255, 0, 0)
    texture[2:, 4:] = (0, 0, 255)
    return texture


def textured_mesh(texture: np.ndarray | None = None) -> SceneMesh:
    """A floor square with a texture, of two triangles, and a glowing wall triangle."""
    return SceneMesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3], [0, 1, 4]], np.int32),
        np.array([0, 0, 1], np.uint8),
        np.array([-1, -1, 0], np.int32),
        np.array([1, 1, 0], np.int32),
        np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]], [[0, 0]] * 3], np.float32),
        (
            Material("lamp", (1.0, 0.5, 0.25), emission=2.0),
            Material("tiles", (0.5, 0.5, 0.5), checkers() if texture is None else texture),
        ),
    )


def scene_with(mesh: SceneMesh) -> Scene:
    flat = small_scene()
    return Scene(
        "home",
        GRID,
        flat.heights_m,
        2.5,
        flat.room_index,
        flat.rooms,
        (),
        flat.semantics,
        Provenance("home", seed=3),
        imported_mesh=mesh,
        attribution=(CHAIR_BY,),
    )


def test_materials_textures_and_attribution_come_back_as_saved(tmp_path):
    scene = scene_with(textured_mesh())
    loaded = load_scene(save_scene(scene, tmp_path / "scene"))
    assert loaded.attribution == (CHAIR_BY,)
    assert loaded.content_hash == scene.content_hash
    lamp, tiles = loaded.mesh.materials
    assert (lamp.name, lamp.color, lamp.texture, lamp.emission) == (
        "lamp",
        (1.0, 0.5, 0.25),
        None,
        2.0,
    )
    np.testing.assert_array_equal(tiles.texture, checkers())
    np.testing.assert_array_equal(loaded.mesh.corner_uv, scene.mesh.corner_uv)
    np.testing.assert_array_equal(loaded.mesh.face_material, [1, 1, 0])


def test_content_hash_covers_texture_places_and_colours():
    base = textured_mesh()
    parts = (base.vertices_m, base.faces, base.face_semantic, base.face_instance)
    hashes = {scene_with(base).content_hash}
    changed = checkers()
    changed[0, 0, 0] = 254
    hashes.add(scene_with(textured_mesh(changed)).content_hash)
    moved = SceneMesh(*parts, base.face_material, base.corner_uv * 2, base.materials)
    hashes.add(scene_with(moved).content_hash)
    dyed = (Material("lamp", (1.0, 0.5, 0.2), emission=2.0), base.materials[1])
    hashes.add(
        scene_with(SceneMesh(*parts, base.face_material, base.corner_uv, dyed)).content_hash
    )
    swapped = SceneMesh(*parts, 1 - base.face_material, base.corner_uv, base.materials)
    hashes.add(scene_with(swapped).content_hash)
    assert len(hashes) == 5


def test_extruded_scenes_keep_the_hash_they_had_before_materials():
    assert small_scene().content_hash == (
        "cfe1b294c967935038370c18fa4ea446d1849b7a1b2b0914bf269e6be5d71c95"
    )


def test_glb_carries_textures_the_right_way_up_and_glow():
    data = glb_bytes(textured_mesh())
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    assert len(data) == struct.unpack_from("<I", data, 8)[0]
    assert {material["name"] for material in document["materials"]} == {"lamp", "tiles"}
    lamp = next(m for m in document["materials"] if m["name"] == "lamp")
    assert lamp["emissiveFactor"] == [1.0, 1.0, 0.5]
    scene = trimesh.load(trimesh.util.wrap_as_stream(data), file_type="glb")
    assert set(scene.geometry) == {"floor", "wall"}
    floor = scene.geometry["floor"]
    picture = np.asarray(floor.visual.material.baseColorTexture.convert("RGB"))
    np.testing.assert_array_equal(picture, checkers())
    # In the map frame (trimesh flips v back to run up) the origin is the lower left corner.
    in_map = trimesh.transform_points(floor.vertices, scene.graph.get("floor")[0])
    at = {
        tuple(np.round(p, 6) + 0.0): tuple(uv)
        for p, uv in zip(in_map, floor.visual.uv, strict=True)
    }
    assert at[(0.0, 0.0, 0.0)] == (0.0, 0.0)
    assert at[(1.0, 0.0, 0.0)] == (1.0, 0.0)
    assert at[(0.0, 0.0, -1.0)] == (0.0, 1.0)


def test_mesh_without_materials_is_grey():
    mesh = textured_mesh()
    plain = SceneMesh(mesh.vertices_m, mesh.faces, mesh.face_semantic, mesh.face_instance)
    assert plain.materials[0].name == "grey"
    assert plain.face_material.tolist() == [0, 0, 0]
    assert plain.corner_uv.shape == (3, 3, 2)


def test_same_texture_of_two_materials_is_stored_once():
    materials = [
        Material("a", texture=checkers()),
        Material("b"),
        Material("c", texture=checkers()),
    ]
    textures, numbers = distinct_textures(materials)
    assert (len(textures), numbers) == (1, [0, None, 0])


@pytest.mark.parametrize(
    ("make", "rule"),
    [
        (lambda: Material("m", (1.5, 0.0, 0.0)), "color must be"),
        (lambda: Material("m", (float("nan"), 0.0, 0.0)), "color must be"),
        (lambda: Material("m\n"), "printable"),
        (lambda: Material("m", emission=-1.0), "emission"),
        (lambda: Material("m", texture=np.zeros((1, 5000, 3), np.uint8)), "4096 px"),
        (lambda: Attribution("w\n", "c", "l"), "printable"),
    ],
)
def test_material_that_cannot_be_drawn_is_refused(make, rule):
    with pytest.raises(InputError, match=rule):
        make()


def test_mesh_whose_materials_do_not_fit_is_refused():
    mesh = textured_mesh()
    parts = (mesh.vertices_m, mesh.faces, mesh.face_semantic, mesh.face_instance)
    with pytest.raises(InputError, match="indexes 2 materials"):
        SceneMesh(*parts, np.array([0, 1, 2], np.int32), mesh.corner_uv, mesh.materials)
    broken = mesh.corner_uv.copy()
    broken[1, 0, 0] = np.nan
    with pytest.raises(InputError, match="face 1"):
        SceneMesh(*parts, mesh.face_material, broken, mesh.materials)


def test_linear_colour_undoes_the_srgb_curve():
    np.testing.assert_allclose(linear_rgb("#ffffff"), 1.0)
    np.testing.assert_allclose(linear_rgb((0.5, 0.04, 0.0)), (0.2140, 0.0031, 0.0), atol=1e-4)
