"""Every example runs, and says what it found."""

import os
import runpy
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run an example as a script that writes its files into `folder`."""
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.syspath_prepend(str(EXAMPLES))
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")


def test_every_example_is_tested():
    scripts = {path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".sh")}
    source = Path(__file__).read_text()
    untested = {name for name in scripts if f'"{name}"' not in source}
    assert untested == set()


def test_map_goes_through_other_formats(tmp_path, monkeypatch, capsys):
    run("06_convert_maps.py", tmp_path, monkeypatch)
    assert capsys.readouterr().out


def test_robot_drives_where_it_is_open(tmp_path, monkeypatch, capsys):
    run("01_drive_in_gymnasium.py", tmp_path, monkeypatch)
    driven_m = float(capsys.readouterr().out.splitlines()[-1].split()[0])
    assert driven_m > 5.0


def test_map_is_written_checked_planned_on_and_drawn(tmp_path, monkeypatch, capsys):
    run("02_read_and_plan_on_a_map.py", tmp_path, monkeypatch)
    lines = capsys.readouterr().out.splitlines()
    assert "nodes" in lines[0]
    assert lines[1].startswith("  at office_")  # no fault in between
    assert Path(lines[-1].removeprefix("drawn: ")).stat().st_size > 10_000


def test_own_agent_is_judged_beside_the_expert(tmp_path, monkeypatch, capsys):
    run("03_write_your_own_agent.py", tmp_path, monkeypatch)
    own, expert, _ = capsys.readouterr().out.splitlines()
    assert own.startswith("03_write_your_own_agent:make_agent: ")
    assert expert.startswith("expert: 100%")


def test_bag_reads_back_as_arrays_and_as_messages(tmp_path, monkeypatch, capsys):
    run("04_record_and_read_a_bag.py", tmp_path, monkeypatch)
    shown = capsys.readouterr().out
    assert "depth images of (60, 80) pixels" in shown
    assert "nav_msgs/msg/Odometry" in shown


@pytest.mark.slow
def test_area_is_evaluated_by_two_commands(tmp_path, areas_dir):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("no bash")
    script = EXAMPLES / "05_evaluate_on_an_area.sh"
    binaries = str(Path(sys.executable).parent)
    done = subprocess.run(
        [bash, str(script), "area_3", "1", "expert", str(tmp_path / "results")],
        env=os.environ
        | {
            "PATH": f"{binaries}{os.pathsep}{os.environ['PATH']}",
            "TOPONAV_DATA": str(areas_dir.parent),
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "GraphNav, Table VI" in done.stdout
    assert (tmp_path / "results" / "results.json").is_file()


@pytest.mark.parametrize("name", ["train_best.sh", "train_compact.sh", "train_quick.sh"])
def test_training_script_is_valid_shell(name):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("no bash")
    # That its commands exist and take these options is tests/test_docs.py's to say.
    assert subprocess.run([bash, "-n", str(EXAMPLES / name)], check=False).returncode == 0
