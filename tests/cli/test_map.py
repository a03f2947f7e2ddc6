import json
from pathlib import Path

import pytest

from tests.maps.small_maps import TL, edge, office_floor, plus
from toponav.cli.main import main
from toponav.maps.spec import load_map, map_to_document, save_map


@pytest.fixture
def floor(tmp_path: Path) -> Path:
    return save_map(office_floor(), tmp_path / "floor.topo.json")


def test_check_passes_a_good_map(floor: Path, capsys) -> None:
    assert main(["map", "check", str(floor)]) == 0
    assert "no faults" in capsys.readouterr().out


def test_check_names_every_fault_and_fails(floor: Path, capsys) -> None:
    document = map_to_document(plus(office_floor(), edge("office_4", "hallway_1-2r", TL)))
    document["edges"][0]["target"] = "nowhere"
    floor.write_text(json.dumps(document))
    assert main(["map", "check", str(floor)]) == 1
    out = capsys.readouterr().out
    assert "exit-from-door-node (rule 6)" in out
    assert "its target nowhere is not a node of the map" in out
    assert main(["map", "check", str(floor), "--json"]) == 1
    faults = json.loads(capsys.readouterr().out)["faults"]
    assert {"exit-from-door-node", "edge-has-nodes"} <= {fault["rule"] for fault in faults}


