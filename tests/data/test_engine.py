"""Tasks in processes and on Ray: the same results, and a killed worker costs its task's time."""

import logging
import os
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from toponav.core.errors import InputError
from toponav.data.engine import Engine, run_tasks

needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed")


def square(number: int) -> int:
    return number * number


def fails(number: int) -> int:
    raise InputError("no such home", where=f"home {number}", remedy="take another")


def dies_once(task: tuple[Path, int]) -> tuple[int, int]:
    """Notes that it began; the third task kills its process the first time."""
    folder, number = task
    begun = folder / f"{number}-{time.time_ns()}"
    begun.touch()
    if number == 2 and len(list(folder.glob("2-*"))) == 1:
        os._exit(1)
    return number, number * number


def process_of(task: str) -> int:
    time.sleep(0.05)
    return os.getpid()


def processes_of_each_key(engine: Engine) -> dict[str, set[int]]:
    found: dict[str, set[int]] = {"a": set(), "b": set()}
    run_tasks(
        process_of,
        ["a1", "b1", "a2", "b2", "a3", "b3", "a4", "b4"],
        2,
        engine=engine,
        affinity=lambda task: task[0],
        on_result=lambda task, process: found[task[0]].add(process),
    )
    return found


def results(engine: Engine, workers: int) -> dict[int, int]:
    found: dict[int, int] = {}
    run_tasks(square, range(7), workers, engine=engine, on_result=found.__setitem__)
    return found


def test_every_result_is_handed_over_with_its_task() -> None:
    assert results("local", 1) == results("local", 2) == {k: k * k for k in range(7)}


def test_tasks_of_a_key_run_in_one_process_as_long_as_others_have_work() -> None:
    found = processes_of_each_key("local")
    assert len(found["a"] | found["b"]) == 2
    # Whoever is done may help the other; that one does not help in return.
    assert min(len(found["a"]), len(found["b"])) == 1


def test_progress_ends_with_all_tasks() -> None:
    told: list[int] = []
    run_tasks(square, range(3), 1, on_poll=told.append)
    assert told == [1, 2, 3]


@pytest.mark.skipif(find_spec("ray") is not None, reason="Ray is installed")
def test_without_ray_the_extra_is_named() -> None:
    with pytest.raises(InputError, match=r"toponav\[ray\]"):
        run_tasks(square, [1], 1, engine="ray")


@needs_ray
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_ray_gives_what_processes_give_and_replaces_a_killed_worker(tmp_path: Path) -> None:
    import ray

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level=logging.ERROR)
    try:
        assert results("ray", 2) == results("local", 1)
        with pytest.raises(InputError, match="no such home") as error:
            run_tasks(fails, [3], 1, engine="ray")
        assert error.value.where == "home 3"
        ran = processes_of_each_key("ray")
        assert len(ran["a"] | ran["b"]) == 2
        assert min(len(ran["a"]), len(ran["b"])) == 1
        found: dict[tuple[Path, int], tuple[int, int]] = {}
        tasks = [(tmp_path, number) for number in range(5)]
        run_tasks(dies_once, tasks, 2, engine="ray", on_result=found.__setitem__)
    finally:
        ray.shutdown()
    assert [found[task] for task in tasks] == [(k, k * k) for k in range(5)]
    begun = [len(list(tmp_path.glob(f"{k}-*"))) for k in range(5)]
    assert begun == [1, 1, 2, 1, 1]
