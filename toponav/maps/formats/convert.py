"""Maps in and out of every format that users have, with a report of what was lost on the way."""

import os
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import check_out_file, read_bytes, write_atomically
from toponav.maps.formats._values import is_name
from toponav.maps.formats.canvas import area_of_drawing, drawing_faults, load_area_map
from toponav.maps.formats.graphml import map_from_graphml, map_to_graphml
from toponav.maps.formats.lif import map_to_lif
from toponav.maps.formats.map_format import (
    ENDINGS,
    READABLE,
    WRITABLE,
    MapFormat,
    document_of,
    format_of_document,
    format_of_name,
)
from toponav.maps.formats.nav2 import map_from_nav2, map_to_nav2
from toponav.maps.formats.report import ConversionReport, Notes
from toponav.maps.formats.rmf import map_from_rmf
from toponav.maps.formats.tmap2 import map_from_tmap2, map_to_tmap2
from toponav.maps.spec import TopologicalMap, load_map, save_map
from toponav.worlds.load.stanford import AreaFiles

__all__ = [
    "READABLE",
    "WRITABLE",
    "Conversion",
    "ImportedMap",
    "MapFormat",
    "convert_map",
    "export_map",
    "format_of_name",
    "import_map",
]

_MOST_BYTES = 64 * 1024 * 1024
_LONGEST_PLAN = 200


@dataclass(frozen=True)
class ImportedMap:
    """A map that was read, and what was dropped or guessed on the way."""

    map: TopologicalMap
    format: MapFormat
    """The format that it was read from."""
    report: ConversionReport


@dataclass(frozen=True)
class Conversion:
    """A map that was turned from one format into another."""

    map: TopologicalMap
    """As it was read; its floor plan's path holds where it was written to."""
    source_format: MapFormat
    target_format: MapFormat
    report: ConversionReport


def import_map(
    path: str | Path, map_format: MapFormat | None = None, *, level: str | None = None
) -> ImportedMap:
    """The map in a file of any format that is read; the content tells which one it is.

    Args:
        path: File to read.
        map_format: Its format, where the content shall not decide.
        level: Level of an Open-RMF building.

    Raises:
        InputError: If the file is no map, or a broken one; names the place in it.

    Example:
        >>> imported = import_map("office.geojson")  # doctest: +SKIP
        >>> imported.map.name, [str(line) for line in imported.report]  # doctest: +SKIP
        ('office', [])
    """
    path = Path(path)
    if map_format is not None and map_format not in READABLE:
        raise InputError(
            f"{map_format} is written, not read",
            where=str(path),
            remedy=f"formats that are read: {', '.join(READABLE)}",
        )
    data = read_bytes(path, max_bytes=_MOST_BYTES)
    try:
        return _imported(data, path, map_format, level)
    except RecursionError:
        raise InputError(
            "nested too deep to be read", where=str(path), remedy="flatten the document"
        ) from None


def export_map(
    topological_map: TopologicalMap,
    path: str | Path,
    map_format: MapFormat | None = None,
    *,
    written: datetime | None = None,
) -> ConversionReport:
    """What the format could not hold of the map, which is now in the file.

    Args:
        topological_map: Map to write.
        path: File to write; its ending tells the format when that is not given.
        map_format: The format.
        written: Time that tmap2 and LIF record; now when not given.

    Raises:
        InputError: If the format is not written, cannot hold the map, or the file cannot be
            written.
    """
    path = Path(path)
    map_format = map_format or format_of_name(path)
    written = written or datetime.now(UTC)
    match map_format:
        case MapFormat.TOPO:
            save_map(topological_map, path)
            return ConversionReport()
        case MapFormat.NAV2:
            text, report = map_to_nav2(topological_map)
        case MapFormat.TMAP2:
            text, report = map_to_tmap2(topological_map, written)
        case MapFormat.GRAPHML:
            text, report = map_to_graphml(topological_map)
        case MapFormat.LIF:
            text, report = map_to_lif(topological_map, written)
        case _:
            raise _not_written(map_format, path)
    write_atomically(path, text)
    return report


