"""The demo: drives an office that no training run saw, and writes a page to look at."""

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toponav.core.errors import InputError
from toponav.evaluation.agents import check_agent_name
from toponav.evaluation.episode import EpisodeRecord, StepView
from toponav.evaluation.metrics import suite_results
from toponav.evaluation.protocol import JudgeRules
from toponav.evaluation.provenance import hash_of_weights, library_versions, source_commit
from toponav.evaluation.records import write_atomically, write_episode_table, write_step_table
from toponav.evaluation.report.film import FilmStep, film_frames, write_film
from toponav.evaluation.report.images import depth_bytes
from toponav.evaluation.report.page import DemoReport, DepthView, agent_title, render_page
from toponav.evaluation.runner import use_one_thread
from toponav.evaluation.suite import EpisodeTask, Suite, sample_tasks
from toponav.evaluation.worker import EpisodeWorker, RunSettings
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import save_map
from toponav.worlds.generate.office import generate_office
from toponav.worlds.generate.suites import DEMO_OFFICE_SEED, suite
from toponav.worlds.scene import Scene
from toponav.worlds.storage import save_scene

__all__ = ["DemoConfig", "DemoResult", "run_demo"]

_SUITE = "offices-test"
_HOMES, _SEARCH = "homes-test", 0
_PLAN_NODES = range(6, 17)
_CANDIDATES = 60
_FILM_FPS = 15.0
_VIEWS = 4

Progress = Callable[[str, int, int], None]
"""Told what is being done, how much of it is done, and of how much."""


@dataclass(frozen=True)
class DemoConfig:
    """What the demo drives."""

    out: Path = Path("toponav-demo")
    """Folder to write to."""
    building: int | None = None
    """Which office of the test suite; the demo's own when None."""
    plans: int = 4
    """How many plans to drive."""
    agents: tuple[str, ...] = ("graphnav_pf", "gtl", "expert")
    """Who drives; the page is about the first."""
    weights: str | None = None
    """Other weights than those that ship."""
    seed: int = 0
    """Seed of the plans."""
    search: bool = True
    """Whether the page also shows a search for the place in a picture, in an unseen home."""

    def __post_init__(self) -> None:
        seeds = suite(_SUITE).seeds
        if self.building is not None and not 0 <= self.building < len(seeds):
            raise InputError(
                f"the suite {_SUITE} has {len(seeds)} offices, got number {self.building}",
                where="--building",
                remedy=f"give a number from 0 to {len(seeds) - 1}",
            )
        if not 1 <= self.plans <= 20:
            raise InputError(
                f"plans must be 1 to 20, got {self.plans}",
                where="--plans",
                remedy="to measure an agent on many plans, use `toponav eval graphnav`",
            )
        for agent in self.agents:
            check_agent_name(agent)

    @property
    def office_seed(self) -> int:
        """The generator's seed of the building."""
        if self.building is None:
            return DEMO_OFFICE_SEED
        return suite(_SUITE).seeds[self.building]


@dataclass(frozen=True, eq=False)
class DemoResult:
    """What the demo made.

    Attributes:
        page: The page.
        report: What it shows.
    """

    page: Path
    report: DemoReport


@dataclass(eq=False)
class _Drive:
    """One episode of the first agent, with its images."""

    record: EpisodeRecord | None = None
    steps: list[FilmStep] = field(default_factory=list)


