"""Runs a suite with any number of processes, resumes, and writes the folder of results."""

import hashlib
import json
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError
from toponav.core.files import check_out_folder
from toponav.data.engine import Engine, run_tasks
from toponav.data.parallel import check_workers
from toponav.evaluation.agents import AgentChoice
from toponav.evaluation.metrics import suite_results
from toponav.evaluation.provenance import (
    hash_of_file,
    hash_of_weights,
    library_versions,
    source_commit,
)
from toponav.evaluation.records import (
    StoredEpisode,
    load_episode,
    save_episode,
    write_atomically,
    write_episode_table,
    write_step_table,
)
from toponav.evaluation.suite import Suite, SuiteSource, load_suite
from toponav.evaluation.worker import EpisodeWorker, RunSettings

__all__ = ["Evaluation", "EvaluationConfig", "Progress", "evaluate", "part_of", "use_one_thread"]

Progress = Callable[[int, int], None]
"""Told how many episodes are done, and of how many."""

_Job = tuple[str, int]


@dataclass(frozen=True)
class EvaluationConfig:
    """One evaluation."""

    source: SuiteSource
    """What is evaluated."""
    agents: tuple[str | AgentChoice, ...]
    """Who drives, in the order of the tables: names in the registry, or with weights and
    settings of their own as `AgentChoice.parse` reads them."""
    out: Path
    """Folder of results; an interrupted evaluation in it is resumed."""
    settings: RunSettings = field(default_factory=RunSettings)
    """What the episodes depend on besides."""
    workers: int = 1
    """Processes; results do not depend on it."""
    engine: Engine = "local"
    """Where they run; nor on this."""

    def __post_init__(self) -> None:
        if not self.agents:
            raise InputError(
                "at least one agent is needed",
                where="--agent",
                remedy="name one, such as --agent graphnav_pf",
            )
        labels = self.labels
        if len(set(labels)) < len(labels):
            twice = next(label for label in labels if labels.count(label) > 1)
            raise InputError(
                f"two agents are called '{twice}'",
                where="--agent",
                remedy="tell them apart with ,label=NAME",
            )
        if self.engine == "local":
            check_workers(self.workers)
        check_out_folder(self.out)

    @cached_property
    def choices(self) -> tuple[AgentChoice, ...]:
        """Who drives, parsed."""
        return tuple(
            AgentChoice.parse(agent) if isinstance(agent, str) else agent for agent in self.agents
        )

    @property
    def labels(self) -> tuple[str, ...]:
        """The agents' names in the results."""
        return tuple(choice.label for choice in self.choices)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A finished evaluation.

    Attributes:
        suite: What was evaluated.
        results: The content of `results.json`.
        resumed: Episodes that an earlier run had finished.
        commits: Source versions that made the episodes; more than one deserves a warning.
        out: The folder.
    """

    suite: Suite
    results: dict[str, Any]
    resumed: int
    commits: tuple[str | None, ...]
    out: Path


def evaluate(config: EvaluationConfig, progress: Progress | None = None) -> Evaluation:
    """Run what is still to be run, and write `run.json`, `episodes.parquet`, `results.json`.

    Each finished episode is put on disk at once (`episodes/<agent>/<index>.parquet`), so an
    interruption loses at most the episodes under way. Whatever the interruptions and the
    number of workers, the results are the same, times apart.

    Args:
        config: What to run and where to write.
        progress: Called at the start and after each episode.

    Raises:
        InputError: If an input cannot be used, or a worker process died.
        KeyboardInterrupt: After the episodes under way have been finished and written.
    """
    suite = load_suite(config.source)
    worker = EpisodeWorker(suite, config.settings, config.choices)
    jobs = [(agent, task.index) for task in suite.tasks for agent in config.labels]
    keys = {job: worker.key(*job) for job in jobs}
    done = _finished_jobs(config.out, keys)
    pending = [job for job in jobs if job not in done]
    for agent in sorted({agent for agent, _ in pending if agent != "expert"}):
        worker.prepare(agent)
    _write_run(config, worker)
    report = progress or (lambda count, total: None)
    report(len(done), len(jobs))
    if config.engine == "ray":
        _run_on_cluster(config, pending, keys, lambda count: report(len(done) + count, len(jobs)))
        return _finish(config, worker, jobs, keys, len(done))
    for count, _ in enumerate(_run_jobs(config, worker, pending, keys), start=len(done) + 1):
        report(count, len(jobs))
    return _finish(config, worker, jobs, keys, len(done))


def part_of(out: Path, agent: str, index: int) -> Path:
    """The file of one finished episode, by the agent's label, in a folder of results."""
    return _part(out, (agent, index))


