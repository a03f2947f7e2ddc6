"""Every camera sees what the slow and obvious one sees."""

import dataclasses
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tests.sim.buildings import CEILING_M, CELL_M, furnished_room, room
from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render import make_renderer, packets
from toponav.sim.render.packets import PacketsRenderer
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import GridFrame, Scene, scene_from_heights

FAST = ["grid", "packets", "embreex"]
SMALL = PinholeCamera(width=15, height=10)
# Poses in the furnished room: open floor, a millimetre from walls, along walls, over a bench.
POSES = [
    Pose2(2.53, 1.94, 0.7),
    Pose2(0.1011, 2.03, math.pi),
    Pose2(0.1011, 2.03, math.pi / 2),
    Pose2(5.899, 3.899, 0.8),
    Pose2(2.95, 2.13, 0.0),
    Pose2(4.85, 1.25, -2.0),
    Pose2(1.0, 1.0, 0.0),
    Pose2(2.0, 3.0, -math.pi / 2),
]


def assert_all_see_what_the_reference_sees(
    scene: Scene, camera: PinholeCamera, pose: Pose2
) -> None:
    """Each pixel lies between what the reference sees when nudged by a tenth of a millimetre.

    Where a ray grazes an edge, both sides of the edge are right answers.
    """
    nudged = []
    for dx, dy, dz, turn in _NUDGES:
        near = dataclasses.replace(camera, mount_height_m=camera.mount_height_m + dz)
        near_pose = Pose2(pose.x_m + dx, pose.y_m + dy, pose.yaw_rad + turn)
        nudged.append(make_renderer(scene, near, "reference").render(near_pose))
    lowest, highest = np.min(nudged, axis=0), np.max(nudged, axis=0)
    for backend in FAST:
        seen = make_renderer(scene, camera, backend).render(pose)
        assert (seen >= lowest - 1e-3).all(), backend
        assert (seen <= highest + 1e-3).all(), backend


_NUDGES = 1e-4 * np.array(
    [(0, 0, 0, 0), (1, 1, 1, 1), (1, -1, -1, -1), (-1, 1, -1, 1), (-1, -1, 1, -1)]
)


@pytest.fixture(scope="module")
def furnished() -> Scene:
    return furnished_room()


@pytest.mark.parametrize("pose", POSES)
def test_fast_cameras_see_what_the_reference_sees(pose: Pose2, furnished: Scene) -> None:
    assert_all_see_what_the_reference_sees(furnished, SMALL, pose)


@pytest.mark.parametrize("pitch_rad", [-0.6, 0.3, 1.2])
def test_pitched_cameras_see_what_the_reference_sees(pitch_rad: float, furnished: Scene) -> None:
    camera = dataclasses.replace(SMALL, pitch_rad=pitch_rad)
    for pose in POSES[:2]:
        assert_all_see_what_the_reference_sees(furnished, camera, pose)


@st.composite
def random_plans(draw: st.DrawFn) -> tuple[np.ndarray, tuple[float, float]]:
    """Heights, and a camera's place in cells, not inside an obstacle."""
    shape = draw(st.tuples(st.integers(3, 9), st.integers(3, 9)))
    some_height = st.sampled_from([0.0, 0.0, 0.0, 0.0, 0.2, 0.6, 1.1, CEILING_M])
    heights_m = draw(hnp.arrays(np.float64, shape, elements=some_height))
    row, col = (draw(st.integers(0, size - 1)) for size in shape)
    heights_m[row, col] = 0.0
    within = st.floats(0.01, 0.99)
    return heights_m, (row + draw(within), col + draw(within))


# Without shrinking: a failing view is small already, and the reference is slow.
@settings(
    max_examples=40, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate]
)
@given(
    plan=random_plans(),
    yaw_rad=st.one_of(st.sampled_from([0.0, math.pi / 2, -math.pi]), st.floats(-4, 4)),
    image=st.tuples(st.integers(1, 9), st.integers(1, 7)),
    pitch_rad=st.sampled_from([0.0, 0.0, 0.5]),
    max_depth_m=st.sampled_from([0.5, 1.0, 3.5]),
)
def test_fast_cameras_agree_in_random_buildings(
    plan: tuple[np.ndarray, tuple[float, float]],
    yaw_rad: float,
    image: tuple[int, int],
    pitch_rad: float,
    max_depth_m: float,
) -> None:
    heights_m, (row, col) = plan
    grid = GridFrame(0.25, (-3.0, 7.0), *heights_m.shape)
    scene = scene_from_heights("random", grid, heights_m, ceiling_m=CEILING_M)
    camera = PinholeCamera(*image, pitch_rad=pitch_rad, max_depth_m=max_depth_m)
    pose = Pose2(-3.0 + 0.25 * col, 7.0 + 0.25 * row, yaw_rad)
    assert_all_see_what_the_reference_sees(scene, camera, pose)


