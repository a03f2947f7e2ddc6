"""Named ranges of buildings, so that no result mixes training and test."""

from dataclasses import dataclass

from toponav.core.errors import InputError, did_you_mean

__all__ = ["DEMO_OFFICE_SEED", "SUITES", "Suite", "suite"]


@dataclass(frozen=True)
class Suite:
    """Buildings of one generator with consecutive seeds."""

    name: str
    """Unique name."""
    generator: str
    """Generator that makes them."""
    seeds: range
    """Their seeds."""


SUITES: tuple[Suite, ...] = (
    Suite("offices-train", "office", range(0, 1000)),
    Suite("offices-val", "office", range(1000, 1050)),
    Suite("offices-test", "office", range(1050, 1100)),
)
"""All suites; no two share a building."""

DEMO_OFFICE_SEED = 1061
"""The office that the demo drives, from `offices-test`: no training run saw it."""


def suite(name: str) -> Suite:
    """The suite of this name.

    Raises:
        InputError: When there is none; the message names the nearest.
    """
    for one in SUITES:
        if one.name == name:
            return one
    raise InputError(
        f"no suite is called '{name}'",
        where="suites",
        remedy=did_you_mean(name, [one.name for one in SUITES]),
    )