def convert_map(
    source: str | Path,
    target: str | Path,
    source_format: MapFormat | None = None,
    target_format: MapFormat | None = None,
    *,
    level: str | None = None,
) -> Conversion:
    """The map of one file, written to another in its format, and what was lost on the way.

    Args:
        source: File to read.
        target: File to write.
        source_format: Format of the first; by its content when not given.
        target_format: Format of the second; by its name when not given.
        level: Level of an Open-RMF building.

    Raises:
        InputError: As `import_map` and `export_map`; nothing is written then.
    """
    source, target = Path(source), Path(target)
    target_format = target_format or format_of_name(target)
    if target_format not in WRITABLE:
        raise _not_written(target_format, target)
    check_out_file(target, flag="map")
    imported = import_map(source, source_format, level=level)
    notes = Notes()
    made = _with_moved_plan(imported.map, source, target, notes)
    report = imported.report + notes.report() + export_map(made, target, target_format)
    return Conversion(made, imported.format, target_format, report)


def _imported(data: bytes, path: Path, wanted: MapFormat | None, level: str | None) -> ImportedMap:
    where, name = str(path), _name_of(path)
    is_xml = data.lstrip(b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n")[:1] == b"<"
    if wanted is MapFormat.GRAPHML or (wanted is None and is_xml):
        return ImportedMap(*_swapped(MapFormat.GRAPHML, map_from_graphml(data, where, name)))
    document = document_of(data, path, wanted)
    found = wanted or format_of_document(document, path)
    if level is not None and found is not MapFormat.RMF:
        raise InputError(
            f"levels are those of Open-RMF buildings, this is {found}",
            where=f"--level {level[:80]}",
            remedy="leave it out",
        )
    match found:
        case MapFormat.NAV2:
            read = map_from_nav2(document, where, name)
        case MapFormat.TMAP2:
            read = map_from_tmap2(document, where, name)
        case MapFormat.RMF:
            read = map_from_rmf(document, where, name, level)
        case MapFormat.CANVAS:
            read = _drawn(area_of_drawing(path))
        case MapFormat.AREA:
            read = _drawn(path)
        case _:
            read = load_map(path), ConversionReport()
    return ImportedMap(*_swapped(found, read))


def _swapped(
    found: MapFormat, read: tuple[TopologicalMap, ConversionReport]
) -> tuple[TopologicalMap, MapFormat, ConversionReport]:
    return read[0], found, read[1]


def _not_written(map_format: MapFormat, path: Path) -> InputError:
    return InputError(
        f"maps are not written as {map_format}",
        where=str(path),
        remedy=did_you_mean(map_format, WRITABLE),
    )


def _drawn(area_yaml: Path) -> tuple[TopologicalMap, ConversionReport]:
    """The authors' drawing of an area."""
    drawn, notes = load_area_map(area_yaml), Notes()
    notes.guessed("kinds and rooms of nodes", "from their names, as the authors name them")
    notes.guessed("yaws and lengths of edges", "from where their nodes are")
    for fault in drawing_faults(AreaFiles.read(area_yaml), drawn):
        notes.dropped("sizes of nodes that were not drawn", "there is no such node", fault.element)
    return drawn, notes.report()


def _name_of(path: Path) -> str:
    """A map's name from its file's."""
    name = path.name
    for ending, _ in (*ENDINGS, (".topo", MapFormat.TOPO), (".tmap2", MapFormat.TMAP2)):
        if name.lower().endswith(ending) and len(name) > len(ending):
            name = name[: -len(ending)]
    return name if is_name(name) else "map"


def _with_moved_plan(
    made: TopologicalMap, source: Path, target: Path, notes: Notes
) -> TopologicalMap:
    """The map with a path to its floor plan that holds where the map is written."""
    if made.frame.plan is None:
        return made
    plan = source.absolute().parent / made.frame.plan
    moved: str | None = Path(os.path.relpath(plan, target.absolute().parent)).as_posix()
    if not is_name(moved):
        notes.dropped(
            "floor plan", f"its path has more than {_LONGEST_PLAN} characters from there"
        )
        moved = None
    return replace(made, frame=replace(made.frame, plan=moved))
