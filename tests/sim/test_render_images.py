"""Colour, class and instance images; every camera paints what the slow and obvious one paints."""

import dataclasses
import math

import numpy as np
import pytest

from tests.sim.buildings import furnished_room, room
from toponav.core.camera import Camera, PanoramaCamera, PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render import make_renderer
from toponav.sim.render.images import INSTANCE_OF_NOTHING, MODALITIES, SEMANTIC_OF_NOTHING
from toponav.sim.render.shading import LIGHT
from toponav.worlds.materials import Material
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Scene, SemanticClass

PINHOLE = PinholeCamera(width=18, height=12, hfov_rad=1.6, pitch_rad=0.2)
STITCHED = PanoramaCamera(height=6, width=48)
ROUND = PanoramaCamera(height=6, width=48, kind="equirectangular")
CASTERS = ["packets", "embreex"]
POSE = Pose2(2.5, 1.9, 0.7)


@pytest.fixture(scope="module")
def furnished() -> Scene:
    return furnished_room()


def with_mesh(scene: Scene, **changes: object) -> Scene:
    return dataclasses.replace(scene, imported_mesh=dataclasses.replace(scene.mesh, **changes))


def painted(scene: Scene, texture: np.ndarray | None, **changes: object) -> Scene:
    """The scene all in one material; one repeat of the texture a metre."""
    material = Material("all", texture=texture, **changes)
    count = len(scene.mesh.faces)
    return with_mesh(scene, materials=(material,), face_material=np.zeros(count, np.int32))


@pytest.mark.parametrize("camera", [PINHOLE, STITCHED, ROUND])
def test_every_camera_paints_what_the_reference_paints(camera: Camera, furnished: Scene) -> None:
    truth = make_renderer(furnished, camera, "reference").render_images(POSE)
    assert np.ptp(truth.rgb.astype(int), axis=(0, 1)).min() > 25, "the room has colours"
    for backend in CASTERS:
        seen = make_renderer(furnished, camera, backend).render_images(POSE)
        # A ray that grazes an edge may fall on either side of it.
        apart = np.abs(seen.rgb.astype(int) - truth.rgb).max(axis=-1)
        assert np.mean(apart > 6) <= 0.02, backend
        assert np.median(apart) <= 2
        assert np.mean(seen.semantic != truth.semantic) <= 0.01
        assert np.mean(seen.instance != truth.instance) <= 0.01
        assert np.mean(np.abs(seen.depth_m - truth.depth_m) > 1e-3) <= 0.01


def test_fine_textures_agree_with_the_reference_near_and_far(furnished: Scene) -> None:
    rng = np.random.default_rng(0)
    scene = painted(furnished, rng.integers(0, 256, (64, 48, 3), dtype=np.uint8))
    truth = make_renderer(scene, PINHOLE, "reference").render_images(POSE, ("rgb",)).rgb
    for backend in CASTERS:
        seen = make_renderer(scene, PINHOLE, backend).render_images(POSE, ("rgb",)).rgb
        apart = np.abs(seen.astype(int) - truth).max(axis=-1)
        assert np.mean(apart > 8) <= 0.03, backend


@pytest.mark.parametrize("backend", ["auto", "grid", *CASTERS, "reference"])
def test_only_what_is_asked_for_is_given(backend: str, furnished: Scene) -> None:
    renderer = make_renderer(furnished, dataclasses.replace(PINHOLE, width=4, height=3), backend)
    both = renderer.render_images(POSE, ("semantic", "rgb"))
    assert both.depth_m is None
    assert both.instance is None
    assert (both.rgb.shape, both.rgb.dtype) == ((3, 4, 3), np.uint8)
    assert both.semantic.dtype == np.uint8
    every = renderer.render_images(POSE)
    assert every.depth_m.dtype == np.float32
    assert every.instance.dtype == np.int32


def test_depth_of_the_images_is_that_of_the_depth_camera(furnished: Scene) -> None:
    for camera in (PINHOLE, STITCHED, ROUND):
        for backend in ("grid", *CASTERS):
            renderer = make_renderer(furnished, camera, backend)
            depth_m = renderer.render_images(POSE, ("depth",)).depth_m
            apart = np.abs(depth_m - renderer.render(POSE))
            assert np.mean(apart > 1e-3) <= 0.01, (backend, camera)


