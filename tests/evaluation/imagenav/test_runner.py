"""Whole evaluations in the two rooms: files, resume, and what is refused."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.evaluation.imagenav import searches
from toponav.core.errors import InputError
from toponav.evaluation.imagenav import runner, worker
from toponav.evaluation.imagenav.records import load_record
from toponav.evaluation.imagenav.runner import ImageNavConfig, evaluate_image_nav, record_path
from toponav.evaluation.imagenav.worker import ImageNavSettings, sequential_goals
from toponav.worlds.free_space import FreeSpace

SCRIPTED = "tests.evaluation.imagenav.searches:scripted"


@pytest.fixture(autouse=True)
def two_rooms(monkeypatch: pytest.MonkeyPatch) -> None:
    """The suite of homes is two rooms, and has four easy episodes."""
    monkeypatch.setattr(worker, "_scene", lambda generator, seed: searches.building())
    episodes = tuple(searches.episode(number) for number in range(4))
    monkeypatch.setattr(runner, "load_episode_set", lambda suite, levels, count: episodes[:count])


def config(out: Path, **changes) -> ImageNavConfig:  # type: ignore[no-untyped-def]
    settings = changes.pop("settings", ImageNavSettings(max_steps=10))
    agents = (f"{SCRIPTED},label=scripted", "shortest_path")
    return ImageNavConfig(
        **{"agents": agents, "out": out, "episodes": 2, "settings": settings, **changes}
    )


def test_the_folder_holds_the_three_files(tmp_path: Path) -> None:
    done = []
    found = evaluate_image_nav(config(tmp_path), lambda count, total: done.append((count, total)))
    results = json.loads((tmp_path / "results.json").read_text())
    run = json.loads((tmp_path / "run.json").read_text())
    assert results == found.results
    assert results["suite"] == "imagenav"
    assert list(results["agents"]) == ["scripted", "shortest_path"]
    assert run["settings"]["max_steps"] == 10
    assert run["episodes"] == ["homes-val/easy/0000", "homes-val/easy/0001"]
    assert run["choices"]["shortest_path"]["weights_sha256"] is None
    assert done[0] == (0, 4)
    assert done[-1] == (4, 4)
    rows = pq.read_table(tmp_path / "episodes.parquet").to_pylist()
    assert [(row["agent"], row["number"]) for row in rows] == [
        ("scripted", 0),
        ("scripted", 1),
        ("shortest_path", 0),
        ("shortest_path", 1),
    ]
    assert rows[0]["rooms"] == 2


def test_finished_episodes_are_kept_and_give_the_same_results(tmp_path: Path) -> None:
    def lasting(results: dict) -> dict:  # type: ignore[type-arg]
        for numbers in results["agents"].values():
            for name in ("steps_per_second", "act_ms_p50", "act_ms_p99"):
                numbers.pop(name)
        return results

    whole = evaluate_image_nav(config(tmp_path / "whole"))
    evaluate_image_nav(config(tmp_path / "parts", episodes=1))
    second = record_path(tmp_path / "parts", "scripted", searches.episode(1))
    second.write_bytes(b"cut short")
    resumed = evaluate_image_nav(config(tmp_path / "parts"))
    assert resumed.resumed == 2
    assert lasting(resumed.results) == lasting(whole.results)


def test_other_settings_do_not_resume(tmp_path: Path) -> None:
    evaluate_image_nav(config(tmp_path, episodes=1))
    other = ImageNavSettings(max_steps=10, sliding=True)
    assert evaluate_image_nav(config(tmp_path, episodes=1, settings=other)).resumed == 0


def test_all_agents_have_the_same_noise(tmp_path: Path) -> None:
    agents = (f"{SCRIPTED},label=one", f"{SCRIPTED},label=two")
    evaluate_image_nav(config(tmp_path, agents=agents, episodes=1))
    paths = []
    for label in ("one", "two"):
        stored = load_record(record_path(tmp_path, label, searches.episode(0)))
        assert stored is not None
        paths.append([(step.x_m, step.y_m, step.yaw_rad) for step in stored.record.steps])
    assert paths[0] == paths[1]


def test_goals_follow_each_other_at_the_papers_distance() -> None:
    space = FreeSpace.of(searches.building(), 0.18)
    goals = sequential_goals(space, searches.episode(), 6, seed=1)
    assert goals == sequential_goals(space, searches.episode(), 6, seed=1)
    last = searches.GOAL
    for goal in goals:
        away_m = space.geodesic_m((last.x_m, last.y_m))[space.grid.cell_of(goal.x_m, goal.y_m)]
        assert 1.5 <= away_m < 5.0
        last = goal


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"agents": ("nts_rgdb",)}, "did you mean 'nts_rgb'"),
        ({"agents": ()}, "at least one agent"),
        ({"agents": ("random", "random")}, "two agents are called 'random'"),
        ({"agents": ("random,label",)}, "no setting of its own"),
        ({"agents": ("no_such_module:thing",)}, "cannot be imported"),
        ({"agents": ("builtins:repr",)}, "reset, act and belief"),
        ({"agents": ("random,speed=3",)}, "no setting 'speed'"),
    ],
)
def test_what_cannot_be_run_is_refused(tmp_path: Path, changes: dict, says: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match=says):
        evaluate_image_nav(config(tmp_path, **changes))


@pytest.mark.parametrize("settings", [{"goals": 0}, {"max_steps": 0}, {"seed": -1}])
def test_settings_out_of_range_are_refused(settings: dict) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match="must be"):
        ImageNavSettings(**settings)
