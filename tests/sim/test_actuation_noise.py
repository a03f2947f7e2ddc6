"""The LoCoBot's noise: its frame, its numbers, its refusals."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action
from toponav.sim.actuation_noise import LOCOBOT_FILE, locobot_noise, read_motion_noise


def shared_file() -> Path:
    default = Path(__file__).parents[3] / "shared" / "data"
    return Path(os.environ.get("TOPONAV_DATA", default)) / "locobot_noise.json"


def test_left_turns_left_and_right_turns_right() -> None:
    noise = locobot_noise()
    assert noise.actuation[Action.LEFT].mean[2] == pytest.approx(math.radians(11.26), abs=0.01)
    assert noise.actuation[Action.RIGHT].mean[2] == pytest.approx(-math.radians(11.09), abs=0.01)
    # The robot turns about a point beside its own: it drifts to the side that it turns to.
    assert noise.actuation[Action.LEFT].mean[1] == pytest.approx(0.0196, abs=1e-3)
    assert noise.actuation[Action.RIGHT].mean[1] == pytest.approx(-0.0195, abs=1e-3)


def test_forward_drives_about_a_quarter_of_a_metre() -> None:
    mean = locobot_noise().actuation[Action.FORWARD].mean
    assert mean[0] == pytest.approx(0.2456, abs=1e-3)
    assert abs(mean[1]) < 0.003
    assert abs(mean[2]) < math.radians(0.02)


def test_the_odometry_misses_the_drift_of_turns() -> None:
    noise = locobot_noise()
    for action in (Action.LEFT, Action.RIGHT):
        drift_m = noise.actuation[action].mean[1]
        error_m = noise.odometry[action].mean[1]
        assert drift_m + error_m == pytest.approx(0.0, abs=1e-3)


def test_draws_have_the_mixture_s_mean_and_spread() -> None:
    mixture = locobot_noise().actuation[Action.FORWARD]
    rng = np.random.default_rng(0)
    draws = np.array([mixture.sample(rng) for _ in range(4000)])
    offset = mixture.means - mixture.mean
    covariance = np.einsum(
        "k,kij->ij",
        mixture.weights,
        mixture.covariances + offset[:, :, None] * offset[:, None, :],
    )
    error = np.sqrt(np.diag(covariance) / len(draws))
    assert (np.abs(draws.mean(axis=0) - mixture.mean) < 4 * error).all()
    assert np.diag(np.cov(draws.T)) == pytest.approx(np.diag(covariance), rel=0.1)


def test_stop_moves_nothing_and_is_read_exactly() -> None:
    rng = np.random.default_rng(0)
    still = Pose2(0.0, 0.0, 0.0)
    assert locobot_noise().motion(Action.STOP, rng) == still
    assert locobot_noise().reading(Action.STOP, still, rng) == still


def test_the_numbers_are_those_that_were_published() -> None:
    if not shared_file().is_file():
        pytest.skip(f"no {shared_file()}; set TOPONAV_DATA")
    given = json.loads(shared_file().read_text())
    ours = json.loads(LOCOBOT_FILE.read_text())
    assert {name: ours[name] for name in given} == given
    assert "MIT" in ours["licence"]
    assert "Neural-SLAM" in ours["source"]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda noise: noise.pop("sensor_noise_left"), "missing"),
        (lambda noise: noise["actuation_noise_fwd"].update(weights=[0.5, 0.2]), "add up"),
        (lambda noise: noise["actuation_noise_fwd"].update(means=[[1, 2]]), "misshapen"),
        (
            lambda noise: noise["actuation_noise_right"].update(
                covariances=[[[-1, 0, 0], [0, 1, 0], [0, 0, 1]]]
            ),
            "not negative",
        ),
    ],
)
def test_a_broken_file_is_refused(spoil, message: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    noise = json.loads(LOCOBOT_FILE.read_text())
    spoil(noise)
    path = tmp_path / "noise.json"
    path.write_text(json.dumps(noise))
    with pytest.raises(InputError, match=message):
        read_motion_noise(path)
