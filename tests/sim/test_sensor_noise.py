"""Depth sensors err as their makers and users measured."""

import dataclasses

import numpy as np
import pytest

from tests.sim.buildings import furnished_room
from toponav.core.camera import PanoramaCamera, PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.render import make_renderer
from toponav.sim.sensor_noise import SENSORS, DepthSensor, DepthSensorNoise, depth_sensor

CAMERA = PinholeCamera(width=64, height=48, hfov_rad=1.0, max_depth_m=12.0)


def seen_wall(name: str, depth_m: float, **changes: object) -> np.ndarray:
    sensor = dataclasses.replace(depth_sensor(name), dropout_share=0.0, **changes)
    flat = np.full((CAMERA.height, CAMERA.width), depth_m, np.float32)
    return DepthSensorNoise(sensor, CAMERA)(flat, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("name", "depth_m", "low_m", "high_m"),
    [
        ("kinect_v1", 1.0, 0.002, 0.004),
        ("kinect_v1", 4.0, 0.02, 0.035),
        ("kinect_v2", 2.0, 0.001, 0.004),
        ("realsense_d435", 1.0, 0.003, 0.005),
        ("realsense_d435", 4.0, 0.05, 0.07),
    ],
)
def test_noise_on_a_wall_is_what_was_measured(
    name: str, depth_m: float, low_m: float, high_m: float
) -> None:
    seen = seen_wall(name, depth_m)
    assert (seen > 0).all()
    assert abs(seen.mean() - depth_m) < 0.2 * high_m
    assert low_m < seen.std() < high_m


def test_depth_comes_in_steps_of_disparity() -> None:
    seen = seen_wall("kinect_v1", 3.0)
    disparity = 0.075 * 580 / np.unique(seen).astype(np.float64)
    np.testing.assert_allclose(disparity / 0.125, np.rint(disparity / 0.125), atol=2e-3)
    assert 3 < len(np.unique(seen)) < 30


@pytest.mark.parametrize("name", SENSORS)
def test_nothing_too_near_or_too_far_is_seen(name: str) -> None:
    sensor = depth_sensor(name)
    assert (seen_wall(name, 0.5 * sensor.nearest_m) == 0).all()
    assert (seen_wall(name, 1.1 * sensor.farthest_m) == 0).all()


def test_far_pixels_drop_out_more_often() -> None:
    lost = []
    for depth_m in (1.0, 4.9):
        flat = np.full((CAMERA.height, CAMERA.width), depth_m, np.float32)
        sensor = dataclasses.replace(depth_sensor("kinect_v1"), dropout_share=0.3)
        lost.append((DepthSensorNoise(sensor, CAMERA)(flat, np.random.default_rng(1)) == 0).mean())
    assert lost[0] < 0.03
    assert 0.2 < lost[1] < 0.4


def test_a_near_thing_casts_a_shadow_on_the_wall_on_one_side() -> None:
    step = np.full((CAMERA.height, CAMERA.width), 3.0, np.float32)
    step[:, 20:40] = 1.0
    quiet = dict.fromkeys(
        ("noise_floor_m", "noise_per_m2", "tilt_noise", "edge_jitter_px", "dropout_share"), 0.0
    )
    sensor = dataclasses.replace(depth_sensor("kinect_v1"), baseline_m=0.3, **quiet)
    seen = DepthSensorNoise(sensor, CAMERA)(step, np.random.default_rng(0))
    width = round(0.3 * CAMERA.focal_px * (1 / 1.0 - 1 / 3.0))
    holes = np.flatnonzero(seen[10] == 0)
    assert abs(len(holes) - width) <= 2
    assert 20 - width - 2 <= holes.min()
    assert holes.max() <= 20


def test_time_of_flight_pixels_fly_at_edges_and_nowhere_else() -> None:
    step = np.full((CAMERA.height, CAMERA.width), 3.0, np.float32)
    step[:, :30] = 1.0
    sensor = dataclasses.replace(depth_sensor("kinect_v2"), dropout_share=0.0)
    seen = DepthSensorNoise(sensor, CAMERA)(step, np.random.default_rng(0))
    between = (seen > 1.1) & (seen < 2.9)
    assert between[:, 29].mean() > 0.3
    assert not between[:, :28].any()
    assert not between[:, 31:].any()


def test_floor_is_lost_where_rays_graze_it() -> None:
    scene = furnished_room()
    camera = PinholeCamera(width=40, height=30, hfov_rad=1.2, max_depth_m=6.0, mount_height_m=0.3)
    depth_m = make_renderer(scene, camera).render(Pose2(0.6, 0.3, 0.0))
    sensor = DepthSensor("grazing", 0.1, 6.0, grazing_rad=np.radians(75.0))
    seen = DepthSensorNoise(sensor, camera)(depth_m, np.random.default_rng(0))
    below = camera.rays_in_robot()[..., 2] < -1e-3
    on_floor = below & (np.abs(depth_m * camera.rays_in_robot()[..., 2] + 0.3) < 1e-3)
    slant = np.degrees(
        np.arccos(0.3 / (depth_m * np.linalg.norm(camera.rays_in_robot(), axis=-1)))
    )
    assert (seen[on_floor & (slant < 68)] > 0).mean() > 0.95
    assert (seen[on_floor & (slant > 82)] > 0).mean() < 0.1


def test_dark_surfaces_are_lost_far_away() -> None:
    flat = np.full((CAMERA.height, CAMERA.width), 4.0, np.float32)
    rgb = np.full((*flat.shape, 3), 255, np.uint8)
    rgb[:, :32] = 5
    noise = DepthSensorNoise(
        dataclasses.replace(depth_sensor("kinect_v2"), dropout_share=0.0), CAMERA
    )
    seen = noise(flat, np.random.default_rng(0), rgb)
    assert (seen[:, :32] == 0).mean() > 0.8
    assert (seen[:, 33:] > 0).all()


def test_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    flat = np.full((CAMERA.height, CAMERA.width), 2.0, np.float32)
    noise = DepthSensorNoise(depth_sensor("realsense_d435"), CAMERA)
    first, again, other = (noise(flat, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes() != other.tobytes()
    assert first.dtype == np.float32


def test_stitched_panorama_has_the_errors_of_its_pinholes() -> None:
    camera = PanoramaCamera(height=16, width=64)
    depth_m = make_renderer(furnished_room(), camera).render(Pose2(2.5, 1.9, 0.3))
    seen = DepthSensorNoise(depth_sensor("kinect_v1"), camera)(depth_m, np.random.default_rng(0))
    good = seen > 0
    assert 0.5 < good.mean() < 1.0
    assert np.median(np.abs(seen - depth_m)[good]) < 0.03


def test_unknown_and_impossible_sensors_are_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'kinect_v1'"):
        depth_sensor("kinect_1")
    with pytest.raises(InputError, match="pinholes"):
        DepthSensorNoise(depth_sensor("kinect_v1"), PanoramaCamera(kind="equirectangular"))
    with pytest.raises(InputError, match="nearest_m"):
        DepthSensor("odd", nearest_m=2.0, farthest_m=1.0)
    with pytest.raises(InputError, match="baseline_m"):
        DepthSensor("odd", 0.1, 1.0, disparity_step_px=0.1)
