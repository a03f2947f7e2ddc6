"""Measures the training of the learned image-goal baselines, and work on a Ray cluster.

    python benchmarks/image_goals.py rollouts   compact RGB-D panoramas a second, as training steps
    python benchmarks/image_goals.py ray        one worker and two, on Ray and in local processes
    python benchmarks/image_goals.py curves RUN [RUN ...]   learning curves of runs of training

The first two write benchmarks/results/image_goal_<what>.json. `curves` stores what the runs'
`metrics.jsonl` say as benchmarks/results/image_goal_curves.json, and draws it as
docs/images/image_goal_curves.png.
"""

import argparse
import io
import json
import os
import re
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from toponav.core.files import write_atomically
from toponav.core.imagenav import DIFFICULTIES
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.evaluation.imagenav.runner import ImageNavConfig, evaluate_image_nav
from toponav.evaluation.imagenav.worker import ImageNavSettings
from toponav.models.baselines.image_goal_presets import image_goal_preset
from toponav.training.image_goals.rollouts import RolloutSettings

RESULTS = Path(__file__).parent / "results"
PICTURE = Path(__file__).parent.parent / "docs" / "images" / "image_goal_curves.png"
HOMES, ROBOTS, SEED = 4, 16, 0
"""Homes that robots run in here: what is measured is stepping, not making homes."""
AGENT, MAX_STEPS, LEVELS = "il_rgbd", 200, DIFFICULTIES[1:]
"""Who drives where workers are counted, for how long at most, and how difficult episodes are."""
TIMES = re.compile(r"_(s|ms)$")
"""Columns of episodes that differ from run to run."""


def rollouts(rounds: int, seconds: float) -> Benchmark:
    """Steps of random robots: rendering, motion, noise, reward and what policies are told.

    One process and two take turns, so that what else runs on the machine meets both.
    """
    from toponav.training.image_goals.robot_processes import RobotProcesses

    figures: dict[str, float] = {}
    rates: dict[str, list[float]] = {}
    loads: list[float] = []
    for policy in ("target_rl", "metric_rl"):
        config = image_goal_preset(policy, "compact", depth=True)
        crowds = {
            f"{policy}_compact_rgbd_steps_per_second_{processes}_processes": RobotProcesses(
                config, RolloutSettings(homes=HOMES), ROBOTS, processes, SEED
            )
            for processes in (1, 2)
        }
        rng = np.random.default_rng(SEED)
        try:
            for robots in crowds.values():
                robots.begin(0, 10.0)
                robots.reset()
                _stepped(robots, rng, seconds)
            for _ in range(rounds):
                loads.append(round(os.getloadavg()[0], 2))
                for name, robots in crowds.items():
                    rates.setdefault(name, []).append(round(_stepped(robots, rng, seconds), 1))
        finally:
            for robots in crowds.values():
                robots.close()
    figures |= {name: float(np.median(found)) for name, found in rates.items()}
    settings = {
        "homes": HOMES,
        "robots": ROBOTS,
        "seed": SEED,
        "steps_per_second": rates,
        "load_average_before": loads,
    }
    return Benchmark("image_goal_rollouts", figures, settings)


def _stepped(robots: Any, rng: np.random.Generator, seconds: float) -> float:
    """Steps a second of robots that turn and drive, but stop seldom."""
    began, steps = time.perf_counter(), 0
    while time.perf_counter() - began < seconds:
        robots.step_async(rng.choice(4, ROBOTS, p=(0.01, 0.49, 0.25, 0.25)))
        robots.step_wait()
        steps += ROBOTS
    return steps / (time.perf_counter() - began)


