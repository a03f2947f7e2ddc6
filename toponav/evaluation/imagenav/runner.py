"""Runs an image-goal evaluation with any number of processes, resumes, writes its folder."""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError
from toponav.core.files import check_out_folder, write_atomically
from toponav.core.imagenav import DIFFICULTIES, Difficulty, ImageNavEpisode
from toponav.data.engine import Engine, run_tasks
from toponav.data.parallel import check_workers
from toponav.evaluation.imagenav.agents import ImageNavChoice
from toponav.evaluation.imagenav.episode_sets import load_episode_set
from toponav.evaluation.imagenav.metrics import suite_results
from toponav.evaluation.imagenav.records import (
    StoredImageNav,
    load_record,
    save_record,
    write_episode_table,
)
from toponav.evaluation.imagenav.worker import ImageNavSettings, ImageNavWorker
from toponav.evaluation.provenance import library_versions, source_commit
from toponav.worlds.generate.suites import frozen_hash, suite

__all__ = ["ImageNavConfig", "ImageNavEvaluation", "evaluate_image_nav", "record_path"]


@dataclass(frozen=True)
class ImageNavConfig:
    """One evaluation."""

    agents: tuple[str, ...]
    """Who drives, in the order of the tables, as `ImageNavChoice.parse` reads them."""
    out: Path
    """Folder of results; an interrupted evaluation in it is resumed."""
    suite: str = "homes-test"
    """Buildings."""
    levels: tuple[Difficulty, ...] = DIFFICULTIES
    """Difficulties."""
    episodes: int = 100
    """How many of each difficulty, spread over the buildings."""
    settings: ImageNavSettings = field(default_factory=ImageNavSettings)
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
                remedy="name one, such as --agent nts_rgbd",
            )
        twice = [label for label, count in Counter(self.labels).items() if count > 1]
        if twice:
            raise InputError(
                f"two agents are called '{twice[0]}'",
                where="--agent",
                remedy="tell them apart with ,label=NAME",
            )
        if self.engine == "local":
            check_workers(self.workers)
        check_out_folder(self.out)

    @cached_property
    def choices(self) -> tuple[ImageNavChoice, ...]:
        """Who drives, parsed."""
        return tuple(map(ImageNavChoice.parse, self.agents))

    @property
    def labels(self) -> tuple[str, ...]:
        """The agents' names in the results."""
        return tuple(choice.label for choice in self.choices)


@dataclass(frozen=True, eq=False)
class ImageNavEvaluation:
    """A finished evaluation.

    Attributes:
        results: The content of `results.json`.
        resumed: Episodes that an earlier run had finished.
        commits: Source versions that made the episodes; more than one deserves a warning.
        out: The folder.
    """

    results: dict[str, Any]
    resumed: int
    commits: tuple[str | None, ...]
    out: Path


@dataclass(frozen=True)
class _Job:
    """One episode of one agent, as it is sent to a process."""

    label: str
    episode: ImageNavEpisode
    key: str
    path: Path
    settings: ImageNavSettings
    choices: tuple[ImageNavChoice, ...]


def evaluate_image_nav(
    config: ImageNavConfig, progress: Callable[[int, int], None] | None = None
) -> ImageNavEvaluation:
    """Run what is still to be run, and write `run.json`, `episodes.parquet`, `results.json`.

    Each finished episode is put on disk at once, `episodes/<agent>/<difficulty>-<number>.parquet`,
    so an interruption loses at most the episodes under way.

    Args:
        config: What to run and where to write.
        progress: Told how many episodes are done, and of how many.

    Raises:
        InputError: If an input cannot be used, or a worker process died.
    """
    episodes = load_episode_set(config.suite, config.levels, config.episodes)
    worker = ImageNavWorker(config.settings, config.choices)
    jobs = [
        _Job(
            label,
            episode,
            worker.key(label, episode),
            record_path(config.out, label, episode),
            config.settings,
            config.choices,
        )
        for episode in episodes
        for label in config.labels
    ]
    pending = [job for job in jobs if _finished(job) is None]
    for label in dict.fromkeys(job.label for job in pending):
        worker.prepare(label)
    _write_run(config, worker, episodes)
    done = len(jobs) - len(pending)
    if progress is not None:
        progress(done, len(jobs))
    # A building's episodes follow each other on one worker: making it takes seconds.
    pending.sort(key=lambda job: (job.episode.scene_seed, config.labels.index(job.label)))
    run_tasks(
        _run_job,
        pending,
        config.workers,
        engine=config.engine,
        affinity=lambda job: (job.episode.scene_suite, job.episode.scene_seed),
        on_result=lambda job, stored: save_record(job.path, stored),
        on_poll=None if progress is None else lambda count: progress(done + count, len(jobs)),
    )
    return _finish(config, worker, episodes, jobs, done)


