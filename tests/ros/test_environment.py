import importlib.util
import os
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

import pytest

from toponav.cli.main import main
from toponav.core.errors import InputError
from toponav.ros import environment, interfaces
from toponav.ros.environment import GUARD, cleaned, find_ros, libraries_of
from toponav.ros.presets import PRESETS, robot_preset


@pytest.fixture
def wheels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An environment with the wheels' rclpy, which is not run."""
    site = tmp_path / "lib" / "python3.11" / "site-packages"
    for name in ("rclpy", "ros_rclpy-7.dist-info", "ros_rclpy.libs", "ros_rcl.libs"):
        (site / name).mkdir(parents=True)
    (tmp_path / "share").mkdir()
    _find(monkeypatch, site / "rclpy")
    return tmp_path


def _find(monkeypatch: pytest.MonkeyPatch, package: Path | None) -> None:
    def find_spec(name: str, *_: Any) -> ModuleSpec | None:
        if package is None:
            return None
        spec = ModuleSpec(name, None, is_package=True)
        spec.submodule_search_locations = [str(package)]
        return spec

    monkeypatch.setattr(importlib.util, "find_spec", find_spec)


def test_without_ros_the_command_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _find(monkeypatch, None)
    assert main(["ros", "messages"]) == 1
    assert "pip install 'toponav[ros]'" in capsys.readouterr().err


def test_wheels_need_their_folders_and_a_process_that_has_them_is_left_alone(
    wheels: Path,
) -> None:
    found = find_ros()
    assert (found.kind, found.prefix) == ("wheels", wheels)
    names = [Path(each).name for each in found.library_paths]
    assert names == ["lib", "ros_rcl.libs", "ros_rclpy.libs"]
    wanted = environment._wanted_path(found, {"LD_LIBRARY_PATH": "/mine"})
    assert wanted is not None
    assert wanted.split(os.pathsep) == [*found.library_paths, "/mine"]
    assert environment._wanted_path(found, {"LD_LIBRARY_PATH": wanted}) is None


def test_a_guard_that_leaked_from_another_environment_starts_python_again(
    wheels: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(GUARD, "1")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/other/ros_rclpy.libs")
    started: list[Any] = []

    def execve(*arguments: Any) -> None:
        started.append(arguments)
        raise SystemExit

    monkeypatch.setattr(os, "execve", execve)
    with pytest.raises(SystemExit):
        environment.prepare()
    program, words, variables = started[0]
    assert (program, words) == (sys.executable, sys.orig_argv)
    assert variables["LD_LIBRARY_PATH"].startswith(str(wheels / "lib"))


def test_children_inherit_neither_guard_nor_folders(wheels: Path) -> None:
    ours = os.pathsep.join((*libraries_of(wheels), "/mine"))
    left = cleaned({GUARD: "1", "LD_LIBRARY_PATH": ours, "HOME": "/home"}, wheels)
    assert left == {"LD_LIBRARY_PATH": "/mine", "HOME": "/home"}
    nothing = cleaned({"LD_LIBRARY_PATH": os.pathsep.join(libraries_of(wheels))}, wheels)
    assert nothing == {}


def test_a_sourced_ros_without_our_messages_is_told_to_build_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "lib" / "python3.11" / "site-packages" / "rclpy"
    package.mkdir(parents=True)
    (tmp_path / "share").mkdir()
    _find(monkeypatch, package)
    found = find_ros()
    assert found.kind == "sourced"
    assert found.library_paths == ()
    _find(monkeypatch, None)
    with pytest.raises(InputError, match="colcon build"):
        interfaces.load_interfaces(found)


def test_the_build_cache_follows_the_definitions() -> None:
    for package in interfaces.PACKAGES:
        assert (interfaces.definitions_dir(package) / "CMakeLists.txt").is_file()
    assert interfaces.cache_dir() == interfaces.cache_dir()


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interfaces.shutil, "which", lambda _: None)
    with pytest.raises(InputError, match="cmake and a C compiler"):
        interfaces._require_tools()


def test_presets_are_found_and_slips_are_helped() -> None:
    assert set(PRESETS) == {"toponav", "turtlebot4", "turtlebot3", "locobot"}
    with pytest.raises(InputError, match="turtlebot4"):
        robot_preset("turtlebot_4")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["sim", "--scene", "x", "--fault", "smoke:1"], "no fault"),
        (["agent"], "looks for pictures"),
        (["agent", "--map", "m", "--max-linear-m-s", "3"], "at most 0.5"),
    ],
)
def test_wrong_options_are_told_before_ros_is_looked_for(
    words: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["ros", *words]) == 1
    assert says in capsys.readouterr().err
