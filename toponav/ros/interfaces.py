"""The message packages that have no wheel, built from their definitions when first needed.

An installed ROS 2 has `tf2_msgs`, and builds `ros2/toponav_msgs` with colcon like any package.
With wheels alone both are built once by CMake and a C compiler into a cache, by the generators
that the extra `ros` installs, so that the types are the same on the wire.
"""

import ctypes
import hashlib
import importlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Final

from toponav.core.errors import InputError
from toponav.ros.environment import RosInstallation, libraries_of

__all__ = ["PACKAGES", "cache_dir", "definitions_dir", "is_built", "load_interfaces"]

PACKAGES: Final = ("tf2_msgs", "toponav_msgs")
"""What is built where it is missing."""

_BUILT_AT: Final = "/opt/python/cp"
_MINUTES: Final = 20


def definitions_dir(package: str) -> Path:
    """The folder of a package's definitions: in the installed toponav, or in its repository."""
    here = Path(__file__).resolve().parent
    repository = here.parents[1] / "ros2"
    for folder in (here / "definitions", repository, repository / "wheels_only"):
        if (folder / package / "package.xml").is_file():
            return folder / package
    raise InputError(
        f"the definitions of {package} are missing",
        where=str(here),
        remedy="install toponav again",
    )


def cache_dir() -> Path:
    """Where message packages are built: one folder for each set of definitions and versions."""
    base = os.environ.get("TOPONAV_CACHE") or os.environ.get("XDG_CACHE_HOME")
    root = Path(base) if base else Path.home() / ".cache"
    digest = hashlib.sha256()
    for package in PACKAGES:
        folder = definitions_dir(package)
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                digest.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
    for name in ("ros-rclpy", "ros-rosidl-generator-py", "numpy"):
        digest.update(f"{name} {_version_of(name)} ".encode())
    digest.update(f"{sys.implementation.cache_tag} {platform.machine()}".encode())
    return root / "toponav" / "ros" / digest.hexdigest()[:16]


def is_built() -> bool:
    """Whether every package can be imported without building anything."""
    return (
        all(_is_importable(package) for package in PACKAGES)
        or (cache_dir() / "complete").is_file()
    )


def load_interfaces(
    ros: RosInstallation, on_build: Callable[[str], None] | None = None
) -> tuple[str, ...]:
    """Makes `toponav_msgs` and `tf2_msgs` importable; returns those taken from the cache.

    Args:
        ros: The ROS 2 of this process.
        on_build: Told what is being built, when something is.

    Raises:
        InputError: A package is missing and cannot be built here.
    """
    missing = tuple(package for package in PACKAGES if not _is_importable(package))
    if not missing:
        return ()
    if ros.kind == "sourced":
        raise InputError(
            f"{' and '.join(missing)} are not built for this ROS 2",
            where=str(ros.prefix),
            remedy="build them: `colcon build --packages-select toponav_msgs` in a workspace that "
            "holds toponav's ros2/ folder, then source its install/setup.bash",
        )
    prefix = cache_dir()
    if not (prefix / "complete").is_file():
        _build(ros, prefix, on_build or (lambda _: None))
    site = prefix / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
    sys.path.append(str(site))
    importlib.invalidate_caches()
    _preload(prefix / "lib", missing)
    return missing


