"""Spoiled buildings: one clear error or a stated repair, in bounded time and memory."""

import json
import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.hostile import Damage, answer_of, assert_one_clear_error, damaged, damages
from tests.worlds.building_files import (
    BOXES,
    dae_text,
    glb_with_accessor,
    home_xml,
    obj_text,
    one_mesh,
    sdf_text,
    write_glb,
    write_sh3d,
    write_sh3f,
)
from toponav.core.errors import InputError
from toponav.core.xml_tree import parse_xml
from toponav.worlds.furniture_library import load_sh3f
from toponav.worlds.load.importer import import_building
from toponav.worlds.load.mesh_parts import MeshPart, Notes, clean_part
from toponav.worlds.load.source_files import FolderFiles, beside


def test_corners_that_are_nowhere_are_left_out_and_said_so(tmp_path: Path) -> None:
    lines = obj_text().splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("v "))
    lines[at] = "v nan inf 1e999"
    lines += ["f 1 2 99999", "f 0 0 0", "v 1e9 0 0"]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    found = import_building(tmp_path / "a.obj")
    assert len(found.scene.rooms) == 2
    assert np.isfinite(found.scene.mesh.vertices_m).all()
    assert any("not finite" in note for note in found.notes)
    assert any("without a corner" in note for note in found.notes)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.obj", b"", "no floor|holds no triangles"),
        ("a.obj", b"v 1 2 3\nv 2 3 4\n", "holds no triangles"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 99999999999\nend_header\n", "must hold"),
        ("a.ply", b"ply\nno header", "PLY"),
        ("a.stl", b"", "holds no triangles|STL"),
        ("a.stl", b"x" * 80 + struct.pack("<I", 4_000_000_000), "at most|STL"),
        ("a.glb", glb_with_accessor(2_000_000_000), "accessor"),
        ("a.glb", b"glTF\x02\x00\x00\x00", "header is cut"),
        ("a.gltf", b'{"asset": {"version": "1.0"}}', "glTF 2.0"),
        ("a.dae", b"<COLLADA/>", "holds no triangles|no floor"),
        ("a.dae", dae_text(head='<!DOCTYPE x [<!ENTITY a "b">]>').encode(), "is not read"),
        ("a.xyz", b"what", "no building that can be read"),
    ],
)
def test_broken_meshes_are_one_clear_error(
    tmp_path: Path, name: str, content: bytes, says: str
) -> None:
    (tmp_path / name).write_bytes(content)
    answer = answer_of(["scene", "import", tmp_path / name, "--out", tmp_path / "out"], tmp_path)
    assert_one_clear_error(answer, says=says)


def test_materials_and_textures_of_other_folders_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret.mtl"
    secret.write_text("newmtl part_0\nKd 1 0 0\n")
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "link.mtl").symlink_to(secret)
    for reference in ("../secret.mtl", str(secret), "link.mtl", "..\\secret.mtl"):
        text = f"mtllib {reference}\nusemtl part_0\n" + obj_text()
        (folder / "a.obj").write_text(text)
        found = import_building(folder / "a.obj")
        assert any("left out" in note for note in found.notes), reference
        assert all(one.color != (1.0, 0.0, 0.0) for one in found.scene.mesh.materials)