def test_colour_reaches_beyond_the_depth() -> None:
    hall = room(rows=20, cols=100)
    camera = dataclasses.replace(PINHOLE, pitch_rad=0.0, max_depth_m=1.0)
    seen = make_renderer(hall, camera, "packets").render_images(Pose2(1.0, 1.0, 0.0))
    assert seen.depth_m.max() == 1.0
    assert set(np.unique(seen.semantic)) == {
        SemanticClass.FLOOR,
        SemanticClass.WALL,
        SemanticClass.CEILING,
    }
    assert seen.semantic[0, 9] == SemanticClass.CEILING
    assert seen.semantic[-1, 9] == SemanticClass.FLOOR


def test_rays_that_leave_the_building_show_nothing(furnished: Scene) -> None:
    mesh = furnished.mesh
    floor = mesh.face_semantic == SemanticClass.FLOOR
    open_air = dataclasses.replace(
        furnished,
        imported_mesh=SceneMesh(
            mesh.vertices_m,
            mesh.faces[floor],
            mesh.face_semantic[floor],
            mesh.face_instance[floor],
        ),
    )
    for backend in (*CASTERS, "reference"):
        camera = dataclasses.replace(PINHOLE, width=3, height=2, pitch_rad=0.0)
        seen = make_renderer(open_air, camera, backend).render_images(POSE)
        assert (seen.semantic[0] == SEMANTIC_OF_NOTHING).all()
        assert (seen.instance[0] == INSTANCE_OF_NOTHING).all()
        assert (seen.rgb[0] == LIGHT.escape).all()
        assert (seen.depth_m[0] == np.float32(camera.max_depth_m)).all()
        assert (seen.semantic[1] == SemanticClass.FLOOR).all()


def test_corners_are_darker_than_the_middle_of_a_wall() -> None:
    scene = painted(room(rows=80, cols=80), None)
    camera = PinholeCamera(width=81, height=61, hfov_rad=2.0)
    rgb = make_renderer(scene, camera, "packets").render_images(Pose2(2.0, 2.0, 0.0), ("rgb",)).rgb
    middle = rgb[30].astype(int).sum(axis=-1)
    left = np.abs(np.diff(middle)).argmax()  # somewhere near one of the two corners
    assert middle[40] > 1.15 * middle[max(0, left - 2) : left + 3].min()


def test_walls_of_a_corner_differ_in_brightness() -> None:
    scene = painted(room(rows=80, cols=80), None)
    camera = PinholeCamera(width=3, height=1, hfov_rad=0.1)
    brightness = [
        make_renderer(scene, camera, "packets")
        .render_images(Pose2(2.0, 2.0, yaw), ("rgb",))
        .rgb.mean()
        for yaw in (0.0, math.pi / 2)
    ]
    assert abs(brightness[0] - brightness[1]) > 3


def test_glowing_things_are_brighter() -> None:
    dim, lit = (
        make_renderer(painted(room(), None, emission=glow), PINHOLE, "packets")
        .render_images(Pose2(1.0, 2.0, 0.0), ("rgb",))
        .rgb.mean()
        for glow in (0.0, 0.5)
    )
    assert lit > dim + 20


def test_texture_is_the_right_way_up_on_a_wall() -> None:
    # Red above and blue below, one repeat over a wall from floor to ceiling.
    texture = np.zeros((64, 64, 3), np.uint8)
    texture[:32, :, 0] = 255
    texture[32:, :, 2] = 255
    scene = room()
    mesh = scene.mesh
    z_m = mesh.vertices_m[mesh.faces][:, :, 2]
    uv = np.stack([np.zeros_like(z_m), z_m / scene.ceiling_m], axis=-1).astype(np.float32)
    striped = with_mesh(
        scene,
        materials=(Material("flag", (1.0, 1.0, 1.0), texture),),
        face_material=np.zeros(len(mesh.faces), np.int32),
        corner_uv=uv,
    )
    camera = PinholeCamera(width=3, height=40, hfov_rad=0.08, mount_height_m=1.25)
    for backend in (*CASTERS, "reference"):
        seen = make_renderer(striped, camera, backend).render_images(Pose2(1.0, 2.0, 0.0))
        wall = seen.semantic[:, 1] == SemanticClass.WALL
        red, _, blue = seen.rgb[wall][:, 1].astype(int).T
        assert red[0] > 50 > blue[0]
        assert blue[-1] > 50 > red[-1]


