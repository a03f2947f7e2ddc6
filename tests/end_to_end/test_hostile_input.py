"""Every file that a stranger can hand over, spoiled: one clear error, and nothing is harmed."""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from tests.end_to_end.conftest import Copy, GoodFiles, drawing
from tests.hostile import SPOILERS, Spoil, answer_of, assert_one_clear_error, huge


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("name", ["area_0.yaml", "area_0.png", "area_0.mat"])
def test_files_of_an_area(
    good: GoodFiles, copy: Copy, tmp_path: Path, name: str, spoil: Spoil
) -> None:
    if name == "area_0.png" and spoil is huge:
        pytest.skip("bytes after the image are not read")
    area = copy(good.area.parent)
    spoil(area / name)
    answer = answer_of(
        ["scene", "import", area / "area_0.yaml", "--out", tmp_path / "o"], tmp_path
    )
    assert_one_clear_error(answer, names=area / name)


def _bomb() -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
    return "\n".join([*lines, "origin: *a11"])


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"resolution": 0}, "resolution_m is out of range"),
        ({"resolution": -0.05}, "resolution_m is out of range"),
        ({"resolution": float("nan")}, "resolution must be a number"),
        ({"resolution": 10**400}, "resolution must be a number"),
        ({"resolution": 1e9}, "resolution_m is out of range"),
        ({"resolution": [1]}, "resolution must be a number"),
        ({"resolution": None}, "resolution must be a number"),
        ({"origin": {"x": 0}}, "origin must be"),
        ({"origin": [0, "y", 0]}, r"origin\[1\] must be a number"),
        ({"origin": [1e300, 0, 0]}, r"origin\[0\] must be a number"),
        ({"image": "../area_0.png"}, "must lie in this file's folder"),
        ({"image": "/etc/hostname"}, "must lie in this file's folder"),
        ({"image": "sub/../../x.png"}, "must lie in this file's folder"),
        ({"image": "area_0.yaml"}, "is not a whole PNG"),
        ({"image": "a\nb"}, "image must name a file"),
        ({"image": 7}, "image must name a file"),
        ({"mat_filepath": "../../secret.mat"}, "must lie in this file's folder"),
        ({"mat_filepath": "area_0.png"}, "is not a whole MATLAB 5 file"),
        ({"graph_filepath": ["x"]}, "graph_filepath must name a file"),
        ({"node_sizes": {"a": 10**400}}, "node_sizes must map"),
        ({"invalid_rooms": 5}, "invalid_rooms must be a list"),
    ],
)
def test_what_an_areas_yaml_says(
    good: GoodFiles, copy: Copy, tmp_path: Path, changes: dict[str, object], says: str
) -> None:
    path = copy(good.area.parent) / "area_0.yaml"
    settings = {**yaml.safe_load(path.read_text()), **changes}
    path.write_text(yaml.safe_dump({key: v for key, v in settings.items() if v is not None}))
    answer = answer_of(["scene", "import", path, "--out", tmp_path / "o"], tmp_path)
    assert_one_clear_error(answer, names=path.parent, says=says)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (_bomb(), "aliases such as .a0 are not read"),
        ("[" * 30_000, "more than 20 levels"),
        ("image: [1, 2", "line 1: is not yaml"),
        ("a: !!python/object/apply:os.system [id]", "line 1: is not yaml"),
        ("a: 2001-99-99", "is not yaml text"),
        ("a: !!bool maybe", "is not yaml text"),
        ("- a list", "must hold a mapping"),
        ("# " + "x" * 70_000, "at most 64,000 bytes"),
    ],
)
def test_yaml_that_is_no_map(
    good: GoodFiles, copy: Copy, tmp_path: Path, text: str, says: str
) -> None:
    path = copy(good.area.parent) / "area_0.yaml"
    path.write_text(text)
    answer = answer_of(["scene", "import", path, "--out", tmp_path / "o"], tmp_path)
    assert_one_clear_error(answer, names=path, says=says)


