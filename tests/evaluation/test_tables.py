import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from tests.evaluation.records import STEP, record, verdict
from toponav.core.errors import InputError
from toponav.core.vocabulary import Outcome
from toponav.evaluation.analysis_tables import failures_table, rules_table, transitions_table
from toponav.evaluation.metrics import suite_results
from toponav.evaluation.tables import (
    StoredResults,
    load_results,
    localization_table,
    paper_numbers,
    prediction_table,
    success_table,
    summary_table,
    to_csv,
    to_latex,
    to_rich,
)


def stored(name: str = "area_3") -> StoredResults:
    lost, good = verdict(Outcome.DEVIATED, 3), verdict(Outcome.SUCCESS, 5)
    records = [
        record("gtl", 0),
        record("gtl", 1, lost, good),
        record("expert"),
        record("expert", 1),
    ]
    results = json.loads(json.dumps(suite_results(records)))
    return StoredResults(name, results, Path("runs") / name)


def test_the_papers_attempts_add_up() -> None:
    """In Table I a failed episode fails one behaviour, so failures tell the episodes."""
    gtl = paper_numbers()["table_1"]["area_3"]["gtl"]
    failures = sum(
        round(numbers["attempts"] * (1 - numbers["success_rate"]))
        for numbers in gtl["by_behavior"].values()
    )
    assert failures == round(72 * (1 - gtl["success_rate"]))


@pytest.mark.parametrize("table", ["table_1", "table_6"])
def test_the_papers_tables_are_complete(table: str) -> None:
    numbers = paper_numbers()[table]
    assert set(numbers) == {"area_1", "area_3", "area_4", "area_5", "area_6"}
    agents = {"phasenet", "behavrnn", "graphnav", "graphnav_pf", "gtl"}
    assert all(set(area) == agents for area in numbers.values())
    assert paper_numbers()["reference"].startswith("Chen et al.")


def test_gtl_predicts_every_behaviour_by_definition() -> None:
    for area in paper_numbers()["table_6"].values():
        accuracies = {numbers["prediction_accuracy"] for numbers in area["gtl"].values()}
        assert accuracies <= {1.0, None}


def test_ours_stand_beside_the_papers() -> None:
    table = success_table([stored()])
    gtl = [row for row in table.rows if row[1] == "GTL"]
    assert [row[2] for row in gtl] == ["strict", "tolerant", "paper"]
    strict, tolerant, paper = (dict(zip(table.columns, row, strict=True)) for row in gtl)
    assert (strict["SR"], tolerant["SR"], paper["SR"]) == ("50.0", "100.0", "76.4")
    assert strict["95 % interval"] == "9..91"
    assert strict["SR feasible"] == "50.0"
    assert paper["tl"] == "92.1 (63)"
    assert paper["III SR / PC"] == "- / -"
    assert [row[1] for row in table.rows if row[2] == "paper"][:2] == ["PhaseNet", "BehavRNN"]


def test_area_5b_stands_beside_the_papers_area_5() -> None:
    rows = success_table([stored("area_5b")]).rows
    assert any(row[2] == "paper" and "83.3" in row for row in rows)


def test_a_building_that_the_paper_has_not_shows_only_ours() -> None:
    assert {row[2] for row in success_table([stored("office-7")]).rows} == {"strict", "tolerant"}


def test_table_six_has_prediction_and_localization_accuracy() -> None:
    table = prediction_table([stored()])
    ours = next(row for row in table.rows if row[1:3] == ("GTL", "strict"))
    cells = dict(zip(table.columns, ours, strict=True))
    assert cells["fd"] == "100.0 [34..100] (4)"
    assert cells["edge"] == "100.0"
    assert any("52.3" in note for note in table.notes)


def test_the_experts_ceiling_stands_beside_every_row() -> None:
    table = success_table([stored()])
    ours = [row for row in table.rows if row[2] != "paper"]
    assert [row[-1] for row in ours] == ["100.0"] * len(ours)


