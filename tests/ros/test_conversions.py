import math

import numpy as np
import pytest

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.image_messages import (
    CameraModel,
    Reprojector,
    color_of_image,
    depth_of_image,
    pose_in_map,
    without_holes,
)
from toponav.ros.conversions import (
    OPTICAL_ROTATION,
    Quaternion,
    nanoseconds,
    odometry_covariance,
    pixels_of,
    quaternion_of_yaw,
    time_parts,
    yaw_of_quaternion,
)


def rotated(rotation: Quaternion, vector: tuple[float, float, float]) -> np.ndarray:
    x, y, z, w = rotation
    axis = np.array([x, y, z])
    v = np.array(vector)
    return v + 2 * w * np.cross(axis, v) + 2 * np.cross(axis, np.cross(axis, v))


def test_the_optical_frame_looks_along_z_with_x_to_the_right() -> None:
    np.testing.assert_allclose(rotated(OPTICAL_ROTATION, (0, 0, 1)), (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(rotated(OPTICAL_ROTATION, (1, 0, 0)), (0, -1, 0), atol=1e-12)
    np.testing.assert_allclose(rotated(OPTICAL_ROTATION, (0, 1, 0)), (0, 0, -1), atol=1e-12)


@pytest.mark.parametrize("yaw", [-3.0, -0.4, 0.0, 1.0, 3.1])
def test_yaw_survives_the_quaternion(yaw: float) -> None:
    assert yaw_of_quaternion(quaternion_of_yaw(yaw)) == pytest.approx(yaw)


def test_stamps_survive() -> None:
    assert nanoseconds(*time_parts(12_345_678_901)) == 12_345_678_901


def test_metres_survive_the_message_to_the_bit() -> None:
    depth = np.random.default_rng(0).uniform(0, 3.5, (6, 8)).astype(np.float32)
    back = depth_of_image("32FC1", 6, 8, 32, False, bytes(pixels_of(depth)))
    assert back.tobytes() == depth.tobytes()


@pytest.mark.parametrize("bigendian", [False, True])
def test_millimetres_become_metres_with_padded_rows_of_either_order(bigendian: bool) -> None:
    rows = np.zeros((3, 6), ">u2" if bigendian else "<u2")
    rows[:, :4] = np.arange(12).reshape(3, 4) * 100
    depth = depth_of_image("16UC1", 3, 4, 12, bigendian, rows.tobytes())
    np.testing.assert_allclose(depth, np.arange(12).reshape(3, 4) * 0.1, atol=1e-6)


@pytest.mark.parametrize(
    ("encoding", "height", "step", "size"),
    [("rgb8", 2, 8, 16), ("32FC1", 2, 8, 15), ("32FC1", 0, 8, 16), ("32FC1", 2, 4, 16)],
)
def test_images_that_lie_are_refused(encoding: str, height: int, step: int, size: int) -> None:
    with pytest.raises(InputError, match="remap"):
        depth_of_image(encoding, height, 2, step, False, bytes(size))


def test_colour_comes_as_red_green_blue() -> None:
    assert color_of_image("bgr8", 1, 1, 3, bytes([1, 2, 3])).tolist() == [[[3, 2, 1]]]
    assert color_of_image("rgba8", 1, 1, 4, bytes([1, 2, 3, 4])).tolist() == [[[1, 2, 3]]]


def test_holes_become_zero_and_out_of_range_the_maximum() -> None:
    depth = np.array([[math.nan, math.inf, -math.inf, 9.0, 1.0]], np.float32)
    assert without_holes(depth, 3.5).tolist() == [[0.0, 3.5, 0.0, 3.5, 1.0]]


def test_a_camera_that_fits_is_not_touched() -> None:
    camera = PinholeCamera()
    depth = np.ones((240, 320), np.float32)
    assert Reprojector(CameraModel.of(camera), camera)(depth) is depth


def test_a_narrow_camera_fills_the_middle_and_leaves_holes() -> None:
    wide = PinholeCamera()
    narrow = CameraModel(640, 480, 525.0, 525.0, 319.5, 239.5)
    project = Reprojector(narrow, wide)
    columns = np.tile(np.arange(640, dtype=np.float32) + 1, (480, 1))
    seen = project(columns)
    assert seen[120, 160] == pytest.approx(320, abs=8)
    assert seen[120, 0] == 0.0
    assert 0.005 < project.seen_share < 0.1
    assert narrow.hfov_rad == pytest.approx(2 * math.atan(320 / 525))


def test_a_frame_of_another_size_than_camera_info_is_refused() -> None:
    project = Reprojector(CameraModel.of(PinholeCamera()), PinholeCamera())
    with pytest.raises(InputError, match="camera_info says 320x240"):
        project(np.ones((4, 4), np.float32))


def test_an_uncalibrated_camera_is_refused() -> None:
    with pytest.raises(InputError, match="focal lengths"):
        Reprojector(CameraModel(320, 240, 0.0, 0.0, 0.0, 0.0), PinholeCamera())


def test_covariances_are_symmetric_and_positive() -> None:
    matrix = odometry_covariance(0.01, 0.02).reshape(6, 6)
    assert (np.linalg.eigvalsh(matrix) > 0).all()


def test_odometry_is_carried_into_the_map() -> None:
    pose = pose_in_map(Pose2(6.0, 5.0, 0.0), Pose2(5.0, 5.0, 0.0), Pose2(2.0, 3.0, math.pi / 2))
    assert pose == pytest.approx((2.0, 4.0, math.pi / 2))
