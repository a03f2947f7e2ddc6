"""The built wheel holds all that the package needs, and works without the source tree."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("hatchling", reason="building a wheel needs the extra 'dev'")

ROOT = Path(__file__).parent.parent.parent
DATA = (
    "evaluation/paper_graphnav.json",
    "evaluation/report/page.html",
    "evaluation/report/script.js",
    "evaluation/report/style.css",
    "maps/topological_map.schema.json",
)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel's content, unpacked where pip would put it."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    done = subprocess.run([*command, str(ROOT)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def run(installed: Path, folder: Path, *words: str) -> str:
    """What a command of the unpacked package prints."""
    program = (
        "import sys, toponav; from toponav.cli.main import main; "
        f"assert toponav.__file__.startswith({str(installed)!r}), toponav.__file__; "
        "sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_holds_every_file_of_the_package(installed):
    wanted = {
        path.relative_to(ROOT / "toponav")
        for path in (ROOT / "toponav").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    packed = {
        path.relative_to(installed / "toponav") for path in (installed / "toponav").rglob("*")
    }
    assert wanted <= packed
    assert {Path(name) for name in DATA} <= packed


def test_wheel_holds_the_licence_and_the_command(installed):
    (metadata,) = installed.glob("toponav-*.dist-info")
    assert "Apache" in (metadata / "licenses" / "LICENSE").read_text()
    assert "toponav.cli.main:main" in (metadata / "entry_points.txt").read_text()


@pytest.mark.parametrize(
    ("preset", "networks", "most_bytes"),
    [("compact", 8, 15e6), ("best", 2, 5e6), ("nts", 2, 15e6)],
)
def test_weights_ship_within_their_size(installed, preset, networks, most_bytes):
    weights = list((installed / "toponav" / "weights" / preset).glob("*.safetensors"))
    assert len(weights) == networks
    assert all(path.with_suffix(".json").is_file() for path in weights)
    assert sum(path.stat().st_size for path in weights) < most_bytes


def test_wheel_works_without_the_source_tree(installed, tmp_path):
    assert run(installed, tmp_path, "--version").startswith("toponav ")
    run(installed, tmp_path, "scene", "generate", "office", "--seed", "7", "--out", "office")
    run(installed, tmp_path, "map", "build", "office", "--out", "office.topo.json")
    assert "no faults" in run(installed, tmp_path, "map", "check", "office.topo.json")