def ray_workers(rounds: int, episodes: int) -> Benchmark:
    """An evaluation of a learned policy with one worker and with two, in turn, by either engine.

    Times are of the whole: Ray is started, processes begin, weights and homes are made ready.
    """
    times: dict[str, list[float]] = {}
    outcomes, loads = [], []
    with tempfile.TemporaryDirectory() as folder:
        for engine in ("ray", "local"):
            for number in range(rounds):
                for workers in (1, 2) if number % 2 == 0 else (2, 1):
                    loads.append(round(os.getloadavg()[0], 2))
                    out = Path(folder) / f"{number}-{engine}-{workers}"
                    seconds, outcome = _timed(out, engine, workers, episodes)
                    name = f"{engine}_{workers}_workers_s"
                    times.setdefault(name, []).append(round(seconds, 2))
                    outcomes.append(outcome)
                    print(name, times[name][-1], "load average before", loads[-1], flush=True)
    assert all(one == outcomes[0] for one in outcomes), "engines must agree"
    figures = {name: float(np.median(found)) for name, found in times.items()}
    for engine in ("ray", "local"):
        ratio = figures[f"{engine}_1_workers_s"] / figures[f"{engine}_2_workers_s"]
        figures[f"{engine}_speedup_2_workers"] = ratio
    settings = {
        "agent": AGENT,
        "suite": "homes-val",
        "levels": list(LEVELS),
        "episodes": episodes,
        "max_steps": MAX_STEPS,
        "seed": SEED,
        "seconds": times,
        "load_average_before": loads,
    }
    return Benchmark("image_goal_ray", figures, settings)


def _timed(out: Path, engine: Any, workers: int, episodes: int) -> tuple[float, Any]:
    """Seconds of an evaluation, and all that it found but times."""
    began = time.perf_counter()
    evaluate_image_nav(
        ImageNavConfig(
            (AGENT,),
            out,
            suite="homes-val",
            levels=LEVELS,
            episodes=episodes,
            settings=ImageNavSettings(seed=SEED, max_steps=MAX_STEPS),
            workers=workers,
            engine=engine,
        )
    )
    seconds = time.perf_counter() - began
    table = pq.read_table(out / "episodes.parquet")
    kept = [name for name in table.column_names if not TIMES.search(name)]
    return seconds, table.select(kept).to_pydict()


def curves(runs: list[Path]) -> None:
    """Store and draw success against frames."""
    stored: dict[str, Any] = {}
    for run in runs:
        for path in sorted(run.glob("*/metrics.jsonl")):
            lines = [json.loads(line) for line in path.read_text().splitlines()]
            about = json.loads((run / f"{path.parent.name}.json").read_text())["metadata"]
            kept = ("frames", "hours", "drives", "preset", "environment")
            stored[path.parent.name] = {
                "curve": lines,
                "about": {name: about[name] for name in kept if name in about},
            }
    text = json.dumps({"schema": 1, "networks": stored}, indent=1) + "\n"
    write_atomically(RESULTS / "image_goal_curves.json", text)
    write_atomically(PICTURE, _drawn(stored))


PANELS = (
    ("training episodes, goals ever farther", "frames", "train_success", "success"),
    ("homes-val, all", "frames", "val_success", "success"),
    ("homes-val, hard", "frames", "val_success_hard", "success"),
    ("imitation: drives held out", "epoch", "accuracy", "agreement with the expert"),
)
"""Title, what lies across, what goes up, and its name."""


def _drawn(stored: dict[str, Any]) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (title, across, up, label) in zip(
        figure.subplots(1, len(PANELS)), PANELS, strict=True
    ):
        for name, one in stored.items():
            lines = [line for line in one["curve"] if across in line and up in line]
            if lines:
                points = ([line[across] for line in lines], [line[up] for line in lines])
                axes.plot(*points, marker=".", label=name)
        axes.set_title(title)
        axes.set_xlabel("epochs" if across == "epoch" else across)
        axes.set_ylabel(label)
        axes.set_ylim(0.0, 1.0)
        axes.grid(alpha=0.3)
        if axes.lines:
            axes.legend(fontsize=8)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=110)
    return picture.getvalue()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("rollouts", "ray", "curves"))
    parser.add_argument("runs", nargs="*", type=Path)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--episodes", type=int, default=84, help="of each difficulty")
    parser.add_argument("--rounds", type=int)
    given = parser.parse_args()
    if given.what == "curves":
        curves(given.runs)
        return
    if given.what == "rollouts":
        found = rollouts(given.rounds or 7, given.seconds)
    else:
        found = ray_workers(given.rounds or 2, given.episodes)
    print(json.dumps(dict(found.metrics), indent=1))
    write_benchmark(found, RESULTS)


if __name__ == "__main__":
    main()