@pytest.mark.parametrize("backend", [*FAST, "reference"])
def test_depth_is_measured_along_the_axis_even_75_degrees_off_it(backend: str) -> None:
    # Facing a flat wall 1 m away in a wide hall: every pixel of the horizon reads 1 m.
    hall = room(rows=100, cols=30)
    camera = PinholeCamera(width=40, height=3)
    depth_m = make_renderer(hall, camera, backend).render(Pose2(1.9, 5.0, 0.0))
    np.testing.assert_allclose(depth_m[1], 1.0, atol=1e-5)


@pytest.mark.parametrize("backend", [*FAST, "reference"])
def test_floor_depth_follows_from_the_camera_height(backend: str) -> None:
    camera = PinholeCamera(width=4, height=4, hfov_rad=math.pi / 2)
    depth_m = make_renderer(room(), camera, backend).render(Pose2(1.0, 2.0, 0.0))
    # The lowest row looks down by 1.5 / 2 of the depth.
    np.testing.assert_allclose(depth_m[3], 0.6 / 0.75, atol=1e-5)


@pytest.mark.parametrize("backend", [*FAST, "reference"])
def test_depth_is_clipped_at_the_maximum(backend: str) -> None:
    camera = dataclasses.replace(SMALL, max_depth_m=0.8)
    depth_m = make_renderer(room(), camera, backend).render(Pose2(2.0, 2.0, 0.0))
    assert depth_m.max() == np.float32(0.8)
    assert depth_m.shape == (camera.height, camera.width)
    assert depth_m.dtype == np.float32


@pytest.mark.parametrize("backend", FAST)
def test_same_pose_gives_the_same_bytes_in_a_new_array(backend: str, furnished: Scene) -> None:
    renderer = make_renderer(furnished, SMALL, backend)
    first = renderer.render(POSES[0])
    kept = first.tobytes()
    renderer.render(POSES[1])
    assert first.tobytes() == kept == renderer.render(POSES[0]).tobytes()


def test_grid_edge_is_a_wall() -> None:
    grid = GridFrame(CELL_M, (0.0, 0.0), 20, 20)
    scene = scene_from_heights("open", grid, np.zeros((20, 20)), ceiling_m=CEILING_M)
    for backend in [*FAST, "reference"]:
        depth_m = make_renderer(scene, PinholeCamera(1, 1), backend).render(Pose2(0.5, 1.0, 0.0))
        np.testing.assert_allclose(depth_m, 1.5, atol=1e-5)


def test_packets_survive_a_heading_a_hair_off_an_axis() -> None:
    # Embree's coherent packets miss walls when a direction component is below 1e-18.
    heights_m = np.zeros((3, 3))
    heights_m[0, 2] = 0.2
    scene = scene_from_heights("tiny", GridFrame(0.25, (0.0, 0.0), 3, 3), heights_m)
    camera = PinholeCamera(9, 1)
    pose = Pose2(0.125, 0.125, -6.3e-22)
    seen, expected = (make_renderer(scene, camera, b).render(pose) for b in ("packets", "grid"))
    np.testing.assert_allclose(seen, expected, atol=1e-5)


def test_hits_name_the_face_and_the_place_on_it(furnished: Scene) -> None:
    renderer = PacketsRenderer(furnished, SMALL)
    pose = Pose2(2.53, 1.94, 0.0)
    depth_m, face, uv = renderer.hits(pose)
    np.testing.assert_array_equal(depth_m, renderer.render(pose))
    seen = face >= 0
    assert seen.any()
    assert (depth_m[~seen] == SMALL.max_depth_m).all()
    corners = furnished.mesh.vertices_m[furnished.mesh.faces[face[seen]]]
    u, v = uv[seen].T[..., None]
    on_face = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    rays = SMALL.rays_in_robot()[seen] * depth_m[seen][:, None]
    on_ray = rays + np.array([pose.x_m, pose.y_m, SMALL.mount_height_m])
    np.testing.assert_allclose(on_face, on_ray, atol=1e-4)


