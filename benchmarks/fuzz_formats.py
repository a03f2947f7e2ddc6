"""Feeds broken and hostile files to every map importer, and stores what they did.

    python benchmarks/fuzz_formats.py [--cases 12000] [--seed 0]

Writes benchmarks/results/fuzz_formats.json. Each file has to give a map that can be saved, or an
error that names the place, within 5 seconds of processor time; exits with status 1 otherwise.
"""

import argparse
import json
import platform
import resource
import sys
import tempfile
import time
from collections import Counter
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from tests.maps.format_bombs import large_bombs, small_bombs  # noqa: E402
from tests.maps.format_fuzz import Case, Seeds, case_of, outcome_of  # noqa: E402
from toponav.core.files import write_atomically  # noqa: E402
from toponav.evaluation.provenance import source_commit  # noqa: E402

LIMIT_S = 5.0
LIMIT_MIB = 2048


def main() -> int:
    """Run the cases, and store the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=12_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    before_mib = _peak_mib()
    results: dict[str, Counter[str]] = {}
    kinds: Counter[str] = Counter()
    faults: list[dict[str, object]] = []
    slowest_s = 0.0
    start = time.perf_counter()

    def run(case: Case, label: str, seeds: Seeds) -> None:
        nonlocal slowest_s
        outcome = outcome_of(case, seeds)
        slowest_s = max(slowest_s, outcome.seconds)
        good = outcome.result in ("map", "error") and outcome.seconds <= LIMIT_S
        counter = results.setdefault(case.format.value, Counter())
        counter[outcome.result if good else "fault"] += 1
        kinds[case.kind] += 1
        if not good:
            faults.append({"case": label, "result": outcome.result, "seconds": outcome.seconds})
            print(label, case.format, case.kind, outcome, flush=True)

    memory = Path("/dev/shm")  # writing each file to a disk would take longer than reading it
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        seeds = Seeds(Path(folder))
        for number in range(options.seed, options.seed + options.cases):
            run(case_of(number, seeds), f"case {number}", seeds)
            if number % 1000 == 999:
                print(f"{number + 1 - options.seed} cases, {len(faults)} faults", flush=True)
        for number, case in enumerate(chain(small_bombs(), large_bombs())):
            run(case, f"bomb {number}", seeds)
    peak_mib = _peak_mib()
    document = {
        "schema": 1,
        "name": "fuzz_formats",
        "command": f"python benchmarks/fuzz_formats.py --cases {options.cases} "
        f"--seed {options.seed}",
        "commit": source_commit(),
        "hardware": {"machine": platform.machine(), "python": platform.python_version()},
        "cases": sum(kinds.values()),
        "faults": faults,
        "by_format": {name: dict(sorted(found.items())) for name, found in results.items()},
        "by_kind": dict(sorted(kinds.items())),
        "slowest_processor_s": round(slowest_s, 3),
        "limit_processor_s": LIMIT_S,
        "peak_memory_mib": round(peak_mib),
        "memory_before_mib": round(before_mib),
        "wall_s": round(time.perf_counter() - start, 1),
    }
    out = ROOT / "benchmarks" / "results" / "fuzz_formats.json"
    write_atomically(out, json.dumps(document, indent=1) + "\n")
    print(
        f"{document['cases']} cases, {len(faults)} faults, slowest {slowest_s:.1f} s; wrote {out}"
    )
    return int(bool(faults) or peak_mib > LIMIT_MIB)


def _peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    sys.exit(main())
