"""Drives the 375 published pairs of areas 1, 3, 5b and 6 with every agent, and stores the runs.

    python benchmarks/graphnav_areas.py [--workers 2] [--weights best] [--agents gtl ...]

Each area's run lies in benchmarks/results/graphnav/<area>/ (run.json, results.json,
episodes.parquet, steps.parquet, the failure map and paths of GraphNavPF);
benchmarks/results/graphnav/table.md is made from all of them, and graphnav_areas.json says how
long an episode takes. Resumes where it was interrupted and runs only what is not done: the
episodes are kept under runs/graphnav_areas/.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from toponav.cli.main import main as toponav
from toponav.evaluation.agents import probes_of

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "graphnav"
RUNS = ROOT / "runs" / "graphnav_areas"
AREAS = ("area_3", "area_1", "area_5b", "area_6")
AGENTS = ("phasenet", "behavrnn", "graphnav", "graphnav_pf", "gtl", "expert")
PROBES = ("teacher_forced", "own_belief")
WITH_WEIGHTS = frozenset({"graphnav", "graphnav_pf", "gtl", *PROBES})
KEPT = ("run.json", "results.json", "episodes.parquet", "steps.parquet")
MOST_BYTES = 1_500_000


def main() -> int:
    """Evaluate, store, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--weights", help="weights of graphnav, graphnav_pf and gtl")
    parser.add_argument("--baseline-weights", help="weights of phasenet and behavrnn")
    parser.add_argument("--agents", nargs="+", help="all, and what measures localization")
    parser.add_argument("--areas", nargs="+", default=list(AREAS))
    parser.add_argument("--episodes", type=int, help="only the first pairs, to time agents")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder to store the runs in")
    parser.add_argument("--runs", type=Path, default=RUNS, help="folder of the episodes")
    options = parser.parse_args()
    data = Path(os.environ.get("TOPONAV_DATA", ROOT.parent / "shared" / "data"))
    os.environ["TOPONAV_DATA"] = str(data)
    for area in options.areas:
        began_s = time.monotonic()
        words = evaluation(area, data / "graphnav_areas", options)
        status = toponav(words)
        if status:
            return status
        print(f"{area}: {(time.monotonic() - began_s) / 60:.1f} minutes")
        store(options.runs / area, options.out / area)
    (options.out / "table.md").write_text(table(options.out))
    write_speed(options.out)
    return 0


def evaluation(area: str, files: Path, options: argparse.Namespace) -> list[str]:
    """The words of the command that evaluates one area."""
    words = ["eval", "graphnav", "--area", str(files / f"{area}.yaml")]
    words += ["--plans", str(files / f"{area}_plans.json"), "--out", str(options.runs / area)]
    words += ["--workers", str(options.workers)]
    if options.episodes:
        words += ["--episodes", str(options.episodes)]
    for agent in options.agents or [*AGENTS, *probes_of(options.weights)]:
        words += ["--agent", chosen(agent, options.weights, options.baseline_weights)]
    return words


def chosen(agent: str, weights: str | None, baseline_weights: str | None) -> str:
    """An agent as the command line chooses it; its label stays the plain name."""
    if agent in WITH_WEIGHTS and weights:
        return f"{agent},weights={weights},label={agent}"
    if agent in ("phasenet", "behavrnn") and baseline_weights:
        return f"{agent},weights={baseline_weights},label={agent}"
    return agent


def store(run: Path, out: Path) -> None:
    """Copy what is kept of a run, and draw what goes beside it."""
    out.mkdir(parents=True, exist_ok=True)
    for name in KEPT:
        shutil.copyfile(run / name, out / name)
    agents = json.loads((out / "results.json").read_text())["agents"]
    about = next((name for name in agents if name.partition("=")[0] == "graphnav_pf"), None)
    if about is not None:
        with tempfile.TemporaryDirectory() as folder:
            words = ["figures", str(out), "--out", folder, "--agent", about]
            toponav([*words, "--only", "failures", "--only", "trajectories"])
            for path in Path(folder).iterdir():
                if path.suffix == ".png":
                    small(path)
                shutil.copyfile(path, out / path.name)
    size = sum(path.stat().st_size for path in out.iterdir())
    if size > MOST_BYTES:
        print(f"{out}: {size:,} bytes are more than a repository should hold")


def small(path: Path) -> None:
    """The picture with 128 colours: a third of the bytes."""
    from PIL import Image

    with Image.open(path) as picture:
        palette = picture.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    palette.save(path, optimize=True)


def table(results: Path = RESULTS) -> str:
    """Success and plan completion of every stored run as Markdown."""
    rows = []
    for area in AREAS:
        path = results / area / "results.json"
        if not path.exists():
            continue
        agents = json.loads(path.read_text())["agents"]
        rows += [(area, name, row) for name, row in agents.items() if name not in PROBES]
    columns = {
        "episodes": lambda row: str(row["episodes"]),
        "strict success / completion, %": pair,
        "95 %": lambda row: interval(row["success_ci95"]),
        "tolerant success / completion, %": lambda row: pair(row["tolerant"]),
        "where the expert succeeds, %": lambda row: percent(row.get("success_on_expert_feasible")),
    }
    if all(
        (row.get("by_collision_rule") or {}).get("stuck", {}).get("strict") for *_, row in rows
    ):
        columns["contact allowed, strict / tolerant success, %"] = contact_allowed
    columns["edge right, %"] = lambda row: percent(row.get("localization_accuracy"))
    lines = [f"| area | agent | {' | '.join(columns)} |", "|---" * (2 + len(columns)) + "|"]
    for area, name, row in rows:
        cells = [cell(row) for cell in columns.values()]
        lines.append(f"| {area} | {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def write_speed(results: Path) -> None:
    """How long an episode takes, and how long one decision, by agent: graphnav_areas.json."""
    from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark

    metrics: dict[str, float] = {}
    settings: dict[str, int] = {}
    total_s = 0.0
    for area in AREAS:
        path = results / area / "results.json"
        if not path.exists():
            continue
        for name, row in json.loads(path.read_text())["agents"].items():
            if "episode_s" in row:
                metrics[f"{area}_{name}_episode_s"] = row["episode_s"]
                metrics[f"{area}_{name}_act_ms_p99"] = row["act_ms_p99"]
                settings[f"{area}_{name}_episodes"] = row["episodes"]
                total_s += row["episode_s"] * row["episodes"]
    metrics["all_runs_core_hours"] = total_s / 3600
    write_benchmark(Benchmark("graphnav_areas", metrics, settings), results.parent)


def pair(row: dict) -> str:
    return f"{percent(row['success_rate'])} / {percent(row['plan_completion'])}"


def contact_allowed(row: dict) -> str:
    by_rule = row["by_collision_rule"]["stuck"]
    return " / ".join(percent(by_rule[rule]["success_rate"]) for rule in ("strict", "tolerant"))


def interval(ends: list[float]) -> str:
    low, high = (100 * bound for bound in ends)
    return f"{low:.0f}-{high:.0f}"


def percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f}"


if __name__ == "__main__":
    sys.exit(main())