def _png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    rows = zlib.compress(bytes(1_000_000))
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (_png(30_000, 30_000), "at most 64,000,000 pixels"),
        (_png(2**31 - 1, 2**31 - 1), "pixels"),
        (_png(0, 0), "is not a whole PNG"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 60 40\n", "is not a whole PNG"),
    ],
)
def test_images_that_explode(
    good: GoodFiles, copy: Copy, tmp_path: Path, content: bytes, says: str
) -> None:
    area = copy(good.area.parent)
    (area / "area_0.png").write_bytes(content)
    answer = answer_of(
        ["scene", "import", area / "area_0.yaml", "--out", tmp_path / "o"], tmp_path
    )
    assert_one_clear_error(answer, names=area / "area_0.png", says=says)


def test_a_plan_of_another_size_than_its_rooms_is_refused(
    good: GoodFiles, copy: Copy, tmp_path: Path
) -> None:
    area = copy(good.area.parent)
    Image.new("L", (1, 1), 254).save(area / "area_0.png")
    answer = answer_of(
        ["scene", "import", area / "area_0.yaml", "--out", tmp_path / "o"], tmp_path
    )
    assert_one_clear_error(answer, names=area / "area_0.mat", says="must label the 1 x 1 pixels")


def test_a_plan_of_16_bits_is_read_as_one_of_8(
    good: GoodFiles, copy: Copy, tmp_path: Path
) -> None:
    area = copy(good.area.parent)
    grey = np.asarray(Image.open(area / "area_0.png").convert("L"))
    words = ["scene", "import", area / "area_0.yaml", "--json", "--out"]
    expected = json.loads(answer_of([*words, tmp_path / "a"], tmp_path).out)
    Image.fromarray(grey.astype(np.uint16) * 257).save(area / "area_0.png")
    found = json.loads(answer_of([*words, tmp_path / "b"], tmp_path).out)
    assert found["content_hash"] == expected["content_hash"]


def _matlab_bomb() -> bytes:
    packed = zlib.compress(struct.pack("<2I", 14, 1 << 30) + bytes(520_000_000), 1)
    return bytes(124) + b"\x00\x01IM" + struct.pack("<2I", 15, len(packed)) + packed


@pytest.mark.slow
def test_a_matlab_file_that_unpacks_to_half_a_gigabyte_is_refused(
    good: GoodFiles, copy: Copy, tmp_path: Path
) -> None:
    area = copy(good.area.parent)
    (area / "area_0.mat").write_bytes(_matlab_bomb())
    answer = answer_of(
        ["scene", "import", area / "area_0.yaml", "--out", tmp_path / "o"], tmp_path
    )
    assert_one_clear_error(answer, names=area / "area_0.mat", says="unpacks to too much")


