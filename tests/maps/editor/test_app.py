"""What the editor's page asks, and what it is told."""

import io
import threading

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the editor needs the extra 'editor'")

from PIL import Image

from tests.maps.editor.served import client, document
from tests.maps.editor.small_office import EDGES, NODES
from toponav.core.errors import InputError
from toponav.maps.editor.floor import Floor
from toponav.maps.editor.work import Workshop
from toponav.maps.spec import MapFrame, TopologicalMap, load_map, map_to_document, save_map
from toponav.worlds.generate.office import generate_office

OFFICE = TopologicalMap("office", MapFrame(), NODES, EDGES)


@pytest.fixture
def editor(tmp_path):
    save_map(OFFICE, tmp_path / "office.topo.json")
    return client(tmp_path / "office.topo.json")


@pytest.fixture(scope="module")
def scene():
    return generate_office(3)


def test_page_is_told_the_map_and_its_version(editor):
    told = editor.get("/api/map").json()
    assert told["map"] == map_to_document(OFFICE)
    assert told["file"] == "office.topo.json"
    assert (told["floor"], told["can_construct"]) == (None, False)
    assert told["version"] == editor.get("/api/version").json()["version"]


def test_page_is_told_nothing_of_the_folder(editor, tmp_path):
    assert str(tmp_path) not in editor.get("/api/map").text
    editor.get("/", params={"token": "a-secret-of-one-launch"})
    assert str(tmp_path) not in editor.get("/").text


def test_save_writes_and_names_the_new_version(editor, tmp_path):
    base = editor.get("/api/version").json()["version"]
    said = editor.put("/api/map", json={"map": document(NODES[:2]), "base": base})
    assert said.status == 200
    assert load_map(tmp_path / "office.topo.json").nodes == NODES[:2]
    assert said.json()["version"] == editor.get("/api/version").json()["version"] != base


def test_save_over_another_version_is_refused_until_told(editor, tmp_path):
    path = tmp_path / "office.topo.json"
    base = editor.get("/api/version").json()["version"]
    save_map(TopologicalMap("other", MapFrame(), (), ()), path)
    body = {"map": document(NODES), "base": base}
    said = editor.put("/api/map", json=body)
    assert (said.status, said.json()) == (409, {"changed_on_disk": True})
    assert load_map(path).name == "other"
    assert editor.put("/api/map", json=body | {"overwrite": True}).status == 200
    assert load_map(path).name == "tiny"
    assert load_map(tmp_path / "office.overwritten-1.topo.json").name == "other"


