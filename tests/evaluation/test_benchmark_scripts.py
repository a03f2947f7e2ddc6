"""The scripts under benchmarks/ that make the project's tables."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.benchmark_script import script

ABLATIONS = script("graphnav_ablations")
AREAS = script("graphnav_areas")
IMAGE_NAV = script("imagenav")
IMAGE_NAV_PAGE = script("imagenav_docs")


def write(path: Path, content: Any) -> Path:
    path.write_text(json.dumps(content))
    return path


def test_variants_drive_the_same_plans_and_are_compared_pair_by_pair(tmp_path: Path) -> None:
    variants = [
        {"name": "dreams", "agent": "tests.evaluation.stand_ins:daydreamer"},
        {"name": "stands", "agent": "tests.evaluation.stand_ins:spinner", "note": "never moves"},
    ]
    words = [str(write(tmp_path / "v.json", variants)), "--buildings", "1", "--episodes", "1"]
    words += ["--workers", "1", "--out", str(tmp_path), "--runs", str(tmp_path / "runs")]
    assert ABLATIONS.main(words) == 0
    document = json.loads((tmp_path / "graphnav_ablations.json").read_text())
    dreams, stands = document["variants"]
    assert stands["tolerant"]["success_rate"] == 0.0
    assert stands["tolerant"]["outcomes"]["stuck"] == 1
    assert dreams["tolerant"]["success_rate"] == document["expert"]["tolerant"]["success_rate"]
    assert "difference" not in dreams["strict"]
    assert stands["tolerant"]["difference"] == -dreams["tolerant"]["success_rate"]
    assert document["metrics"]["stands_strict_success"] == 0.0
    table = (tmp_path / "graphnav_ablations.md").read_text()
    assert "| stands: never moves | 0.0 /" in table
    assert "offices-val (seeds 1000 to 1000)" in table


@pytest.mark.parametrize(
    ("variants", "said"),
    [
        ({}, "variants are a list"),
        ([{"name": "a", "agent": "graphnva"}], "did you mean 'graphnav'"),
        ([{"name": "a"}], "needs a name of its own and an agent"),
        ([{"name": "a", "agent": "gtl", "wieghts": "b"}], "did you mean 'weights'"),
    ],
)
def test_broken_variants_are_refused(
    tmp_path: Path, variants: Any, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ABLATIONS.main([str(write(tmp_path / "v.json", variants))]) == 1
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("suite", ["offices-test", "area_3"])
def test_ablations_never_see_test_buildings(
    tmp_path: Path, suite: str, capsys: pytest.CaptureFixture[str]
) -> None:
    variants = write(tmp_path / "v.json", [{"name": "a", "agent": "expert"}])
    assert ABLATIONS.main([str(variants), "--suite", suite]) == 1
    assert "validation buildings" in capsys.readouterr().err


def test_the_paired_interval_is_narrower_where_variants_agree() -> None:
    rng = np.random.default_rng(0)
    here = (rng.random(200) < 0.7).astype(float)
    same, other = here.copy(), rng.permutation(here)
    same[:4] = 1.0 - same[:4]
    close, wide = (ABLATIONS.paired_interval(here, there) for there in (same, other))
    assert close[0] < (here - same).mean() < close[1]
    assert close[1] - close[0] < wide[1] - wide[0]


def test_chosen_weights_keep_the_plain_name() -> None:
    assert AREAS.chosen("gtl", "runs/best", None) == "gtl,weights=runs/best,label=gtl"
    assert AREAS.chosen("phasenet", "runs/best", "b") == "phasenet,weights=b,label=phasenet"
    assert AREAS.chosen("expert", "runs/best", "b") == "expert"


def test_stored_runs_of_image_goals_share_what_is_finished_and_make_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = IMAGE_NAV.Run(("shortest_path", "random"), 1, levels=("easy",))
    alone = IMAGE_NAV.Run(("random",), 1, levels=("easy",))
    monkeypatch.setattr(IMAGE_NAV, "RUNS", {"both": run, "alone": alone})
    words = ["--suite", "homes-val", "--workers", "1", "--out", str(tmp_path / "out")]
    words += ["--runs", str(tmp_path / "runs")]
    assert IMAGE_NAV.main(words) == 0
    assert len(list((tmp_path / "runs").rglob("easy-0000.parquet"))) == 2
    for name, agents in {"both": {"shortest_path", "random"}, "alone": {"random"}}.items():
        folder = tmp_path / "out" / name
        assert json.loads((folder / "results.json").read_text())["agents"].keys() == agents
        assert json.loads((folder / "run.json").read_text())["hardware"]["cores"] >= 1
        failures = json.loads((folder / "failures.json").read_text())
        assert sum(failures["random"].values()) == 1
        assert (folder / "episodes.parquet").exists()
    table = (tmp_path / "out" / "tables.md").read_text()
    assert "Shortest path" in table
    assert IMAGE_NAV.main(["nonsense"]) == 2


def test_the_page_of_image_goals_shows_what_is_stored() -> None:
    page = IMAGE_NAV_PAGE.PAGE.read_text("utf-8")
    assert IMAGE_NAV_PAGE.written(page) == page
    shown = set(re.findall(r"<!-- stored: (\w+) -->", page))
    assert shown == IMAGE_NAV_PAGE.TABLES.keys()


def test_a_table_of_the_page_that_drifted_is_noticed_and_written_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "nts.md"
    page.write_text("before\n<!-- stored: episodes -->\n| old |\n<!-- end -->\nafter\n")
    monkeypatch.setattr(IMAGE_NAV_PAGE, "PAGE", page)
    assert IMAGE_NAV_PAGE.main(["--check"]) == 1
    assert IMAGE_NAV_PAGE.main([]) == 0
    assert IMAGE_NAV_PAGE.main(["--check"]) == 0
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "| hard | " in text
    assert "old" not in text
