"""Builds maps of areas 1, 3, 5b and 6 and compares them with the authors' drawings.

    python benchmarks/map_agreement.py

Writes benchmarks/results/map_agreement.json (every count, and every pair that is planned
differently) and benchmarks/results/map_agreement.md, the table made from it.
"""

import os
import sys
import time
from pathlib import Path

from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.maps.agreement import compare_maps
from toponav.maps.construct import map_from_scene
from toponav.maps.formats.canvas import load_area_map
from toponav.maps.validate import validate
from toponav.worlds.load.stanford import load_area, load_pairs

ROOT = Path(__file__).parent.parent
OUT = ROOT / "benchmarks" / "results" / "map_agreement.json"
AREAS = ("area_1", "area_3", "area_5b", "area_6")
SUMMED = ("doors_drawn", "doors_found", "doors_built", "pairs", "pairs_planned", "pairs_same")


def main() -> int:
    """Build, compare, store."""
    data = Path(os.environ.get("TOPONAV_DATA", ROOT.parent / "shared" / "data"))
    areas = {}
    for name in AREAS:
        yaml = data / "graphnav_areas" / f"{name}.yaml"
        scene = load_area(yaml)
        start = time.process_time()
        built = map_from_scene(scene)
        seconds = time.process_time() - start
        pairs = [
            (p.start_room, p.end_room) for p in load_pairs(yaml.with_name(f"{name}_plans.json"))
        ]
        compared = compare_maps(load_area_map(yaml), built, pairs).to_document()
        faults = [fault.to_document() for fault in validate(built)]
        areas[name] = {"build_cpu_s": round(seconds, 2), "faults": faults, **compared}
    benchmark = Benchmark("map_agreement", _metrics(areas), {"scene_seed": 0, "areas": areas})
    write_benchmark(benchmark, OUT.parent)
    OUT.with_suffix(".md").write_text(table(areas))
    print(table(areas))
    return 0


def _metrics(areas: dict) -> dict[str, float]:
    total = {key: sum(area[key] for area in areas.values()) for key in SUMMED}
    metrics = {
        "door_recall": total["doors_found"] / total["doors_drawn"],
        "door_precision": total["doors_found"] / total["doors_built"],
        "pairs_planned": total["pairs_planned"] / total["pairs"],
        "same_sequence": total["pairs_same"] / total["pairs"],
        "area_5b_build_cpu_s": areas["area_5b"]["build_cpu_s"],
    }
    metrics |= {f"{name}_same_sequence": area["same_sequence"] for name, area in areas.items()}
    return metrics


def table(areas: dict) -> str:
    """The comparison as Markdown."""
    lines = [
        "| area | doors found | doors invented | nodes matched within 1 m | "
        "behaviour of matched edges | pairs with a plan | same behaviours | "
        "of these beyond reach | built in, CPU s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, area in areas.items():
        lines.append(
            f"| {name} | {area['doors_found']} of {area['doors_drawn']} | "
            f"{area['doors_built'] - area['doors_found']} | "
            f"{area['nodes_matched']} of {area['nodes_drawn']} | "
            f"{area['edges_same_behavior']} of {area['edges_matched']} | "
            f"{area['pairs_planned']} of {area['pairs']} | "
            f"{area['pairs_same']} ({100 * area['same_sequence']:.1f} %) | "
            f"{area['pairs_through_fault']} | {area['build_cpu_s']} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
