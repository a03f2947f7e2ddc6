"""What an evaluation was made with: source version, library versions, hashes of its inputs."""

import ast
import hashlib
import importlib.metadata
import platform
import subprocess
from functools import cache
from pathlib import Path

import toponav
from toponav.core.files import hash_of_file

__all__ = [
    "decisive_modules",
    "hash_of_code",
    "hash_of_file",
    "hash_of_weights",
    "library_versions",
    "source_commit",
]

_PACKAGE = Path(toponav.__file__).parent
# Where an episode begins to be decided; whatever these import, at any depth, decides too.
_ROOTS = tuple(
    f"evaluation/{name}.py" for name in ("agents", "episode", "privileged", "protocol", "worker")
)
# Buildings and maps count by their content: what makes, reads, checks or draws them does not.
_BESIDE = (
    *("worlds/generate", "worlds/load", "worlds/storage.py", "worlds/draw.py"),
    *("maps/formats", "maps/editor", "maps/draw.py", "maps/construct.py", "maps/validate.py"),
    *("evaluation/suite.py", "evaluation/provenance.py"),
)
_MOST_BYTES = 2 << 30
_LIBRARIES = ("torch", "torch-geometric", "numpy", "numba", "mujoco", "embreex", "networkx")


@cache
def source_commit() -> str | None:
    """The commit of the source tree, `+changes` if files differ from it, None when installed."""
    here = str(_PACKAGE)
    try:
        _git("-C", here, "ls-files", "--error-unmatch", "__init__.py")
        commit = _git("-C", here, "rev-parse", "HEAD").strip()
        changes = _git("-C", here, "status", "--porcelain", "--untracked-files=no", here)
    except (OSError, subprocess.SubprocessError):
        return None
    return commit + ("+changes" if changes.strip() else "")


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], check=True, capture_output=True, text=True, timeout=10
    ).stdout


@cache
def hash_of_code(roots: tuple[str, ...] = _ROOTS) -> str:
    """SHA-256 over the modules that decide what happens in an episode.

    Args:
        roots: Files of this package where an episode begins to be decided.
    """
    digest = hashlib.sha256()
    for path in decisive_modules(roots):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def decisive_modules(roots: tuple[str, ...] = _ROOTS) -> tuple[Path, ...]:
    """Files of this package that an episode depends on: the worker, and what it imports."""
    found: set[Path] = set()
    waiting = [_PACKAGE / name for name in roots]
    while waiting:
        path = waiting.pop()
        name = path.relative_to(_PACKAGE).as_posix()
        if path in found or any(name == one or name.startswith(f"{one}/") for one in _BESIDE):
            continue
        found.add(path)
        waiting += _imported_files(path)
    return tuple(sorted(found))


def _imported_files(path: Path) -> list[Path]:
    """The files of this package that a file imports, wherever in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.update((node.module, *(f"{node.module}.{alias.name}" for alias in node.names)))
    places = [
        _PACKAGE.joinpath(*name.split(".")[1:]) for name in names if name.startswith("toponav.")
    ]
    files = [file for at in places for file in (at.with_suffix(".py"), at / "__init__.py")]
    return [file for file in files if file.is_file()]


def library_versions() -> dict[str, str]:
    """Versions of Python, of this package and of the libraries that numbers depend on."""
    versions = {
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "toponav": toponav.__version__,
    }
    for library in _LIBRARIES:
        try:
            versions[library] = importlib.metadata.version(library)
        except importlib.metadata.PackageNotFoundError:
            continue
    return versions


def hash_of_weights(weights: str | None) -> str:
    """SHA-256 over the weight files: a folder's, a file's, or those that ship (None, a preset).

    Raises:
        InputError: If a file cannot be read.
    """
    named = Path(weights) if weights is not None else None
    if named is not None and named.is_file():
        return hash_of_file(named, max_bytes=_MOST_BYTES)
    folder = named if named is not None and named.is_dir() else _PACKAGE / "weights"
    digest = hashlib.sha256(b"" if folder is named else str(weights).encode())
    for path in sorted(folder.rglob("*")):
        if path.suffix in {".safetensors", ".json"} and path.is_file():
            digest.update(path.relative_to(folder).as_posix().encode())
            digest.update(bytes.fromhex(hash_of_file(path, max_bytes=_MOST_BYTES)))
    return digest.hexdigest()
