import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from tests.evaluation.tiny_building import tiny_map, tiny_scene
from toponav.core.errors import InputError
from toponav.evaluation import runner
from toponav.evaluation.protocol import JudgeRules
from toponav.evaluation.runner import EvaluationConfig, evaluate
from toponav.evaluation.suite import SuiteSource
from toponav.evaluation.worker import EpisodeWorker, RunSettings
from toponav.maps.spec import save_map
from toponav.worlds.storage import save_scene

SPINNER = "tests.evaluation.stand_ins:spinner"
DAYDREAMER = "tests.evaluation.stand_ins:daydreamer"
TIMES = {"act_ms_p50", "act_ms_p99", "episode_s", "steps_per_second"}


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> SuiteSource:
    folder = tmp_path_factory.mktemp("tiny")
    save_scene(tiny_scene(), folder / "scene")
    save_map(tiny_map(), folder / "tiny.topo.json")
    return SuiteSource(scene=folder / "scene", map=folder / "tiny.topo.json", episodes=2, seed=3)


@pytest.fixture
def configure(source: SuiteSource, tmp_path: Path) -> Callable[..., EvaluationConfig]:
    def make(name: str = "run", agents: tuple[str, ...] = (DAYDREAMER, "expert"), **changes: Any):
        return replace(EvaluationConfig(source, agents, tmp_path / name), **changes)

    return make


def timeless(results: Any) -> Any:
    """Results without what depends on the clock."""
    if isinstance(results, dict):
        return {key: timeless(value) for key, value in results.items() if key not in TIMES}
    return results


def steps_of(out: Path) -> list[dict[str, Any]]:
    return list(pq.read_table(out / "steps.parquet").to_pylist())


class StopHereError(Exception):
    pass


def stop_after(count: int) -> Callable[[int, int], None]:
    def progress(done: int, total: int) -> None:
        if done == count:
            raise StopHereError

    return progress


def test_an_evaluation_leaves_a_folder_of_results(configure: Callable[..., Any]) -> None:
    config = configure()
    evaluation = evaluate(config)
    written = json.loads((config.out / "results.json").read_text())
    assert written == json.loads(json.dumps(evaluation.results))
    assert written["agents"]["expert"]["success_rate"] == 1.0
    run = json.loads((config.out / "run.json").read_text())
    assert run["agents"] == [DAYDREAMER, "expert"]
    assert run["settings"]["rules"]["tolerance_steps"] == 5
    assert run["source"]["seed"] == 3
    assert {"scene_content", "map_content", "weights"} <= run["data"].keys()
    assert pq.read_table(config.out / "episodes.parquet").num_rows == 4


def test_an_interrupted_evaluation_resumes_to_the_same_result(
    configure: Callable[..., Any],
) -> None:
    whole = evaluate(configure("whole"))
    config = configure("interrupted")
    for finished in (1, 3):
        with pytest.raises(StopHereError):
            evaluate(config, stop_after(finished))
    assert not (config.out / "results.json").exists()
    resumed = evaluate(config)
    assert resumed.resumed == 3
    assert timeless(resumed.results) == timeless(whole.results)
    assert steps_of(resumed.out) == steps_of(whole.out)


def test_a_truncated_episode_is_run_again(configure: Callable[..., Any]) -> None:
    config = configure()
    before = evaluate(config)
    part = config.out / "episodes" / "expert" / "00001.parquet"
    part.write_bytes(part.read_bytes()[:200])
    after = evaluate(config)
    assert after.resumed == 3
    assert timeless(after.results) == timeless(before.results)


def test_a_finished_evaluation_is_not_run_again(
    configure: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluate(configure())

    def refuse(*_: object) -> None:
        raise AssertionError("ran an episode again")

    monkeypatch.setattr(EpisodeWorker, "run", refuse)
    assert evaluate(configure()).resumed == 4


@pytest.mark.parametrize(
    "settings", [RunSettings(seed=1), RunSettings(rules=JudgeRules(collisions="stuck"))]
)
def test_other_settings_run_every_episode_again(
    configure: Callable[..., Any], settings: RunSettings
) -> None:
    evaluate(configure(agents=(SPINNER,)))
    assert evaluate(configure(agents=(SPINNER,), settings=settings)).resumed == 0


def test_adding_an_agent_keeps_the_others_episodes(configure: Callable[..., Any]) -> None:
    evaluate(configure(agents=("expert",)))
    assert evaluate(configure(agents=(SPINNER, "expert"))).resumed == 2


def test_an_agent_that_never_moves_is_stuck(configure: Callable[..., Any]) -> None:
    results = evaluate(configure(agents=(SPINNER,))).results["agents"][SPINNER]
    assert results["outcomes"]["stuck"] == 2
    assert results["plan_completion"] < 0.5


def test_the_order_of_episodes_does_not_matter(configure: Callable[..., Any]) -> None:
    config = configure()
    suite = runner.load_suite(config.source)
    forwards, backwards = (EpisodeWorker(suite, config.settings) for _ in range(2))
    first = {index: forwards.run(DAYDREAMER, index) for index in (0, 1)}
    second = {index: backwards.run(DAYDREAMER, index) for index in (1, 0)}
    for index in (0, 1):
        a, b = first[index], second[index]
        assert [replace(step, act_ms=0.0) for step in a.steps] == [
            replace(step, act_ms=0.0) for step in b.steps
        ]


@pytest.mark.slow
def test_the_number_of_workers_does_not_matter(configure: Callable[..., Any]) -> None:
    alone = evaluate(configure("alone", workers=1))
    many = evaluate(configure("many", workers=2))
    assert timeless(alone.results) == timeless(many.results)
    assert steps_of(alone.out) == steps_of(many.out)


def test_a_worker_reports_a_users_mistake(
    configure: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise InputError("the weights are broken", where="weights", remedy="get them again")

    config = configure()
    monkeypatch.setattr(runner, "_worker", object())
    monkeypatch.setattr(runner, "_worker_out", config.out)
    monkeypatch.setattr(runner, "_run_and_save", refuse)
    answer = runner._run_in_worker(("expert", 0), "key")
    assert answer == ("the weights are broken", "weights", "get them again")


@pytest.mark.parametrize(
    ("change", "where"), [({"workers": 0}, "--workers"), ({"agents": ()}, "--agent")]
)
def test_a_senseless_configuration_is_refused(
    configure: Callable[..., Any], change: dict[str, Any], where: str
) -> None:
    with pytest.raises(InputError, match=where):
        configure(**change)


def test_missing_weights_are_found_before_anything_is_written(
    configure: Callable[..., Any], tmp_path: Path
) -> None:
    settings = RunSettings(weights=str(tmp_path / "nothing"))
    with pytest.raises(InputError, match="nothing"):
        evaluate(configure(agents=("gtl",), settings=settings))
    assert not (tmp_path / "run").exists()
