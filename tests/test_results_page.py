"""docs/results.md shows what is stored."""

from tests.benchmark_script import ROOT, script


def test_the_page_of_results_is_that_of_the_stored_runs() -> None:
    module = script("results_page")
    page = module.page()
    assert all(f"| {area} |" in page for area in module.AREAS)
    assert (ROOT / "docs" / "results.md").read_text() == page
