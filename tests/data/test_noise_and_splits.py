import numpy as np
import pytest

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.data.noise import NoiseConfig, VelocityNoise
from toponav.data.splits import office_name, office_seed, split_buildings, validation_buildings


def test_noise_follows_the_papers_recursion() -> None:
    noise, random = VelocityNoise(NoiseConfig()), np.random.default_rng(1)
    draws = np.random.default_rng(1).standard_normal((3, 2)) * (0.2, 1.0)
    z = np.zeros(2)
    for n in draws:
        z = 0.95 * z + 0.05 * n
        told = noise.apply(Velocity(0.4, -0.1), random)
        assert (told.linear_m_s, told.angular_rad_s) == pytest.approx((0.4 + z[0], -0.1 + z[1]))


def test_noise_settles_at_the_documented_amplitude_times_the_scale() -> None:
    noise, random = VelocityNoise(NoiseConfig(noise_scale=2.0)), np.random.default_rng(0)
    told = [noise.apply(Velocity(0.0, 0.0), random) for _ in range(20_000)]
    assert np.std([v.linear_m_s for v in told]) == pytest.approx(2 * 0.032, rel=0.15)
    assert np.std([v.angular_rad_s for v in told]) == pytest.approx(2 * 0.16, rel=0.15)


def test_no_noise_executes_what_the_expert_says() -> None:
    noise = VelocityNoise(NoiseConfig(noise_scale=0.0))
    assert noise.apply(Velocity(0.3, 0.2), np.random.default_rng(0)) == Velocity(0.3, 0.2)


def test_a_bad_noise_is_refused_by_flag() -> None:
    with pytest.raises(InputError, match=r"--noise-scale: .*got -1"):
        NoiseConfig(noise_scale=-1.0)


def test_a_building_keeps_its_side_when_others_come() -> None:
    some = [office_name(seed) for seed in range(100)]
    more = [office_name(seed) for seed in range(400)]
    assert validation_buildings(some) == validation_buildings(more) & set(some)
    assert 0.05 < len(validation_buildings(more)) / 400 < 0.16


def test_both_sides_are_there_as_soon_as_there_are_two_buildings() -> None:
    for first in range(20):
        pair = [office_name(first), office_name(first + 1)]
        train, val = split_buildings(pair, "train"), split_buildings(pair, "val")
        assert len(train) == len(val) == 1
        assert train | val == split_buildings(pair, "all")
    assert split_buildings(["x"], "train") == {"x"}


def test_areas_are_divided_as_in_the_paper() -> None:
    areas = ["area_1", "area_5b", "area_6", "area_3"]
    assert validation_buildings(areas) == {"area_3"}


def test_offices_of_the_test_suite_are_never_for_training() -> None:
    test = office_name(office_seed("offices-test", 0))
    names = [test, *(office_name(seed) for seed in range(30))]
    assert test in validation_buildings(names)


def test_an_unknown_suite_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'offices-train'"):
        office_seed("office-train", 0)
