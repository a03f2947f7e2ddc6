"""Which buildings are for training, validation and test: fixed once, by seed and by name."""

import functools
import hashlib
from collections.abc import Iterable
from typing import Literal

from toponav.worlds.generate.suites import SUITES, suite

__all__ = ["Split", "office_name", "office_seed", "split_buildings", "validation_buildings"]

Split = Literal["train", "val", "all"]

_UNSEEN_AREAS = frozenset({"area_3", "area_4"})
_VALIDATION_FRACTION = 0.1


def office_seed(suite_name: str, number: int) -> int:
    """The generator's seed of the n-th office of a suite; after the last comes the first.

    Raises:
        InputError: There is no such suite.
    """
    seeds = suite(suite_name).seeds
    return seeds[number % len(seeds)]


def office_name(seed: int) -> str:
    """What the office of this seed is called in a dataset."""
    return f"office_{seed:06d}"


def validation_buildings(names: Iterable[str]) -> frozenset[str]:
    """The buildings held out for validation: whole buildings, chosen by their names alone.

    A building keeps its side when further buildings or DAgger rounds are added. GraphNav's
    own areas are divided as in the paper (3 and 4 unseen); offices of other suites than
    `offices-train` are held out, and of all other buildings one in ten, at least one. A
    single building is all for training.
    """
    unique = sorted(set(names))
    if len(unique) < 2:
        return frozenset()
    held_out = {name for name in unique if name in _UNSEEN_AREAS or name in _unseen_offices()}
    others = [name for name in unique if not name.startswith("area_")]
    held_out |= {name for name in others if _position(name) < _VALIDATION_FRACTION}
    if not held_out:
        held_out = {min(unique, key=_position)}
    if len(held_out) == len(unique):
        held_out -= {max(unique, key=_position)}
    return frozenset(held_out)


def split_buildings(names: Iterable[str], split: Split) -> frozenset[str]:
    """The buildings of one side of the division."""
    everything = frozenset(names)
    if split == "all":
        return everything
    held_out = validation_buildings(everything)
    return held_out if split == "val" else everything - held_out


@functools.cache
def _unseen_offices() -> frozenset[str]:
    suites = [one for one in SUITES if one.generator == "office" and one.name != "offices-train"]
    return frozenset(office_name(seed) for one in suites for seed in one.seeds)


def _position(name: str) -> float:
    """A number in [0, 1) that depends on the name alone."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2**64