def run_demo(config: DemoConfig, progress: Progress | None = None) -> DemoResult:
    """Drive, film, and write the page.

    The plans are drawn by seed before anything is driven; none is chosen for its outcome.
    Beside the page lie the film, the numbers as `toponav eval` writes them, and the scene and
    map for use with the other commands.

    Args:
        config: What to drive and where to write.
        progress: Called as the work goes on.

    Raises:
        InputError: If the weights cannot be read or the folder cannot be written to.
    """
    report_progress = progress or (lambda what, done, total: None)
    report_progress("building an office", 0, 1)
    use_one_thread()
    scene = generate_office(config.office_seed, "medium")
    map_ = map_from_layout(scene)
    chosen = Suite(scene.name, scene, map_, _choose_plans(scene, config))
    # The film and the page end where the run failed.
    rules = JudgeRules(both_collision_rules=False)
    settings = RunSettings(weights=config.weights, rules=rules, seed=config.seed)
    worker = EpisodeWorker(chosen, settings)
    records, drives = _drive_all(config, worker, report_progress)
    hero = _pick_hero(drives)
    assert hero.record is not None
    report = DemoReport(
        suite=chosen,
        agents=config.agents,
        records=records,
        hero=hero.record,
        beliefs=[step.edge_probability for step in hero.steps],
        views=_pick_views(hero),
        film=_film(config, worker, hero, report_progress),
        fps=_FILM_FPS,
        area_m2=float((scene.room_index >= 0).sum()) * scene.grid.resolution_m**2,
        real_time_factor=_real_time_factor(drives),
        facts=_facts(config, scene),
        search=_search(config, report_progress) if config.search else "",
    )
    report_progress("writing the page", 0, 1)
    return DemoResult(_write(config, report), report)


def _choose_plans(scene: Scene, config: DemoConfig) -> tuple[EpisodeTask, ...]:
    """Plans of a length worth watching, from different rooms where possible; shortest first."""
    sampled = sample_tasks(scene, map_from_layout(scene), _CANDIDATES, config.seed)
    fitting = [task for task in sampled if len(task.plan.nodes) in _PLAN_NODES] or list(sampled)
    starts: set[str] = set()
    fresh: list[EpisodeTask] = []
    repeated: list[EpisodeTask] = []
    for task in fitting:
        (repeated if task.plan.nodes[0] in starts else fresh).append(task)
        starts.add(task.plan.nodes[0])
    found = (fresh + repeated)[: config.plans]
    return tuple(sorted(found, key=lambda task: (len(task.plan.nodes), task.index)))


def _drive_all(
    config: DemoConfig, worker: EpisodeWorker, progress: Progress
) -> tuple[dict[tuple[str, int], EpisodeRecord], list[_Drive]]:
    records: dict[tuple[str, int], EpisodeRecord] = {}
    drives = []
    jobs = [(agent, task.index) for agent in config.agents for task in worker.suite.tasks]
    for done, (agent, index) in enumerate(jobs):
        progress(f"driving with {agent_title(agent)}", done, len(jobs))
        if agent == config.agents[0]:
            drive = _Drive()
            drive.record = worker.run(agent, index, _filming(worker, drive))
            drives.append(drive)
            records[agent, index] = drive.record
        else:
            records[agent, index] = worker.run(agent, index)
    return records, drives


def _filming(worker: EpisodeWorker, drive: _Drive) -> Callable[[StepView], None]:
    max_depth_m = worker.settings.camera.max_depth_m

    def film(view: StepView) -> None:
        belief = view.belief
        probability: Mapping[str, float] = belief.edge_probability
        if not probability and belief.edge is not None:
            probability = {belief.edge: 1.0}
        drive.steps.append(
            FilmStep(
                time_s=view.observation.time_s,
                depth=depth_bytes(view.observation.depth_m, max_depth_m),
                pose=view.truth.pose,
                behavior=belief.behavior,
                edge_probability=dict(probability),
                believed=belief.node or "unknown",
                true=view.truth.node or "no node",
            )
        )

    return film


def _pick_hero(drives: list[_Drive]) -> _Drive:
    """The longest plan that was completed, else the drive that got furthest."""

    def merit(drive: _Drive) -> tuple[bool, int]:
        assert drive.record is not None
        verdict = drive.record.tolerant
        return verdict.success, verdict.nodes_reached

    return max(drives, key=merit)


