"""Writes benchmarks/results/scene_invariants.json: how many generated buildings are sound.

It generates homes and offices, checks `toponav.worlds.invariants` on each, and counts what does
not hold. Homes and offices of the frozen suites come first; their content hashes are written
beside the counts, which is how `toponav/worlds/generate/suite_hashes.json` is made
(`--write-hashes`). An interrupted run keeps what it has counted.

Example: python benchmarks/scene_invariants.py --homes 500 --offices 500
"""

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toponav.cli.progress_bar import progress
from toponav.core.files import read_json_object, write_atomically
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.worlds.generate.home import HOME_VERSION, generate_home
from toponav.worlds.generate.office import OFFICE_VERSION, generate_office
from toponav.worlds.generate.suites import HASHES_FILE, SUITES
from toponav.worlds.invariants import INVARIANTS, check_invariants
from toponav.worlds.scene import Scene

_RESULTS = Path(__file__).parent / "results"
_CHUNK = 100
"""The suites of homes, and of offices for testing, are within the first hundred."""
_MORE_SEEDS = 3000
"""Homes beyond the suites have seeds from here on."""


def main() -> int:
    """Counts, and writes what was counted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--homes", type=int, default=500)
    parser.add_argument("--offices", type=int, default=500)
    parser.add_argument("--out", type=Path, default=_RESULTS)
    parser.add_argument("--write-hashes", action="store_true")
    options = parser.parse_args()
    tallies = {
        "home": Tally("home", generate_home, _seeds("home", options.homes)),
        "office": Tally("office", generate_office, _seeds("office", options.offices)),
    }
    while any(tally.seeds for tally in tallies.values()):
        for tally in tallies.values():
            tally.check_some()
            _write(list(tallies.values()), options.out, options.write_hashes)
    return 1 if any(tally.faults for tally in tallies.values()) else 0


def _write(tallies: list["Tally"], out: Path, with_hashes: bool) -> None:
    """The counts so far."""
    metrics: dict[str, float] = {}
    for tally in tallies:
        metrics |= tally.metrics()
    settings = {
        "faults": [fault for tally in tallies for fault in tally.faults],
        "versions": {"home": HOME_VERSION, "office": OFFICE_VERSION},
        "seconds": "of processor time of one process with one thread",
    }
    write_benchmark(Benchmark("scene_invariants", metrics, settings), out)
    if with_hashes:
        # What this run has not come to yet stays as it was.
        hashes = read_json_object(HASHES_FILE) if HASHES_FILE.is_file() else {}
        for tally in tallies:
            hashes[tally.kind] = hashes.get(tally.kind, {}) | tally.hashes
        write_atomically(HASHES_FILE, (json.dumps(hashes, indent=1) + "\n").encode())


def _seeds(kind: str, count: int) -> list[int]:
    """Test buildings first, then those of the other suites, then others."""
    suites = sorted(
        (suite for suite in SUITES if suite.generator == kind),
        key=lambda suite: ("test" not in suite.name, "val" not in suite.name),
    )
    seeds = [seed for suite in suites for seed in suite.seeds]
    seeds += list(range(_MORE_SEEDS, _MORE_SEEDS + count))
    return seeds[:count]


@dataclass
class Tally:
    """What was found in buildings of one kind."""

    kind: str
    make: Callable[[int], Scene]
    seeds: list[int]
    faults: list[str] = field(default_factory=list)
    hashes: dict[str, str] = field(default_factory=dict)
    broken: Counter[str] = field(default_factory=Counter)
    sound: int = 0
    seconds: list[float] = field(default_factory=list)
    rooms: list[int] = field(default_factory=list)
    sizes_m: list[float] = field(default_factory=list)

    def check_some(self) -> None:
        """Generates and checks the next buildings."""
        now, self.seeds = self.seeds[:_CHUNK], self.seeds[_CHUNK:]
        with progress(f"checking {self.kind}s") as report:
            for done, seed in enumerate(now):
                report(done, len(now))
                self._check(seed)

    def _check(self, seed: int) -> None:
        start = time.process_time()
        scene = self.make(seed)
        self.seconds.append(time.process_time() - start)
        found = check_invariants(scene)
        self.sound += not found
        self.broken.update({fault.rule for fault in found})
        self.faults += [f"{scene.name}: {f.rule}: {f.where}: {f.what}" for f in found]
        self.hashes[str(seed)] = scene.content_hash[:16]
        self.rooms.append(len(scene.rooms))
        self.sizes_m.append(max(scene.grid.shape) * scene.grid.resolution_m)

    def metrics(self) -> dict[str, float]:
        """Counts and times by name; empty before the first building."""
        if not self.seconds:
            return {}
        kind = self.kind
        return {
            f"{kind}s_checked": float(len(self.seconds)),
            f"{kind}s_sound": float(self.sound),
            f"{kind}_seconds_median": float(np.median(self.seconds)),
            f"{kind}_seconds_p95": float(np.percentile(self.seconds, 95)),
            f"{kind}_seconds_max": float(np.max(self.seconds)),
            f"{kind}_rooms_median": float(np.median(self.rooms)),
            f"{kind}_longest_side_m_median": float(np.median(self.sizes_m)),
        } | {f"{kind}s_with_fault_{rule}": float(self.broken[rule]) for rule in INVARIANTS}


if __name__ == "__main__":
    sys.exit(main())
