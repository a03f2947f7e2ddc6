import math

import numpy as np
import pytest

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.models.graphnav.preprocess import DepthResampler, FrameHistory
from toponav.models.graphnav.presets import ImageSpec, get_preset

COMPACT, PAPER = get_preset("compact"), get_preset("paper")
CAMERA = PinholeCamera()


def test_each_pixel_shows_the_ray_of_its_angles():
    rays = CAMERA.rays_in_robot()
    resampler = DepthResampler(CAMERA, COMPACT)
    azimuth = np.degrees(np.arctan2(rays[..., 1], rays[..., 0])).astype(np.float32)
    picture = (azimuth + 90) / 180 * 3.5
    seen = resampler(picture.astype(np.float32)) / 255 * 180 - 90
    wanted = (0.5 - (np.arange(96) + 0.5) / 96) * 150
    assert np.abs(seen - wanted[None, :]).max() < 2.0
    elevation = np.degrees(np.arctan2(rays[..., 2], np.hypot(rays[..., 0], rays[..., 1])))
    picture = ((elevation + 90) / 180 * 3.5).astype(np.float32)
    seen = resampler(picture) / 255 * 180 - 90
    wanted = (0.5 - (np.arange(32) + 0.5) / 32) * 80
    assert np.abs(seen - wanted[:, None]).max() < 2.5


def test_mirrored_frames_give_mirrored_images():
    depth = np.random.default_rng(0).uniform(0.1, 3.5, (240, 320)).astype(np.float32)
    resampler = DepthResampler(CAMERA, COMPACT)
    mirrored = resampler(np.ascontiguousarray(depth[:, ::-1]))
    # Rays that fall on a border between two pixels may take either.
    assert (mirrored == resampler(depth)[:, ::-1]).mean() > 0.99


def test_paper_sees_the_frame_as_it_is():
    depth = np.random.default_rng(0).uniform(1.0, 3.0, (240, 320)).astype(np.float32)
    image = DepthResampler(CAMERA, PAPER)(depth)
    np.testing.assert_allclose(image / 255 * 3.5, depth, atol=0.5 * 3.5 / 255 + 1e-6)


def test_a_smaller_camera_will_do():
    small = DepthResampler(PinholeCamera(160, 120), COMPACT)
    assert small(np.full((120, 160), 1.4, np.float32)).tolist() == [[102] * 96] * 32


def test_depths_are_clipped_and_holes_are_far():
    depth = np.full((240, 320), 9.0, np.float32)
    depth[:, :160] = 0.0
    assert (DepthResampler(CAMERA, COMPACT)(depth) == 255).all()
    near = DepthResampler(CAMERA, PAPER)(depth)
    assert set(np.unique(near)) == {round(0.8 / 3.5 * 255), 255}
    assert depth[0, 0] == 0.0, "the caller's frame is left alone"


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_frames_that_are_not_finite_are_refused(bad):
    depth = np.full((240, 320), 1.0, np.float32)
    depth[100:140, 100:140] = bad
    with pytest.raises(InputError, match="finite"):
        DepthResampler(CAMERA, COMPACT)(depth)


def test_frames_of_another_size_are_refused():
    with pytest.raises(InputError, match="240 rows and 320 columns, got 320 x 240"):
        DepthResampler(CAMERA, COMPACT)(np.ones((320, 240), np.float32))


@pytest.mark.parametrize(
    ("camera", "word"),
    [
        (PinholeCamera(hfov_rad=math.radians(90)), "misses part"),
        (PinholeCamera(320, 60), "misses part"),
        (PinholeCamera(pitch_rad=0.3), "tilted"),
        (PinholeCamera(max_depth_m=2.0), "2.0 m"),
    ],
)
def test_cameras_that_see_too_little_are_refused(camera, word):
    with pytest.raises(InputError, match=word):
        DepthResampler(camera, COMPACT)


def test_history_repeats_the_first_frame_then_slides():
    history = FrameHistory(4, ImageSpec(1, 1, "pinhole"))
    for value in range(6):
        history.push(np.array([[value]], np.uint8))
        stack = history.stack((3, 1, 0))[:, 0, 0].tolist()
        assert stack == [max(value - 3, 0), max(value - 1, 0), value]
    history.clear()
    history.push(np.array([[9]], np.uint8))
    assert history.stack((3, 0))[:, 0, 0].tolist() == [9, 9]