def test_saves_at_once_let_one_win(editor):
    base = editor.get("/api/version").json()["version"]
    statuses = []

    def save(number):
        body = {"map": document(NODES[:number]), "base": base}
        statuses.append(editor.put("/api/map", json=body).status)

    threads = [threading.Thread(target=save, args=(number,)) for number in range(1, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(statuses) == [200, 409, 409, 409]


@pytest.mark.parametrize(
    "body",
    [b"", b"{", b"[]", b"null", b'{"map": {}}', b'{"map": {"version": 1}, "base": ""}', b"\xff",
     b'{"map": NaN}', b"[" * 100_000, b'{"base": "", "base": ""}', b'{"map": "\\ud800"}'],
)  # fmt: skip
@pytest.mark.parametrize("path", ["/api/map", "/api/copy", "/api/suggestions", "/api/plans"])
def test_broken_requests_name_the_rule_and_write_nothing(editor, tmp_path, path, body):
    method = "PUT" if path == "/api/map" else "POST"
    before = sorted((one.name, one.read_bytes()) for one in tmp_path.iterdir())
    said = editor.request(method, path, content=body)
    assert said.status == 422
    assert set(said.json()["error"]) == {"rule", "where", "remedy"}
    assert sorted((one.name, one.read_bytes()) for one in tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "change",
    [{"nodes": [{"id": "a"}]}, {"edges": [{"id": "e", "source": "x", "target": "y"}]},
     {"more": 1}, {"version": 2}, {"name": ""}],
)  # fmt: skip
def test_documents_that_are_no_maps_are_not_saved(editor, tmp_path, change):
    base = editor.get("/api/version").json()["version"]
    said = editor.put("/api/map", json={"map": document(NODES) | change, "base": base})
    assert said.status == 422
    assert load_map(tmp_path / "office.topo.json") == OFFICE


@pytest.mark.parametrize("more", [{}, {"base": 1}, {"base": "", "overwrite": 1}])
def test_saves_that_name_no_base_are_refused(editor, more):
    assert editor.put("/api/map", json={"map": document(NODES)} | more).status == 422


def test_faults_are_those_of_the_python_checks(editor):
    broken = document(NODES, EDGES[:4])
    rules = {
        fault["rule"]
        for fault in editor.post("/api/faults", json={"map": broken}).json()["faults"]
    }
    assert "find-door-joins-room-and-door" in rules
    fine = editor.post("/api/faults", json={"map": document(NODES, EDGES)}).json()["faults"]
    assert fine == []


def test_faults_carry_the_papers_rule_number(editor):
    found = editor.post("/api/faults", json={"map": document(NODES, EDGES[:4])}).json()["faults"]
    assert {fault["paper_rule"] for fault in found} >= {3}


def test_faults_of_what_is_no_map_are_faults_too(editor):
    said = editor.post("/api/faults", json={"map": {"version": 1}})
    assert said.status == 200
    assert {fault["rule"] for fault in said.json()["faults"]} == {"document-follows-schema"}


def test_suggestions_name_edges_whose_geometry_says_otherwise(editor):
    sent = document(NODES, EDGES)
    wrong = next(edge for edge in sent["edges"] if edge["id"] == "hall-1->office")
    wrong["behavior"] = "turn_right"
    found = editor.post("/api/suggestions", json={"map": sent}).json()["suggestions"]
    named = {"edge": "hall-1->office", "behavior": "turn_right", "suggested": "turn_left"}
    assert named in found
    some = {"map": sent, "edges": ["office->office_door"]}
    assert editor.post("/api/suggestions", json=some).json()["suggestions"] == []


@pytest.mark.parametrize("edges", [["nothing"], [1], "all", {}])
def test_suggestions_for_edges_that_are_not_there_are_refused(editor, edges):
    sent = {"map": document(NODES, EDGES), "edges": edges}
    assert editor.post("/api/suggestions", json=sent).status == 422


def test_repair_fixes_what_needs_no_decision_and_writes_nothing(editor, tmp_path):
    sent = document(NODES, EDGES)
    next(edge for edge in sent["edges"] if edge["id"] == "office->office_door")["yaw"] = 0.5
    said = editor.post("/api/repair", json={"map": sent}).json()
    assert said["fixed"] == 1
    assert said["map"] == document(NODES, EDGES)
    assert load_map(tmp_path / "office.topo.json") == OFFICE


def test_plans_give_the_behaviours_in_order(editor):
    sent = {"map": document(NODES, EDGES), "start": "office", "goal": "hall-3"}
    plan, *others = editor.post("/api/plans", json=sent).json()["plans"]
    assert all(len(other["edges"]) >= len(plan["edges"]) for other in others)
    assert plan["behaviors"] == [
        {"behavior": "find_door", "count": 1},
        {"behavior": "turn_left", "count": 1},
    ]
    assert plan["nodes"] == ["office", "office_door", "hall-3"]


@pytest.mark.parametrize("goal", ["hall-1", "nowhere", None])
def test_plans_that_cannot_be_are_explained(editor, goal):
    sent = {"map": document(NODES, EDGES), "start": "office", "goal": goal}
    said = editor.post("/api/plans", json=sent)
    assert said.status == 422
    assert said.json()["error"]["remedy"]


def test_construction_without_a_building_is_explained(editor):
    said = editor.post("/api/construct", json={"map": document()})
    assert said.status == 422
    assert "--scene" in said.json()["error"]["remedy"]


def test_construction_keeps_the_maps_name_and_writes_nothing(tmp_path):
    workshop = Workshop(construct=lambda: OFFICE)
    editor = client(tmp_path / "new.topo.json", workshop)
    assert editor.get("/api/map").json()["can_construct"] is True
    made = editor.post("/api/construct", json={"map": document()}).json()["map"]
    assert (made["name"], len(made["nodes"])) == ("tiny", len(NODES))
    assert list(tmp_path.iterdir()) == []


def test_construction_that_fails_is_explained(tmp_path):
    def fail():
        raise InputError("rooms are needed", where="scene x", remedy="name them")

    editor = client(tmp_path / "new.topo.json", Workshop(construct=fail))
    said = editor.post("/api/construct", json={"map": document()})
    assert said.json()["error"] == {
        "rule": "rooms are needed", "where": "scene x", "remedy": "name them"
    }  # fmt: skip


def test_floor_plan_is_the_scenes_right_way_up(tmp_path, scene):
    editor = client(tmp_path / "new.topo.json", floor=Floor.of_scene(scene))
    told = editor.get("/api/map").json()["floor"]
    assert told["extent"] == list(scene.grid.extent_m)
    assert {room["name"] for room in told["rooms"]} == {room.name for room in scene.rooms}
    for theme in ("light", "dark"):
        said = editor.get(f"/api/floor/{theme}")
        assert said.headers["content-type"] == "image/png"
        image = np.asarray(Image.open(io.BytesIO(said.body)))
        assert image.shape[:2] == scene.grid.shape
        in_rooms = (scene.room_index >= 0)[::-1]
        assert image[in_rooms, 3].min() == 255
    assert image[in_rooms & ~scene.occupied[::-1]][:, :3].mean() < 80


def test_rooms_on_the_page_lie_where_the_scenes_do(scene):
    import base64

    cells = Floor.of_scene(scene).to_document()["cells"]
    index = np.frombuffer(base64.b64decode(cells["data"]), "<i2")
    index = index.reshape(cells["rows"], cells["cols"])
    left, _, bottom, _ = scene.grid.extent_m
    rng = np.random.default_rng(5)
    agree = 0
    for _ in range(300):
        row, col = rng.integers(cells["rows"]), rng.integers(cells["cols"])
        x_m, y_m = left + (col + 0.5) * cells["side"], bottom + (row + 0.5) * cells["side"]
        name = scene.rooms[index[row, col]].name if index[row, col] >= 0 else None
        agree += name == scene.room_at(x_m, y_m)
    assert agree >= 294


@pytest.mark.parametrize("theme", ["pink", "light.png", "..", "%2e%2e"])
def test_other_floor_plans_are_not_served(editor, theme):
    assert editor.get(f"/api/floor/{theme}").status in (404, 422)
