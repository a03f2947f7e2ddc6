"""The formats of maps, and how a file's content or name tells which one it is."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError
from toponav.core.files import parse_json
from toponav.core.yaml_text import parse_yaml

__all__ = [
    "ENDINGS",
    "READABLE",
    "WRITABLE",
    "MapFormat",
    "document_of",
    "format_of_document",
    "format_of_name",
]


class MapFormat(StrEnum):
    """A format of topological maps."""

    TOPO = "topo"
    """Ours, `*.topo.json`."""
    NAV2 = "nav2"
    """Route graph of Nav2's route server, GeoJSON."""
    TMAP2 = "tmap2"
    """LCAS `topological_navigation`, YAML."""
    GRAPHML = "graphml"
    """GraphML with typed keys."""
    LIF = "lif"
    """VDMA Layout Interchange Format 1.0, JSON; written only."""
    CANVAS = "canvas"
    """Drawing of GraphNav's authors, JSON, with its area's yaml beside it; read only."""
    AREA = "area"
    """Yaml of a Stanford area that names such a drawing; read only."""
    RMF = "rmf"
    """Open-RMF building of the traffic editor, YAML; read only."""


READABLE = tuple(one for one in MapFormat if one is not MapFormat.LIF)
"""Formats that maps are read from."""
WRITABLE = (MapFormat.TOPO, MapFormat.NAV2, MapFormat.TMAP2, MapFormat.GRAPHML, MapFormat.LIF)
"""Formats that maps are written in."""
ENDINGS: tuple[tuple[str, MapFormat], ...] = (
    (".lif.json", MapFormat.LIF),
    (".building.yaml", MapFormat.RMF),
    (".geojson", MapFormat.NAV2),
    (".json", MapFormat.TOPO),
    (".graphml", MapFormat.GRAPHML),
    (".xml", MapFormat.GRAPHML),
    (".tmap2", MapFormat.TMAP2),
    (".yaml", MapFormat.TMAP2),
    (".yml", MapFormat.TMAP2),
)
"""Formats by the end of a file's name, the first that fits."""


def format_of_name(path: str | Path) -> MapFormat:
    """The format that a file's ending stands for.

    Raises:
        InputError: If it stands for none.
    """
    name = Path(path).name.lower()
    for ending, found in ENDINGS:
        if name.endswith(ending):
            return found
    raise InputError(
        f"the ending of '{Path(path).name[:80]}' tells no map format",
        where=str(path),
        remedy="end it in .topo.json, .geojson, .tmap2, .graphml or .lif.json, or give the format",
    )


def document_of(data: bytes, path: Path, wanted: MapFormat | None) -> Any:
    """What a file holds as JSON, or as YAML where it is none or is known to be YAML.

    Raises:
        InputError: If it is neither.
    """
    by_name = path.suffix.lower() in (".yaml", ".yml", ".tmap2")
    is_yaml = wanted in (MapFormat.TMAP2, MapFormat.RMF, MapFormat.AREA)
    looks_like_json = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"[")
    if is_yaml or (wanted is None and (by_name or not looks_like_json)):
        return parse_yaml(data, str(path))
    return parse_json(data, str(path))


def format_of_document(document: Any, path: Path) -> MapFormat:
    """The format that a document's keys show.

    Raises:
        InputError: If they show none that is read.
    """
    if not isinstance(document, dict):
        raise _unknown(path, f"a {type(document).__name__}")
    keys = document.keys()
    if document.get("type") == "FeatureCollection":
        return MapFormat.NAV2
    if {"oval", "line", "text"} <= keys:
        return MapFormat.CANVAS
    if "layouts" in keys and "metaInformation" in keys:
        raise InputError(
            "this is a LIF file, which is written, not read",
            where=str(path),
            remedy=f"formats that are read: {', '.join(READABLE)}",
        )
    if "levels" in keys:
        return MapFormat.RMF
    if {"image", "resolution"} <= keys:
        return MapFormat.AREA
    if "nodes" in keys:
        return MapFormat.TMAP2 if _is_tmap2(document) else MapFormat.TOPO
    if "version" in keys and "frame" in keys:
        return MapFormat.TOPO
    raise _unknown(path, "the keys " + ", ".join(sorted(map(str, keys)))[:120] if keys else "{}")


def _is_tmap2(document: Mapping[str, Any]) -> bool:
    nodes = document["nodes"]
    first = nodes[0] if isinstance(nodes, list) and nodes else None
    return "pointset" in document or (isinstance(first, dict) and "node" in first)


def _unknown(path: Path, got: str) -> InputError:
    return InputError(
        f"the content shows no map format that is read, got {got}",
        where=str(path),
        remedy=f"give its format, one of {', '.join(READABLE)}",
    )
