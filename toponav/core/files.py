"""Files of strangers: read with a limit and checked; our own written whole or not at all."""

import contextlib
import errno
import hashlib
import json
import math
import os
import stat
import tempfile
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError, shown

__all__ = [
    "MAX_JSON_BYTES",
    "check_file_name",
    "check_is_file",
    "check_out_file",
    "check_out_folder",
    "file_beside",
    "hash_of_file",
    "os_fault",
    "parse_json",
    "read_bytes",
    "read_json",
    "read_json_object",
    "write_atomically",
]

MAX_JSON_BYTES = 64 * 1024 * 1024
"""No JSON of ours is this large: a bigger file is refused before it fills the memory."""

_MOST_JSON_VALUES = 8_000_000
_SHOWN_CHARACTERS = 60
_MOST_DIGITS = 19
_REMEDY_OF = {
    errno.ENOENT: "check the path",
    errno.EACCES: "choose a place that you may use, or change its permissions",
    errno.EPERM: "choose a place that you may use, or change its permissions",
    errno.EROFS: "choose a place that you may write to",
    errno.ENOSPC: "free some space, or choose another disk",
    errno.EDQUOT: "free some space, or choose another disk",
    errno.EEXIST: "a file is in the way: choose another name, or move it",
    errno.ENOTDIR: "a file stands where a folder is needed: choose another name, or move it",
    errno.EISDIR: "name a file, not a folder",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def os_fault(
    error: OSError, path: str | Path | None = None, *, verb: str = "be read"
) -> InputError:
    """What the operating system refused, as an error that names the file and the remedy.

    Args:
        error: What it raised.
        path: The file, where the error does not know it.
        verb: What could not be done: `be read` or `be written`.
    """
    where = path or error.filename or "the operating system"
    cause = "no such file" if error.errno == errno.ENOENT else error.strerror or str(error)
    remedy = _REMEDY_OF.get(error.errno or 0, "check the file and the disk that it is on")
    return InputError(f"cannot {verb}: {cause}", where=str(where), remedy=remedy)


def check_is_file(path: Path, *, max_bytes: int = 64 << 30) -> None:
    """Nothing, if this is a regular file of at most so many bytes; a pipe would never end.

    Raises:
        InputError: If it is missing, too large or no regular file.
    """
    try:
        status = path.stat()
    except OSError as error:
        raise os_fault(error, path) from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError("not a file", where=str(path), remedy="name a file")
    if status.st_size > max_bytes:
        raise InputError(
            f"at most {max_bytes:,} bytes are read, the file has {status.st_size:,}",
            where=str(path),
            remedy="check that this is the right file",
        )


def read_bytes(path: str | Path, *, max_bytes: int) -> bytes:
    """All of a regular file of at most so many bytes.

    Raises:
        InputError: If it is missing, too large, no regular file, or cannot be read.
    """
    path = Path(path)
    check_is_file(path, max_bytes=max_bytes)
    try:
        return path.read_bytes()
    except OSError as error:
        raise os_fault(error, path) from None


def hash_of_file(path: str | Path, *, max_bytes: int = 8 << 30) -> str:
    """SHA-256 of a regular file's bytes, read piece by piece.

    Raises:
        InputError: If it is missing, too large, no regular file, or cannot be read.
    """
    path = Path(path)
    check_is_file(path, max_bytes=max_bytes)
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise os_fault(error, path) from None


def read_json(path: str | Path, *, max_bytes: int = MAX_JSON_BYTES) -> Any:
    """What a JSON file holds, with nothing in it that JSON does not allow.

    Args:
        path: File to read.
        max_bytes: Largest size that is read at all.

    Raises:
        InputError: If the file is missing, too large, not UTF-8, not JSON, nested too deep,
            repeats a key, or holds NaN, an infinity, a lone surrogate, or a whole number of
            more than 64 bits.
    """
    return parse_json(read_bytes(path, max_bytes=max_bytes), str(path))


def parse_json(data: bytes, where: str) -> Any:
    """What JSON text holds, as strictly as `read_json` reads a file.

    Args:
        data: UTF-8 text.
        where: The file that it came from, for messages.

    Raises:
        InputError: If it is not JSON, or holds what `read_json` refuses.
    """
    # Each value but the first follows one of these: small values must not fill the memory.
    if sum(data.count(sign) for sign in (b",", b"[", b"{", b":")) > _MOST_JSON_VALUES:
        raise InputError(
            f"at most {_MOST_JSON_VALUES:,} values are read",
            where=where,
            remedy="check that this is the right file",
        )
    try:
        text = data.decode("utf-8-sig")
        document = json.loads(
            text,
            parse_constant=_refuse_constant,
            parse_float=_finite_float,
            parse_int=_bounded_int,
            object_pairs_hook=_unique_keys,
        )
        if "\\ud" in text.lower():
            json.dumps(document, ensure_ascii=False).encode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"not UTF-8 at byte {error.start}", where=where, remedy="save the file as UTF-8 text"
        ) from None
    except UnicodeEncodeError as error:
        raise InputError(
            f"text must be Unicode, got a lone surrogate {error.object[error.start]!r}",
            where=where,
            remedy="save the file again from the tool that made it",
        ) from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"not JSON: {error.msg} at line {error.lineno} column {error.colno}",
            where=where,
            remedy="repair that place, or save the file again from the tool that made it",
        ) from None
    except RecursionError:
        raise InputError(
            "nested too deep to be read", where=where, remedy="flatten the document"
        ) from None
    except ValueError as error:
        raise InputError(
            str(error), where=where, remedy="write finite JSON numbers and each key once"
        ) from None
    return document


