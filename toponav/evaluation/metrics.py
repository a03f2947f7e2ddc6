"""Numbers from episode records: success with intervals, by difficulty, behaviour, transition."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from toponav.core.vocabulary import Behavior, Difficulty, Outcome
from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.protocol import (
    COLLISION_RULES,
    DEVIATION_RULES,
    CollisionRule,
    DeviationRule,
    Verdict,
)

__all__ = ["FAILURES", "Rule", "agent_results", "suite_results", "wilson_interval"]

Rule = DeviationRule

_Z95 = 1.959963984540054
_EXPERT = "expert"
FAILURES = tuple(outcome for outcome in Outcome if outcome is not Outcome.SUCCESS)


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
        "collisions": records[0].collisions,
        "by_collision_rule": {
            rule: {deviation: _by_rules(records, deviation, rule) for deviation in DEVIATION_RULES}
            for rule in COLLISION_RULES
        },
        "episode_s": wall_s / len(records),
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
        feasible_success = _success(chosen)
        results["expert_success_rate"] = len(feasible) / len(expert) if expert else None
        results["expert_feasible_episodes"] = len(chosen)
        results["success_on_expert_feasible"] = feasible_success["success_rate"]
        results["success_on_expert_feasible_ci95"] = feasible_success["success_ci95"]
    return results


def _by_rules(
    records: Sequence[EpisodeRecord], deviation: DeviationRule, collisions: CollisionRule
) -> dict[str, Any] | None:
    """Success and outcomes by one pair of rules; None where a run was not judged by them."""
    verdicts = [record.verdict(deviation, collisions) for record in records]
    known = [verdict for verdict in verdicts if verdict is not None]
    if len(known) < len(verdicts):
        return None
    outcomes = Counter(verdict.outcome for verdict in known)
    return {
        **_success(known),
        "outcomes": {str(outcome): outcomes[outcome] for outcome in Outcome},
    }


def _verdict(record: EpisodeRecord, rule: Rule) -> Verdict:
    return record.strict if rule == "strict" else record.tolerant


def _success(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    successes = sum(verdict.success for verdict in verdicts)
    count = len(verdicts)
    interval = wilson_interval(successes, count)
    completion = [verdict.plan_completion for verdict in verdicts]
    return {
        "episodes": count,
        "success_rate": successes / count if count else None,
        "success_ci95": None if interval is None else list(interval),
        "plan_completion": sum(completion) / count if count else None,
        "plan_completion_ci95": _interval_of_mean(completion),
    }


def _interval_of_mean(values: Sequence[float]) -> list[float] | None:
    """95 % interval of the mean of shares, by the normal approximation; None below two."""
    if len(values) < 2:
        return None
    mean = sum(values) / len(values)
    variance = sum((value - mean) ** 2 for value in values) / (len(values) - 1)
    half = _Z95 * math.sqrt(variance / len(values))
    return [max(0.0, mean - half), min(1.0, mean + half)]


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
    failed: Counter[tuple[str, Outcome]] = Counter()
    for record in records:
        verdict = _verdict(record, rule)
        if verdict.failed_edge is not None:
            failed[str(record.behaviors[verdict.failed_edge]), verdict.outcome] += 1
    return {
        name: {
            "attempts": attempts[name],
            **_rate(passes[name], attempts[name]),
            "failures": {str(why): failed[name, why] for why in FAILURES},
            **_prediction([_rightly_chosen(record, rule, name) for record in records]),
        }
        for name in map(str, Behavior)
    }


def _prediction(counts: Sequence[tuple[int, int]]) -> dict[str, Any]:
    return {
        "prediction_steps": sum(count for _, count in counts),
        "prediction_accuracy": _share(counts),
        "prediction_ci95": _clustered_interval(counts),
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


def _rightly_chosen(record: EpisodeRecord, rule: Rule, behavior: str) -> tuple[int, int]:
    """Steps at which the behaviour was chosen when it was the true one, and all such steps."""
    steps = [step for step in record.judged_steps(rule) if step.true_behavior == behavior]
    return sum(step.behavior == behavior for step in steps), len(steps)


def _localization(records: Sequence[EpisodeRecord], rule: Rule) -> dict[str, Any]:
    """How often the believed edge, and the believed node, is the true one on the plan.

    Nothing is measured of an agent that never says where it is, such as BehavRNN.
    """
    edges, nodes = [], []
    if not any(s.believed_node or s.believed_edge for r in records for s in r.steps):
        records = ()
    for record in records:
        steps = [step for step in record.judged_steps(rule) if step.true_edge is not None]
        edges.append((sum(s.believed_edge == s.true_edge for s in steps), len(steps)))
        nodes.append((sum(s.believed_node == s.true_node for s in steps), len(steps)))
    return {
        "localization_accuracy": _share(edges),
        "localization_ci95": _clustered_interval(edges),
        "localization_steps": sum(count for _, count in edges),
        "node_localization_accuracy": _share(nodes),
    }


def _share(counts: Sequence[tuple[int, int]]) -> float | None:
    total = sum(count for _, count in counts)
    return sum(right for right, _ in counts) / total if total else None


def _clustered_interval(counts: Sequence[tuple[int, int]]) -> list[float] | None:
    """95 % interval of a share of steps, where the steps of one episode hang together.

    The ratio estimator's variance over episodes; None with fewer than two of them.

    Args:
        counts: Steps that were right, and all steps, of each episode.

    Reference:
        Cochran 1977, "Sampling Techniques", section 3.12: cluster sampling for proportions.
    """
    known = [(right, count) for right, count in counts if count]
    share = _share(known)
    if share is None or len(known) < 2:
        return None
    mean = sum(count for _, count in known) / len(known)
    spread = sum((right - share * count) ** 2 for right, count in known) / (len(known) - 1)
    if share in (0.0, 1.0):
        # No episode differs from the others: as if each were one trial.
        ends = wilson_interval(round(share * len(known)), len(known))
        return None if ends is None else list(ends)
    half = _Z95 * math.sqrt(spread / len(known)) / mean
    return [max(0.0, share - half), min(1.0, share + half)]
