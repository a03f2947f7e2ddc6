"""Which ROS 2 this process uses, and an environment that fits it.

The ROS wheels find their shared libraries through `LD_LIBRARY_PATH`, which the loader reads at
the start of a process: a start-up hook of theirs runs Python again with it set, and marks that
in `_ROS_WHEELS_BOOTSTRAP_COMPLETE`. Children inherit both, where they do harm: a child with
another Python is not started again, and other programs load libraries that they never asked
for. `prepare` makes sure that this process has what it needs, and cleans up for its children.
"""

import importlib.util
import os
import sys
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from toponav.core.errors import InputError

__all__ = ["GUARD", "RosInstallation", "cleaned", "find_ros", "libraries_of", "prepare"]

GUARD: Final = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
"""Set by the wheels' start-up hook once it has started Python again."""
_OWN_GUARD: Final = "_TOPONAV_ROS_STARTED_AGAIN"
_PATH: Final = "LD_LIBRARY_PATH"


@dataclass(frozen=True)
class RosInstallation:
    """A ROS 2 that can be imported.

    Attributes:
        kind: `sourced`: an installation whose setup script was sourced. `wheels`: pip's.
        rclpy_path: Where rclpy is.
        prefix: The folder that holds `share` and `lib`.
    """

    kind: Literal["sourced", "wheels"]
    rclpy_path: Path
    prefix: Path

    @property
    def library_paths(self) -> tuple[str, ...]:
        """Folders that the loader has to search; none for a sourced ROS, which sets its own."""
        return libraries_of(self.prefix) if self.kind == "wheels" else ()


def libraries_of(prefix: Path) -> tuple[str, ...]:
    """The folders of shared libraries that the ROS wheels put below a prefix, in order."""
    sites = sorted(prefix.glob("lib/python3*/site-packages"))
    bundled = [str(path) for site in sites for path in sorted(site.glob("ros_*.libs"))]
    return (str(prefix / "lib"), *bundled)


def find_ros() -> RosInstallation:
    """The ROS 2 of this process: a sourced one where there is one, else pip's wheels.

    Raises:
        InputError: There is none.
    """
    found = importlib.util.find_spec("rclpy")
    if found is None or not found.submodule_search_locations:
        raise InputError(
            "ROS 2 is not installed for this Python",
            where=sys.executable,
            remedy="run `pip install 'toponav[ros]'` (Linux, Python 3.11 to 3.13), or source the "
            "setup script of a ROS 2 whose Python this is, such as /opt/ros/jazzy/setup.bash",
        )
    path = Path(next(iter(found.submodule_search_locations))).resolve()
    prefix = _prefix_of(path)
    is_wheel = any(path.parent.glob("ros_rclpy-*.dist-info"))
    kind: Literal["sourced", "wheels"] = "wheels" if is_wheel else "sourced"
    return RosInstallation(kind, path, prefix)


def prepare() -> RosInstallation:
    """The ROS 2 to use, with this process fit for it; starts Python again where it is not.

    Call it before rclpy is imported, in a process that has done nothing yet. Afterwards
    `os.environ` holds neither the guard nor the wheels' folders: children begin afresh.

    Raises:
        InputError: There is no ROS 2, or its libraries cannot be found even so.
    """
    found = find_ros()
    wanted = _wanted_path(found, os.environ)
    if wanted is not None and not os.environ.get(_OWN_GUARD):
        changed = {**os.environ, _PATH: wanted, GUARD: "1", _OWN_GUARD: "1"}
        sys.stdout.flush()
        sys.stderr.flush()
        os.execve(sys.executable, sys.orig_argv, changed)
    # What a sourced ROS set is its own affair; wheels beside it leak all the same.
    wheels = found.prefix if found.kind == "wheels" else Path(sys.prefix)
    _replace(os.environ, cleaned(os.environ, wheels))
    return found


def cleaned(environment: Mapping[str, str], prefix: Path) -> dict[str, str]:
    """The environment without what the start-up hook of the wheels at `prefix` left in it."""
    kept = {name: value for name, value in environment.items() if name not in (GUARD, _OWN_GUARD)}
    ours = set(libraries_of(prefix))
    path = [each for each in _listed(environment, _PATH) if each not in ours]
    kept.pop(_PATH, None)
    if path:
        kept[_PATH] = os.pathsep.join(path)
    return kept


def _wanted_path(found: RosInstallation, environment: Mapping[str, str]) -> str | None:
    """The loader's path that this ROS needs, or None where the process has it already."""
    has = _listed(environment, _PATH)
    if found.kind == "wheels":
        missing = [each for each in found.library_paths if each not in has]
        return os.pathsep.join([*missing, *has]) if missing else None
    # Wheels in the same Python put their libraries before those of the sourced ROS.
    of_wheels = set(libraries_of(Path(sys.prefix)))
    kept = [each for each in has if each not in of_wheels]
    return os.pathsep.join(kept) if len(kept) < len(has) else None


def _prefix_of(package: Path) -> Path:
    """The prefix that a package in `lib/python3.x/site-packages` or the like belongs to."""
    for parent in package.parents:
        if parent.name in ("lib", "local") and (parent.parent / "share").is_dir():
            return parent.parent
    return package.parent


def _listed(environment: Mapping[str, str], name: str) -> list[str]:
    return [each for each in environment.get(name, "").split(os.pathsep) if each]


def _replace(environment: MutableMapping[str, str], by: Mapping[str, str]) -> None:
    for name in set(environment) - set(by):
        del environment[name]
    environment.update(by)
