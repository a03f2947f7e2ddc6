import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from tests.maps.map_strategy import map_contents, map_of
from tests.maps.small_maps import office_floor
from toponav.core.errors import InputError
from toponav.maps.formats.convert import (
    MapFormat,
    convert_map,
    export_map,
    format_of_name,
    import_map,
)
from toponav.maps.formats.report import Loss
from toponav.maps.spec import TopologicalMap, load_map, save_map

_LOSSLESS = {
    MapFormat.TOPO: "map.topo.json",
    MapFormat.NAV2: "map.geojson",
    MapFormat.TMAP2: "map.tmap2",
    MapFormat.GRAPHML: "map.graphml",
}
_WHEN = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


def _back(original: TopologicalMap, path: Path) -> TopologicalMap:
    report = export_map(original, path, written=_WHEN)
    assert not [line for line in report if line.loss is Loss.DROPPED]
    imported = import_map(path)
    assert not imported.report, [str(line) for line in imported.report]
    return imported.map


@pytest.mark.parametrize("name", _LOSSLESS.values(), ids=list(_LOSSLESS))
@settings(max_examples=20, deadline=None)
@given(contents=map_contents())
def test_any_map_comes_back_as_it_was(
    contents: dict[str, Any], name: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    original = map_of(contents)
    path = tmp_path_factory.mktemp("maps") / name
    assert _back(original, path) == original
    first = path.read_bytes()
    export_map(original, path, written=_WHEN)
    assert path.read_bytes() == first


@settings(max_examples=6, deadline=None)
@given(contents=map_contents())
def test_any_map_survives_all_formats_in_turn(
    contents: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    original = map_of(contents)
    folder = tmp_path_factory.mktemp("maps")
    made = original
    for name in (*_LOSSLESS.values(), *list(_LOSSLESS.values())[::-1]):
        made = _back(made, folder / name)
    assert made == original


@pytest.mark.parametrize("area", ["area_3", "area_6"])
def test_the_authors_maps_survive_all_formats(areas_dir: Path, tmp_path: Path, area: str) -> None:
    drawn = import_map(areas_dir / f"{area}.yaml")
    assert drawn.format is MapFormat.AREA
    for name in _LOSSLESS.values():
        assert _back(drawn.map, tmp_path / name) == drawn.map


@pytest.mark.parametrize("kind", _LOSSLESS)
def test_content_decides_the_format_whatever_the_name(tmp_path: Path, kind: MapFormat) -> None:
    path = tmp_path / ("map.yaml" if kind is MapFormat.TMAP2 else "map.dat")
    export_map(office_floor(), path, kind)
    imported = import_map(path)
    assert (imported.format, imported.map) == (kind, office_floor())
    assert import_map(path, kind).map == office_floor()


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a.topo.json", MapFormat.TOPO),
        ("a.LIF.json", MapFormat.LIF),
        ("a.geojson", MapFormat.NAV2),
        ("a.tmap2.yaml", MapFormat.TMAP2),
        ("a.building.yaml", MapFormat.RMF),
        ("a.graphml", MapFormat.GRAPHML),
    ],
)
def test_names_tell_formats(name: str, expected: MapFormat) -> None:
    assert format_of_name(name) is expected


def test_a_name_without_a_format_is_refused() -> None:
    with pytest.raises(InputError, match=r"'map\.png' tells no map format"):
        format_of_name("map.png")


@pytest.mark.parametrize("content", ["7", "[1]", "{}", '{"a": 1}', "a: 1", "just words", "<a/>"])
def test_content_without_a_map_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "map.txt"
    path.write_text(content)
    with pytest.raises(InputError, match=r"map\.txt"):
        import_map(path)


def test_a_format_that_is_only_read_or_only_written_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not written as rmf"):
        export_map(office_floor(), tmp_path / "a.building.yaml")
    with pytest.raises(InputError, match="not written as canvas"):
        convert_map(tmp_path / "a", tmp_path / "b.json", None, MapFormat.CANVAS)
    with pytest.raises(InputError, match="lif is written, not read"):
        import_map(tmp_path / "a.lif.json", MapFormat.LIF)
    export_map(office_floor(), tmp_path / "a.lif.json")
    with pytest.raises(InputError, match="LIF file, which is written, not read"):
        import_map(tmp_path / "a.lif.json")


def test_floor_plan_is_found_from_the_new_place(areas_dir: Path, tmp_path: Path) -> None:
    target = tmp_path / "deep" / "folder" / "a.geojson"
    made = convert_map(areas_dir / "area_3_graph_v6.json", target)
    assert made.source_format is MapFormat.CANVAS
    plan = import_map(target).map.frame.plan
    assert plan is not None
    assert (target.parent / plan).resolve() == (areas_dir / "area_3.yaml").resolve()


def test_canvas_reports_what_its_drawing_does_not_say(areas_dir: Path) -> None:
    told = [str(line) for line in import_map(areas_dir / "area_3_graph_v6.json").report]
    assert told[0].startswith("guessed: kinds and rooms of nodes")


def test_a_conversion_that_fails_keeps_the_old_file(tmp_path: Path) -> None:
    source, target = tmp_path / "a.topo.json", tmp_path / "b.graphml"
    save_map(office_floor(), source)
    document = json.loads(source.read_text())
    document["name"] = "no \uffff character"
    source.write_text(json.dumps(document))
    target.write_text("old")
    with pytest.raises(InputError, match=r"XML cannot hold the character U\+FFFF"):
        convert_map(source, target)
    assert target.read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.topo.json", "b.graphml"]


def test_converted_maps_load(tmp_path: Path) -> None:
    export_map(office_floor(), tmp_path / "a.tmap2")
    convert_map(tmp_path / "a.tmap2", tmp_path / "a.topo.json")
    assert load_map(tmp_path / "a.topo.json") == office_floor()
