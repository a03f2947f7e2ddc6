"""Which plans are driven."""

import numpy as np
import pytest

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.data.buildings import Building
from toponav.data.driving import Site, StartConfig, sample_start
from toponav.maps.construct import map_from_layout
from toponav.worlds.generate.office import generate_office


def mean_length_m(site: Site, longest_of: int) -> float:
    rng = np.random.default_rng(0)
    config = StartConfig(longest_of=longest_of)
    plans = [sample_start(site, config, rng)[0] for _ in range(6)]
    return float(np.mean([plan.length_m(site.building.map) for plan in plans]))


def test_longest_of_many_plans_is_long():
    scene = generate_office(0, size="small")
    site = Site(Building(scene.name, scene, map_from_layout(scene), ""), PinholeCamera(40, 30))
    assert mean_length_m(site, 12) > mean_length_m(site, 1)


def test_number_of_draws_is_checked():
    with pytest.raises(InputError, match="pairs"):
        StartConfig(longest_of=0)
