"""Shapes are checked while the tests run; areas are found or the tests that need them skip."""

import os
from pathlib import Path

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

_PACKAGE = Path(__file__).parent.parent / "toponav"

# CI draws the same examples each time, so that a change is judged and not the draw; elsewhere the
# draw differs from run to run and finds what is left.
settings.register_profile("same-draw", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("same-draw")


def _checked_modules() -> list[str]:
    """Every module but numba kernels, which compile the undecorated function."""
    modules = []
    for path in sorted(_PACKAGE.rglob("*.py")):
        if path.stem.endswith("_kernels") or path.stem == "__init__":
            continue
        modules.append(".".join(path.relative_to(_PACKAGE.parent).with_suffix("").parts))
    return modules


install_import_hook(_checked_modules(), "beartype.beartype")


def _data_dir() -> Path:
    return Path(os.environ.get("TOPONAV_DATA", _PACKAGE.parent.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def areas_dir() -> Path:
    """The Stanford areas as GraphNav's authors published them."""
    directory = _data_dir() / "graphnav_areas"
    if not directory.is_dir():
        pytest.skip(f"no Stanford areas at {directory}; set TOPONAV_DATA")
    return directory