def test_panorama_is_four_pinholes_side_by_side(furnished: Scene) -> None:
    turns = {0.0: slice(18, 30), math.pi / 2: slice(6, 18), -math.pi / 2: slice(30, 42)}
    for backend in ("grid", *CASTERS):
        whole = make_renderer(furnished, STITCHED, backend)
        quarter = make_renderer(furnished, STITCHED.quarter, backend)
        depth_m, images = whole.render(POSE), whole.render_images(POSE)
        for turn, columns in turns.items():
            pose = Pose2(POSE.x_m, POSE.y_m, POSE.yaw_rad + turn)
            np.testing.assert_allclose(depth_m[:, columns], quarter.render(pose), atol=1e-3)
            one = quarter.render_images(pose)
            assert np.mean(images.semantic[:, columns] != one.semantic) <= 0.02
            assert np.median(np.abs(images.rgb[:, columns].astype(int) - one.rgb)) <= 1
        behind = quarter.render(Pose2(POSE.x_m, POSE.y_m, POSE.yaw_rad + math.pi))
        np.testing.assert_allclose(depth_m[:, :6], behind[:, 6:], atol=1e-3)
        np.testing.assert_allclose(depth_m[:, 42:], behind[:, :6], atol=1e-3)


@pytest.mark.parametrize("kind", ["stitched", "equirectangular"])
def test_panorama_looks_forward_in_the_middle_and_left_of_that_to_the_left(kind: str) -> None:
    rays = PanoramaCamera(height=4, width=64, kind=kind).rays_in_robot()
    yaw = np.degrees(np.arctan2(rays[1, :, 1], rays[1, :, 0]))
    assert (np.diff(yaw) < 0).all()
    assert yaw[0] > 175
    assert abs(yaw[31] + yaw[32]) < 1e-3
    assert yaw[31] > 0
    assert rays[0, 0, 2] > 0 > rays[3, 0, 2]


def test_equirectangular_depth_is_the_length_of_the_ray() -> None:
    hall = room(rows=40, cols=40)
    camera = PanoramaCamera(height=3, width=8, kind="equirectangular", max_depth_m=9.0)
    for backend in ("grid", *CASTERS, "reference"):
        depth_m = make_renderer(hall, camera, backend).render(Pose2(3.0, 2.0, 0.0))
        # Half a step (22.5 degrees) off the axis, a wall 0.9 m away.
        np.testing.assert_allclose(depth_m[1, 3:5], 0.9 / math.cos(math.pi / 8), atol=1e-4)


def test_auto_casts_equal_angles_and_walks_stitched_panoramas(furnished: Scene) -> None:
    assert make_renderer(furnished, ROUND).backend == "packets"
    assert make_renderer(furnished, STITCHED).backend == "grid"


@pytest.mark.parametrize(
    ("modalities", "message"),
    [(("rbg",), "did you mean 'rgb'"), ((), "at least one"), ("rgb", "must be a list")],
)
def test_unknown_modalities_are_refused(
    modalities: object, message: str, furnished: Scene
) -> None:
    for backend in ("auto", *CASTERS, "reference"):
        with pytest.raises(InputError, match=message):
            make_renderer(furnished, PINHOLE, backend).render_images(POSE, modalities)


@pytest.mark.parametrize(
    "sizes",
    [
        {"width": 12},
        {"height": 0},
        {"height": 300, "kind": "equirectangular"},
        {"kind": "fisheye"},
        {"max_depth_m": math.inf},
    ],
)
def test_impossible_panoramas_are_refused(sizes: dict[str, object]) -> None:
    with pytest.raises(InputError, match="PanoramaCamera"):
        PanoramaCamera(**sizes)


def test_same_pose_gives_the_same_images(furnished: Scene) -> None:
    renderer = make_renderer(furnished, STITCHED, "packets")
    first = renderer.render_images(POSE)
    again = make_renderer(furnished, STITCHED, "packets").render_images(POSE)
    for name in MODALITIES:
        field = "depth_m" if name == "depth" else name
        assert getattr(first, field).tobytes() == getattr(again, field).tobytes()


def test_a_cylinder_has_equal_angles_and_level_distances() -> None:
    camera = PanoramaCamera(height=32, width=96, kind="cylindrical")
    rays = camera.rays_in_robot().astype(np.float64)
    np.testing.assert_allclose(np.hypot(rays[..., 0], rays[..., 1]), 1.0, atol=1e-6)
    yaw = np.arctan2(rays[0, :, 1], rays[0, :, 0])
    np.testing.assert_allclose(np.diff(yaw), -2 * np.pi / 96, atol=1e-5)
    np.testing.assert_allclose(np.diff(rays[:, 0, 2]), -1.4 / 32, atol=1e-6)
    assert rays[:, 0, 2].max() < 0.7