def _pick_views(drive: _Drive) -> list[DepthView]:
    """Images from the middle of the first stretches of different behaviours."""
    starts = [0] + [
        number
        for number in range(1, len(drive.steps))
        if drive.steps[number].behavior is not drive.steps[number - 1].behavior
    ]
    ends = [*starts[1:], len(drive.steps)]
    stretches = [(start, end) for start, end in zip(starts, ends, strict=True) if end - start >= 3]
    chosen = stretches or [(0, len(drive.steps))]
    if len(chosen) > _VIEWS:
        chosen = [chosen[i] for i in np.linspace(0, len(chosen) - 1, _VIEWS).round().astype(int)]
    views = []
    for start, end in chosen:
        step = drive.steps[(start + end) // 2]
        name = str(step.behavior or "stopped").replace("_", " ")
        place = step.true.replace("_", " ")
        views.append(DepthView(step.depth, f"{step.time_s:.0f} s, at {place}: {name}"))
    return views


def _film(config: DemoConfig, worker: EpisodeWorker, hero: _Drive, progress: Progress) -> bytes:
    assert hero.record is not None
    frames = film_frames(
        worker.suite.scene,
        worker.suite.map,
        hero.record.plan,
        hero.steps,
        title=agent_title(config.agents[0]),
        max_depth_m=worker.settings.camera.max_depth_m,
    )

    def counted() -> Iterator[np.ndarray]:
        for number, frame in enumerate(frames):
            progress("filming", number, len(hero.steps))
            yield frame

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.mp4"
        write_film(path, counted(), _FILM_FPS)
        return path.read_bytes()


def _search(config: DemoConfig, progress: Progress) -> str:
    """Films the image-goal agent in a home; the section of the page that shows it."""
    from toponav.evaluation.imagenav.agents import ImageNavChoice
    from toponav.evaluation.imagenav.episode_sets import load_episode_set
    from toponav.evaluation.imagenav.page import film_episode, search_section
    from toponav.evaluation.imagenav.worker import ImageNavSettings, ImageNavWorker

    progress("looking for a place", 0, 1)
    name = "nts_rgbd"
    worker = ImageNavWorker(ImageNavSettings(seed=config.seed), [ImageNavChoice.parse(name)])
    episode = load_episode_set(_HOMES, ["medium"], _SEARCH + 1)[_SEARCH]
    return search_section(film_episode(worker, name, episode, config.out / "image-goal"))


def _real_time_factor(drives: list[_Drive]) -> float:
    found = [drive.record for drive in drives if drive.record is not None]
    return sum(record.tolerant.time_s for record in found) / sum(r.wall_s for r in found)


def _facts(config: DemoConfig, scene: Scene) -> list[str]:
    versions = library_versions()
    return [
        f"office {config.office_seed} of {_SUITE}, scene {scene.content_hash[:12]}",
        f"plans by seed {config.seed}",
        f"weights {hash_of_weights(config.weights)[:12]}",
        f"toponav {versions['toponav']}" + (f" ({c[:10]})" if (c := source_commit()) else ""),
        f"torch {versions['torch']}, mujoco {versions['mujoco']}, Python {versions['python']}",
    ]


def _write(config: DemoConfig, report: DemoReport) -> Path:
    out = config.out
    records = [
        report.record(agent, task.index) for agent in report.agents for task in report.suite.tasks
    ]
    try:
        write_atomically(out / "drive.mp4", report.film)
        write_episode_table(out / "episodes.parquet", records)
        write_step_table(out / "steps.parquet", records)
        results = suite_results(records)
        write_atomically(out / "results.json", json.dumps(results, indent=1) + "\n")
        run = {
            "schema": 1,
            "suite": "graphnav",
            "name": report.suite.name,
            "demo": {"building": config.building, "plans": config.plans, "seed": config.seed},
            "agents": list(config.agents),
            "commit": source_commit(),
            "versions": library_versions(),
            "data": {"scene_content": report.suite.scene.content_hash},
        }
        write_atomically(out / "run.json", json.dumps(run, indent=1) + "\n")
        save_scene(report.suite.scene, out / "scene")
        save_map(report.suite.map, out / "map.topo.json")
        page = out / "report.html"
        write_atomically(page, render_page(report))
    except OSError as error:
        raise InputError(
            f"cannot be written: {error.strerror or error}",
            where=str(error.filename or out),
            remedy="name a folder that you may write to with --out",
        ) from None
    return page
