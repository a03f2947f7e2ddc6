import json

import pytest

from tests.worlds.building_files import write_sh3f
from tests.worlds.test_stanford import write_area
from toponav.cli.main import main
from toponav.worlds.furniture_library import load_sh3f
from toponav.worlds.storage import load_scene


def test_imported_area_can_be_shown(tmp_path, capsys):
    area, scene = write_area(tmp_path), tmp_path / "scene"
    assert main(["scene", "import", str(area), "--out", str(scene), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["rooms"] == {"conference_room": 1, "hallway": 1}
    assert facts["size_m"] == [6.0, 4.0]
    assert facts["content_hash"] == load_scene(scene).content_hash
    plan = tmp_path / "plan.png"
    assert main(["scene", "show", str(scene), "--out", str(plan), "--views", "1"]) == 0
    assert plan.stat().st_size > 10_000
    assert "conference_room" in capsys.readouterr().out
    page = tmp_path / "scene.html"
    assert main(["scene", "show", str(scene), "--web", "--out", str(page)]) == 0
    assert load_scene(scene).rooms[0].name in page.read_text("utf-8")


def test_generated_office_is_a_pure_function_of_its_seed(tmp_path, capsys):
    words = ["scene", "generate", "office", "--seed", "5", "--size", "small", "--json", "--out"]
    hashes = []
    for name in ("a", "b"):
        assert main([*words, str(tmp_path / name)]) == 0
        hashes.append(json.loads(capsys.readouterr().out)["content_hash"])
    assert hashes[0] == hashes[1]
    loaded = load_scene(tmp_path / "a")
    assert loaded.doors
    assert loaded.layout is not None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["import", "house.world", "--out", "o"], "house.world: cannot be read: no such file"),
        (["import", "notes.txt", "--out", "o"], "notes.txt: no such file"),
        (["import", "none.yaml", "--out", "o"], "no such file"),
        (["import", "none.yaml", "--out", "o", "--seed", "-1"], "seed must not be negative"),
        (["generate", "home", "--rooms", "12", "--out", "o"], "a home has 2 to 9 rooms"),
        (["show", "nowhere"], "cannot be read"),
        (["show", "nowhere", "--out", "plan.gif"], "must be PNG, PDF or SVG"),
        (["show", "nowhere", "--web", "--out", "plan.png"], "the page must be HTML"),
        (["show", "nowhere", "--views", "99"], "views must lie in 0..24"),
    ],
)
def test_bad_input_is_one_line_and_status_one(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["scene", *words]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert "Remedy:" in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_homes_are_furnished_from_a_library_and_say_whose_work_it_is(tmp_path, capsys):
    write_sh3f(tmp_path / "tiny.sh3f")
    held_out = load_sh3f(tmp_path / "tiny.sh3f").of("chair")[0].is_held_out
    words = ["scene", "generate", "home", "--rooms", "6", "--furniture", tmp_path / "tiny.sh3f"]
    for seed, is_for_testing in ((1, False), (2001, True)):
        scene = tmp_path / str(seed)
        assert main([*map(str, words), "--seed", str(seed), "--out", str(scene)]) == 0
        uses_the_chair = "A. Maker, CC0" in capsys.readouterr().out
        assert uses_the_chair == (held_out == is_for_testing)
        assert bool(load_scene(scene).attribution) == uses_the_chair
        assert main(["scene", "show", str(scene), "--views", "0", "--out", f"{scene}.png"]) == 0
        assert ("A. Maker, CC0" in capsys.readouterr().out) == uses_the_chair


def test_a_library_that_is_none_is_refused(tmp_path, capsys):
    (tmp_path / "a.sh3f").write_bytes(b"no zip")
    words = [
        "scene",
        "generate",
        "home",
        "--out",
        tmp_path / "o",
        "--furniture",
        tmp_path / "a.sh3f",
    ]
    assert main(list(map(str, words))) == 1
    assert "not a whole zip" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()
