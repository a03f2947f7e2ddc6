import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path

import trimesh

from tests.worlds.test_materials import CHAIR_BY, scene_with, textured_mesh
from tests.worlds.test_scene import small_scene
from toponav.worlds.materials import Attribution
from toponav.worlds.scene import Scene
from toponav.worlds.web_page import scene_page

SOURCES = Path(__file__).parents[2] / "viewer"


def element(page: str, name: str) -> str:
    found = re.search(rf'<script type="[^"]+" id="{name}">(.*?)</script>', page, re.DOTALL)
    return found.group(1)


def test_page_holds_the_model_and_the_viewer_and_fetches_nothing() -> None:
    page = scene_page(small_scene())
    model = base64.b64decode(element(page, "model"), validate=True)
    mesh = trimesh.load(trimesh.util.wrap_as_stream(model), file_type="glb")
    assert "wall" in mesh.geometry
    rooms = json.loads(element(page, "facts"))["rooms"]
    assert {room["name"] for room in rooms} <= {"hallway_1", "office_1"}
    assert "@" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)

    class Links(HTMLParser):
        found: list[str] = []  # noqa: RUF012

        def handle_starttag(self, tag: str, attrs: list) -> None:
            self.found += [value for name, value in attrs if name in ("src", "href")]

    links = Links()
    links.feed(page)
    assert links.found == []


def test_page_names_whose_work_is_in_the_scene() -> None:
    page = scene_page(scene_with(textured_mesh()))
    assert f"{CHAIR_BY.work}: {CHAIR_BY.creator}, {CHAIR_BY.licence}" in page


def test_names_cannot_break_out_of_the_page() -> None:
    flat = small_scene()
    evil = "</script><script>alert(1)</script>@MODEL@"
    scene = Scene(
        evil,
        flat.grid,
        flat.heights_m,
        flat.ceiling_m,
        flat.room_index,
        flat.rooms,
        (),
        flat.semantics,
        flat.provenance,
        attribution=(Attribution(evil, evil, evil),),
    )
    page = scene_page(scene)
    assert "<script>alert" not in page
    assert json.loads(element(page, "facts"))["name"] == evil
    assert page.count(element(page, "model")) == 1


def test_bundle_is_built_from_the_sources_beside_it() -> None:
    folder = files("toponav.worlds") / "viewer"
    manifest = json.loads((folder / "manifest.json").read_text("utf-8"))
    for name, digest in manifest["built"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest, name
    assert "MIT License" in (folder / "LICENSE.three").read_text("utf-8")
    if SOURCES.is_dir():
        for name, digest in manifest["sources"].items():
            found = hashlib.sha256((SOURCES / name).read_bytes()).hexdigest()
            assert found == digest, f"{name} changed: run npm run build in viewer/"