def record_path(out: Path, label: str, episode: ImageNavEpisode) -> Path:
    """The file of one finished episode, by the agent's label, in a folder of results."""
    name = "".join(letter if letter.isalnum() or letter in "_-" else "_" for letter in label)
    if name != label:
        name += "-" + hashlib.sha256(label.encode()).hexdigest()[:8]
    return out / "episodes" / name / f"{episode.difficulty}-{episode.number:04d}.parquet"


def _finished(job: _Job) -> StoredImageNav | None:
    stored = load_record(job.path)
    return stored if stored is not None and stored.key == job.key else None


def _run_job(job: _Job) -> StoredImageNav:
    import torch

    torch.set_num_threads(1)
    record = _worker(job.settings, job.choices).run(job.label, job.episode)
    return StoredImageNav(record, job.key, source_commit())


@lru_cache(maxsize=1)
def _worker(settings: ImageNavSettings, choices: tuple[ImageNavChoice, ...]) -> ImageNavWorker:
    return ImageNavWorker(settings, choices)


def _finish(
    config: ImageNavConfig,
    worker: ImageNavWorker,
    episodes: Sequence[ImageNavEpisode],
    jobs: Sequence[_Job],
    resumed: int,
) -> ImageNavEvaluation:
    records, commits = [], set()
    for job in sorted(jobs, key=lambda job: config.labels.index(job.label)):
        stored = _finished(job)
        if stored is None:
            raise InputError(
                "an episode's file vanished or changed while the evaluation ran",
                where=str(job.path),
                remedy="run the same command again to resume, alone in this folder",
            )
        records.append(stored.record)
        commits.add(stored.commit)
    results = suite_results(records, config.settings.variant)
    for choice in config.choices:
        results["agents"][choice.label]["agent"] = choice.agent
    write_episode_table(config.out / "episodes.parquet", records)
    known = tuple(sorted(commits, key=str))
    _write_run(config, worker, episodes, known)
    write_atomically(config.out / "results.json", json.dumps(results, indent=1) + "\n")
    return ImageNavEvaluation(results, resumed, known, config.out)


def _write_run(
    config: ImageNavConfig,
    worker: ImageNavWorker,
    episodes: Sequence[ImageNavEpisode],
    commits: tuple[str | None, ...] | None = None,
) -> None:
    """Write `run.json`; before the run without, after it with the episodes' source versions."""
    generator = suite(config.suite).generator
    seeds = sorted({episode.scene_seed for episode in episodes})
    run = {
        "schema": 1,
        "suite": "imagenav",
        "name": config.suite,
        "finished": datetime.now(UTC).isoformat(timespec="seconds") if commits else None,
        "agents": list(config.labels),
        "choices": {
            choice.label: {
                "agent": choice.agent,
                "weights": _shown(worker.weights_of(choice.label)) if choice.is_learned else None,
                "weights_sha256": worker.weights_hash(choice.label) or None,
                "options": dict(choice.options),
            }
            for choice in config.choices
        },
        "workers": config.workers,
        "levels": list(config.levels),
        "settings": {**asdict(config.settings), "weights": _shown(config.settings.weights)},
        "commit": source_commit(),
        "episode_commits": list(commits) if commits else None,
        "versions": library_versions(),
        "data": {"scenes": {seed: frozen_hash(generator, seed) for seed in seeds}},
        "episodes": [episode.id for episode in episodes],
    }
    write_atomically(config.out / "run.json", json.dumps(run, indent=1) + "\n")


def _shown(weights: str | None) -> str:
    """A preset or a relative folder as it was given; of a folder elsewhere only its name."""
    if weights is None:
        return "shipped"
    return Path(weights).name if Path(weights).is_absolute() else weights
