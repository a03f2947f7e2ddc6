import dataclasses

import pytest

from toponav.core.errors import InputError
from toponav.worlds.generate.home import HELD_OUT_SEEDS
from toponav.worlds.generate.suites import (
    SUITES,
    check_frozen,
    frozen_hash,
    suite,
    suite_scene,
)
from toponav.worlds.scene import Provenance, Scene


@pytest.fixture(scope="module")
def office() -> Scene:
    return suite_scene("office", 1050)


def test_the_suites_of_homes_have_their_sizes() -> None:
    sizes = [len(suite(f"homes-{part}").seeds) for part in ("train", "val", "test")]
    assert sizes == [68, 4, 14]


def test_test_homes_alone_are_furnished_from_what_is_held_out() -> None:
    for one in SUITES:
        if one.generator == "home":
            held_out = [seed in HELD_OUT_SEEDS for seed in one.seeds]
            assert held_out == [one.name == "homes-test"] * len(held_out)


def test_every_home_of_a_suite_is_frozen() -> None:
    for one in SUITES:
        if one.generator == "home":
            assert all(frozen_hash("home", seed) for seed in one.seeds)


def test_every_office_for_testing_is_frozen() -> None:
    assert all(frozen_hash("office", seed) for seed in suite("offices-test").seeds)


def test_a_frozen_office_is_still_the_same(office: Scene) -> None:
    assert office.content_hash[:16] == frozen_hash("office", 1050)


@pytest.mark.parametrize("seed", [2006])
def test_a_frozen_home_is_still_the_same(seed: int) -> None:
    assert suite_scene("home", seed).content_hash[:16] == frozen_hash("home", seed)


def test_another_building_under_a_frozen_seed_is_refused(office: Scene) -> None:
    other = dataclasses.replace(office, provenance=Provenance("office", "1", 1051))
    with pytest.raises(InputError, match="not the frozen one"):
        check_frozen(other)


def test_buildings_beyond_the_suites_are_not_frozen() -> None:
    assert frozen_hash("home", 999_999) is None


def test_an_unknown_generator_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'home'"):
        suite_scene("hom", 1)