def _is_importable(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


def _version_of(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "-"


def _build(ros: RosInstallation, prefix: Path, on_build: Callable[[str], None]) -> None:
    """Build every package into a folder beside `prefix`, then rename it: all or nothing."""
    _require_tools()
    prefix.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".build-", dir=prefix.parent) as name:
        work = Path(name)
        _copy_generators(ros.prefix, work / "ros")
        for package in PACKAGES:
            on_build(package)
            _build_package(ros, package, work)
        (work / "out" / "complete").touch()
        try:
            os.rename(work / "out", prefix)
        except OSError:
            if not (prefix / "complete").is_file():  # another process was faster otherwise
                raise


def _require_tools() -> None:
    lacking = [tool for tool in ("cmake",) if shutil.which(tool) is None]
    if shutil.which(os.environ.get("CC", "cc")) is None:
        lacking.append("a C compiler")
    if shutil.which(os.environ.get("CXX", "c++")) is None:
        lacking.append("a C++ compiler")
    if lacking:
        raise InputError(
            f"building the ROS messages needs {' and '.join(lacking)}",
            where="toponav ros",
            remedy="install them, such as with `apt install g++ cmake`, once; or use an installed "
            "ROS 2 with toponav's ros2/ folder built by colcon",
        )


def _copy_generators(prefix: Path, to: Path) -> None:
    """The wheels' CMake files with this machine's paths in place of the build machine's."""
    python, numpy_headers = sysconfig.get_path("include"), _numpy_headers()
    for path in sorted((prefix / "share").rglob("*")):
        target = to / "share" / path.relative_to(prefix / "share")
        if path.is_dir():
            target.mkdir(parents=True, exist_ok=True)
        elif path.suffix != ".cmake":
            target.symlink_to(path)
        else:
            text = path.read_text(encoding="utf-8")
            if _BUILT_AT in text:
                text = _with_headers(text, python, numpy_headers)
            target.write_text(text.replace("/usr/lib64/libtinyxml2.so;", ""), encoding="utf-8")
    for name in ("include", "lib"):
        (to / name).symlink_to(prefix / name)


def _with_headers(text: str, python: str, numpy_headers: str) -> str:
    """A CMake file whose include directories are those of this Python."""
    lines = [
        f'  INTERFACE_INCLUDE_DIRECTORIES "{python};{numpy_headers}"'
        if _BUILT_AT in line and "INTERFACE_INCLUDE_DIRECTORIES" in line
        else line
        for line in text.splitlines()
    ]
    return "\n".join(lines) + "\n"


def _numpy_headers() -> str:
    import numpy

    return numpy.get_include()


def _build_package(ros: RosInstallation, package: str, work: Path) -> None:
    source, build = definitions_dir(package), work / package
    ninja = ["-G", "Ninja"] if shutil.which("ninja") else []
    paths = f"{work / 'ros'};{work / 'out'}"
    configure = ["cmake", *ninja, "-S", str(source), "-B", str(build)]
    configure += [f"-DCMAKE_PREFIX_PATH={paths}", f"-DCMAKE_INSTALL_PREFIX={work / 'out'}"]
    configure += [f"-DPython3_EXECUTABLE={sys.executable}", "-DBUILD_TESTING=OFF"]
    configure += ["-DCMAKE_C_FLAGS=-O0", "-DCMAKE_CXX_FLAGS=-O0"]  # half the time to build
    _run(configure, ros, work)
    workers = str(min(os.cpu_count() or 1, 4))
    _run(["cmake", "--build", str(build), "--target", "install", "-j", workers], ros, work)


def _run(command: list[str], ros: RosInstallation, work: Path) -> None:
    environment = {
        **os.environ,
        "AMENT_PREFIX_PATH": str(work / "ros"),
        "LD_LIBRARY_PATH": os.pathsep.join(libraries_of(ros.prefix)),
    }
    done = subprocess.run(
        command,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60 * _MINUTES,
        check=False,
    )
    if done.returncode != 0:
        log = work.parent / "build.log"
        log.write_text(done.stdout, encoding="utf-8")
        raise InputError(
            f"the ROS messages could not be built: {' '.join(command[:2])} failed",
            where=str(log),
            remedy="read the log; g++, cmake 3.22 or newer and Python's headers are needed",
        )


def _preload(folder: Path, packages: tuple[str, ...]) -> None:
    """Load the packages' libraries now: rclpy asks for them by name, and then finds them."""
    waiting = [path for name in packages for path in sorted(folder.glob(f"lib{name}__*.so"))]
    while waiting:
        left = []
        for path in waiting:
            try:
                ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
            except OSError:  # needs another of them first
                left.append(path)
        if len(left) == len(waiting):
            raise InputError(
                "the built ROS messages cannot be loaded",
                where=str(folder),
                remedy="remove that folder; it is built again when needed",
            )
        waiting = left