def _part(out: Path, job: _Job) -> Path:
    agent = "".join(letter if letter.isalnum() or letter in "_-" else "_" for letter in job[0])
    if agent != job[0]:
        agent += "-" + hashlib.sha256(job[0].encode()).hexdigest()[:8]
    return out / "episodes" / agent / f"{job[1]:05d}.parquet"


def _finished_jobs(out: Path, keys: dict[_Job, str]) -> set[_Job]:
    done = set()
    for job, key in keys.items():
        stored = load_episode(_part(out, job))
        if stored is not None and stored.key == key:
            done.add(job)
    return done


def _run_jobs(
    config: EvaluationConfig, worker: EpisodeWorker, jobs: Sequence[_Job], keys: dict[_Job, str]
) -> Iterator[_Job]:
    """Yields each job once its record is on disk."""
    if not jobs:
        return
    if config.workers == 1:
        use_one_thread()
        for job in jobs:
            _run_and_save(worker, config.out, job, keys[job])
            yield job
        return
    yield from _run_in_pool(config, jobs, keys)


_Task = tuple[SuiteSource, RunSettings, tuple[AgentChoice, ...], _Job, str]


def _run_on_cluster(
    config: EvaluationConfig,
    jobs: Sequence[_Job],
    keys: dict[_Job, str],
    report: Callable[[int], None],
) -> None:
    run_tasks(
        _run_task,
        [(config.source, config.settings, config.choices, job, keys[job]) for job in jobs],
        config.workers,
        engine=config.engine,
        on_result=lambda task, stored: save_episode(_part(config.out, task[3]), stored),
        on_poll=report,
    )


def _run_task(task: _Task) -> StoredEpisode:
    source, settings, choices, job, key = task
    use_one_thread()
    return StoredEpisode(_kept_worker(source, settings, choices).run(*job), key, source_commit())


@lru_cache(maxsize=1)
def _kept_worker(
    source: SuiteSource, settings: RunSettings, choices: tuple[AgentChoice, ...]
) -> EpisodeWorker:
    return EpisodeWorker(load_suite(source), settings, choices)


def _run_in_pool(
    config: EvaluationConfig, jobs: Sequence[_Job], keys: dict[_Job, str]
) -> Iterator[_Job]:
    pool = ProcessPoolExecutor(
        max_workers=min(config.workers, len(jobs)),
        # Torch and numba do not survive a fork.
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_start_worker,
        initargs=(config.source, config.settings, config.choices, config.out, os.getpid()),
    )
    try:
        futures: list[Future[_Job | tuple[str, str, str]]] = [
            pool.submit(_run_in_worker, job, keys[job]) for job in jobs
        ]
        for future in as_completed(futures):
            answer = future.result()
            if len(answer) == 3:
                rule, where, remedy = answer
                raise InputError(rule, where=where, remedy=remedy)
            yield answer
    except BrokenProcessPool:
        raise InputError(
            "a worker process died, perhaps for lack of memory",
            where=f"evaluation in {config.out}",
            remedy="run the same command again to resume, with fewer --workers",
        ) from None
    finally:
        # On Ctrl-C the episodes under way finish (seconds) and are kept.
        pool.shutdown(wait=True, cancel_futures=True)


_worker: EpisodeWorker | None = None
_worker_out: Path | None = None


def _start_worker(
    source: SuiteSource,
    settings: RunSettings,
    choices: tuple[AgentChoice, ...],
    out: Path,
    parent: int,
) -> None:
    global _worker, _worker_out
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(parent,), daemon=True).start()
    use_one_thread()
    _worker = EpisodeWorker(load_suite(source), settings, choices)
    _worker_out = out


