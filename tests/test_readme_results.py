"""The README's numbers are those of the stored runs."""

import json

from tests.benchmark_script import ROOT, script

PROBES = {"teacher_forced", "own_belief"}


def test_the_readme_shows_the_table_of_the_stored_runs() -> None:
    module = script("graphnav_areas")
    table = module.table()
    stored = [
        json.loads((module.RESULTS / area / "results.json").read_text())["agents"]
        for area in module.AREAS
    ]
    assert table.count("\n") == 2 + sum(len(agents.keys() - PROBES) for agents in stored)
    assert table in (ROOT / "README.md").read_text()
