"""A taste of benchmarks/fuzz_formats.py, which runs 12,000 cases."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.maps.format_bombs import small_bombs
from tests.maps.format_fuzz import Case, Seeds, case_of, outcome_of
from toponav.maps.formats.convert import READABLE

_ENDINGS = {"canvas": ".json", "area": ".yaml"}


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> Seeds:
    return Seeds(tmp_path_factory.mktemp("fuzz"))


@pytest.mark.parametrize("map_format", READABLE)
def test_seeds_are_maps(seeds: Seeds, map_format) -> None:
    name = f"seed_of{_ENDINGS.get(map_format.value, '')}"
    case = Case(map_format, "seed", name, seeds.content[map_format], told=True)
    assert outcome_of(case, seeds).result == "map"


@settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
@given(number=st.integers(10**6, 2**40))
def test_any_broken_file_gives_a_map_or_names_its_place(seeds: Seeds, number: int) -> None:
    case = case_of(number, seeds)
    outcome = outcome_of(case, seeds)
    assert outcome.result in ("map", "error"), (case.format, case.kind, outcome)
    assert outcome.seconds < 5.0


@pytest.mark.parametrize(
    "case", list(small_bombs()), ids=lambda case: f"{case.format}, {case.kind}"
)
def test_bombs_do_not_go_off(seeds: Seeds, case: Case) -> None:
    outcome = outcome_of(case, seeds)
    assert outcome.result == "error", outcome
    assert outcome.seconds < 5.0