def _run_in_worker(job: _Job, key: str) -> _Job | tuple[str, str, str]:
    assert _worker is not None
    assert _worker_out is not None
    try:
        _run_and_save(_worker, _worker_out, job, key)
    except InputError as error:
        # An exception with keyword arguments does not survive the way between processes.
        return error.rule, error.where, error.remedy
    return job


def _end_with_parent(parent: int) -> None:
    """A killed evaluation leaves no workers behind."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def use_one_thread() -> None:
    """One thread a process: as many workers as cores, and sums in the same order anywhere."""
    import torch

    torch.set_num_threads(1)


def _run_and_save(worker: EpisodeWorker, out: Path, job: _Job, key: str) -> None:
    record = worker.run(*job)
    save_episode(_part(out, job), StoredEpisode(record, key, source_commit()))


def _finish(
    config: EvaluationConfig,
    worker: EpisodeWorker,
    jobs: Sequence[_Job],
    keys: dict[_Job, str],
    resumed: int,
) -> Evaluation:
    suite = worker.suite
    order = {agent: rank for rank, agent in enumerate(config.labels)}
    records, commits = [], set()
    for job in sorted(jobs, key=lambda job: (order[job[0]], job[1])):
        stored = load_episode(_part(config.out, job))
        if stored is None or stored.key != keys[job]:
            raise InputError(
                "an episode's file vanished or changed while the evaluation ran",
                where=str(_part(config.out, job)),
                remedy="run the same command again to resume, alone in this folder",
            )
        records.append(stored.record)
        commits.add(stored.commit)
    results = suite_results(records)
    for choice in config.choices:
        results["agents"][choice.label]["agent"] = choice.agent
    write_episode_table(config.out / "episodes.parquet", records, suite.map)
    write_step_table(config.out / "steps.parquet", records)
    known = tuple(sorted(commits, key=str))
    _write_run(config, worker, commits=known)
    write_atomically(config.out / "results.json", json.dumps(results, indent=1) + "\n")
    return Evaluation(suite, results, resumed, known, config.out)


def _write_run(
    config: EvaluationConfig, worker: EpisodeWorker, commits: tuple[str | None, ...] | None = None
) -> None:
    """Write `run.json`; before the run without, after it with the episodes' source versions."""
    source, suite = config.source, worker.suite
    files = {
        name: {"file": path.name, "sha256": hash_of_file(path)}
        for name in ("area", "plans", "map")
        if (path := getattr(source, name)) is not None
    }
    run = {
        "schema": 1,
        "suite": "graphnav",
        "name": suite.name,
        "finished": datetime.now(UTC).isoformat(timespec="seconds") if commits else None,
        "agents": list(config.labels),
        "choices": {choice.label: _described(worker, choice) for choice in config.choices},
        "workers": config.workers,
        "source": {
            key: value.name if isinstance(value, Path) else value
            for key, value in asdict(source).items()
        },
        "settings": {
            **asdict(config.settings),
            "weights": _shown_weights(config.settings.weights),
        },
        "commit": source_commit(),
        "episode_commits": list(commits) if commits else None,
        "versions": library_versions(),
        "data": {
            **files,
            "scene_content": suite.scene.content_hash,
            "map_content": suite.map_hash,
            "weights": hash_of_weights(config.settings.weights),
        },
        "episodes": [task.index for task in suite.tasks],
        "left_out": [asdict(pair) for pair in suite.left_out],
    }
    write_atomically(config.out / "run.json", json.dumps(run, indent=1) + "\n")


def _described(worker: EpisodeWorker, choice: AgentChoice) -> dict[str, Any]:
    """What a label in the results stands for."""
    weights = worker.weights_of(choice.label)
    is_learned = choice.spec is None or choice.spec.is_learned
    return {
        "agent": choice.agent,
        "weights": (_shown_weights(weights) or "shipped") if is_learned else None,
        "weights_sha256": worker.weights_hash(choice.label) or None,
        "options": dict(choice.options),
    }


def _shown_weights(weights: str | None) -> str | None:
    """A preset or a relative folder as it was given; of a folder elsewhere only its name."""
    if weights is None or not Path(weights).is_absolute():
        return weights
    return Path(weights).name
