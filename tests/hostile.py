"""Runs a command as a stranger would, and says what it did to the disk."""

import io
import os
import re
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from toponav.cli.main import main

__all__ = [
    "SPOILERS",
    "Answer",
    "Damage",
    "Spoil",
    "answer_of",
    "assert_one_clear_error",
    "cut",
    "damaged",
    "damages",
    "huge",
]


@dataclass(frozen=True)
class Answer:
    """What a command said, how it ended, and which files it left otherwise than they were."""

    status: int
    out: str
    err: str
    changed: tuple[str, ...]


def answer_of(words: Sequence[object], watched: Path) -> Answer:
    """Run one command in this process, watching a folder."""
    out, err = io.StringIO(), io.StringIO()
    before = _state(watched)
    with redirect_stdout(out), redirect_stderr(err):
        status = main([str(word) for word in words])
    after = _state(watched)
    changed = tuple(sorted(name for name in before | after if before.get(name) != after.get(name)))
    return Answer(status, out.getvalue(), err.getvalue(), changed)


def assert_one_clear_error(answer: Answer, *, names: object = "", says: str = "") -> None:
    """One line that names the place and the remedy, status 1, and nothing written."""
    assert answer.status == 1, (answer.status, answer.err[-500:], answer.out[-500:])
    lines = [line for line in answer.err.splitlines() if line.startswith("toponav: ")]
    assert len(lines) == 1, answer.err
    assert "Remedy: " in lines[0]
    assert "Traceback" not in answer.err
    assert lines[0].isprintable()
    assert len(lines[0]) < 1500
    assert str(names) in lines[0], (names, lines[0])
    assert re.search(says, lines[0]), (says, lines[0])
    assert answer.changed == ()


Damage = tuple[str, float, int, bytes]


def damages() -> st.SearchStrategy[list[Damage]]:
    """What to do to a file: where (0..1) to flip a byte, cut, repeat, insert, or write zeros."""
    kinds = st.sampled_from(["flip", "flip", "flip", "cut", "repeat", "insert", "zero", "replace"])
    where = st.floats(0.0, 1.0, allow_nan=False)
    one = st.tuples(kinds, where, st.integers(1, 255), st.binary(min_size=1, max_size=64))
    return st.lists(one, min_size=1, max_size=3)


def damaged(content: bytes, what: list[Damage]) -> bytes:
    """The bytes after it was done to them."""
    data = bytearray(content)
    for kind, where, value, text in what:
        at = min(int(where * len(data)), max(len(data) - 1, 0))
        if kind == "flip" and data:
            data[at] ^= value
        elif kind == "cut":
            del data[at:]
        elif kind == "repeat":
            data[at:at] = data[at : at + value]
        elif kind == "insert":
            data[at:at] = text
        elif kind == "replace":
            data[:] = text
        else:
            data[at : at + 8] = bytes(min(8, len(data) - at))
    return bytes(data)


def _state(folder: Path) -> dict[str, tuple[int, int]]:
    found = {}
    for path in folder.rglob("*"):
        status = path.lstat()
        is_file = path.is_file()
        found[str(path.relative_to(folder))] = (
            status.st_size if is_file else -1,
            status.st_mtime_ns if is_file else 0,
        )
    return found


Spoil = Callable[[Path], object]


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def noise(path: Path) -> None:
    path.write_bytes(np.random.default_rng(0).bytes(3000))


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def huge(path: Path) -> None:
    with path.open("r+b") as file:
        file.truncate(5 << 30)  # A hole: no byte of it is on the disk.


SPOILERS: tuple[Spoil, ...] = (cut, empty, noise, folder, pipe, endless, huge, Path.unlink)
