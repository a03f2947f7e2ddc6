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
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.files import write_atomically
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.evaluation.imagenav.runner import ImageNavConfig, evaluate_image_nav
from toponav.evaluation.imagenav.worker import ImageNavSettings
from toponav.models.baselines.image_goal_presets import image_goal_preset
from toponav.training.image_goals.rollouts import RolloutSettings

RESULTS = Path(__file__).parent / "results"
PICTURE = Path(__file__).parent.parent / "docs" / "images" / "image_goal_curves.png"
HOMES, ROBOTS, SEED = 4, 16, 0
"""Homes that robots run in here: what is measured is stepping, not making homes."""


def rollouts(seconds: float) -> Benchmark:
    """Steps of random robots: rendering, motion, noise, reward and what policies are told."""
    from toponav.training.image_goals.robot_processes import RobotProcesses

    figures: dict[str, float] = {}
    for policy in ("target_rl", "metric_rl"):
        config = image_goal_preset(policy, "compact", depth=True)
        for processes in (1, 2):
            robots = RobotProcesses(config, RolloutSettings(homes=HOMES), ROBOTS, processes, SEED)
            rng = np.random.default_rng(SEED)
            try:
                robots.begin(0, 10.0)
                robots.reset()
                _stepped(robots, rng, seconds / 2)
                rates = [_stepped(robots, rng, seconds / 5) for _ in range(5)]
            finally:
                robots.close()
            name = f"{policy}_compact_rgbd_steps_per_second_{processes}_processes"
            figures[name] = float(np.median(rates))
    load = os.getloadavg()[0]
    settings = {"homes": HOMES, "robots": ROBOTS, "seed": SEED, "load_average": load}
    return Benchmark("image_goal_rollouts", figures, settings)


def _stepped(robots: Any, rng: np.random.Generator, seconds: float) -> float:
    """Steps a second of robots that turn and drive, but stop seldom."""
    began, steps = time.perf_counter(), 0
    while time.perf_counter() - began < seconds:
        robots.step_async(rng.choice(4, ROBOTS, p=(0.01, 0.49, 0.25, 0.25)))
        robots.step_wait()
        steps += ROBOTS
    return steps / (time.perf_counter() - began)


def ray_workers(episodes: int) -> Benchmark:
    """An evaluation of the shortest path, by either engine with one and with two workers."""
    figures: dict[str, float] = {}
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        for engine in ("local", "ray"):
            for workers in (1, 2):
                # What starts a process is timed apart, by an evaluation of an episode or two.
                few, many = (
                    _timed(Path(folder) / f"{engine}{workers}-{count}", engine, workers, count)
                    for count in (2, episodes)
                )
                figures[f"{engine}_{workers}_workers_s"] = many[0] - few[0]
                outcomes.append(many[1])
    assert all(one == outcomes[0] for one in outcomes), "engines must agree"
    figures["ray_speedup_2_workers"] = figures["ray_1_workers_s"] / figures["ray_2_workers_s"]
    figures["local_speedup_2_workers"] = (
        figures["local_1_workers_s"] / figures["local_2_workers_s"]
    )
    settings = {"episodes": episodes, "seed": SEED, "load_average": os.getloadavg()[0]}
    return Benchmark("image_goal_ray", figures, settings)


def _timed(out: Path, engine: Any, workers: int, episodes: int) -> tuple[float, Any]:
    began = time.perf_counter()
    found = evaluate_image_nav(
        ImageNavConfig(
            ("shortest_path",),
            out,
            suite="homes-val",
            levels=("hard",),
            episodes=episodes,
            settings=ImageNavSettings(seed=SEED),
            workers=workers,
            engine=engine,
        )
    )
    numbers = found.results["agents"]["shortest_path"]
    return time.perf_counter() - began, {name: numbers[name] for name in ("success_rate", "spl")}


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
    ("training episodes", "frames", "train_success", "success"),
    ("homes-val, easy", "frames", "val_success_easy", "success"),
    ("imitation: drives held out", "epoch", "accuracy", "agreement with the expert"),
)
"""Title, what lies across, what goes up, and its name."""


def _drawn(stored: dict[str, Any]) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (title, across, up, label) in zip(figure.subplots(1, 3), PANELS, strict=True):
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
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--episodes", type=int, default=24)
    given = parser.parse_args()
    if given.what == "curves":
        curves(given.runs)
        return
    found = rollouts(given.seconds) if given.what == "rollouts" else ray_workers(given.episodes)
    print(json.dumps(dict(found.metrics), indent=1))
    write_benchmark(found, RESULTS)


if __name__ == "__main__":
    main()
