"""The page that ships is built from the sources that are here."""

import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SOURCES = ROOT / "editor"
BUNDLE = ROOT / "toponav" / "maps" / "editor" / "static"
REBUILD = "npm --prefix editor ci && npm --prefix editor run build"


@pytest.fixture(scope="module")
def manifest():
    return json.loads((BUNDLE / "manifest.json").read_text("utf-8"))


def hashes(folder, names):
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


def test_bundle_was_built_from_these_sources(manifest):
    present = [path for path in (SOURCES / "src").rglob("*") if path.is_file()]
    names = [path.relative_to(SOURCES).as_posix() for path in present]
    assert hashes(SOURCES, [*names, "build.mjs", "package-lock.json"]) == manifest["sources"], (
        REBUILD
    )


def test_bundle_was_not_edited_by_hand(manifest):
    names = [path.name for path in BUNDLE.iterdir() if path.name != "manifest.json"]
    assert hashes(BUNDLE, names) == manifest["bundle"], REBUILD


def test_bundle_is_small(manifest):
    assert sum((BUNDLE / name).stat().st_size for name in manifest["bundle"]) < 150_000


def test_building_again_gives_the_same_bytes(manifest, tmp_path):
    if shutil.which("node") is None or not (SOURCES / "node_modules" / "esbuild").is_dir():
        pytest.skip("needs Node and `npm --prefix editor ci`")
    command = ["node", str(SOURCES / "build.mjs"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert hashes(tmp_path, manifest["bundle"]) == manifest["bundle"]


def test_lock_file_names_no_registry_and_pins_every_package():
    lock = json.loads((SOURCES / "package-lock.json").read_text("utf-8"))
    for name, package in lock["packages"].items():
        if name:
            resolved = package.get("resolved", "https://registry.npmjs.org/")
            assert resolved.startswith("https://registry.npmjs.org/"), name
            assert package["integrity"].startswith("sha512-"), name


def test_page_loads_nothing_from_elsewhere():
    for name in ("index.html", "editor.css", "editor.js"):
        text = (BUNDLE / name).read_text("utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|//[a-z]+\.[a-z]", text), name
    html = (BUNDLE / "index.html").read_text("utf-8")
    assert not re.search(r"<script(?![^>]*\bsrc=)|\son\w+=|\sstyle=", html)


def test_scripts_write_no_html():
    for path in (SOURCES / "src").rglob("*.ts"):
        text = path.read_text("utf-8")
        assert not re.search(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(", text
        )


def test_sources_are_short():
    for path in (SOURCES / "src").rglob("*.*"):
        if path.suffix == ".ts":
            assert len(path.read_text("utf-8").splitlines()) <= 400, path.name
