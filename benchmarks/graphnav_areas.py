"""Drives the 375 published pairs of areas 1, 3, 5b and 6 with every agent, and stores the runs.

    python benchmarks/graphnav_areas.py [--workers 2] [--agents gtl graphnav_pf ...]

Each area's run lies in benchmarks/results/graphnav/<area>/ (run.json, results.json,
episodes.parquet); benchmarks/results/graphnav/table.md is made from all of them. Resumes where
it was interrupted: the episodes are kept under runs/graphnav_areas/.
"""

import argparse
import json
import os
import shutil
import sys
from pathlib import Path

from toponav.cli.main import main as toponav

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "graphnav"
RUNS = ROOT / "runs" / "graphnav_areas"
AREAS = ("area_3", "area_1", "area_5b", "area_6")
AGENTS = ("graphnav", "graphnav_pf", "gtl", "expert")
KEPT = ("run.json", "results.json", "episodes.parquet")


def main() -> int:
    """Evaluate, store, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--agents", nargs="+", default=list(AGENTS))
    parser.add_argument("--areas", nargs="+", default=list(AREAS))
    options = parser.parse_args()
    data = Path(os.environ.get("TOPONAV_DATA", ROOT.parent / "shared" / "data"))
    for area in options.areas:
        files = data / "graphnav_areas"
        words = ["eval", "graphnav", "--area", str(files / f"{area}.yaml")]
        words += ["--plans", str(files / f"{area}_plans.json"), "--out", str(RUNS / area)]
        words += ["--workers", str(options.workers)]
        for agent in options.agents:
            words += ["--agent", agent]
        status = toponav(words)
        if status:
            return status
        (RESULTS / area).mkdir(parents=True, exist_ok=True)
        for name in KEPT:
            shutil.copyfile(RUNS / area / name, RESULTS / area / name)
    (RESULTS / "table.md").write_text(table())
    return 0


def table() -> str:
    """Success and plan completion of every stored run as Markdown."""
    lines = [
        "| area | agent | episodes | strict success / completion, % | 95 % | "
        "tolerant success / completion, % | edge right, % |",
        "|---|---|---|---|---|---|---|",
    ]
    for area in AREAS:
        path = RESULTS / area / "results.json"
        if not path.exists():
            continue
        for name, row in json.loads(path.read_text())["agents"].items():
            low, high = (100 * bound for bound in row["success_ci95"])
            right = row.get("localization_accuracy")
            lines.append(
                f"| {area} | {name} | {row['episodes']} | {_pair(row)} | {low:.0f}-{high:.0f} | "
                f"{_pair(row['tolerant'])} | {'-' if right is None else f'{100 * right:.1f}'} |"
            )
    return "\n".join(lines) + "\n"


def _pair(row: dict) -> str:
    return f"{100 * row['success_rate']:.1f} / {100 * row['plan_completion']:.1f}"


if __name__ == "__main__":
    sys.exit(main())
