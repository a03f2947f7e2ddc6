"""The README's numbers are those of the stored runs."""

import importlib.util
import json
from pathlib import Path

ROOT = Path(__file__).parent.parent
PROBES = {"teacher_forced", "own_belief"}


def test_the_readme_shows_the_table_of_the_stored_runs() -> None:
    path = ROOT / "benchmarks" / "graphnav_areas.py"
    spec = importlib.util.spec_from_file_location("graphnav_areas", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    table = module.table()
    stored = [
        json.loads((module.RESULTS / area / "results.json").read_text())["agents"]
        for area in module.AREAS
    ]
    assert table.count("\n") == 2 + sum(len(agents.keys() - PROBES) for agents in stored)
    assert table in (ROOT / "README.md").read_text()
