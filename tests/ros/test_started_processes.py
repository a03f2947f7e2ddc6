"""The wheels' start-up hook for real: its leaks are cleaned up, and a sourced ROS goes first."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from toponav.ros.environment import GUARD, libraries_of

pytestmark = pytest.mark.ros

CHILD = """
import json, os, subprocess, sys
from toponav.ros.runtime import start
found = start()
import rclpy
say = "import json, os; print(json.dumps(dict(os.environ)))"
# -S: no start-up hook runs in it that could set anything again.
child = subprocess.run([sys.executable, "-S", "-c", say], capture_output=True, check=True)
print(json.dumps([found.kind, rclpy.__file__, json.loads(child.stdout)]))
"""


@pytest.fixture(autouse=True)
def only_with_wheels() -> None:
    pytest.importorskip("rclpy", reason="ROS 2 is not installed; `make test-ros` installs it")


def start(**changes: str) -> tuple[str, str, dict[str, str]]:
    """Kind and place of the ROS that a fresh process uses, and its children's environment."""
    kept = {name: value for name, value in os.environ.items() if name not in changes}
    done = subprocess.run(
        [sys.executable, "-c", CHILD],
        env={**kept, **changes},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    kind, place, environment = json.loads(done.stdout.splitlines()[-1])
    return kind, place, environment


def ours(environment: dict[str, str]) -> set[str]:
    path = environment.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    return set(path) & set(libraries_of(Path(sys.prefix)))


@pytest.mark.parametrize(
    "leaked",
    [{}, {GUARD: "1"}, {GUARD: "1", "LD_LIBRARY_PATH": "/of/another/environment"}],
)
def test_whatever_leaked_into_a_process_its_ros_works_and_its_children_are_clean(
    leaked: dict[str, str],
) -> None:
    kind, place, child = start(**leaked)
    assert kind == "wheels"
    assert Path(place).is_relative_to(sys.prefix)
    assert GUARD not in child
    assert ours(child) == set()
    assert child.get("LD_LIBRARY_PATH", "") == leaked.get("LD_LIBRARY_PATH", "")


def test_a_sourced_ros_goes_before_the_wheels_of_the_same_python(tmp_path: Path) -> None:
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    site = tmp_path / "lib" / version / "site-packages"
    for package in ("rclpy", "tf2_msgs", "toponav_msgs"):
        (site / package).mkdir(parents=True)
        (site / package / "__init__.py").touch()
    (tmp_path / "share").mkdir()
    kind, place, child = start(PYTHONPATH=str(site), LD_LIBRARY_PATH=str(tmp_path / "lib"))
    assert kind == "sourced"
    assert Path(place).is_relative_to(tmp_path)
    assert GUARD not in child
    assert ours(child) == set()
    assert child["LD_LIBRARY_PATH"] == str(tmp_path / "lib")