def test_gltf_buffers_of_other_folders_are_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": "../secret.bin", "byteLength": 36}],
    }
    (folder / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(InputError, match="must lie inside"):
        import_building(folder / "a.gltf")


def test_names_stay_inside_their_folder(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "In.txt").write_bytes(b"in")
    (tmp_path / "out.txt").write_bytes(b"out")
    files = FolderFiles(tmp_path / "a")
    assert files.read("in.TXT", max_bytes=9) == b"in", "models often come from Windows"
    for name in ("../out.txt", "/etc/passwd", "x/../../out.txt", "", "..", "c:/x", "a\0b"):
        with pytest.raises(InputError):
            files.read(name, max_bytes=99)
    assert beside("a/b.dae", "../../../x.png") == "../../x.png"


def test_xml_is_bounded() -> None:
    with pytest.raises(InputError, match="inside one another"):
        parse_xml(b"<a>" * 500, "x")
    with pytest.raises(InputError, match="more than 10 elements"):
        parse_xml(b"<a>" + b"<b/>" * 20 + b"</a>", "x", max_elements=10)


def test_a_texture_of_too_many_pixels_is_left_out(tmp_path: Path) -> None:
    import zlib

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    picture = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b""))
    write_sh3f(tmp_path / "a.sh3f", **{"models/seat.png": picture})
    tracemalloc.start()
    (material,) = load_sh3f(tmp_path / "a.sh3f").of("chair")[0].mesh.materials
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert material.texture is None
    assert most < 100e6


def test_a_million_triangles_are_simplified_and_it_is_said(tmp_path: Path) -> None:
    from toponav.worlds.load.mesh_scene import MeshOptions, scene_of_parts
    from toponav.worlds.scene import Provenance

    # A fine floor of 500 x 500 quadrilaterals and the walls of the two rooms.
    side = 501
    x, y = np.meshgrid(np.linspace(0, 8, side), np.linspace(0, 4, side))
    fine = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1).astype(np.float32)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + side], axis=1),
            np.stack([corner + 1, corner + side + 1, corner + side], axis=1),
        ]
    ).astype(np.int32)
    rest = one_mesh()
    parts = [
        MeshPart("fine", fine, faces),
        MeshPart("rest", np.asarray(rest.vertices, np.float32), np.asarray(rest.faces, np.int32)),
    ]
    notes = Notes()
    scene = scene_of_parts(
        parts,
        name="fine",
        provenance=Provenance("mesh"),
        where="x",
        notes=notes,
        options=MeshOptions(max_faces=50_000),
    )
    assert len(scene.mesh.faces) <= 50_000
    assert len(scene.rooms) == 2
    assert any("simplified" in note for note in notes.lines)


