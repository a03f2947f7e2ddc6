"""The commands that evaluate, from words on the command line to files on disk."""

import json
from pathlib import Path

import pytest

from tests.evaluation.tiny_building import tiny_map, tiny_scene
from toponav.cli.main import main
from toponav.maps.spec import save_map
from toponav.worlds.storage import save_scene

DAYDREAMER = "tests.evaluation.stand_ins:daydreamer"


@pytest.fixture
def tiny(tmp_path: Path) -> list[str]:
    save_scene(tiny_scene(), tmp_path / "scene")
    save_map(tiny_map(), tmp_path / "tiny.topo.json")
    return ["--scene", str(tmp_path / "scene"), "--map", str(tmp_path / "tiny.topo.json")]


def test_an_evaluation_ends_in_tables(
    tiny: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "run")
    command = ["eval", "graphnav", *tiny, "--agent", DAYDREAMER, "--episodes", "1", "--out", out]
    assert main(command) == 0
    assert "Expert" in capsys.readouterr().out
    assert main([*command, "--json"]) == 0
    results = json.loads(capsys.readouterr().out)
    assert list(results["agents"]) == [DAYDREAMER, "expert"]
    assert main(["tables", out]) == 0
    assert "Table I" in capsys.readouterr().out
    assert main(["tables", out, "--format", "csv", "--out", str(tmp_path / "tables")]) == 0
    assert (tmp_path / "tables" / "table_1.csv").read_text().startswith("area,model,rule,cf")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--agent", "graphnva"], "did you mean 'graphnav'"),
        (["--agent", "expert", "--workers", "0"], "--workers: workers must be 1 to"),
        (["--agent", "expert", "--episodes", "0"], "--episodes"),
        (["--agent", "expert", "--area", "a.yaml"], "needs an area with pairs, or a scene"),
    ],
)
def test_a_mistake_is_answered_in_one_line(
    tiny: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    out = tmp_path / "run"
    assert main(["eval", "graphnav", *tiny, *words, "--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said
    assert not out.exists()


@pytest.mark.parametrize("words", [["eval", "graphnav"], ["tables"], ["demo"]])
def test_help_has_an_example(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*words, "--help"]) == 0
    assert f"toponav {words[0]}" in capsys.readouterr().out.split("options")[0].split("\n", 1)[1]


@pytest.mark.slow
def test_the_demo_ends_with_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from toponav.evaluation.demo import DemoConfig, run_demo

    said: list[str] = []
    result = run_demo(
        DemoConfig(tmp_path / "demo", plans=2, agents=(DAYDREAMER, "expert"), search=False),
        lambda what, done, total: said.append(what),
    )
    page = result.page.read_text("utf-8")
    assert page.startswith("<!doctype html>")
    assert page.count("<figure>") >= 6
    assert "data:video/mp4;base64," in page
    assert {"filming", "writing the page"} <= set(said)
    assert result.report.successes("expert") == 2
    names = {path.name for path in result.page.parent.iterdir()}
    assert names == {
        *("report.html", "drive.mp4", "results.json", "run.json", "episodes.parquet"),
        *("steps.parquet", "scene", "map.topo.json"),
    }
    assert main(["tables", str(tmp_path / "demo")]) == 0
    assert "Expert" in capsys.readouterr().out