def test_auto_walks_plans_and_casts_packets_at_meshes(furnished: Scene) -> None:
    scanned = dataclasses.replace(furnished, imported_mesh=furnished.mesh)
    assert make_renderer(furnished, SMALL).backend == "grid"
    assert make_renderer(scanned, SMALL).backend == "packets"


def test_auto_falls_back_to_plain_embreex(
    furnished: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    scanned = dataclasses.replace(furnished, imported_mesh=furnished.mesh)
    monkeypatch.setattr(packets, "load_library", lambda: None)
    assert make_renderer(scanned, SMALL).backend == "embreex"
    with pytest.raises(InputError, match=r"could not be reached.*Remedy: use backend='auto'"):
        make_renderer(scanned, SMALL, "packets")


def test_grid_refuses_a_scanned_mesh(furnished: Scene) -> None:
    scanned = dataclasses.replace(furnished, imported_mesh=furnished.mesh)
    with pytest.raises(InputError, match="needs an extruded plan"):
        make_renderer(scanned, SMALL, "grid")


def test_unknown_backend_names_the_nearest(furnished: Scene) -> None:
    with pytest.raises(InputError, match="did you mean 'packets'"):
        make_renderer(furnished, SMALL, "packet")


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (Pose2(math.nan, 1.0, 0.0), "must be finite"),
        (Pose2(1.0, 1.0, math.inf), "must be finite"),
        (Pose2(-1.0, 1.0, 0.0), "inside the scene"),
        (Pose2(3.15, 2.15, 0.0), "cannot be inside an obstacle"),
    ],
)
@pytest.mark.parametrize("backend", [*FAST, "reference"])
def test_impossible_viewpoints_are_refused(
    backend: str, pose: Pose2, message: str, furnished: Scene
) -> None:
    with pytest.raises(InputError, match=message):
        make_renderer(furnished, SMALL, backend).render(pose)


@pytest.mark.parametrize("backend", [*FAST, "reference"])
def test_camera_above_the_ceiling_is_refused(backend: str, furnished: Scene) -> None:
    camera = dataclasses.replace(SMALL, mount_height_m=CEILING_M)
    with pytest.raises(InputError, match="must be below the ceiling"):
        make_renderer(furnished, camera, backend)


def test_grid_and_packets_agree_on_a_real_floor(areas_dir) -> None:
    from toponav.worlds.load.stanford import load_area

    scene = load_area(areas_dir / "area_3.yaml")
    camera = PinholeCamera(width=80, height=60)
    grid, packet = (make_renderer(scene, camera, name) for name in ("grid", "packets"))
    cells = np.argwhere(FreeSpace.of(scene, 0.2).free)
    rng = np.random.default_rng(0)
    differing = 0
    for row, col in cells[rng.integers(len(cells), size=40)]:
        pose = Pose2(*scene.grid.center_of(int(row), int(col)), float(rng.uniform(-3, 3)))
        differing += int((np.abs(grid.render(pose) - packet.render(pose)) > 2e-3).sum())
    # A pixel in ten thousand may graze an edge.
    assert differing <= 40 * 80 * 60 // 10_000


@pytest.mark.skipif(not packets.packets_available(), reason="needs embreex")
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts threads as Linux does")
def test_many_buildings_leave_no_thread_behind():
    """Embree's scheduler spins on a core of its own where a process has several devices."""
    program = (
        "import os\n"
        "from tests.sim.buildings import furnished_room\n"
        "from toponav.core.camera import PinholeCamera\n"
        "from toponav.sim.render.packets import PacketsRenderer\n"
        "def threads(): return len(os.listdir('/proc/self/task'))\n"
        "first = PacketsRenderer(furnished_room(), PinholeCamera(width=15, height=10))\n"
        "before = threads()\n"
        "others = [PacketsRenderer(furnished_room(), first.camera) for _ in range(3)]\n"
        "print(threads() - before)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120
    )
    assert found.stdout.split() == ["0"]