def test_table_five_has_teacher_forced_closed_loop_and_the_papers() -> None:
    lost = replace(STEP, believed_edge="elsewhere", true_edge=STEP.true_edge)
    records = [
        record("graphnav_pf", 0, steps=(STEP, lost)),
        record("gtl"),
        record("teacher_forced", 0, steps=(STEP, STEP)),
    ]
    found = StoredResults("area_3", json.loads(json.dumps(suite_results(records))), Path("run"))
    table = localization_table([found])
    assert [row[1:4] for row in table.rows] == [
        ("GraphNav", "teacher forced", "100.0"),
        ("GraphNav", "teacher forced, paper", "52.3"),
        ("GraphNavPF", "closed loop, strict", "50.0"),
        ("GraphNavPF", "closed loop, tolerant", "50.0"),
    ]
    assert all("Teacher" not in row[1] for row in success_table([found]).rows)


def test_both_rules_on_contact_come_from_the_same_runs() -> None:
    hit, good = verdict(Outcome.COLLIDED, 3), verdict(Outcome.SUCCESS, 5)
    bumped = replace(record("gtl", 0, hit), by_other_collision_rule=(good, good))
    untouched = replace(record("gtl", 1), by_other_collision_rule=(good, good))
    results = json.loads(json.dumps(suite_results([bumped, untouched])))
    table = rules_table([StoredResults("x", results, Path("x"))])
    cells = dict(zip(table.columns, table.rows[0], strict=False))
    assert cells["contact fails, strict"] == "50.0 / 80.0"
    assert cells["contact allowed, strict"] == "100.0 / 100.0"


def test_a_run_judged_by_one_rule_on_contact_leaves_the_other_empty() -> None:
    row = rules_table([stored()]).rows[0]
    assert row[2] != "-"
    assert row[-2:] == ("-", "-")


def test_failures_are_charged_to_the_behaviour_that_was_to_be_executed() -> None:
    table = failures_table([stored()])
    cells = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    (strict,) = [row for row in cells if row["rule"] == "strict"]
    assert (strict["outcome"], strict["cf"], strict["tr"]) == ("deviated", "1", "0")
    assert (strict["all"], strict["% of runs"]) == ("1", "50")


def test_transitions_have_a_column_an_agent() -> None:
    table = transitions_table([stored()])
    assert table.columns == ("area", "transition", "GTL", "Expert")
    rows = {row[1]: row[2:] for row in table.rows}
    assert rows["within hallway"] == ("50.0 (2)", "100.0 (2)")


def test_every_table_has_an_interval() -> None:
    numbers = stored().results["agents"]["gtl"]
    low, high = numbers["plan_completion_ci95"]
    assert low < numbers["plan_completion"] < high
    low, high = numbers["by_behavior"]["find_door"]["prediction_ci95"]
    assert 0.0 < low < high == 1.0


def test_csv_and_latex_hold_the_same_rows_as_the_text() -> None:
    table = success_table([stored()])
    parsed = list(csv.reader(io.StringIO(to_csv(table))))
    assert tuple(parsed[0]) == table.columns
    assert [tuple(row) for row in parsed[1:]] == list(table.rows)
    latex = to_latex(table)
    assert latex.count(r" \\") == len(table.rows) + 1
    assert r"area\_3" in latex
    assert "%" not in latex.replace(r"\%", "")
    assert to_rich(table).row_count == len(table.rows)


def test_the_summary_fits_a_terminal_of_eighty_columns() -> None:
    console = Console(width=80)
    with console.capture() as captured:
        console.print(summary_table(stored().results, "area_3"))
    assert "\N{HORIZONTAL ELLIPSIS}" not in captured.get()
    assert "GTL" in captured.get()


def test_a_folder_without_results_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"results\.json: cannot be read"):
        load_results(tmp_path)


@pytest.mark.parametrize("content", ["{", "[]", '{"suite": "imagenav"}', '{"suite": "graphnav"}'])
def test_results_of_another_kind_are_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "results.json").write_text(content)
    (tmp_path / "run.json").write_text('{"name": "x"}')
    said = r"results\.json: (is not the result of an evaluation|not JSON|must hold a JSON object)"
    with pytest.raises(InputError, match=said):
        load_results(tmp_path)
