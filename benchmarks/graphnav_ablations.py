"""Compares variants of agents on validation buildings: what earns its place, in one table.

    python benchmarks/graphnav_ablations.py [VARIANTS.json] [--buildings 6] [--episodes 20]

VARIANTS.json (benchmarks/graphnav_variants.json when left out) is a list; the first is what the
others are compared with:

    [{"name": "best", "agent": "graphnav_pf", "weights": "best"},
     {"name": "no filter", "agent": "graphnav", "weights": "best", "note": "one line"},
     {"name": "mine", "agent": "module:factory", "options": {"particles": "300"}}]

Every variant drives the same plans in the first buildings of a validation suite (never the test
areas), beside the expert. Writes NAME.json and NAME.md under benchmarks/results; resumes where it
was interrupted, and a variant that is added later runs alone.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from toponav.cli.progress_bar import progress
from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import read_json, write_atomically
from toponav.evaluation.agents import AgentChoice
from toponav.evaluation.benchmarks.record import hardware
from toponav.evaluation.metrics import suite_results, wilson_interval
from toponav.evaluation.provenance import library_versions, source_commit
from toponav.evaluation.records import load_episode
from toponav.evaluation.runner import EvaluationConfig, evaluate, part_of
from toponav.evaluation.suite import SuiteSource
from toponav.evaluation.worker import RunSettings
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import save_map
from toponav.worlds.generate.office import generate_office
from toponav.worlds.generate.suites import SUITES, suite
from toponav.worlds.storage import save_scene

ROOT = Path(__file__).parent.parent
VARIANTS = ROOT / "benchmarks" / "graphnav_variants.json"
RESULTS = ROOT / "benchmarks" / "results"
RUNS = ROOT / "runs" / "graphnav_ablations"
RULES = ("strict", "tolerant")


def main(arguments: list[str] | None = None) -> int:
    """Evaluate the variants, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("variants", type=Path, nargs="?", default=VARIANTS)
    parser.add_argument("--name", default="graphnav_ablations", help="name of the files written")
    parser.add_argument("--suite", default="offices-val")
    parser.add_argument("--buildings", type=int, default=6)
    parser.add_argument("--episodes", type=int, default=20, help="plans in each building")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--runs", type=Path, default=RUNS)
    options = parser.parse_args(arguments)
    try:
        variants = read_variants(options.variants)
        seeds = seeds_of(options.suite, options.buildings)
        records = drive(variants, seeds, options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    document = {
        "schema": 1,
        "name": options.name,
        "commit": source_commit(),
        "hardware": hardware(),
        "versions": library_versions(),
        "settings": {
            "suite": options.suite,
            "building_seeds": list(seeds),
            "episodes_per_building": options.episodes,
            "seed": options.seed,
        },
        "variants": [compared(variant, variants[0], records) for variant in variants],
        "expert": numbers(records["expert"], records["expert"]),
        "metrics": {},
    }
    document["metrics"] = {
        f"{row['name']}_{rule}_success": row[rule]["success_rate"]
        for row in document["variants"]
        for rule in RULES
    }
    write_atomically(options.out / f"{options.name}.json", json.dumps(document, indent=1) + "\n")
    text = markdown(document)
    write_atomically(options.out / f"{options.name}.md", text)
    print(text)
    return 0


def read_variants(path: Path) -> list[dict[str, Any]]:
    """The list of variants, each checked.

    Raises:
        InputError: The file is no such list, or an agent is unknown.
    """
    found = read_json(path)
    if not isinstance(found, list) or not found or not all(isinstance(v, dict) for v in found):
        raise InputError(
            "variants are a list of objects", where=str(path), remedy="see the script's top"
        )
    known = ("name", "agent", "weights", "options", "note")
    for number, variant in enumerate(found):
        for key in sorted(variant.keys() - set(known)):
            raise InputError(
                f"variant {number} has '{key}'", where=str(path), remedy=did_you_mean(key, known)
            )
        if not variant.get("name") or not variant.get("agent") or variant["name"] == "expert":
            raise InputError(
                f"variant {number} needs a name of its own and an agent",
                where=str(path),
                remedy='such as {"name": "mine", "agent": "graphnav_pf", "weights": "best"}',
            )
        choice(variant)
    return found


def choice(variant: dict[str, Any]) -> AgentChoice:
    options = tuple((key, str(value)) for key, value in (variant.get("options") or {}).items())
    return AgentChoice(variant["agent"], variant.get("weights"), options, variant["name"])


def seeds_of(name: str, count: int) -> range:
    """The first buildings of a validation suite of offices."""
    names = [one.name for one in SUITES if one.name.endswith("-val") and one.generator == "office"]
    if name not in names:
        raise InputError(
            f"ablations run on validation buildings, not on '{name}'",
            where="--suite",
            remedy=f"use {' or '.join(names)}",
        )
    seeds = suite(name).seeds
    if not 1 <= count <= len(seeds):
        raise InputError(
            f"{name} has {len(seeds)} buildings, asked for {count}",
            where="--buildings",
            remedy="ask for fewer",
        )
    return seeds[:count]


def drive(
    variants: list[dict[str, Any]], seeds: range, options: argparse.Namespace
) -> dict[str, list[Any]]:
    """Every variant's records over all buildings, and the expert's, in the same order."""
    agents = (*(choice(variant) for variant in variants), AgentChoice("expert"))
    records: dict[str, list[Any]] = {agent.label: [] for agent in agents}
    for position, seed in enumerate(seeds):
        folder = options.runs / f"office_{seed:06d}"
        if not (folder / "map.topo.json").is_file():
            scene = generate_office(seed)
            save_scene(scene, folder / "scene")
            save_map(map_from_layout(scene), folder / "map.topo.json")
        source = SuiteSource(
            scene=folder / "scene",
            map=folder / "map.topo.json",
            episodes=options.episodes,
            seed=options.seed,
        )
        config = EvaluationConfig(
            source, agents, folder / "run", RunSettings(seed=options.seed), options.workers
        )
        with progress(f"building {position + 1} of {len(seeds)}") as update:
            evaluate(config, update)
        for agent in agents:
            for index in range(options.episodes):
                stored = load_episode(part_of(config.out, agent.label, index))
                assert stored is not None
                records[agent.label].append(stored.record)
    return records


def numbers(records: list[Any], expert: list[Any]) -> dict[str, Any]:
    """A variant's numbers over all buildings, by the strict and the tolerant rule."""
    # The runner numbers episodes within a building; here they are numbered through.
    results = suite_results(_numbered(records, "variant") + _numbered(expert, "expert"))
    row = results["agents"]["variant"]
    kept = ("success_rate", "success_ci95", "plan_completion", "plan_completion_ci95", "outcomes")
    kept += ("success_on_expert_feasible", "localization_accuracy", "localization_ci95")
    return {
        "episodes": row["episodes"],
        "strict": {key: row.get(key) for key in kept},
        "tolerant": {key: row["tolerant"].get(key) for key in kept},
        "act_ms_p50": row["act_ms_p50"],
        "act_ms_p99": row["act_ms_p99"],
        "episode_s": row["episode_s"],
    }


def _numbered(records: list[Any], name: str) -> list[Any]:
    return [replace(record, agent=name, index=at) for at, record in enumerate(records)]


def compared(
    variant: dict[str, Any], reference: dict[str, Any], records: dict[str, list[Any]]
) -> dict[str, Any]:
    """A variant's numbers, and how its success differs from the first variant's, pair by pair."""
    mine, theirs = records[variant["name"]], records[reference["name"]]
    row = {
        "name": variant["name"],
        "agent": variant["agent"],
        "weights": Path(variant["weights"]).name if variant.get("weights") else None,
        "options": variant.get("options") or {},
        "note": variant.get("note", ""),
        **numbers(mine, records["expert"]),
    }
    for rule in RULES if variant is not reference else ():
        here = np.array([getattr(record, rule).success for record in mine], float)
        there = np.array([getattr(record, rule).success for record in theirs], float)
        row[rule]["difference"] = float((here - there).mean())
        row[rule]["difference_ci95"] = paired_interval(here, there)
    return row


def paired_interval(here: np.ndarray, there: np.ndarray) -> list[float] | None:
    """95 % interval of the difference of two success rates on the same episodes.

    Reference:
        Bonett and Price 2012, "Adjusted Wald Confidence Interval for a Difference of Binomial
        Proportions Based on Paired Data".
    """
    n = len(here)
    if n < 2:
        return None
    won, lost = float((here > there).sum()) + 1.0, float((here < there).sum()) + 1.0
    p, q, size = won / (n + 2), lost / (n + 2), n + 2
    half = 1.96 * float(np.sqrt(max(0.0, (p + q - (p - q) ** 2) / size)))
    return [max(-1.0, p - q - half), min(1.0, p - q + half)]


def markdown(document: dict[str, Any]) -> str:
    """The table."""
    lines = [
        "| variant | strict SR / PC, % | 95 % | against the first | tolerant SR / PC, % | "
        "against the first | edge right, % | collided / deviated / stuck / timeout, % | act p99, "
        "ms |",
        "|---" * 9 + "|",
    ]
    rows = [*document["variants"], {"name": "expert", "note": "", **document["expert"]}]
    for row in rows:
        strict, tolerant = row["strict"], row["tolerant"]
        why = " / ".join(
            f"{100 * tolerant['outcomes'][name] / row['episodes']:.0f}"
            for name in ("collided", "deviated", "stuck", "timeout")
        )
        ends = wilson_interval(round(strict["success_rate"] * row["episodes"]), row["episodes"])
        assert ends is not None
        name = f"{row['name']}: {row['note']}" if row["note"] else row["name"]
        cells = [
            name,
            _pair(strict),
            f"{100 * ends[0]:.0f}-{100 * ends[1]:.0f}",
            _difference(strict),
            _pair(tolerant),
            _difference(tolerant),
            _percent(tolerant["localization_accuracy"]),
            why,
            f"{row['act_ms_p99']:.1f}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    settings = document["settings"]
    buildings = settings["building_seeds"]
    lines += [
        "",
        f"{len(buildings)} buildings of {settings['suite']} (seeds {buildings[0]} to "
        f"{buildings[-1]}), {settings['episodes_per_building']} sampled plans in each, seed "
        f"{settings['seed']}, commit {str(document['commit'])[:12]}. SR: success, PC: plan "
        "completion. Outcomes by the tolerant rule. Differences are of the same episodes, in "
        "points, with their 95 % interval.",
    ]
    return "\n".join(lines) + "\n"


def _pair(row: dict[str, Any]) -> str:
    return f"{_percent(row['success_rate'])} / {_percent(row['plan_completion'])}"


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f}"


def _difference(row: dict[str, Any]) -> str:
    ends = row.get("difference_ci95")
    if ends is None:
        return "-"
    return f"{100 * row['difference']:+.1f} ({100 * ends[0]:+.0f}..{100 * ends[1]:+.0f})"


if __name__ == "__main__":
    sys.exit(main())
