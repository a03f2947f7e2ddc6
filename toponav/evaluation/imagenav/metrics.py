"""Numbers from records of image-goal navigation: success and SPL with bootstrap intervals."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from toponav.core.imagenav import DIFFICULTIES
from toponav.evaluation.imagenav.episode import OUTCOMES, GoalRecord, ImageNavRecord
from toponav.evaluation.metrics import wilson_interval

__all__ = ["agent_results", "bootstrap_interval", "paired_results", "suite_results"]

RESAMPLES = 2000


def bootstrap_interval(
    values: Float[np.ndarray, " episodes"],
    groups: Sequence[Any] | None = None,
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> tuple[float, float] | None:
    """The 95 % percentile bootstrap interval of a mean; None with fewer than two values.

    Episodes are drawn again within their group, such as their difficulty, so that every resample
    has the groups' sizes.

    Args:
        values: One number an episode.
        groups: The group of each; all one group if left out.
        resamples: How often to draw.
        seed: Seed of the draws.

    Reference:
        Efron and Tibshirani 1993, "An Introduction to the Bootstrap", section 13.3.

    Example:
        >>> low, high = bootstrap_interval(np.array([0.0, 1.0, 1.0, 1.0] * 25))
        >>> round(low, 2), round(high, 2)
        (0.66, 0.83)
    """
    if len(values) < 2:
        return None
    rng = np.random.default_rng(seed)
    names = np.array(["" if groups is None else str(groups[k]) for k in range(len(values))])
    total = np.zeros(resamples)
    for name in sorted(set(names)):
        mine = values[names == name]
        # One row a resample; a thousand episodes are two million draws, which fit.
        total += mine[rng.integers(len(mine), size=(resamples, len(mine)))].sum(axis=1)
    low, high = np.quantile(total / len(values), [0.025, 0.975])
    return float(low), float(high)


def suite_results(records: Iterable[ImageNavRecord], variant: Mapping[str, Any]) -> dict[str, Any]:
    """The content of `results.json`, one entry an agent in the order of their first record.

    Args:
        records: All episodes of all agents.
        variant: What was run: `noise`, `stop`, `sliding` and the number of `goals`.
    """
    by_agent: dict[str, list[ImageNavRecord]] = {}
    for record in records:
        by_agent.setdefault(record.agent, []).append(record)
    first = next(iter(by_agent.values()), [])
    return {
        "schema": 1,
        "suite": "imagenav",
        "episodes": _episode_numbers(first),
        "agents": {
            name: {**agent_results(found), "variant": dict(variant)}
            for name, found in by_agent.items()
        },
        "paired": paired_results(by_agent),
    }


def agent_results(records: Sequence[ImageNavRecord]) -> dict[str, Any]:
    """One agent's numbers: all goals together, by difficulty, and by the number of the goal.

    Rates are fractions and outcomes counts. An episode of several goals counts as the share that
    it reached; intervals are over episodes.
    """
    steps = [step for record in records for step in record.steps]
    act_ms = np.array([step.act_ms for step in steps]) if steps else np.zeros(1)
    wall_s = sum(record.wall_s for record in records)
    goals = [goal for record in records for goal in record.goals]
    levels = {level: _at(records, level) for level in DIFFICULTIES}
    return {
        **_rates(records),
        "outcomes": {name: Counter(goal.outcome for goal in goals)[name] for name in OUTCOMES},
        "reasons": dict(Counter(goal.reason for goal in goals if goal.reason).most_common(12)),
        "by_difficulty": {
            level: _rates(found) | _ways(found) for level, found in levels.items() if found
        },
        "by_goal": _by_goal(records),
        **_ways(records),
        "steps_per_second": len(steps) / wall_s if wall_s > 0 else None,
        "act_ms_p50": float(np.quantile(act_ms, 0.5)),
        "act_ms_p99": float(np.quantile(act_ms, 0.99)),
    }


def paired_results(by_agent: Mapping[str, Sequence[ImageNavRecord]]) -> list[dict[str, Any]]:
    """Each agent against the first, on the episodes that both ran.

    The ratio of success rates is None where the other never succeeded.
    """
    names = list(by_agent)
    answers = []
    for other in names[1:]:
        mine = {record.episode.id: record for record in by_agent[names[0]]}
        pairs = [
            (mine[record.episode.id], record)
            for record in by_agent[other]
            if record.episode.id in mine
        ]
        answers.append({"agent": names[0], "than": other, **_paired(pairs)})
    return answers


def _paired(pairs: Sequence[tuple[ImageNavRecord, ImageNavRecord]]) -> dict[str, Any]:
    levels = [ours.episode.difficulty for ours, _ in pairs]

    def against(value: Callable[[ImageNavRecord], float]) -> dict[str, Any]:
        difference = np.array([value(ours) - value(theirs) for ours, theirs in pairs])
        ends = bootstrap_interval(difference, levels)
        return {
            "mean": float(difference.mean()) if len(pairs) else None,
            "ci95": None if ends is None else list(ends),
        }

    theirs = sum(_success(record) for _, record in pairs)
    return {
        "episodes": len(pairs),
        "success_difference": against(_success),
        "spl_difference": against(_spl),
        "success_ratio": sum(_success(record) for record, _ in pairs) / theirs if theirs else None,
    }


def _success(record: ImageNavRecord) -> float:
    return sum(goal.success for goal in record.goals) / len(record.goals)


def _spl(record: ImageNavRecord) -> float:
    return sum(goal.spl for goal in record.goals) / len(record.goals)


def _at(records: Sequence[ImageNavRecord], level: str) -> list[ImageNavRecord]:
    return [record for record in records if record.episode.difficulty == level]


def _rates(records: Sequence[ImageNavRecord]) -> dict[str, Any]:
    success = np.array([_success(record) for record in records])
    spl = np.array([_spl(record) for record in records])
    levels = [record.episode.difficulty for record in records]
    return {
        "episodes": len(records),
        "success_rate": _mean(success),
        "success_ci95": _interval(success, levels),
        "spl": _mean(spl),
        "spl_ci95": _interval(spl, levels),
    }


def _interval(values: np.ndarray, groups: Sequence[str]) -> list[float] | None:
    """A bootstrap never leaves 0 or 1 where every episode did the same; Wilson's interval does."""
    if len(values) >= 2 and values.min() == values.max() and values[0] in (0.0, 1.0):
        ends = wilson_interval(int(values.sum()), len(values))
    else:
        ends = bootstrap_interval(values, groups)
    return None if ends is None else list(ends)


