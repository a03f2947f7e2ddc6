"""The paper's tables with ours, from made-up runs."""

import json
from pathlib import Path

import pytest

from tests.evaluation.imagenav.searches import record
from toponav.cli.main import main
from toponav.core.errors import InputError
from toponav.evaluation.imagenav.metrics import suite_results
from toponav.evaluation.imagenav.tables import (
    ImageNavResults,
    load_image_nav_results,
    paper_numbers,
    sequential_figure,
    sequential_table,
    success_table,
    variants_table,
)


def results(goals: str = "s", **variant) -> dict:  # type: ignore[no-untyped-def,type-arg]
    standard = {"noise": True, "stop": True, "sliding": False, "goals": len(goals)}
    records = [
        record(agent, number, goals if number else "w" * len(goals), level=level)
        for agent in ("nts_rgbd", "nts_rgb", "oracle")
        for level in ("easy", "medium", "hard")
        for number in range(2)
    ]
    found = suite_results(records, {**standard, **variant})
    for name, numbers in found["agents"].items():
        numbers["agent"] = name
    return found


def stored(goals: str = "s", **variant) -> ImageNavResults:  # type: ignore[no-untyped-def]
    return ImageNavResults("homes-test", results(goals, **variant), Path("run"))


def written(folder: Path, content: dict) -> Path:  # type: ignore[type-arg]
    folder.mkdir()
    (folder / "results.json").write_text(json.dumps(content))
    (folder / "run.json").write_text(json.dumps({"name": "homes-test"}))
    return folder


def test_the_papers_overall_is_the_mean_of_its_difficulties() -> None:
    for theirs in paper_numbers()["table_1"].values():
        for numbers in theirs.values():
            for k in range(2):
                mean = sum(numbers[level][k] for level in ("easy", "medium", "hard")) / 3
                assert numbers["overall"][k] == pytest.approx(mean, abs=0.011)
    for theirs in paper_numbers()["table_2"].values():
        for easy, medium, hard, overall in theirs.values():
            assert overall == pytest.approx((easy + medium + hard) / 3, abs=0.011)


def test_an_agent_with_the_same_episodes_in_two_runs_stands_once() -> None:
    once = success_table([stored()]).rows
    assert success_table([stored(), stored()]).rows == once
    more = success_table([stored(), stored(sliding=True)]).rows
    assert len(more) == len(once) + 3


def test_ours_stand_above_the_papers_by_sensor() -> None:
    rows = success_table([stored()]).rows
    nts = [row for row in rows if row[1].startswith("Neural Topological SLAM")]
    assert [(row[0], row[2].split(",")[0]) for row in nts] == [
        ("RGB", "homes-test"),
        ("RGB", "paper"),
        ("RGBD", "homes-test"),
        ("RGBD", "paper"),
    ]
    assert nts[2][4:8] == ("50.0 / 25.0",) * 4
    assert nts[3][4:8] == ("87.0 / 65.0", "58.0 / 38.0", "43.0 / 26.0", "63.0 / 43.0")
    assert any("all four functions" in row[1] for row in rows)


def test_table_2_takes_the_runs_without_stop_and_without_noise() -> None:
    rows = variants_table([stored(), stored(stop=False), stored(noise=False)]).rows
    ours = [row for row in rows if row[2] == "homes-test" and row[1] == "Neural Topological SLAM"]
    assert {row[0] for row in ours} == {"no stop", "no noise"}
    assert not [row for row in variants_table([stored()]).rows if row[2] == "homes-test"]


def test_figure_8_follows_the_goals() -> None:
    run = stored(goals="sst")
    row = sequential_table([run]).rows[0]
    assert [cell.split(" ")[0] for cell in row[3:]] == ["50.0", "50.0", "33.3"]
    figure = sequential_figure([run])
    assert [len(line.get_xdata()) for line in figure.axes[0].lines] == [3, 3, 3]


def test_the_command_writes_every_table_and_the_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = written(tmp_path / "run", results(goals="ss"))
    out = tmp_path / "out"
    assert main(["tables", str(folder), "--out", str(out), "--figures"]) == 0
    made = {path.name for path in out.iterdir()}
    assert {"table_nts_1.txt", "table_nts_figure_8.txt", "nts_figure_8.png"} <= made
    assert main(["tables", str(folder), "--only", "nts_1", "--format", "csv"]) == 0
    assert "Neural Topological SLAM" in capsys.readouterr().out


@pytest.mark.parametrize("spoil", [{"agents": {}}, {"agents": {"a": {}}}, {"paired": None}])
def test_spoiled_results_are_named(tmp_path: Path, spoil: dict) -> None:  # type: ignore[type-arg]
    folder = written(tmp_path / "run", {**results(), **spoil})
    with pytest.raises(InputError, match="is not the result of an evaluation"):
        load_image_nav_results(folder)
