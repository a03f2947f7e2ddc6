import math

import pytest

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError, did_you_mean
from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.vocabulary import Difficulty


def test_wrap_angle_stays_below_pi() -> None:
    assert wrap_angle(math.pi) == pytest.approx(-math.pi)


def test_relative_pose_composes_back() -> None:
    origin, pose = Pose2(1.0, 2.0, 0.7), Pose2(-3.0, 0.5, 2.9)
    assert origin.compose(pose.relative_to(origin)) == pytest.approx(pose)


def test_paper_camera_has_forty_three_pixels_of_focal_length() -> None:
    assert PinholeCamera().focal_px == pytest.approx(42.87, abs=0.01)


def test_rays_have_unit_depth_and_look_left_at_column_zero() -> None:
    rays = PinholeCamera(width=4, height=4, hfov_rad=1.0).rays_in_robot()
    assert (rays[..., 0] == 1).all()
    assert rays[0, 0, 1] > 0
    assert rays[0, 0, 2] > 0


def test_zero_width_camera_is_refused() -> None:
    with pytest.raises(InputError, match="width"):
        PinholeCamera(width=0)


def test_nearest_name_is_offered() -> None:
    assert "turn_left" in did_you_mean("turn_lift", ["turn_left", "straight"])


@pytest.mark.parametrize(("nodes", "level"), [(10, "I"), (11, "II"), (20, "II"), (21, "III")])
def test_difficulty_thresholds_are_the_papers(nodes: int, level: str) -> None:
    assert Difficulty.of_plan(nodes) == level
