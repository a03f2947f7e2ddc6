import math

import numpy as np
import pytest

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.ros.watchdog import CommandTimeout, Watchdog, WatchdogConfig

DRIVING = Velocity(0.4, 0.0)
STANDING = Velocity(0.0, 0.0)


def frame(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.5, 3.0, (24, 32)).astype(np.float32)


def watchdog() -> Watchdog:
    made = Watchdog()
    made.start(0.0)
    return made


def test_fresh_frames_and_a_quick_agent_are_no_fault() -> None:
    dog = watchdog()
    for number in range(1, 20):
        now_s = 0.2 * number
        assert dog.frame(frame(number), now_s - 0.02, now_s, DRIVING) == ""
        dog.thinking(now_s)
        assert dog.fault(now_s + 0.03) == ""
        dog.decided()
        assert dog.fault(now_s + 0.19) == ""


def test_silence_is_a_fault_after_half_a_second_and_not_before() -> None:
    dog = watchdog()
    dog.frame(frame(), 1.0, 1.0, DRIVING)
    assert dog.fault(1.5) == ""
    assert "no depth frame for 0.6 s" in dog.fault(1.56)


def test_a_run_that_never_saw_a_frame_is_faulty() -> None:
    assert "no depth frame" in watchdog().fault(0.51)


def test_frames_that_arrive_late_are_old_however_regularly_they_come() -> None:
    dog = watchdog()
    assert dog.frame(frame(1), 1.0, 1.3, DRIVING) == ""
    assert dog.fault(1.4) == ""
    assert "0.6 s old" in dog.frame(frame(2), 1.2, 1.8, DRIVING)
    assert "old" in dog.fault(1.8)


def test_a_frame_that_is_not_newer_is_no_news() -> None:
    dog = watchdog()
    dog.frame(frame(1), 1.0, 1.0, DRIVING)
    assert "not newer" in dog.frame(frame(2), 1.0, 1.4, DRIVING)
    assert dog.fault(1.55) != ""


@pytest.mark.parametrize("share", [1.0, 0.6])
def test_nan_frames_stop_at_once_until_a_good_one(share: float) -> None:
    dog = watchdog()
    bad = frame()
    bad.ravel()[: int(share * bad.size)] = math.nan
    assert "NaN" in dog.frame(bad, 0.2, 0.2, DRIVING)
    assert "NaN" in dog.fault(0.21)
    assert dog.frame(frame(1), 0.4, 0.4, STANDING) == ""
    assert dog.fault(0.41) == ""


def test_a_few_nan_pixels_are_holes() -> None:
    bad = frame()
    bad[:5] = math.nan
    assert watchdog().frame(bad, 0.2, 0.2, DRIVING) == ""


def test_frozen_frames_stop_a_driving_robot_and_keep_it_stopped() -> None:
    dog = watchdog()
    found = [dog.frame(frame(), 0.2 * n, 0.2 * n, DRIVING) for n in range(1, 5)]
    assert found[:3] == ["", "", ""]
    assert "frozen" in found[3]
    assert "frozen" in dog.frame(frame(), 1.0, 1.0, STANDING)
    assert dog.frame(frame(1), 1.2, 1.2, STANDING) == ""


def test_a_standing_robot_may_see_the_same_for_ever() -> None:
    dog = watchdog()
    assert {dog.frame(frame(), 0.2 * n, 0.2 * n, STANDING) for n in range(1, 50)} == {""}


def test_floor_and_ceiling_alone_are_not_frozen() -> None:
    rows = np.linspace(0.5, 3.0, 24, dtype=np.float32)
    flat = np.repeat(rows[:, None], 32, axis=1)
    dog = watchdog()
    assert {dog.frame(flat, 0.2 * n, 0.2 * n, DRIVING) for n in range(1, 20)} == {""}


def test_an_agent_that_does_not_answer_is_dead() -> None:
    dog = watchdog()
    for number in range(1, 5):
        dog.frame(frame(number), 0.2 * number, 0.2 * number, DRIVING)
        if number == 1:
            dog.thinking(0.2)
    assert "has not answered for 0.6 s" in dog.fault(0.81)
    dog.decided()
    assert dog.fault(0.81) == ""


def test_thresholds_must_be_positive() -> None:
    with pytest.raises(InputError, match="max_age_s"):
        WatchdogConfig(max_age_s=0.0)


def test_a_command_lasts_half_a_second() -> None:
    timeout = CommandTimeout()
    assert timeout.current(0.0) == STANDING
    timeout.command(DRIVING, 1.0)
    assert timeout.current(1.5) == DRIVING
    assert timeout.current(1.52) == STANDING
    timeout.command(DRIVING, 2.0)
    timeout.clear()
    assert timeout.current(2.0) == STANDING


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_command_that_is_not_finite_means_zero(value: float) -> None:
    timeout = CommandTimeout()
    timeout.command(Velocity(value, 0.0), 0.0)
    assert timeout.current(0.1) == STANDING
