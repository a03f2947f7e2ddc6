"""Commands that need no network or simulator start without loading one."""

import subprocess
import sys

import pytest

from toponav.cli.main import main

PROGRAM = """
import sys
from toponav.cli.main import main
status = main(sys.argv[1:])
heavy = sorted({"torch", "numba", "mujoco", "matplotlib", "scipy"} & sys.modules.keys())
assert not heavy, f"loaded {heavy}"
sys.exit(status)
"""


@pytest.fixture(scope="module")
def map_file(tmp_path_factory):
    scene, file = (str(tmp_path_factory.mktemp("map") / name) for name in ("o", "o.topo.json"))
    assert (
        main(["scene", "generate", "office", "--seed", "7", "--size", "small", "--out", scene])
        == 0
    )
    assert main(["map", "build", scene, "--out", file]) == 0
    return file


@pytest.mark.parametrize(
    "words", ["--help", "train all --help", "map check MAP", "map plan MAP office_1 office_2"]
)
def test_command_starts_light(words, map_file):
    arguments = [map_file if word == "MAP" else word for word in words.split()]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
