"""`toponav map convert`: maps from one format into another, with what was lost on the way."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from toponav.core.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from toponav.maps.formats.convert import Conversion, MapFormat

__all__ = ["convert"]


def convert(
    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="IN")],
    target: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")],
    from_format: Annotated[str | None, tyro.conf.arg(name="from", metavar="FORMAT")] = None,
    to_format: Annotated[str | None, tyro.conf.arg(name="to", metavar="FORMAT")] = None,
    level: str | None = None,
    as_json: Annotated[bool, tyro.conf.arg(name="json")] = False,
) -> int:
    """Turn a map of one format into another, and tell what was dropped, guessed or changed.

    Reads topo (ours), nav2 (route graph GeoJSON), tmap2 (LCAS topological_navigation), graphml,
    canvas (the drawing of GraphNav's authors, its yaml and PNG beside it), area (that yaml) and
    rmf (Open-RMF building.yaml); writes topo, nav2, tmap2, graphml and lif (VDMA LIF 1.0).

    Example: toponav map convert area_3.topo.json area_3.geojson

    Args:
        source: Map to read.
        target: Map to write: .topo.json, .geojson, .tmap2, .graphml or .lif.json.
        from_format: Format to read; told from the content by default.
        to_format: Format to write; told from the name by default.
        level: Level of an Open-RMF building; its reference level by default.
        as_json: Print what was made, and what was lost, as JSON.
    """
    from toponav.maps.formats.convert import READABLE, WRITABLE, convert_map

    made = convert_map(
        source,
        target,
        _format(from_format, READABLE, "--from"),
        _format(to_format, WRITABLE, "--to"),
        level=level,
    )
    if as_json:
        print(json.dumps(_document(made, target), indent=1))
    else:
        _print(made, target)
    return 0


def _format(name: str | None, valid: "tuple[MapFormat, ...]", flag: str) -> "MapFormat | None":
    if name is None:
        return None
    for one in valid:
        if one.value == name.lower():
            return one
    raise InputError(
        f"must be one of {', '.join(valid)}, got '{name[:80]}'",
        where=flag,
        remedy=did_you_mean(name, valid),
    )


def _document(made: "Conversion", target: Path) -> dict[str, object]:
    return {
        "map": made.map.name,
        "from": made.source_format.value,
        "to": made.target_format.value,
        "wrote": str(target),
        "nodes": len(made.map.nodes),
        "edges": len(made.map.edges),
        "report": made.report.to_document(),
    }


def _print(made: "Conversion", target: Path) -> None:
    from rich.console import Console

    console = Console(soft_wrap=True, highlight=False, markup=False)
    console.print(
        f"{made.map.name}: {len(made.map.nodes)} nodes, {len(made.map.edges)} edges, "
        f"from {made.source_format} to {made.target_format}"
    )
    for line in made.report:
        console.print(f"  {line}")
    if not made.report:
        console.print("  nothing was lost")
    console.print(f"wrote {target}")
