"""The one map file that an editor may read and write, and what happened to it meanwhile."""

import hashlib
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError
from toponav.core.files import MAX_JSON_BYTES, check_out_file, parse_json, read_bytes
from toponav.core.files import write_atomically as write
from toponav.maps.schema import FORMAT_VERSION, map_schema_faults
from toponav.maps.spec import TopologicalMap, map_from_document, map_to_document, save_map

__all__ = ["ChangedOnDiskError", "MapFile", "OpenedMap", "map_of_document"]

_MOST_COPIES = 1000


class ChangedOnDiskError(Exception):
    """Something else wrote the file after the editor last read or wrote it."""


@dataclass(frozen=True)
class OpenedMap:
    """A map as the editor shows it."""

    document: dict[str, Any]
    """The map as JSON, yaws and lengths filled in."""
    version: str
    """Names the file's content; empty where there is no file yet."""


class MapFile:
    """The file that is edited: read, written whole, and never overwritten unseen.

    The content that the first save of a launch replaces is kept beside it, with `~` after its
    name; what somebody else wrote and an editor overwrites is kept under a name of its own.

    Args:
        path: A `*.topo.json`; it need not be there yet.
        plan: Floor plan that a new map names, relative to its file.

    Raises:
        InputError: If it could not be written.
    """

    def __init__(self, path: Path, plan: str | None = None) -> None:
        check_out_file(path, flag="map")
        self.path = path.resolve()
        self._plan = plan
        self._lock = threading.Lock()
        self._kept_aside = False

    @property
    def name(self) -> str:
        """The file's name, without its folder."""
        return self.path.name

    def open(self) -> OpenedMap:
        """The map in the file, or an empty one where there is no file.

        Raises:
            InputError: If the file holds no map; names the element.
        """
        data = self._data()
        if data is None:
            return OpenedMap(_empty_document(self.path, self._plan), "")
        drawn = map_of_document(parse_json(data, str(self.path)), str(self.path))
        return OpenedMap(map_to_document(drawn), _version(data))

    def version(self) -> str:
        """Names what is on disk now; empty where there is no file."""
        return _version(self._data())

    def save(self, drawn: TopologicalMap, base: str, *, overwrite: bool = False) -> str:
        """The version that is on disk after the map was written.

        Args:
            drawn: Map to write.
            base: Version that the editor's map came from.
            overwrite: Whether to replace what somebody else wrote; that is kept aside.

        Raises:
            ChangedOnDiskError: If the file holds something else than the base.
            InputError: If the file cannot be written.
        """
        with self._lock:
            data = self._data()
            changed = _version(data) != base
            if changed and not overwrite:
                raise ChangedOnDiskError
            if data is not None and changed:
                write(self._free_name("overwritten"), data)
            elif data is not None and not self._kept_aside:
                write(self.path.with_name(f"{self.path.name}~"), data)
            self._kept_aside = True
            save_map(drawn, self.path)
            return self.version()

    def save_copy(self, drawn: TopologicalMap) -> Path:
        """The file beside the map, under a name that was free, that now holds this map."""
        with self._lock:
            return save_map(drawn, self._free_name("copy"))

    def _data(self) -> bytes | None:
        if not self.path.exists():
            return None
        return read_bytes(self.path, max_bytes=MAX_JSON_BYTES)

    def _free_name(self, what: str) -> Path:
        stem = self.path.name.removesuffix(".json").removesuffix(".topo")
        for number in range(1, _MOST_COPIES):
            path = self.path.with_name(f"{stem}.{what}-{number}.topo.json")
            if not path.exists():
                return path
        raise InputError(
            f"there are {_MOST_COPIES} copies of this map already",
            where=str(self.path.parent),
            remedy="remove those that you do not need",
        )


def map_of_document(document: Any, where: str) -> TopologicalMap:
    """The map that a document of unknown shape holds.

    Raises:
        InputError: If it breaks the schema, repeats an id or has an edge without its nodes.
    """
    faults = map_schema_faults(document)
    if faults:
        shown = "; ".join(f"{place}: {rule}" for place, rule in faults[:5])
        raise InputError(shown, where=where, remedy="correct the named elements")
    try:
        return map_from_document(document)
    except InputError as error:
        raise InputError(error.rule, where=where, remedy=error.remedy) from None


def _version(data: bytes | None) -> str:
    return "" if data is None else hashlib.sha256(data).hexdigest()


def _empty_document(path: Path, plan: str | None) -> dict[str, Any]:
    name = path.name.removesuffix(".json").removesuffix(".topo")[:200]
    return {
        "version": FORMAT_VERSION,
        "name": "".join(letter for letter in name if letter.isprintable()) or "map",
        "frame": {"name": "map", "plan": plan if plan and len(plan) <= 200 else None},
        "nodes": [],
        "edges": [],
    }
