import numpy as np
import pytest

from tests.training.synthetic import SyntheticSet
from toponav.training.motion import MotionSampler


class Straight(SyntheticSet):
    """Every frame drives 0.5 m/s and turns 0.5 rad/s."""

    def __init__(self) -> None:
        super().__init__(trajectories=2, frames_an_edge=10, rows=8, cols=16)
        self.executed = np.full_like(self.command, 0.5)


def test_motion_counts_from_the_last_entry_to_the_edge() -> None:
    data = Straight()
    frames = np.full(4000, 25)
    motion = MotionSampler(data).draw(frames, data.edge[frames], np.random.default_rng(0))
    # Frame 25 is the sixth of its edge: five commands of 0.1 m have been executed on it.
    assert np.mean([m.driven_m for m in motion]) == pytest.approx(0.5, abs=0.05)
    assert np.mean([m.turned_rad for m in motion]) == pytest.approx(0.5, abs=0.02)


def test_a_robot_that_missed_a_switch_counts_from_the_edge_before() -> None:
    data = Straight()
    frames = np.full(4000, 25)
    motion = MotionSampler(data).draw(frames, data.edge[frames - 10], np.random.default_rng(0))
    assert np.mean([m.driven_m for m in motion]) == pytest.approx(1.5, abs=0.05)


def test_the_first_edge_is_entered_on_time() -> None:
    data = Straight()
    frames = np.full(100, 5)
    motion = MotionSampler(data).draw(frames, data.edge[frames], np.random.default_rng(0))
    assert all(m.turned_rad == pytest.approx(0.5) for m in motion)


def test_nothing_is_counted_across_trajectories() -> None:
    data = Straight()
    first = int(np.flatnonzero(data.trajectory == 1)[0])
    frames = np.array([first])
    motion = MotionSampler(data).draw(frames, data.edge[frames], np.random.default_rng(0))
    assert motion[0].turned_rad == pytest.approx(0.0)
