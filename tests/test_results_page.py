"""docs/results.md shows what is stored."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_the_page_of_results_is_that_of_the_stored_runs() -> None:
    path = ROOT / "benchmarks" / "results_page.py"
    spec = importlib.util.spec_from_file_location("results_page", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = module.page()
    assert all(f"| {area} |" in page for area in module.AREAS)
    assert (ROOT / "docs" / "results.md").read_text() == page
