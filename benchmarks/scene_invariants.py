"""Writes benchmarks/results/scene_invariants.json: how many generated buildings are sound.

It generates homes and offices, checks `toponav.worlds.invariants` on each, counts what does not
hold, and times the generation; offices of about 40 rooms are timed apart. Buildings of the frozen
suites come first; their content hashes are how `toponav/worlds/generate/suite_hashes.json` is
made (`--write-hashes`). With `--journal FILE` each building is noted as it is checked: the same
command goes on where an interrupted one stopped, while the generators and the checks are the same.

Example: python benchmarks/scene_invariants.py --homes 500 --offices 500
"""

import argparse
import dataclasses
import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import toponav.worlds
from toponav.cli.progress_bar import progress
from toponav.core.files import read_json_object, write_atomically
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.evaluation.provenance import source_commit
from toponav.worlds.generate.home import HOME_VERSION, generate_home
from toponav.worlds.generate.office import OFFICE_VERSION, generate_office
from toponav.worlds.generate.suites import HASHES_FILE, SUITES
from toponav.worlds.invariants import INVARIANTS, check_invariants
from toponav.worlds.scene import Scene

_RESULTS = Path(__file__).parent / "results"
_MORE_SEEDS = 3000
"""Buildings beyond the suites have seeds from here on."""
_FORTY_ROOMS = range(38, 43)
_SAVE_EVERY = 100
_MAKERS: dict[str, Callable[[int], Scene]] = {"home": generate_home, "office": generate_office}


@dataclass(frozen=True)
class Checked:
    """What was found in one building."""

    kind: str
    seed: int
    content_hash: str
    seconds: float
    rooms: int
    side_m: float
    faults: tuple[tuple[str, str], ...]
    """Rule, and where and what."""


