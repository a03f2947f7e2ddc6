"""`toponav map edit`: what it is given, and what it says when that is wrong."""

import builtins

import pytest

from toponav.cli import map_edit
from toponav.cli.main import main
from toponav.core.vocabulary import NodeKind
from toponav.maps.spec import MapFrame, Node, TopologicalMap, load_map, save_map
from toponav.worlds.generate.office import generate_office
from toponav.worlds.storage import save_scene


@pytest.fixture(scope="module")
def office(tmp_path_factory):
    folder = tmp_path_factory.mktemp("office") / "scene"
    save_scene(generate_office(3), folder)
    return folder


def editor_of(map_path, scene=None, area=None, plan=None):
    return map_edit._editor(map_path, scene, area, plan)


def test_scene_gives_floor_checks_and_construction(office, tmp_path):
    editor = editor_of(tmp_path / "new.topo.json", scene=office)
    assert editor.floor is not None
    assert editor.workshop.can_construct
    opened = editor.file.open().document
    assert (tmp_path / opened["frame"]["plan"]).resolve() == (office / "map.yaml").resolve()


def test_plan_of_a_scenes_folder_brings_the_scene(office, tmp_path):
    editor = editor_of(tmp_path / "new.topo.json", plan=office / "map.yaml")
    assert editor.floor is not None
    assert len(editor.floor.rooms) > 3


def test_map_names_its_floor_plan_itself(office, tmp_path):
    assert main(["map", "build", str(office), "--out", str(tmp_path / "o.topo.json")]) == 0
    editor = editor_of(tmp_path / "o.topo.json")
    assert editor.floor is not None
    drawn = load_map(tmp_path / "o.topo.json")
    assert len(editor.workshop.construct(drawn)["nodes"]) == len(drawn.nodes)


def test_map_without_a_building_is_edited_too(tmp_path):
    nodes = (Node("a", NodeKind.HALLWAY, 0.0, 0.0),)
    frame = MapFrame("map", "gone.yaml")
    path = save_map(TopologicalMap("bare", frame, nodes, ()), tmp_path / "bare.topo.json")
    editor = editor_of(path)
    assert editor.floor is None
    assert not editor.workshop.can_construct


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["map.yaml"], "a map is a JSON file"),
        (["missing/../."], "a map is a JSON file"),
        (["m.topo.json", "--scene", "nowhere"], "no such"),
        (["m.topo.json", "--scene", "a", "--plan", "b"], "one building"),
        (["m.topo.json", "--area", "nowhere.yaml"], "no such"),
        (["m.topo.json", "--port", "70000"], "a port is a number"),
    ],
)
def test_wrong_words_are_explained(tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    assert main(["map", "edit", *words, "--no-browser"]) == 1
    assert said in capsys.readouterr().err


def test_broken_map_is_explained_before_anything_is_served(tmp_path, capsys):
    path = tmp_path / "broken.topo.json"
    path.write_text("{")
    assert main(["map", "edit", str(path), "--no-browser"]) == 1
    assert "not JSON" in capsys.readouterr().err


def test_taken_port_is_explained(tmp_path, capsys):
    from toponav.maps.editor.serve import listen

    with listen(0) as taken:
        port = str(taken.getsockname()[1])
        assert main(["map", "edit", str(tmp_path / "m.topo.json"), "--port", port]) == 1
    assert "cannot be listened on" in capsys.readouterr().err


@pytest.mark.parametrize("package", ["uvicorn", "starlette"])
def test_missing_extra_is_named(tmp_path, monkeypatch, capsys, package):
    real = builtins.__import__

    def without(name, *more):
        if name.partition(".")[0] == package:
            raise ModuleNotFoundError(f"No module named '{package}'", name=package)
        return real(name, *more)

    import sys

    for name in [
        name for name in sys.modules if name.startswith(("toponav.maps.editor.app", package))
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", without)
    assert main(["map", "edit", str(tmp_path / "m.topo.json"), "--no-browser"]) == 1
    assert "pip install 'toponav[editor]'" in capsys.readouterr().err