def test_plan_prints_nodes_behaviors_and_metres(floor: Path, capsys) -> None:
    assert main(["map", "plan", str(floor), "office_4", "office_41"]) == 0
    out = capsys.readouterr().out
    assert "turn_left" in out
    assert "5 nodes, 8.4 m, difficulty I" in out
    assert main(["map", "plan", str(floor), "office_4", "office_41", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["nodes"][0] == "office_4"
    assert document["behaviors"] == ["find_door", "turn_left", "corridor_follow", "straight"]


def test_a_wrong_name_is_one_line_without_traceback(floor: Path, capsys) -> None:
    assert main(["map", "plan", str(floor), "office_5", "office_41"]) == 1
    error = capsys.readouterr().err
    assert "there is no node 'office_5'. Remedy: did you mean 'office_4'?" in error
    assert "Traceback" not in error


def test_show_writes_a_picture(floor: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "pictures" / "floor.png"
    words = ["--start", "office_4", "--goal", "WC_1", "--out", str(out)]
    assert main(["map", "show", str(floor), *words]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")
    assert "14 nodes, 17 edges" in capsys.readouterr().out
    assert main(["map", "show", str(floor), "--out", str(tmp_path / "floor.txt")]) == 1
    assert main(["map", "show", str(floor), "--goal", "WC_1"]) == 1
    assert "a plan has a start and a goal" in capsys.readouterr().err


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"version": 9}'])
@pytest.mark.parametrize("command", ["show", "plan", "check"])
def test_a_broken_map_gives_status_1(broken, command, tmp_path: Path, capsys) -> None:
    path = tmp_path / "broken.topo.json"
    path.write_text(broken)
    names = ["a", "b"] if command == "plan" else []
    assert main(["map", command, str(path), *names]) == 1
    captured = capsys.readouterr()
    assert "Remedy" in captured.err + captured.out
    assert path.read_text() == broken


def test_build_check_and_convert_an_area(areas_dir: Path, tmp_path: Path, capsys) -> None:
    built, converted = tmp_path / "built.topo.json", tmp_path / "converted.topo.json"
    area = str(areas_dir / "area_3.yaml")
    assert main(["map", "build", area, "--from", "drawing", "--out", str(built)]) == 0
    drawing = areas_dir / "area_3_graph_v6.json"
    assert main(["map", "convert", str(drawing), str(converted)]) == 0
    assert converted.read_bytes() == built.read_bytes()
    assert (tmp_path / load_map(built).frame.plan).resolve() == (
        areas_dir / "area_3.yaml"
    ).resolve()
    capsys.readouterr()
    assert main(["map", "check", str(areas_dir / "area_3.yaml")]) == 0
    assert main(["map", "check", str(built), "--scene", str(areas_dir / "area_3.yaml")]) == 0
    assert "warning" in capsys.readouterr().out
    assert main(["map", "check", str(areas_dir / "area_6.yaml")]) == 1
    assert "find_door leads from hallway_4-2r" in capsys.readouterr().out


def test_build_a_generated_scene(tmp_path: Path, capsys) -> None:
    from toponav.worlds.generate.office import generate_office
    from toponav.worlds.storage import save_scene

    scene = tmp_path / "office"
    save_scene(generate_office(3, size="small"), scene)
    out = tmp_path / "office.topo.json"
    assert main(["map", "build", str(scene), "--out", str(out)]) == 0
    assert load_map(out).frame.plan == "office/map.yaml"
    capsys.readouterr()
    assert main(["map", "check", str(out), "--scene", str(scene)]) == 0, capsys.readouterr().out
    assert main(["map", "show", str(out), "--out", str(tmp_path / "office.png")]) == 0


def test_convert_says_what_it_reads(tmp_path: Path, floor: Path, capsys) -> None:
    assert main(["map", "convert", "plan.dwg", str(tmp_path / "x.topo.json")]) == 1
    assert "no such file" in capsys.readouterr().err
    assert main(["map", "convert", str(floor), str(tmp_path / "x.png")]) == 1
    assert main(["map", "convert", str(floor), str(tmp_path / "x.topo.json")]) == 0
    assert load_map(tmp_path / "x.topo.json") == office_floor()


def test_convert_tells_what_was_lost(tmp_path: Path, floor: Path, capsys) -> None:
    lif, graphml = tmp_path / "x.lif.json", tmp_path / "x.graphml"
    assert main(["map", "convert", str(floor), str(lif)]) == 0
    assert "dropped: rooms of nodes that are not room nodes" in capsys.readouterr().out
    assert main(["map", "convert", str(floor), str(graphml)]) == 0
    assert "nothing was lost" in capsys.readouterr().out
    back = tmp_path / "back.json"
    assert main(["map", "convert", str(graphml), str(back), "--to", "nav2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["from"], told["to"], told["report"]) == ("graphml", "nav2", [])
    assert main(["map", "convert", str(back), str(tmp_path / "x.topo.json")]) == 0
    assert load_map(tmp_path / "x.topo.json") == office_floor()


def test_check_fixes_what_needs_no_decision_and_keeps_a_backup(floor: Path, capsys) -> None:
    document = map_to_document(office_floor())
    document["edges"][0]["yaw"] += 2.0
    floor.write_text(json.dumps(document))
    as_it_was = floor.read_bytes()
    assert main(["map", "check", str(floor)]) == 1
    out = capsys.readouterr().out
    assert "yaw-fits-geometry [fix]" in out
    assert "--fix can repair 1" in out
    assert main(["map", "check", str(floor), "--fix"]) == 0
    assert "as it was:" in capsys.readouterr().out
    assert floor.with_name("floor.topo.json.bak").read_bytes() == as_it_was
    assert load_map(floor) == office_floor()
    assert main(["map", "check", str(floor), "--fix", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fixed"] == []
    assert not floor.with_name("floor.topo.json.bak2").exists()


def test_check_fix_writes_elsewhere_when_asked(floor: Path, tmp_path: Path, capsys) -> None:
    document = map_to_document(office_floor())
    document["edges"][0]["length"] = 99.0
    floor.write_text(json.dumps(document))
    as_it_was, out = floor.read_bytes(), tmp_path / "fixed.topo.json"
    assert main(["map", "check", str(floor), "--fix", "--out", str(out)]) == 0
    assert load_map(out) == office_floor()
    assert floor.read_bytes() == as_it_was
    assert main(["map", "check", str(floor), "--out", str(out)]) == 1
    assert "add --fix" in capsys.readouterr().err
    floor.write_text("{}")
    assert main(["map", "check", str(floor), "--fix"]) == 1
    assert "no map that could be repaired" in capsys.readouterr().err
    assert floor.read_text() == "{}"


def test_plan_prints_the_k_shortest(floor: Path, capsys) -> None:
    assert main(["map", "plan", str(floor), "office_4", "WC_1", "--all", "--json"]) == 0
    plans = json.loads(capsys.readouterr().out)
    assert [plan["length_m"] for plan in plans] == sorted(plan["length_m"] for plan in plans)
    assert len(plans) == 2
    assert main(["map", "plan", str(floor), "office_4", "WC_1", "-k", "3"]) == 0
    assert "plan 2 of 2: " in capsys.readouterr().out
    assert main(["map", "plan", str(floor), "office_4", "WC_1", "-k", "0"]) == 1
    assert "must lie in 1..1000" in capsys.readouterr().err


def test_show_writes_vectors_for_print(floor: Path, tmp_path: Path) -> None:
    svg, pdf = tmp_path / "floor.svg", tmp_path / "floor.pdf"
    assert main(["map", "show", str(floor), "--out", str(svg), "--title", "A floor"]) == 0
    text = svg.read_text()
    assert "A floor" in text
    assert "office_41" in text
    assert "corridor follow" in text
    assert " m<" in text, "a scale bar"
    assert main(["map", "show", str(floor), "--out", str(pdf), "--width-in", "3.5"]) == 0
    assert pdf.read_bytes().startswith(b"%PDF")
    assert main(["map", "show", str(floor), "--out", str(pdf), "--width-in", "99"]) == 1
