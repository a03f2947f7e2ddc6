"""What ships drives: the demo from the command line, with the weights inside the package."""

import json
from pathlib import Path

import pytest

import toponav
from toponav.cli.main import main

WEIGHTS = Path(toponav.__file__).parent / "weights" / "compact"

pytestmark = pytest.mark.skipif(
    not any(WEIGHTS.glob("*.safetensors")), reason="no weights ship with this version yet"
)


@pytest.mark.slow
def test_demo_drives_an_unseen_office_with_the_shipped_weights(tmp_path, capsys):
    assert main(["demo", "--plans", "2", "--out", str(tmp_path / "demo"), "--json"]) == 0
    agents = json.loads(capsys.readouterr().out)["agents"]
    assert agents["expert"]["tolerant"]["success_rate"] == 1.0
    # Far below what they do; far above what broken weights, cameras or maps would do.
    assert agents["graphnav_pf"]["tolerant"]["plan_completion"] > 0.5
    assert agents["graphnav_pf"]["localization_accuracy"] > 0.6
    assert (tmp_path / "demo" / "report.html").stat().st_size > 100_000
