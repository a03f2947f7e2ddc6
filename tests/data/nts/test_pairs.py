"""Pairs of panoramas come balanced, in order, and never all at once."""

import math

import numpy as np
import pytest

from tests.sim.two_rooms import two_rooms
from toponav.core.errors import InputError
from toponav.core.imagenav import bin_of_direction
from toponav.data.nts.ground import Ground
from toponav.data.nts.labels import HomeLabels, home_labels
from toponav.data.nts.pairs import PairStream


def labels(seed: int, count: int) -> HomeLabels:
    ground = Ground.of(two_rooms())
    rng = np.random.default_rng(seed)
    cells = ground.cells[rng.integers(len(ground.cells), size=count)]
    yaw_rad = rng.uniform(-math.pi, math.pi, (count, 1))
    return home_labels(ground, np.concatenate([ground.centers_of(cells), yaw_rad], axis=1))


@pytest.fixture(scope="module")
def homes() -> list[HomeLabels]:
    return [labels(0, 7), labels(1, 12)]


def test_in_order_every_pair_comes_once(homes: list[HomeLabels]) -> None:
    stream = PairStream(homes)
    assert len(stream) == 7 * 7 + 12 * 12
    batches = list(stream.in_order(50))
    assert [len(batch) for batch in batches] == [50, 50, 50, 43]
    pairs = {
        pair
        for batch in batches
        for pair in zip(
            batch.home.tolist(), batch.source.tolist(), batch.goal.tolist(), strict=True
        )
    }
    assert len(pairs) == len(stream)


def test_a_row_holds_its_home_s_labels(homes: list[HomeLabels]) -> None:
    for batch in PairStream(homes).in_order(64):
        for row in range(len(batch)):
            home = homes[batch.home[row]]
            at = batch.source[row], batch.goal[row]
            assert batch.same_node[row] == home.same_node[at]
            assert batch.distance_m[row] == home.distance_m[at]
            assert batch.direction[row] == bin_of_direction(float(home.bearing_rad[at]))
            assert (batch.explorable[row] == home.explorable[at[0]]).all()
            assert batch.score[row] == pytest.approx(
                np.exp(-home.via_m[at].astype(np.float32) / 5.0)
            )


def test_the_two_kinds_are_balanced_when_asked(homes: list[HomeLabels]) -> None:
    stream = PairStream(homes)
    rng = np.random.default_rng(0)
    balanced = next(stream.random(4000, rng, same_node_fraction=0.5))
    assert balanced.same_node.mean() == pytest.approx(0.5, abs=0.05)
    as_they_come = next(stream.random(4000, rng, same_node_fraction=None))
    assert as_they_come.same_node.mean() == pytest.approx(stream.same_node_fraction, abs=0.05)


def test_the_same_generator_gives_the_same_pairs(homes: list[HomeLabels]) -> None:
    first, again = (next(PairStream(homes).random(32, np.random.default_rng(3))) for _ in range(2))
    assert all((getattr(first, name) == value).all() for name, value in vars(again).items())


def test_a_home_of_one_node_gives_pairs_of_one_node(homes: list[HomeLabels]) -> None:
    alone = PairStream([labels(2, 1)])
    batch = next(alone.random(8, np.random.default_rng(0), same_node_fraction=0.0))
    assert batch.same_node.all()


def test_nothing_to_pair_is_refused(homes: list[HomeLabels]) -> None:
    with pytest.raises(InputError, match="at least one home"):
        PairStream([])
    with pytest.raises(InputError, match=r"0\.\.1"):
        next(PairStream(homes).random(8, np.random.default_rng(0), same_node_fraction=2.0))