@pytest.mark.parametrize("spoil", SPOILERS)
def test_files_of_maps(good: GoodFiles, copy: Copy, tmp_path: Path, spoil: Spoil) -> None:
    drawn = copy(good.area.parent) / "area_0_graph.json"
    spoil(drawn)
    target = tmp_path / "o.topo.json"
    words = ["map", "build", drawn.with_name("area_0.yaml"), "--from", "drawing", "--out", target]
    answer = answer_of(words, tmp_path)
    assert_one_clear_error(answer, names=drawn)
    written = copy(good.map)
    spoil(written)
    for words in (["plan", written, "office_1", "office_2"], ["convert", written, target]):
        assert_one_clear_error(answer_of(["map", *words], tmp_path), names=written)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: d["oval"][0].__setitem__(0, float("nan")), "finite, got NaN"),
        (lambda d: d["oval"][0].__setitem__(0, 10**30), "64 bits"),
        (lambda d: d["oval"][0].__setitem__(0, None), r"oval\[0\]: coordinates must be pixels"),
        (lambda d: d["oval"].append(d["oval"][0]), r"oval\[3\]: two nodes are tagged 'n0'"),
        (lambda d: d["text"][1][-1].update(text="lobby_1"), "node 'lobby_1' comes twice"),
        (lambda d: d["line"][0][-1].update(tags="e n0 n9"), r"line\[0\]: an edge is tagged"),
        (lambda d: d["text"][-1][-1].update(text="tx"), "the unknown behaviour 'tx'"),
        (lambda d: d["text"][0][-1].update(text="\ud800"), "lone surrogate"),
        (lambda d: d.pop("line"), "the lists oval, line and text"),
    ],
)
def test_what_a_drawing_says(
    good: GoodFiles, copy: Copy, tmp_path: Path, change: Callable[[object], object], says: str
) -> None:
    drawn = copy(good.area.parent) / "area_0_graph.json"
    document = drawing()
    change(document)
    drawn.write_text(json.dumps(document))
    answer = answer_of(["map", "check", drawn.with_name("area_0.yaml")], tmp_path)
    assert_one_clear_error(answer, names=drawn, says=says)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: p.update(start_yaw=10**400), "64 bits"),
        (lambda p: p.update(start_yaw=float("nan")), "finite, got NaN"),
        (lambda p: p.update(start_yaw="north"), "start_yaw must be an angle in radians"),
        (lambda p: p.update(start_px=[10**6, 0]), r"pair 0: start_px must be a \[row, column\]"),
        (lambda p: p.update(end_px=[1.5, 2]), r"pair 0: end_px must be a \[row, column\]"),
        (lambda p: p.update(end_px="x" * 10**5), r"pair 0: end_px must be a \[row, column\]"),
        (lambda p: p.update(start_room=5), "start_room must be a room's name"),
        (lambda p: p.update(start_room="nowhere_1"), "none of the 1 pairs has a plan"),
    ],
)
def test_what_published_pairs_say(
    good: GoodFiles, copy: Copy, tmp_path: Path, change: Callable[[object], object], says: str
) -> None:
    area = copy(good.area.parent)
    plans = area / "area_0_plans.json"
    pairs = json.loads(plans.read_text())
    change(pairs[0])
    plans.write_text(json.dumps(pairs))
    source = ["--area", area / "area_0.yaml", "--plans", plans, "--out", tmp_path / "o"]
    answer = answer_of(["eval", "graphnav", "--agent", "expert", *source], tmp_path)
    assert_one_clear_error(answer, names=plans, says=says)


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("name", ["scene.json", "arrays.npz"])
def test_files_of_a_scene(
    good: GoodFiles, copy: Copy, tmp_path: Path, name: str, spoil: Spoil
) -> None:
    scene = copy(good.building)
    spoil(scene / name)
    answer = answer_of(["scene", "show", scene, "--out", tmp_path / "o.png"], tmp_path)
    assert_one_clear_error(answer, names=scene / name)


def _npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def _zip_bomb() -> bytes:
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (56, 84), }".ljust(117) + b"\n"
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("../../evil.npy", b"")
        archive.writestr("heights_m.npy", b"\x93NUMPY\x01\x00v\x00" + header + bytes(50_000_000))
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (_npz(heights_m=np.array([{}], object)), r"heights_m must be float32\[56, 84\]"),
        (_npz(heights_m=np.zeros((56, 84))), r"got float64\[56, 84\]"),
        (_npz(heights_m=np.zeros((9, 9), np.float32)), r"got float32\[9, 9\]"),
        (_zip_bomb(), "room_index"),
        (b"\x80\x04\x95", "not a zip file"),
    ],
)
def test_arrays_of_a_scene(
    good: GoodFiles, copy: Copy, tmp_path: Path, content: bytes, says: str
) -> None:
    scene = copy(good.building)
    (scene / "arrays.npz").write_bytes(content)
    answer = answer_of(["scene", "show", scene, "--out", tmp_path / "o.png"], tmp_path)
    assert_one_clear_error(answer, names=scene / "arrays.npz", says=says)
