"""`toponav map check`: every fault of a map, and the repair of those that need no decision."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toponav.cli._map_files import Json, MapPath, area_map, building_of, is_yaml, require_map_name
from toponav.core.errors import InputError
from toponav.core.files import read_bytes, write_atomically

if TYPE_CHECKING:
    from toponav.maps.repair import Repair
    from toponav.maps.spec import TopologicalMap
    from toponav.maps.validate import Building, Fault

__all__ = ["check"]

_MAX_BYTES = 64_000_000
_SEVERITY_COLORS = {"error": "red", "warning": "yellow"}


def check(
    map: MapPath,
    scene: Path | None = None,
    fix: bool = False,
    out: Path | None = None,
    as_json: Json = False,
) -> int:
    """Report every fault of a map, each with its place and remedy; status 1 if any is an error.

    The six rules of GraphNav's section IV, and what any map needs. With the building, it also
    checks that nodes stand in their rooms and that the robot fits there. Faults marked [fix]
    can be repaired without a decision of yours: --fix does, and never makes a new fault.

    Example: toponav map check area_3.topo.json --scene graphnav_areas/area_3.yaml --fix

    Args:
        map: A `*.topo.json`, or the yaml of a Stanford area to check the authors' drawing.
        scene: Building: folder of a scene, or the yaml of a Stanford area or ROS map.
        fix: Repair what needs no decision; the file as it was is kept as MAP.bak.
        out: With --fix, write the repaired map here and leave MAP alone.
        as_json: Print the faults as JSON.
    """
    from toponav.maps.validate import has_errors

    target = _target(map, fix, out)
    building = None if scene is None else building_of(scene)
    checked, faults = _faults_of(map, building)
    fixed: Sequence[Fault] = ()
    backup: Path | None = None
    if target is not None:
        repaired = _repaired(map, checked, faults, building)
        fixed, faults = repaired.fixed, repaired.left
        backup = _write(repaired, map, target)
    if as_json:
        document: dict[str, Any] = {
            "map": str(map),
            "faults": [fault.to_document() for fault in faults],
        }
        if target is not None:
            document["fixed"] = [fault.to_document() for fault in fixed]
            document["wrote"] = str(target) if fixed or target != map else None
            document["backup"] = None if backup is None else str(backup)
        print(json.dumps(document, indent=1))
    else:
        _print_fixed(fixed, target, backup, map)
        _print_faults(map if target is None else target, faults, hint=target is None)
    return int(has_errors(faults))


def _target(map: Path, fix: bool, out: Path | None) -> Path | None:
    """Where to write the repaired map, or None where nothing is to be repaired."""
    if out is not None and not fix:
        raise InputError("--out is where --fix writes", where="--out", remedy="add --fix")
    if not fix:
        return None
    if out is None and is_yaml(map):
        raise InputError(
            "the authors' drawing is not changed",
            where=str(map),
            remedy="name a map to write: --fix --out NAME.topo.json",
        )
    target = map if out is None else out
    require_map_name(target)
    return target


def _faults_of(
    map: Path, building: "Building | None"
) -> "tuple[TopologicalMap | None, tuple[Fault, ...]]":
    """The map, or None where its document holds none, and all its faults."""
    from toponav.maps.validate import check_file, validate

    if not is_yaml(map):
        return check_file(map, building)
    from toponav.maps.formats.canvas import drawing_faults
    from toponav.worlds.load.stanford import AreaFiles

    files = AreaFiles.read(map)
    drawn = area_map(map)
    building = building or building_of(map)
    return drawn, (*validate(drawn, building), *drawing_faults(files, drawn))


def _repaired(
    map: Path,
    checked: "TopologicalMap | None",
    faults: "tuple[Fault, ...]",
    building: "Building | None",
) -> "Repair":
    from toponav.maps.repair import repair

    if checked is None:
        raise InputError(
            "the file holds no map that could be repaired: "
            + "; ".join(f"{fault.element}: {fault.message}" for fault in faults[:3]),
            where=str(map),
            remedy=f"correct it by hand: {faults[0].remedy}",
        )
    if building is None and is_yaml(map):
        building = building_of(map)
    return repair(checked, building)


def _write(repaired: "Repair", map: Path, target: Path) -> Path | None:
    """Writes the repaired map whole; the backup's path where the map itself was replaced."""
    from toponav.cli._map_files import with_plan
    from toponav.maps.spec import save_map

    made = repaired.topological_map
    if target != map:
        if is_yaml(map):
            made = with_plan(made, map, target)
        elif made.frame.plan is not None:
            made = with_plan(made, map.parent / made.frame.plan, target)
        save_map(made, target)
        return None
    if not repaired.fixed:
        return None
    backup = map.with_name(map.name + ".bak")
    number = 2
    while backup.exists():
        backup = map.with_name(f"{map.name}.bak{number}")
        number += 1
    write_atomically(backup, read_bytes(map, max_bytes=_MAX_BYTES))
    save_map(made, map)
    return backup


def _print_fixed(
    fixed: "Sequence[Fault]", target: Path | None, backup: Path | None, map: Path
) -> None:
    from rich.console import Console
    from rich.markup import escape

    if target is None:
        return
    console = Console(soft_wrap=True, highlight=False)
    for fault in fixed:
        console.print(
            f"[green]fixed[/green] {escape(fault.element)}: {fault.rule}, "
            f"{escape(fault.message)}: {escape(fault.remedy)}"
        )
    if target != map:
        console.print(f"wrote {target}", markup=False)
    elif backup is not None:
        console.print(f"wrote {target}; as it was: {backup}", markup=False)
    else:
        console.print(f"{map}: nothing that can be fixed without you", markup=False)


def _print_faults(path: Path, faults: "Sequence[Fault]", *, hint: bool) -> None:
    from rich.console import Console
    from rich.markup import escape

    console = Console(soft_wrap=True)
    for fault in faults:
        color = _SEVERITY_COLORS[fault.severity]
        number = fault.rule.paper_number
        rule = f"{fault.rule}{f' (rule {number})' if number else ''}"
        where = "" if fault.place_m is None else " at ({:.2f}, {:.2f})".format(*fault.place_m)
        mark = r" [green]\[fix][/green]" if fault.fixable else ""
        console.print(
            f"[{color}]{fault.severity}[/{color}] {escape(fault.element)}{where}: {rule}{mark}\n"
            f"    {escape(fault.message)}. Remedy: {escape(fault.remedy)}",
            highlight=False,
        )
    counts = Counter(fault.severity for fault in faults)
    found = ", ".join(
        f"{count} {kind}{'s' if count > 1 else ''}" for kind, count in sorted(counts.items())
    )
    fixable = sum(fault.fixable for fault in faults)
    more = f"; --fix can repair {fixable}" if fixable and hint else ""
    console.print(f"{path}: {found or 'no faults'}{more}", highlight=False, markup=False)
