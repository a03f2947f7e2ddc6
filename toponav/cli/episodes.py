"""`toponav episodes`: the frozen episodes of image-goal navigation, and Habitat's format."""

import dataclasses
import json as json_module
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

__all__ = ["register"]

Suite = Literal["homes-test", "homes-val"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {
        ("episodes", "show"): show,
        ("episodes", "export"): export,
        ("episodes", "check"): check,
    }


def show(
    *,
    suite: Suite = "homes-test",
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Show how long and how hidden the ways of the frozen episodes are.

    Example: toponav episodes show --suite homes-test

    Args:
        suite: Suite of homes.
        json: Print the statistics and all episodes as JSON.
    """
    from toponav.data.nts.episodes import frozen_statistics, load_episodes

    statistics = frozen_statistics(suite)
    if json:
        episodes = [dataclasses.asdict(one) for one in load_episodes(suite)]
        print(json_module.dumps({"statistics": statistics, "episodes": episodes}))
        return 0
    print(f"{'':8}{'episodes':>9}{'path':>9}{'path / straight':>17}{'rooms':>7}", end="")
    print(f"{'in the same room':>18}{'in the same node':>18}")
    for difficulty, row in statistics.items():
        print(
            f"{difficulty:8}{row['episodes']:>9.0f}{row['path_m']:>7.2f} m"
            f"{row['path_over_straight']:>17.2f}{row['rooms']:>7.2f}"
            f"{row['same_room']:>18.0%}{row['same_node']:>18.0%}"
        )
    return 0


def export(
    *,
    out: Path,
    suite: Suite = "homes-test",
    difficulty: Literal["easy", "medium", "hard"] | None = None,
) -> int:
    """Export frozen episodes as Habitat's episode JSON.

    Example: toponav episodes export --suite homes-val --out homes-val.json.gz

    Args:
        out: File to write; gzipped where it ends in .gz.
        suite: Suite of homes.
        difficulty: Only these; all by default.
    """
    from toponav.core.files import check_out_file
    from toponav.data.nts.episodes import load_episodes
    from toponav.data.nts.habitat import export_habitat

    check_out_file(out)
    episodes = load_episodes(suite, difficulty)
    export_habitat(out, episodes)
    print(f"{len(episodes)} episodes: {out}")
    return 0


def check(
    episodes: Annotated[Path, tyro.conf.Positional],
    /,
    *,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Read a Habitat episode file and say what it holds.

    Example: toponav episodes check homes-val.json.gz

    Args:
        episodes: Habitat's JSON of point-goal or image-goal episodes, gzipped or not.
        json: Print the episodes as JSON.
    """
    from toponav.core.imagenav import DIFFICULTIES
    from toponav.data.nts.habitat import import_habitat

    found = import_habitat(episodes)
    if json:
        print(json_module.dumps([dataclasses.asdict(one) for one in found]))
        return 0
    suites = sorted({one.scene_suite for one in found})
    counts = {kind: sum(one.difficulty == kind for one in found) for kind in DIFFICULTIES}
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()))
    print(
        f"in {len({(one.scene_suite, one.scene_seed) for one in found})} buildings of "
        f"{', '.join(suites[:5])}{', ...' if len(suites) > 5 else ''}"
    )
    return 0
