"""Which buildings are for training, validation and test: fixed once, by seed and by name."""

import hashlib
from collections.abc import Iterable
from typing import Final, Literal

from toponav.core.errors import InputError, did_you_mean

__all__ = ["OFFICE_SUITES", "Split", "office_seed", "split_buildings", "validation_buildings"]

Split = Literal["train", "val", "all"]

OFFICE_SUITES: Final = {
    "offices-train": (0, 1_000_000),
    "offices-val": (1_000_000, 1_100_000),
    "offices-test": (2_000_000, 2_100_000),
}
"""Generated offices by range of seeds. Nothing is ever trained on `offices-test`."""

_UNSEEN_AREAS = frozenset({"area_3", "area_4"})
_VALIDATION_FRACTION = 0.1


def office_seed(suite: str, number: int) -> int:
    """The generator's seed of the n-th office of a suite.

    Raises:
        InputError: There is no such suite, or it has fewer offices.
    """
    if suite not in OFFICE_SUITES:
        raise InputError(
            f"there is no suite of buildings '{suite}'",
            where="--buildings",
            remedy=did_you_mean(suite, OFFICE_SUITES),
        )
    first, stop = OFFICE_SUITES[suite]
    if not 0 <= number < stop - first:
        raise InputError(
            f"suite {suite} has {stop - first} offices, got number {number}",
            where="--buildings",
            remedy="collect fewer buildings, or more episodes in each",
        )
    return first + number


def validation_buildings(names: Iterable[str]) -> frozenset[str]:
    """The buildings held out for validation: whole buildings, chosen by their names alone.

    A building keeps its side when further buildings or DAgger rounds are added. GraphNav's
    own areas are divided as in the paper (3 and 4 unseen); of other buildings one in ten is
    held out, at least one; a single building is all for training.
    """
    unique = sorted(set(names))
    if len(unique) < 2:
        return frozenset()
    held_out = {name for name in unique if name in _UNSEEN_AREAS}
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


def _position(name: str) -> float:
    """A number in [0, 1) that depends on the name alone."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2**64
