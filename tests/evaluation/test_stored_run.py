import csv
import io
import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.evaluation.records import MAP, STEP, record
from tests.evaluation.tiny_building import tiny_map, tiny_scene
from toponav.cli.main import main
from toponav.core.errors import InputError
from toponav.core.vocabulary import Outcome
from toponav.evaluation.failures import _beside_others, edge_counts, failures_csv
from toponav.evaluation.records import load_episode, plan_length_m, write_step_table
from toponav.evaluation.run_figures import choose_episodes
from toponav.evaluation.runner import EvaluationConfig, evaluate
from toponav.evaluation.step_table import StepTable
from toponav.evaluation.stored_run import find_building, load_run
from toponav.evaluation.suite import SuiteSource
from toponav.maps.spec import save_map
from toponav.worlds.storage import save_scene

SPINNER = "tests.evaluation.stand_ins:spinner,label=spinner"
DAYDREAMER = "tests.evaluation.stand_ins:daydreamer,label=daydreamer"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished evaluation with its scene and map beside it, as the demo leaves them."""
    folder = tmp_path_factory.mktemp("tiny") / "run"
    save_scene(tiny_scene(), folder / "scene")
    save_map(tiny_map(), folder / "map.topo.json")
    source = SuiteSource(scene=folder / "scene", map=folder / "map.topo.json", episodes=2, seed=3)
    evaluate(EvaluationConfig(source, (DAYDREAMER, SPINNER, "expert"), folder))
    return folder


def test_a_stored_episode_is_the_one_that_was_driven_to_a_centimetre(out: Path) -> None:
    run = load_run(out)
    building = find_building(run)
    (part,) = (out / "episodes").glob("daydreamer*/00001.parquet")
    driven = load_episode(part)
    assert driven is not None
    again = run.record("daydreamer", 1, building.map)
    assert again.plan == driven.record.plan
    assert again.strict.outcome is driven.record.strict.outcome
    steps = driven.record.judged_steps("tolerant")
    assert len(again.steps) == len(steps)
    for mine, theirs in zip(again.steps, steps, strict=True):
        assert mine.x_m == pytest.approx(theirs.x_m, abs=0.0051)
        assert mine.yaw_rad == pytest.approx(theirs.yaw_rad, abs=0.0051)
        assert mine.time_s == pytest.approx(theirs.time_s, abs=1e-5)
        assert mine.plan_probability == pytest.approx(theirs.plan_probability, abs=0.5 / 31)
        for name in ("true_node", "true_edge", "true_behavior", "believed_edge", "behavior"):
            assert getattr(mine, name) == getattr(theirs, name)


def test_a_step_takes_a_few_bytes(tmp_path: Path) -> None:
    walk = np.random.default_rng(0).normal(0, 0.05, (4000, 2)).cumsum(axis=0)
    steps = tuple(
        STEP.__class__(**{**vars(STEP), "x_m": float(x), "y_m": float(y)}) for x, y in walk
    )
    write_step_table(tmp_path / "steps.parquet", [record(steps=steps)])
    assert (tmp_path / "steps.parquet").stat().st_size < 10 * len(steps)


def test_figures_are_drawn_from_stored_results(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figures", str(out), "--out", str(tmp_path), "--agent", "daydreamer"]) == 0
    written = {Path(line).name for line in capsys.readouterr().out.split()}
    kinds = {name.rsplit("_0", 1)[0].removesuffix(".png") for name in written}
    assert kinds == {
        "failures_daydreamer", "failures_daydreamer.csv", "trajectories_daydreamer",
        "localization_daydreamer", "lengths",
    }  # fmt: skip
    assert all((tmp_path / name).stat().st_size > 50 for name in written)
    first = (tmp_path / "lengths.png").read_bytes()
    assert main(["figures", str(out), "--out", str(tmp_path), "--only", "lengths"]) == 0
    assert (tmp_path / "lengths.png").read_bytes() == first


def test_tables_draw_the_figures_too_if_asked(
    out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(
        "toponav.cli.figures.figures", lambda folders, out: asked.append((folders, out)) or 0
    )
    words = ["tables", str(out), "--only", "5", "--out", str(tmp_path), "--figures"]
    assert main(words) == 0
    assert asked == [((out,), tmp_path)]
    assert [path.name for path in tmp_path.iterdir()] == ["table_5.txt"]


def test_a_run_without_steps_still_has_failure_maps(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = Path(shutil.copytree(out, tmp_path / "old"))
    (old / "steps.parquet").unlink()
    words = ["figures", str(old), "--out", str(tmp_path / "drawn"), "--agent", "spinner"]
    assert main([*words, "--format", "svg"]) == 0
    said = capsys.readouterr()
    assert "failures_spinner.svg" in said.out
    assert "trajectories" not in said.out
    assert "has no steps.parquet" in said.err


def test_a_building_of_another_content_is_refused(out: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(out, tmp_path / "other"))
    run = json.loads((other / "run.json").read_text())
    run["data"]["scene_content"] = "0" * 64
    (other / "run.json").write_text(json.dumps(run))
    with pytest.raises(InputError, match="is not the building of the run"):
        find_building(load_run(other))


def test_a_building_that_is_not_there_is_asked_for(out: Path, tmp_path: Path) -> None:
    bare = Path(shutil.copytree(out, tmp_path / "bare"))
    shutil.rmtree(bare / "scene")
    with pytest.raises(InputError, match=r"--area AREA\.yaml, or with --scene"):
        find_building(load_run(bare))


@pytest.mark.parametrize("agent", ["daydraemer", "nobody"])
def test_an_agent_that_did_not_drive_is_refused(
    out: Path, agent: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figures", str(out), "--agent", agent]) == 1
    assert f"no agent of this run is called '{agent}'" in capsys.readouterr().err


def test_broken_tables_are_one_clear_error(out: Path, tmp_path: Path) -> None:
    broken = Path(shutil.copytree(out, tmp_path / "broken"))
    steps = broken / "steps.parquet"
    steps.write_bytes(steps.read_bytes()[:-50])
    with pytest.raises(InputError, match=r"steps\.parquet: is not a table of steps"):
        StepTable(steps)
    pq.write_table(pa.table({"agent": ["a"]}), steps)
    with pytest.raises(InputError, match="is not a table of steps"):
        StepTable(steps)
    (broken / "episodes.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"episodes\.parquet: is not a table of episodes"):
        load_run(broken)
    pq.write_table(pa.table({"agent": ["a"]}), broken / "episodes.parquet")
    with pytest.raises(InputError, match="has no column episode"):
        load_run(broken)


def test_an_episode_that_was_not_driven_is_refused(out: Path) -> None:
    run = load_run(out)
    with pytest.raises(InputError, match="has no episode 99 of expert"):
        run.record("expert", 99, MAP)


def test_figures_show_successes_and_a_failure(out: Path) -> None:
    run = load_run(out)
    assert sorted(choose_episodes(run, "expert")) == [0, 1]
    assert len(choose_episodes(run, "spinner", 1)) == 1


def row(outcome: str, reached: int, nodes: tuple[str, ...] = ("a", "b", "c")) -> dict[str, object]:
    return {
        "nodes": list(nodes),
        "behaviors": ["find_door", "turn_left"],
        "tolerant_outcome": outcome,
        "tolerant_nodes_reached": reached,
    }


def test_a_failed_run_is_charged_to_the_edge_that_it_was_on() -> None:
    counts = edge_counts([row("success", 3), row("stuck", 1), row("collided", 2), row("stuck", 3)])
    by_edge = {(one.source, one.target): one for one in counts}
    assert by_edge["a", "b"].attempts == 4
    assert by_edge["a", "b"].ended == {Outcome.STUCK: 1}
    assert by_edge["b", "c"].attempts == 3
    assert by_edge["b", "c"].ended == {Outcome.COLLIDED: 1, Outcome.STUCK: 1}
    assert counts[0].source == "b"
    table = list(csv.DictReader(io.StringIO(failures_csv(counts))))
    assert [(line["source"], line["failures"], line["stuck"]) for line in table] == [
        ("b", "2", "1"),
        ("a", "1", "1"),
    ]


def test_markers_of_one_place_lie_side_by_side() -> None:
    taken: list[tuple[float, float]] = []
    places = [_beside_others((1.0, 1.0), taken) for _ in range(5)]
    assert places[0] == (1.0, 1.0)
    gaps = [np.hypot(a[0] - b[0], a[1] - b[1]) for a in places for b in places if a != b]
    assert min(gaps) > 0.4


def test_the_length_of_a_plan_is_that_of_its_legs() -> None:
    plan = record().plan
    nodes = [MAP.node(node) for node in plan.nodes]
    legs = [np.hypot(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in itertools.pairwise(nodes)]
    assert plan_length_m(MAP, plan) == pytest.approx(sum(legs))
