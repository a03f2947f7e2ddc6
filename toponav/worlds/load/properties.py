"""Java properties files: keys and values, a line each."""

import re

from toponav.core.errors import InputError

__all__ = ["read_properties"]

_MAX_LINES = 2_000_000
_ESCAPES = {"t": "\t", "n": "\n", "r": "\r", "f": "\f"}
_ESCAPE = re.compile(r"\\(u[0-9a-fA-F]{4}|.|$)", re.DOTALL)
_PAIR = re.compile(r"((?:\\.|[^\\=:\s])*)[ \t\f]*[=:]?[ \t\f]*(.*)", re.DOTALL)


def read_properties(data: bytes, where: str) -> dict[str, str]:
    """The values by key; of a key that comes twice the last counts, as in Java.

    Reference:
        `java.util.Properties.load`: Latin 1 with escapes such as \\u00e9; lines that end in a
        backslash run on.

    Raises:
        InputError: It has too many lines, or is no text.

    Example:
        >>> read_properties(b"name#1 = Coffee table", "example")
        {'name#1': 'Coffee table'}
    """
    if b"\0" in data[:4096]:
        raise InputError("is no text", where=where, remedy="copy the file again")
    lines = data.decode("latin-1").splitlines()
    if len(lines) > _MAX_LINES:
        raise InputError(
            f"at most {_MAX_LINES:,} lines are read", where=where, remedy="split the file"
        )
    found: dict[str, str] = {}
    logical: list[str] = []
    for line in lines:
        part = line.lstrip(" \t\f")
        if not logical and (not part or part[0] in "#!"):
            continue
        slashes = len(part) - len(part.rstrip("\\"))
        if slashes % 2:
            logical.append(part[:-1])
            continue
        logical.append(part)
        _store("".join(logical), found)
        logical = []
    if logical:
        _store("".join(logical), found)
    return found


def _store(line: str, found: dict[str, str]) -> None:
    match = _PAIR.match(line)
    assert match is not None, "every part of the pattern may be empty"
    found[_plain(match.group(1))] = _plain(match.group(2))


def _plain(text: str) -> str:
    """The text without escapes."""
    return _ESCAPE.sub(_letter, text)


def _letter(match: re.Match[str]) -> str:
    """What an escape stands for."""
    code = match.group(1)
    return chr(int(code[1:], 16)) if len(code) == 5 else _ESCAPES.get(code, code)
