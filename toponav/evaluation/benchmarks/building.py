"""The building that benchmarks run in."""

import os
from pathlib import Path

import toponav
from toponav.evaluation.suite import Suite, SuiteSource, load_suite, suite_of

__all__ = ["benchmark_suite"]

_AREA = "area_3"


def benchmark_suite(episodes: int = 20) -> Suite:
    """Stanford area 3 with its published pairs where the data is there, else an office.

    Looked for in `$TOPONAV_DATA`, else in `shared/data` beside the source tree.
    """
    beside = Path(toponav.__file__).parents[2] / "shared" / "data"
    areas = Path(os.environ.get("TOPONAV_DATA") or beside) / "graphnav_areas"
    area, plans = areas / f"{_AREA}.yaml", areas / f"{_AREA}_plans.json"
    if area.is_file() and plans.is_file():
        return load_suite(SuiteSource(area=area, plans=plans, episodes=episodes))
    from toponav.maps.construct import map_from_layout
    from toponav.worlds.generate.office import generate_office

    scene = generate_office(0)
    return suite_of(scene, map_from_layout(scene), episodes, seed=0)
