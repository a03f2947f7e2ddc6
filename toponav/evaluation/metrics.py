"""Numbers from episode records: success with intervals, by difficulty, behaviour, transition."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np

from toponav.core.vocabulary import Behavior, Difficulty, Outcome
from toponav.evaluation.episode import EpisodeRecord, Step
from toponav.evaluation.protocol import Verdict

__all__ = ["Rule", "agent_results", "suite_results", "wilson_interval"]

Rule = Literal["strict", "tolerant"]

_Z95 = 1.959963984540054
_EXPERT = "expert"


def wilson_interval(successes: int, trials: int, z: float = _Z95) -> tuple[float, float] | None:
    """The Wilson score interval of a success rate, by default at 95 %; None without trials.

    Reference:
        Wilson 1927, "Probable inference, the law of succession, and statistical inference".

    Example:
        >>> low, high = wilson_interval(34, 72)
        >>> round(low, 3), round(high, 3)
        (0.361, 0.586)
    """
    if trials == 0:
        return None
    rate = successes / trials
    denominator = 1 + z * z / trials
    center = (rate + z * z / (2 * trials)) / denominator
    half = z * math.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials**2)) / denominator
    # Rounding must not push the interval off the rate at 0 and at 1.
    low = 0.0 if successes == 0 else max(0.0, center - half)
    high = 1.0 if successes == trials else min(1.0, center + half)
    return low, high


def suite_results(records: Iterable[EpisodeRecord]) -> dict[str, Any]:
    """The content of `results.json` for the GraphNav suite, one entry an agent.

    Agents come in the order of their first record. When the expert ran, the others' success
    is also given on the episodes that it passes.
    """
    by_agent: dict[str, list[EpisodeRecord]] = {}
    for record in records:
        by_agent.setdefault(record.agent, []).append(record)
    expert = by_agent.get(_EXPERT)
    return {
        "schema": 1,
        "suite": "graphnav",
        "agents": {name: agent_results(found, expert) for name, found in by_agent.items()},
    }


def agent_results(
    records: Sequence[EpisodeRecord], expert: Sequence[EpisodeRecord] | None = None
) -> dict[str, Any]:
    """One agent's numbers: the strict rule's at the top, the tolerant rule's under `tolerant`.

    Rates are fractions, outcomes are counts, and what has no attempts is None. Accuracies
    count the steps up to the rule's verdict at which the true node is on the plan.

    Args:
        records: The agent's episodes.
        expert: The expert's episodes, if it ran beside.
    """
    act_ms = np.array([step.act_ms for record in records for step in record.steps])
    steps, wall_s = sum(len(r.steps) for r in records), sum(r.wall_s for r in records)
    return {
        **_by_rule(records, "strict", expert),
        "tolerant": _by_rule(records, "tolerant", expert),
        "steps_per_second": steps / wall_s if wall_s > 0 else None,
        "act_ms_p50": float(np.percentile(act_ms, 50)) if len(act_ms) else None,
        "act_ms_p99": float(np.percentile(act_ms, 99)) if len(act_ms) else None,
    }


def _by_rule(
    records: Sequence[EpisodeRecord], rule: Rule, expert: Sequence[EpisodeRecord] | None
) -> dict[str, Any]:
    verdicts = [_verdict(record, rule) for record in records]
    outcomes = Counter(verdict.outcome for verdict in verdicts)
    results = {
        **_success(verdicts),
        "outcomes": {str(outcome): outcomes[outcome] for outcome in Outcome},
        "by_difficulty": _by_difficulty(records, rule),
        "by_behavior": _by_behavior(records, rule),
        "by_transition": _by_transition(records, rule),
        **_localization(records, rule),
    }
    if expert is not None:
        feasible = {record.index for record in expert if _verdict(record, rule).success}
        chosen = [_verdict(record, rule) for record in records if record.index in feasible]
        results["expert_feasible_episodes"] = len(chosen)
        results["success_on_expert_feasible"] = _success(chosen)["success_rate"]
    return results


def _verdict(record: EpisodeRecord, rule: Rule) -> Verdict:
    return record.strict if rule == "strict" else record.tolerant


def _success(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    successes = sum(verdict.success for verdict in verdicts)
    count = len(verdicts)
    interval = wilson_interval(successes, count)
    return {
        "episodes": count,
        "success_rate": successes / count if count else None,
        "success_ci95": None if interval is None else list(interval),
        "plan_completion": (
            sum(verdict.plan_completion for verdict in verdicts) / count if count else None
        ),
    }


def _by_difficulty(records: Sequence[EpisodeRecord], rule: Rule) -> dict[str, Any]:
    return {
        str(difficulty): _success(
            [
                _verdict(record, rule)
                for record in records
                if Difficulty.of_plan(len(record.plan.nodes)) is difficulty
            ]
        )
        for difficulty in Difficulty
    }


def _by_behavior(records: Sequence[EpisodeRecord], rule: Rule) -> dict[str, Any]:
    """Per behaviour: plan edges attempted and passed, and how often it was rightly chosen."""
    attempts, passes = _count_edges(records, rule, lambda record: map(str, record.behaviors))
    asked: Counter[str] = Counter()
    right: Counter[str] = Counter()
    for record in records:
        for step in _judged_steps(record, rule):
            if step.true_behavior is not None:
                asked[step.true_behavior] += 1
                right[step.true_behavior] += step.behavior == step.true_behavior
    return {
        name: {
            "attempts": attempts[name],
            **_rate(passes[name], attempts[name]),
            "prediction_steps": asked[name],
            "prediction_accuracy": right[name] / asked[name] if asked[name] else None,
        }
        for name in map(str, Behavior)
    }


def _by_transition(records: Sequence[EpisodeRecord], rule: Rule) -> dict[str, Any]:
    attempts, passes = _count_edges(records, rule, lambda record: record.transitions)
    return {
        name: {"attempts": attempts[name], **_rate(passes[name], attempts[name])}
        for name in sorted(attempts)
    }


def _count_edges(
    records: Sequence[EpisodeRecord], rule: Rule, labels_of: Any
) -> tuple[Counter[str], Counter[str]]:
    """Plan edges attempted and passed, by label.

    An edge is attempted once its source is reached and passed once a later node is; a failed
    episode so charges exactly one edge, as the attempts in the paper's Table I add up.
    """
    attempts: Counter[str] = Counter()
    passes: Counter[str] = Counter()
    for record in records:
        verdict = _verdict(record, rule)
        labels = list(labels_of(record))
        attempts.update(labels[: verdict.edges_attempted])
        passes.update(labels[: verdict.edges_passed])
    return attempts, passes


def _rate(passes: int, attempts: int) -> dict[str, Any]:
    interval = wilson_interval(passes, attempts)
    return {
        "success_rate": passes / attempts if attempts else None,
        "success_ci95": None if interval is None else list(interval),
    }


def _judged_steps(record: EpisodeRecord, rule: Rule) -> tuple[Step, ...]:
    return record.steps[: _verdict(record, rule).step]


def _localization(records: Sequence[EpisodeRecord], rule: Rule) -> dict[str, Any]:
    """How often the believed edge, and the believed node, is the true one on the plan."""
    known = edges_right = nodes_right = 0
    for record in records:
        for step in _judged_steps(record, rule):
            if step.true_edge is None:
                continue
            known += 1
            edges_right += step.believed_edge == step.true_edge
            nodes_right += step.believed_node == step.true_node
    return {
        "localization_accuracy": edges_right / known if known else None,
        "node_localization_accuracy": nodes_right / known if known else None,
    }