def test_nothing_is_written_outside_the_out_folder(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(obj_text())
    answer = answer_of(["scene", "import", tmp_path / "a.obj", "--out", tmp_path / "o"], tmp_path)
    assert answer.status == 0, answer.err
    assert {name.split("/")[0] for name in answer.changed} == {"o"}
    assert "which way is up: z" in answer.out


def test_what_was_found_is_printed_as_json(tmp_path: Path) -> None:
    write_sh3d(tmp_path / "a.sh3d")
    answer = answer_of(
        ["scene", "import", tmp_path / "a.sh3d", "--out", tmp_path / "o", "--json"], tmp_path
    )
    said = json.loads(answer.out)
    assert said["read as"] == "Sweet Home 3D home"
    assert said["rooms"] == {"bedroom": 1, "kitchen": 1}
    assert said["doors"] == 1


def test_labelled_scans_give_their_rooms(tmp_path: Path) -> None:
    names = {
        name: f"{name.split('_')[0]}_{number}_office_1_3" for number, name in enumerate(BOXES)
    }
    text = obj_text(names, as_materials=True)
    (tmp_path / "semantic.obj").write_text("mtllib semantic.mtl\n" + text)
    (tmp_path / "semantic.mtl").write_text("")
    found = import_building(tmp_path / "semantic.obj")
    assert found.kind == "2D-3D-S semantic mesh"
    assert [room.name for room in found.scene.rooms] == ["office_1"]
    objects = import_building(_as_objects(tmp_path, obj_text(names)))
    assert [room.name for room in objects.scene.rooms] == ["office_1"]


def _as_objects(folder: Path, text: str) -> Path:
    (folder / "objects.obj").write_text(text)
    return folder / "objects.obj"


def _glb(path: Path) -> None:
    write_glb(path)


def _fault_of(read: Callable[[], object]) -> str:
    """What an importer says against a file; empty where it reads it."""
    try:
        read()
    except InputError as error:
        return str(error)
    return ""


_WRITERS: dict[str, Callable[[Path], object]] = {
    "a.obj": lambda path: path.write_text(obj_text()),
    "a.ply": lambda path: one_mesh().export(path),
    "a.stl": lambda path: one_mesh().export(path),
    "a.glb": _glb,
    "a.dae": lambda path: path.write_text(dae_text()),
    "a.sdf": lambda path: path.write_text(sdf_text()),
    "a.sh3d": write_sh3d,
}


@pytest.mark.parametrize("name", list(_WRITERS))
@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(what=damages())
def test_damaged_files_are_read_or_refused(tmp_path: Path, name: str, what: list[Damage]) -> None:
    whole = tmp_path / f"whole_{name}"
    if not whole.exists():
        _WRITERS[name](whole)
    spoiled = tmp_path / name
    spoiled.write_bytes(damaged(whole.read_bytes(), what))
    message = _fault_of(lambda: import_building(spoiled))
    assert len(message) < 1500
    assert message.isprintable()


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(what=damages())
def test_damaged_drawings_of_homes_are_read_or_refused(tmp_path: Path, what: list[Damage]) -> None:
    text = damaged(home_xml().encode(), what).decode("latin-1")
    write_sh3d(tmp_path / "a.sh3d", text)
    assert _fault_of(lambda: import_building(tmp_path / "a.sh3d")).isprintable()


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(what=damages())
def test_damaged_libraries_are_read_or_refused(tmp_path: Path, what: list[Damage]) -> None:
    write_sh3f(tmp_path / "whole.sh3f")
    (tmp_path / "a.sh3f").write_bytes(damaged((tmp_path / "whole.sh3f").read_bytes(), what))
    path = tmp_path / "a.sh3f"
    assert _fault_of(lambda: [model.mesh for model in load_sh3f(path).models]).isprintable()


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-3, 12)] * 3), max_size=6),
    st.lists(st.tuples(*[st.floats(width=32)] * 3), max_size=8),
)
def test_cleaned_parts_hold_finite_corners_alone(
    faces: list[tuple[int, int, int]], vertices: list[tuple[float, float, float]]
) -> None:
    part = clean_part(
        MeshPart(
            "x",
            np.array(vertices, np.float32).reshape(-1, 3),
            np.array(faces, np.int32).reshape(-1, 3),
        ),
        Notes(),
    )
    assert np.isfinite(part.vertices).all()
    assert ((part.faces >= 0) & (part.faces < max(len(part.vertices), 1))).all()


def test_archives_that_explode_are_refused_in_little_memory(tmp_path: Path) -> None:
    write_sh3d(tmp_path / "a.sh3d", home_xml() + " " * 60_000_000)
    write_sh3f(tmp_path / "a.sh3f", **{"models/chair.obj": b"#" * 60_000_000})
    models = load_sh3f(tmp_path / "a.sh3f").models
    tracemalloc.start()
    with pytest.raises(InputError, match="bytes are read"):
        import_building(tmp_path / "a.sh3d")
    with pytest.raises(InputError, match="bytes are read"):
        [model.mesh for model in models]
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 30e6


def test_names_in_archives_lead_nowhere_else(tmp_path: Path) -> None:
    write_sh3d(tmp_path / "a.sh3d", **{"../../evil.txt": b"evil", "/evil.txt": b"evil"})
    answer = answer_of(["scene", "import", tmp_path / "a.sh3d", "--out", tmp_path / "o"], tmp_path)
    assert answer.status in (0, 1)
    assert {name.split("/")[0] for name in answer.changed} <= {"o"}
    assert not (tmp_path.parent / "evil.txt").exists()


def test_more_triangles_than_a_scene_may_have_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from toponav.worlds.load import mesh_parts

    monkeypatch.setattr(mesh_parts, "MAX_FACES", 20)
    (tmp_path / "a.obj").write_text(obj_text())
    with pytest.raises(InputError, match="more than 20 triangles"):
        import_building(tmp_path / "a.obj")
