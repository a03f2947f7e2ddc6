"""Files that a model names, from a folder or a zip archive and from nowhere else.

Nothing is ever unpacked to the disk, and no name leads out of the folder or the archive.
"""

import os
import posixpath
import zipfile
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable
from urllib.parse import unquote

from toponav.core.errors import InputError, shown
from toponav.core.files import check_is_file, os_fault, read_bytes

__all__ = ["FolderFiles", "SourceFiles", "ZipFiles", "beside"]

_MAX_ENTRIES = 100_000
_MAX_ARCHIVE_BYTES = 4 << 30
_MAX_RATIO = 100
_SMALL_BYTES = 16_000_000


@runtime_checkable
class SourceFiles(Protocol):
    """Reads files by their names, relative and with slashes."""

    @property
    def label(self) -> str:
        """The folder or archive, for messages."""

    def read(self, name: str, *, max_bytes: int) -> bytes:
        """All of a file.

        Raises:
            InputError: There is none of that name inside, or it is larger.
        """


class FolderFiles:
    """Files in one folder and below; links that lead out of it are not followed."""

    def __init__(self, root: Path) -> None:
        self.root = root

    @property
    def label(self) -> str:
        """The folder."""
        return str(self.root)

    def read(self, name: str, *, max_bytes: int) -> bytes:
        """All of a file in the folder or below.

        Raises:
            InputError: There is none of that name inside, or it is larger.
        """
        inside = _inside(name, self.label)
        path = self.root / inside
        try:
            if not path.exists():
                path = _other_case(self.root, inside) or path
            if not path.resolve().is_relative_to(self.root.resolve()):
                raise _outside(name, self.label)
        except OSError as error:
            raise os_fault(error, path) from None
        except RuntimeError:
            raise _outside(name, self.label) from None
        return read_bytes(path, max_bytes=max_bytes)


class ZipFiles:
    """Files in a zip archive, read into memory one at a time and never unpacked.

    Raises:
        InputError: It is no zip archive, has too many entries, or expands beyond reason.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        check_is_file(path, max_bytes=_MAX_ARCHIVE_BYTES)
        try:
            with zipfile.ZipFile(path) as archive:
                entries = archive.infolist()
        except OSError as error:
            raise os_fault(error, path) from None
        except Exception as error:  # Damaged zip files fail in a dozen ways.
            raise self._broken(f"is not a whole zip archive ({str(error)[:100]})") from None
        if len(entries) > _MAX_ENTRIES:
            raise self._broken(f"an archive holds at most {_MAX_ENTRIES:,} files")
        self._size_of = {entry.filename: entry.file_size for entry in entries}
        self._packed_of = {entry.filename: entry.compress_size for entry in entries}

    @property
    def label(self) -> str:
        """The archive."""
        return str(self.path)

    @property
    def names(self) -> list[str]:
        """What the archive says that it holds."""
        return list(self._size_of)

    @cached_property
    def _archive(self) -> zipfile.ZipFile:
        return zipfile.ZipFile(self.path)

    @cached_property
    def _by_lower_case(self) -> dict[str, str]:
        return {name.lower(): name for name in reversed(self._size_of)}

    def __contains__(self, name: str) -> bool:
        return self._entry(name) is not None

    def _entry(self, name: str) -> str | None:
        if name in self._size_of:
            return name
        return self._by_lower_case.get(name.lower())

    def read(self, name: str, *, max_bytes: int) -> bytes:
        """All of a file in the archive.

        Raises:
            InputError: There is none of that name inside, it is larger, or it is broken.
        """
        entry = self._entry(_inside(name, self.label))
        if entry is None:
            raise InputError(
                f"holds no file {shown(name)}",
                where=self.label,
                remedy="copy the archive again from where it came",
            )
        where = f"{self.label}:{entry}"
        size, packed = self._size_of[entry], self._packed_of[entry]
        if size > max_bytes or size > max(_SMALL_BYTES, _MAX_RATIO * max(packed, 1)):
            raise InputError(
                f"at most {max_bytes:,} bytes are read, and beyond {_SMALL_BYTES:,} at most "
                f"{_MAX_RATIO} for each packed one; "
                f"the file says {size:,} from {packed:,}",
                where=where,
                remedy="check where the archive came from",
            )
        try:
            with self._archive.open(entry) as stream:
                data = stream.read(size + 1)
        except Exception as error:  # Damaged, encrypted, or of an unknown compression.
            raise InputError(
                f"cannot be unpacked ({str(error)[:100]})",
                where=where,
                remedy="copy the archive again from where it came",
            ) from None
        if len(data) != size:
            raise self._broken(f"the size of {entry[:60]!r} is not what the archive says")
        return data

    def _broken(self, rule: str) -> InputError:
        return InputError(
            rule, where=str(self.path), remedy="copy the archive again from where it came"
        )


def beside(document: str, reference: str) -> str:
    """The name of a file that a document refers to, relative to the same root.

    Example:
        >>> beside("meshes/bed.dae", "../textures/oak%20dark.png")
        'textures/oak dark.png'
    """
    reference = reference.strip().replace("\\", "/")
    if reference.lower().startswith("file://"):
        reference = reference[7:]
    if "%" in reference:
        reference = unquote(reference)
    return posixpath.normpath(posixpath.join(posixpath.dirname(document), reference))


def _inside(name: str, label: str) -> str:
    """The name, made plain, if it stays inside."""
    if not 0 < len(name) <= 1000 or "\0" in name:
        raise _outside(name, label)
    plain = posixpath.normpath(name.replace("\\", "/"))
    if plain.startswith(("/", "../")) or plain in ("..", ".") or ":" in plain.split("/")[0]:
        raise _outside(name, label)
    return plain


def _other_case(root: Path, name: str) -> Path | None:
    """The file whose name differs in case alone: models often come from Windows."""
    path = root
    for part in name.split("/"):
        if not path.is_dir():
            return None
        if not (path / part).exists():
            same = [entry for entry in os.listdir(path) if entry.lower() == part.lower()]
            if not same:
                return None
            part = min(same)
        path = path / part
    return path


def _outside(name: str, label: str) -> InputError:
    return InputError(
        f"files must lie inside, got {shown(name)}",
        where=label,
        remedy="copy the file into the folder or archive that names it",
    )
