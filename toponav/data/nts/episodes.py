"""Episodes of image-goal navigation: sampled once, frozen as JSON, read ever after.

A frozen file is gzipped JSON with the seed, the buildings' content hashes, statistics, and a row
per episode; its own hash is in it, so that a changed file is refused.
"""

import gzip
import hashlib
import json
import zlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import parse_json, read_bytes, write_atomically
from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    DIFFICULTIES,
    ImageNavEpisode,
)

__all__ = [
    "FROZEN_COUNTS",
    "frozen_file",
    "frozen_statistics",
    "load_episodes",
    "read_episodes",
    "write_episodes",
]

FROZEN_COUNTS = {"homes-test": 1000, "homes-val": 100}
"""Episodes of each difficulty that ship with toponav, by suite."""

_SCHEMA = 1
_MAX_BYTES = 64 << 20
_REMEDY = "install toponav again, or make the episodes again with toponav.data.nts.episodes"
_ROW = 8


def frozen_file(suite_name: str) -> Path:
    """Where the frozen episodes of a suite lie."""
    return Path(__file__).with_name("frozen") / f"{suite_name}.json.gz"


def load_episodes(
    suite_name: str, difficulty: str | None = None, count: int | None = None
) -> tuple[ImageNavEpisode, ...]:
    """The frozen episodes of a suite; the first n visit all its buildings alike.

    Args:
        suite_name: `homes-test` or `homes-val`.
        difficulty: Of which difficulty; None for all, the easy ones first.
        count: How many of each difficulty, from the first; None for all.

    Raises:
        InputError: When there are none or fewer.

    Example:
        >>> [round(one.geodesic_m, 1) for one in load_episodes("homes-val", "easy", 2)]
        [1.9, 2.4]
    """
    if suite_name not in FROZEN_COUNTS:
        raise InputError(
            f"no episodes are frozen for '{suite_name}'",
            where="episodes",
            remedy=did_you_mean(suite_name, list(FROZEN_COUNTS)),
        )
    if difficulty is not None and difficulty not in DIFFICULTIES:
        raise InputError(
            f"no difficulty is called '{difficulty}'",
            where="episodes",
            remedy=did_you_mean(str(difficulty), DIFFICULTIES),
        )
    episodes = _frozen(suite_name)
    most = FROZEN_COUNTS[suite_name]
    if count is not None and not 1 <= count <= most:
        raise InputError(
            f"{suite_name} has {most} episodes of each difficulty, got {count}",
            where="episodes",
            remedy=f"ask for 1 to {most}",
        )
    return tuple(
        one
        for one in episodes
        if difficulty in (None, one.difficulty) and one.number < (count or most)
    )


@cache
def _frozen(suite_name: str) -> tuple[ImageNavEpisode, ...]:
    return read_episodes(frozen_file(suite_name))


def write_episodes(
    path: Path,
    episodes: Sequence[ImageNavEpisode],
    *,
    seed: int,
    scenes: dict[int, str],
    statistics: dict[str, dict[str, int | float]] | None = None,
) -> str:
    """Freezes episodes of one suite in a file; its hash.

    Args:
        path: File to write; gzipped JSON.
        episodes: What to write; by difficulty and number.
        seed: What they were sampled with.
        scenes: Content hash of each building.
        statistics: As `episode_statistics`.
    """
    rows: dict[str, list[list[float]]] = {}
    for one in episodes:
        row = [one.scene_seed, *one.start, *one.goal, one.geodesic_m]
        rows.setdefault(one.difficulty, []).append(row)
    document = {
        "schema": _SCHEMA,
        "suite": episodes[0].scene_suite,
        "seed": seed,
        "scenes": {str(number): found for number, found in scenes.items()},
        "statistics": statistics or {},
        "episodes": rows,
    }
    found = _hash_of(document)
    text = json.dumps({**document, "sha256": found}, separators=(",", ":"))
    write_atomically(path, gzip.compress(text.encode(), mtime=0))
    return found


def read_episodes(path: Path) -> tuple[ImageNavEpisode, ...]:
    """The episodes that `write_episodes` froze, by difficulty and number.

    Raises:
        InputError: The file is missing, damaged or changed.
    """
    document = _read_document(path)
    episodes = []
    try:
        for difficulty, rows in document["episodes"].items():
            for number, row in enumerate(rows):
                if len(row) != _ROW:
                    raise ValueError(f"row {number} has {len(row)} numbers")
                scene_seed, *numbers = row
                values = [float(value) for value in numbers]
                episodes.append(
                    ImageNavEpisode(
                        str(document["suite"]),
                        int(scene_seed),
                        Pose2(*values[:3]),
                        Pose2(*values[3:6]),
                        values[6],
                        difficulty,
                        number,
                    )
                )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"does not hold episodes ({error})", where=str(path), remedy=_REMEDY
        ) from None
    return tuple(episodes)


def frozen_statistics(suite_name: str) -> dict[str, dict[str, int | float]]:
    """What was measured of the frozen episodes of a suite, as `episode_statistics`."""
    found: dict[str, dict[str, int | float]] = _read_document(frozen_file(suite_name))[
        "statistics"
    ]
    return found


def _read_document(path: Path) -> dict[str, Any]:
    data = read_bytes(path, max_bytes=_MAX_BYTES)
    try:
        unpacked = zlib.decompressobj(wbits=31).decompress(data, _MAX_BYTES)
    except zlib.error as error:
        raise InputError(f"not gzip: {error}", where=str(path), remedy=_REMEDY) from None
    document = parse_json(unpacked, str(path))
    if not isinstance(document, dict) or document.get("schema") != _SCHEMA:
        raise InputError("not a file of episodes", where=str(path), remedy=_REMEDY)
    expected = document.pop("sha256", None)
    if _hash_of(document) != expected:
        raise InputError(
            "the episodes were changed: their hash is not the file's",
            where=str(path),
            remedy=_REMEDY,
        )
    return document


def _hash_of(document: dict[str, Any]) -> str:
    text = json.dumps(document, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
