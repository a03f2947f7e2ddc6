"""Tables beyond the paper's: every pair of rules, what failures are made of, transitions."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from toponav.core.vocabulary import Outcome
from toponav.evaluation.metrics import FAILURES
from toponav.evaluation.protocol import COLLISION_RULES, DEVIATION_RULES
from toponav.evaluation.table_layout import NONE, PaperTable, counted, interval, pair
from toponav.evaluation.tables import BEHAVIOR_COLUMNS, StoredResults, ordered, title_in

__all__ = ["ANALYSES", "failures_table", "rules_table", "transitions_table"]

_RULES = tuple(
    (deviation, collisions) for collisions in COLLISION_RULES for deviation in DEVIATION_RULES
)


def rules_table(stored: Sequence[StoredResults]) -> PaperTable:
    """Success and plan completion of the same runs by each pair of rules."""
    rows = []
    for found in stored:
        for label in ordered(found.drivers, ()):
            cells = []
            for deviation, collisions in _RULES:
                numbers = _by_rules(found.drivers[label], deviation, collisions)
                cells.append(pair(numbers))
                cells.append(interval(None if numbers is None else numbers["success_ci95"]))
            rows.append((found.name, title_in(found, label), *cells))
    names = {"fail": "contact fails", "stuck": "contact allowed"}
    return PaperTable(
        title="Both rules on contact and both on leaving the plan: success / completion, %",
        columns=(
            *("area", "model"),
            *(
                column
                for deviation, collisions in _RULES
                for column in (f"{names[collisions]}, {deviation}", "95 %")
            ),
        ),
        rows=tuple(rows),
        notes=(
            "All four from the same runs. contact allowed: it fails a run only if the robot then",
            "stops moving, as in the authors' code (`--collisions stuck`).",
        ),
        name_columns=2,
    )


def failures_table(stored: Sequence[StoredResults]) -> PaperTable:
    """What ended the runs that failed, by the behaviour that was to be executed."""
    rows = []
    for found in stored:
        for label in ordered(found.drivers, ()):
            for rule in ("strict", "tolerant"):
                numbers = found.drivers[label]
                numbers = numbers if rule == "strict" else numbers["tolerant"]
                for why in FAILURES:
                    cells = _failure_cells(numbers, why)
                    if cells is not None:
                        rows.append((found.name, title_in(found, label), rule, str(why), *cells))
    return PaperTable(
        title="Failed runs by behaviour of the edge on which they ended",
        columns=("area", "model", "rule", "outcome", *BEHAVIOR_COLUMNS, "all", "% of runs"),
        rows=tuple(rows),
        notes=(
            "Runs that ended so. cf: corridor follow, fd: find door, tr, tl: turns, s: straight.",
        ),
        name_columns=4,
    )


def transitions_table(stored: Sequence[StoredResults]) -> PaperTable:
    """Success by kind of place left and entered, a column an agent, by the strict rule."""
    labels = ordered(dict.fromkeys(label for found in stored for label in found.drivers), ())
    titles = {label: title_in(found, label) for found in stored for label in found.drivers}
    rows = []
    for found in stored:
        kinds: dict[str, int] = {}
        for numbers in found.drivers.values():
            for kind, counts in numbers["by_transition"].items():
                kinds[kind] = max(kinds.get(kind, 0), counts["attempts"])
        for kind in sorted(kinds, key=lambda kind: (-kinds[kind], kind)):
            cells = []
            for label in labels:
                made = found.drivers.get(label, {}).get("by_transition", {}).get(kind)
                cells.append(NONE if made is None else counted(made, "success_rate", "attempts"))
            rows.append((found.name, kind, *cells))
    return PaperTable(
        title="Success by semantic transition, %, strict rule",
        columns=("area", "transition", *(titles[label] for label in labels)),
        rows=tuple(rows),
        notes=("Attempts in parentheses. junction: a turn between passages.",),
        name_columns=2,
    )


ANALYSES: Mapping[str, Callable[[Sequence[StoredResults]], PaperTable]] = {
    "rules": rules_table,
    "failures": failures_table,
    "transitions": transitions_table,
}
"""Each table by the name of its file."""


def _by_rules(
    numbers: Mapping[str, Any], deviation: str, collisions: str
) -> Mapping[str, Any] | None:
    """An agent's numbers by one pair of rules, where its runs were judged by them."""
    made: Mapping[str, Any] | None = (
        numbers.get("by_collision_rule", {}).get(collisions, {}).get(deviation)
    )
    if made is None and collisions == numbers.get("collisions", "fail"):
        own: Mapping[str, Any] = numbers if deviation == "strict" else numbers["tolerant"]
        return own
    return made


def _failure_cells(numbers: Mapping[str, Any], why: Outcome) -> list[str] | None:
    """How many runs ended so, by behaviour and in all; None where none did."""
    count = numbers["outcomes"][str(why)]
    if not count:
        return None
    cells = []
    for name in BEHAVIOR_COLUMNS.values():
        failures = numbers["by_behavior"][name].get("failures")
        cells.append(NONE if failures is None else str(failures[str(why)]))
    return [*cells, str(count), f"{100 * count / numbers['episodes']:.0f}"]