def _mean(values: Sequence[float | int] | np.ndarray) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _ways(records: Sequence[ImageNavRecord]) -> dict[str, Any]:
    """How the robot drove: what a rate of success does not say."""
    goals = [goal for record in records for goal in record.goals]
    steps = sum(goal.steps for goal in goals)
    return {
        "steps_mean": _mean([goal.steps for goal in goals]),
        "path_m_mean": _mean([goal.path_m for goal in goals]),
        "final_distance_m_mean": _mean(
            [goal.distance_m for goal in goals if math.isfinite(goal.distance_m)]
        ),
        "collisions_per_100_steps": (
            100 * sum(goal.collisions for goal in goals) / steps if steps else None
        ),
    }


def _by_goal(records: Sequence[ImageNavRecord]) -> list[dict[str, Any]]:
    """Success of the first goal, the second, ... and of all up to it (figure 8)."""
    most = max((len(record.goals) for record in records), default=0)
    answers = []
    for number in range(most):
        having = [record for record in records if len(record.goals) > number]
        own = [(record.goals[number],) for record in having]
        upto = [record.goals[: number + 1] for record in having]
        answers.append({"goal": number + 1, **_goals(own), "up_to": _goals(upto)})
    return answers


def _goals(found: Sequence[Sequence[GoalRecord]]) -> dict[str, Any]:
    success = np.array([sum(goal.success for goal in goals) / len(goals) for goals in found])
    spl = np.array([sum(goal.spl for goal in goals) / len(goals) for goals in found])
    same = [""] * len(found)
    return {
        "success_rate": _mean(success),
        "success_ci95": _interval(success, same),
        "spl": _mean(spl),
        "spl_ci95": _interval(spl, same),
    }


def _episode_numbers(records: Sequence[ImageNavRecord]) -> dict[str, Any]:
    """How hard the episodes are: shortest paths, detours and rooms, by difficulty."""
    numbers: dict[str, Any] = {}
    for level in DIFFICULTIES:
        found = _at(records, level)
        if not found:
            continue
        geodesic_m = np.array([record.episode.geodesic_m for record in found])
        straight_m = np.array(
            [record.episode.start.distance_to(record.episode.goal) for record in found]
        )
        rooms = np.array([record.rooms for record in found])
        numbers[level] = {
            "episodes": len(found),
            "homes": len({record.episode.scene_seed for record in found}),
            "geodesic_m_mean": float(geodesic_m.mean()),
            "geodesic_m_range": [float(geodesic_m.min()), float(geodesic_m.max())],
            "geodesic_over_straight_mean": float(
                np.mean(geodesic_m / np.maximum(straight_m, 0.1))
            ),
            "rooms_mean": float(rooms.mean()),
            "rooms_range": [int(rooms.min()), int(rooms.max())],
        }
    return numbers
