"""The stored runs of image-goal navigation: tables 1 and 2 and figure 8 of the NTS paper.

    python benchmarks/imagenav.py [RUN ...] [--episodes N] [--workers 2]

Without a name it does all runs, the most important first. Every run is `toponav eval imagenav`
on the first frozen episodes of homes-test (`RUNS` below says whom and how many), so that all
agents get the same episodes with the same noise. What is finished is kept under runs/imagenav;
interrupted, the same command resumes, and more episodes are added to fewer. Writes run.json,
results.json, episodes.parquet and failures.json to benchmarks/results/imagenav/RUN, and then
tables.md of all that is there.
"""

import argparse
import json
import shutil
import sys
from dataclasses import dataclass, field
from pathlib import Path

from toponav.cli.progress_bar import progress
from toponav.core.errors import InputError
from toponav.core.files import write_atomically
from toponav.core.imagenav import DIFFICULTIES, Difficulty
from toponav.evaluation.benchmarks.record import hardware
from toponav.evaluation.imagenav.episode_sets import load_episode_set
from toponav.evaluation.imagenav.failures import count_failures
from toponav.evaluation.imagenav.records import load_record
from toponav.evaluation.imagenav.runner import ImageNavConfig, evaluate_image_nav, record_path
from toponav.evaluation.imagenav.tables import IMAGE_NAV_TABLES, load_image_nav_results
from toponav.evaluation.imagenav.worker import ImageNavSettings
from toponav.evaluation.table_layout import to_markdown

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "imagenav"
WORK = ROOT / "runs" / "imagenav"
SUITE = "homes-test"


@dataclass(frozen=True)
class Run:
    """One stored run."""

    agents: tuple[str, ...]
    """The first is compared with the others."""
    episodes: int
    """Of each difficulty."""
    settings: ImageNavSettings = field(default_factory=ImageNavSettings)
    """Noise, stop, sliding and the number of goals."""
    levels: tuple[Difficulty, ...] = DIFFICULTIES
    """Difficulties."""


LEARNED = ("il_rgbd", "target_rl_rgbd", "metric_map_rl_rgbd")
RUNS = {
    "rgbd": Run(("nts_rgbd", "ans_rgbd", "frontier_rgbd", "random"), 100),
    "rgb": Run(("nts_rgb", "ans_rgb"), 100),
    "learned": Run((*LEARNED, "il_rgb", "target_rl_rgb"), 28),
    "goals": Run(
        ("nts_rgbd", "nts_no_graph_rgbd", "nts_no_score_rgbd"),
        14,
        ImageNavSettings(goals=4),
        ("easy", "medium"),
    ),
    "no_noise": Run(("nts_rgbd", "ans_rgbd", "frontier_rgbd"), 14, ImageNavSettings(noise=False)),
    "no_stop": Run(("nts_rgbd", "ans_rgbd", "frontier_rgbd"), 14, ImageNavSettings(stop=False)),
    "learned_no_noise": Run(LEARNED, 14, ImageNavSettings(noise=False)),
    "learned_no_stop": Run(LEARNED, 14, ImageNavSettings(stop=False)),
    "oracle": Run(
        (
            "oracle",
            "nts_rgbd",
            "oracle_localization",
            "oracle_relative_pose",
            "oracle_explorable",
            "oracle_score",
            "shortest_path",
        ),
        14,
    ),
    "sliding": Run(("nts_rgbd", "nts_rgb"), 14, ImageNavSettings(sliding=True)),
}
"""The runs, the most important first. homes-test has 14 homes, which multiples visit alike."""


def main(arguments: list[str] | None = None) -> int:
    """Do the runs, and write their results and tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help=f"of {', '.join(RUNS)}; all by default")
    parser.add_argument("--episodes", type=int, help="of each difficulty, instead of the run's")
    parser.add_argument("--suite", default=SUITE)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--runs", type=Path, default=WORK)
    options = parser.parse_args(arguments)
    unknown = [name for name in options.names if name not in RUNS]
    if unknown:
        print(f"no run is called '{unknown[0]}'; there are {', '.join(RUNS)}", file=sys.stderr)
        return 2
    try:
        for name in options.names or RUNS:
            store(name, RUNS[name], options)
        print(write_tables(options.out))
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def store(name: str, run: Run, options: argparse.Namespace) -> None:
    """Does one run and stores what it found."""
    # Runs of the same settings share what is finished: an agent of both drives once.
    settings = run.settings
    shared = "_".join(f"{key}={value}" for key, value in settings.variant.items())
    config = ImageNavConfig(
        agents=run.agents,
        out=options.runs / shared.lower(),
        suite=options.suite,
        levels=run.levels,
        episodes=options.episodes or run.episodes,
        settings=settings,
        workers=options.workers,
    )
    with progress(name) as update:
        evaluate_image_nav(config, update)
    folder = options.out / name
    folder.mkdir(parents=True, exist_ok=True)
    for file in ("run.json", "results.json", "episodes.parquet"):
        shutil.copyfile(config.out / file, folder / file)
    # The machine belongs to the times of a step.
    described = json.loads((folder / "run.json").read_text()) | {"hardware": hardware()}
    write_atomically(folder / "run.json", json.dumps(described, indent=1) + "\n")
    episodes = load_episode_set(config.suite, config.levels, config.episodes)
    stored = [
        load_record(record_path(config.out, label, episode))
        for label in config.labels
        for episode in episodes
    ]
    failures = count_failures([one.record for one in stored if one is not None])
    write_atomically(folder / "failures.json", json.dumps(failures, indent=1) + "\n")


def write_tables(out: Path) -> str:
    """The tables of all runs that are stored, as Markdown; also in tables.md."""
    stored = [
        load_image_nav_results(folder)
        for folder in (out / name for name in RUNS)
        if (folder / "results.json").exists()
    ]
    tables = [make(stored) for make in IMAGE_NAV_TABLES.values()] if stored else []
    text = "\n\n".join(to_markdown(table) for table in tables if table.rows) + "\n"
    write_atomically(out / "tables.md", text)
    return text


if __name__ == "__main__":
    sys.exit(main())
