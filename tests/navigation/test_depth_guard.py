import numpy as np
import pytest

from toponav.core.camera import PinholeCamera
from toponav.navigation.graphnav.depth_guard import fault_in_depth

CAMERA = PinholeCamera(width=8, height=6)


def frame(value: float = 1.0) -> np.ndarray:
    return np.full((6, 8), value, np.float32)


def test_a_good_frame_has_no_fault() -> None:
    assert fault_in_depth(frame(), CAMERA) == ""


@pytest.mark.parametrize(
    ("value", "said"),
    [(np.nan, "1 depth values are NaN"), (np.inf, "1 infinite"), (-1, "negative")],
)
def test_a_single_bad_value_is_named(value: float, said: str) -> None:
    depth = frame()
    depth[2, 3] = value
    assert said in fault_in_depth(depth, CAMERA)


def test_an_all_zero_frame_is_named() -> None:
    assert "all zero" in fault_in_depth(frame(0.0), CAMERA)


def test_a_wrong_size_names_both_sizes() -> None:
    assert "8x5 pixels, expected 8x6" in fault_in_depth(np.ones((5, 8), np.float32), CAMERA)
