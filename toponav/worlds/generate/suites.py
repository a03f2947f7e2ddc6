"""Named ranges of buildings, so that no result mixes training and test."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import read_json_object
from toponav.worlds.scene import Scene

__all__ = [
    "DEMO_OFFICE_SEED",
    "HASHES_FILE",
    "SUITES",
    "Suite",
    "check_frozen",
    "frozen_hash",
    "suite",
    "suite_scene",
]

HASHES_FILE = Path(__file__).with_name("suite_hashes.json")
"""The first 16 digits of the content hash of frozen buildings, by generator and seed."""


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
    Suite("homes-train", "home", range(0, 68)),
    Suite("homes-val", "home", range(1000, 1004)),
    # Within HELD_OUT_SEEDS: nothing that furnishes these homes furnishes any other.
    Suite("homes-test", "home", range(2000, 2014)),
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


def suite_scene(generator: str, seed: int) -> Scene:
    """The building of a suite, checked against its frozen hash.

    Args:
        generator: `home` or `office`.
        seed: Its seed.

    Raises:
        InputError: When this version of the generator makes another building than the frozen
            one, or there is no such generator.

    Example:
        >>> suite_scene("office", 1050).name
        'office-1050'
    """
    if generator == "office":
        from toponav.worlds.generate.office import generate_office

        scene = generate_office(seed)
    elif generator == "home":
        from toponav.worlds.generate.home import generate_home

        scene = generate_home(seed)
    else:
        raise InputError(
            f"no generator is called '{generator}'",
            where="suites",
            remedy=did_you_mean(generator, ["home", "office"]),
        )
    check_frozen(scene)
    return scene


def check_frozen(scene: Scene) -> None:
    """Nothing, when a generated building is the frozen one of its seed or none is frozen.

    Raises:
        InputError: When its content differs from what results were stored on.
    """
    origin = scene.provenance
    if origin.source:  # furnished from a library, so it is none of a suite
        return
    expected = frozen_hash(origin.generator, origin.seed)
    if expected is not None and not scene.content_hash.startswith(expected):
        raise InputError(
            f"the building is not the frozen one: its content hash starts with "
            f"{scene.content_hash[:16]}, the frozen one's with {expected}",
            where=f"scene {scene.name}",
            remedy="use the version of toponav that the suite was frozen with",
        )


def frozen_hash(generator: str, seed: int | None) -> str | None:
    """The start of the frozen content hash of a building; None where none is frozen."""
    found = _hashes().get(generator, {}).get(str(seed))
    return None if found is None else str(found)


@cache
def _hashes() -> dict[str, dict[str, str]]:
    if not HASHES_FILE.is_file():
        return {}
    return {name: dict(table) for name, table in read_json_object(HASHES_FILE).items()}