def main() -> int:
    """Counts, and writes what was counted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--homes", type=int, default=500)
    parser.add_argument("--offices", type=int, default=500)
    parser.add_argument("--out", type=Path, default=_RESULTS)
    parser.add_argument("--journal", type=Path)
    parser.add_argument("--write-hashes", action="store_true")
    options = parser.parse_args()
    wanted = [("home", seed) for seed in _seeds("home", options.homes)]
    wanted += [("office", seed) for seed in _seeds("office", options.offices)]
    found = _journalled(options.journal)
    generate_home(0, rooms=3)  # compiled code is loaded before the clock starts
    generate_office(0, size="small")
    with progress("checking buildings") as report:
        for done, key in enumerate(wanted):
            report(done, len(wanted))
            if key not in found:
                found[key] = _check(*key)
                _note(options.journal, found[key])
                if done % _SAVE_EVERY == 0:
                    _write(_of(found, wanted), options.out)
    checked = _of(found, wanted)
    _write(checked, options.out)
    if options.write_hashes:
        _write_hashes(checked)
    return 1 if any(one.faults for one in checked) else 0


def _of(found: dict[tuple[str, int], Checked], wanted: list[tuple[str, int]]) -> list[Checked]:
    return [found[key] for key in wanted if key in found]


def _check(kind: str, seed: int) -> Checked:
    start = time.process_time()
    scene = _MAKERS[kind](seed)
    seconds = time.process_time() - start
    return Checked(
        kind=kind,
        seed=seed,
        content_hash=scene.content_hash[:16],
        seconds=seconds,
        rooms=len(scene.rooms),
        side_m=max(scene.grid.shape) * scene.grid.resolution_m,
        faults=tuple((one.rule, f"{one.where}: {one.what}") for one in check_invariants(scene)),
    )


def _seeds(kind: str, count: int) -> list[int]:
    """Test buildings first, then those of the other suites, then others."""
    suites = sorted(
        (suite for suite in SUITES if suite.generator == kind),
        key=lambda suite: ("test" not in suite.name, "val" not in suite.name),
    )
    seeds = [seed for suite in suites for seed in suite.seeds]
    seeds += list(range(_MORE_SEEDS, _MORE_SEEDS + count))
    return seeds[:count]


def _journalled(journal: Path | None) -> dict[tuple[str, int], Checked]:
    """What an earlier run of the same code noted."""
    if journal is None or not journal.is_file():
        return {}
    code, found = _code_hash(), {}
    for line in journal.read_text().splitlines():
        note = json.loads(line)
        if note.pop("code") == code:
            note["faults"] = tuple(map(tuple, note["faults"]))
            found[note["kind"], note["seed"]] = Checked(**note)
    return found


def _note(journal: Path | None, checked: Checked) -> None:
    if journal is not None:
        with journal.open("a") as file:
            file.write(json.dumps({"code": _code_hash(), **dataclasses.asdict(checked)}) + "\n")


def _code_hash() -> str:
    """Of all code that buildings are made and checked with."""
    folder = Path(toponav.worlds.__file__).parent
    text = b"".join(path.read_bytes() for path in sorted(folder.rglob("*.py")))
    return hashlib.sha256(text).hexdigest()[:16]


def _write(checked: list[Checked], out: Path) -> None:
    """The counts so far."""
    path = out / "scene_invariants.json"
    before = read_json_object(path) if path.is_file() else {"metrics": {}, "settings": {}}
    metrics: dict[str, float] = {}
    kinds: dict[str, object] = {}
    for kind, version in (("home", HOME_VERSION), ("office", OFFICE_VERSION)):
        these = [one for one in checked if one.kind == kind]
        if these:
            metrics |= _metrics(kind, these)
            faults = [f"{kind}-{one.seed}: {': '.join(f)}" for one in these for f in one.faults]
            kinds[kind] = {
                "version": version,
                "commit": source_commit(),
                "seeds": _ranges(one.seed for one in these),
                "faults": faults,
            }
        elif kind in before["settings"]:
            kinds[kind] = before["settings"][kind]
            metrics |= {n: v for n, v in before["metrics"].items() if n.startswith(kind)}
    settings = {**kinds, "seconds": "of processor time of one process with one thread"}
    write_benchmark(Benchmark("scene_invariants", metrics, settings), out)


def _ranges(seeds: Iterable[int]) -> list[list[int]]:
    """First and last of each run of consecutive seeds."""
    runs: list[list[int]] = []
    for seed in sorted(seeds):
        if runs and runs[-1][1] == seed - 1:
            runs[-1][1] = seed
        else:
            runs.append([seed, seed])
    return runs


def _write_hashes(checked: list[Checked]) -> None:
    """The frozen hashes; buildings that this run did not come to stay as they were."""
    hashes = read_json_object(HASHES_FILE) if HASHES_FILE.is_file() else {}
    for kind in _MAKERS:
        found = {str(one.seed): one.content_hash for one in checked if one.kind == kind}
        hashes[kind] = hashes.get(kind, {}) | found
    write_atomically(HASHES_FILE, (json.dumps(hashes, indent=1) + "\n").encode())


def _metrics(kind: str, checked: list[Checked]) -> dict[str, float]:
    """Counts and times by name; empty where nothing was checked."""
    if not checked:
        return {}
    seconds = np.array([one.seconds for one in checked])
    broken = Counter(rule for one in checked for rule in {rule for rule, _ in one.faults})
    metrics = {
        f"{kind}s_checked": float(len(checked)),
        f"{kind}s_sound": float(sum(not one.faults for one in checked)),
        f"{kind}_seconds_median": float(np.median(seconds)),
        f"{kind}_seconds_p95": float(np.percentile(seconds, 95)),
        f"{kind}_seconds_max": float(seconds.max()),
        f"{kind}_rooms_median": float(np.median([one.rooms for one in checked])),
        f"{kind}_longest_side_m_median": float(np.median([one.side_m for one in checked])),
    }
    forty = [one.seconds for one in checked if one.rooms in _FORTY_ROOMS]
    if kind == "office" and forty:
        metrics |= {
            "offices_of_about_40_rooms": float(len(forty)),
            "office_of_about_40_rooms_seconds_max": float(max(forty)),
        }
    return metrics | {f"{kind}s_with_fault_{rule}": float(broken[rule]) for rule in INVARIANTS}


if __name__ == "__main__":
    sys.exit(main())