def read_json_object(path: str | Path, *, max_bytes: int = MAX_JSON_BYTES) -> dict[str, Any]:
    """The object that a JSON file holds.

    Raises:
        InputError: As `read_json`, and if it holds anything else.
    """
    document = read_json(path, max_bytes=max_bytes)
    if not isinstance(document, dict):
        raise InputError(
            f"must hold a JSON object, got {type(document).__name__}",
            where=str(path),
            remedy="check that this is the right file",
        )
    return document


def write_atomically(path: str | Path, content: bytes | str) -> Path:
    """The path, holding all of the content or, after a failure, what it held before.

    Folders that are missing are made.

    Raises:
        InputError: If it cannot be written: no space, no permission, a file in the way.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(
            dir=path.parent, prefix=f".{path.name}.", suffix=".partial"
        )
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise os_fault(error, path, verb="be written") from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
    return path


def check_out_folder(path: str | Path, flag: str = "--out") -> None:
    """Nothing, if results can go into this folder; to be asked before hours of work.

    Raises:
        InputError: If a file stands there, or the folder may not be written to or made.
    """
    folder = Path(path)
    try:
        while not folder.exists():
            folder = folder.parent
        is_folder = folder.is_dir()
    except OSError as error:
        raise os_fault(error, path, verb="be written") from None
    if not is_folder:
        raise InputError(
            f"must be a folder, but {folder} is a file",
            where=f"{flag} {path}",
            remedy="name another folder, or move the file",
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder} may not be written to", where=f"{flag} {path}", remedy="name another folder"
        )


def check_out_file(path: str | Path, flag: str = "--out") -> None:
    """Nothing, if a file can be written or replaced at this path.

    Raises:
        InputError: If a folder stands there, or its folder may not be written to or made.
    """
    if Path(path).is_dir():
        raise InputError(
            "must be a file, but is a folder",
            where=f"{flag} {path}",
            remedy="name a file in it",
        )
    check_out_folder(Path(path).parent, flag)


def check_file_name(name: Any, where: str) -> str:
    """The name, if it is that of a file or folder and leads nowhere else.

    Raises:
        InputError: If it is empty, `.` or `..`, or holds a separator or a control character.
    """
    if (
        not isinstance(name, str)
        or name in ("", ".", "..")
        or len(name) > 255
        or any(letter in "/\\:" or not letter.isprintable() for letter in name)
    ):
        raise InputError(
            f"must be the plain name of a file or folder, got {shown(name)}",
            where=where,
            remedy="use letters, digits, '_', '-' and '.'",
        )
    return name


def file_beside(path: Path, name: Any, what: str) -> Path:
    """The file that a document names, which has to lie in the document's folder or below.

    Args:
        path: The document.
        name: What it says: a path relative to its folder.
        what: The key under which it says so.

    Raises:
        InputError: If it is no such path; absolute ones and `..` lead out of the folder.
    """
    if not isinstance(name, str) or not 0 < len(name) <= 1000 or not name.isprintable():
        raise InputError(
            f"{what} must name a file, got {shown(name)}",
            where=str(path),
            remedy=f"set {what} to a file beside this one",
        )
    inside = os.path.normpath(name)
    if os.path.isabs(inside) or inside.split(os.sep)[0] == os.pardir:
        raise InputError(
            f"{what} must lie in this file's folder, got {name[:_SHOWN_CHARACTERS]!r}",
            where=str(path),
            remedy="copy that file beside this one and give its name alone",
        )
    return path.parent / inside


def _refuse_constant(name: str) -> float:
    raise ValueError(f"numbers must be finite, got {name}")


def _finite_float(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"numbers must be finite, got {text[:_SHOWN_CHARACTERS]}")
    return value


def _bounded_int(text: str) -> int:
    if len(text) > _MOST_DIGITS + 1:
        raise ValueError(f"whole numbers must fit 64 bits, got one of {len(text)} digits")
    return int(text)


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        seen: set[str] = set()
        for key, _ in pairs:
            if key in seen:
                raise ValueError(f"keys must be unique, {key[:_SHOWN_CHARACTERS]!r} comes twice")
            seen.add(key)
    return result
