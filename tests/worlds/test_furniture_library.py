"""Furniture libraries of Sweet Home 3D."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from tests.worlds.building_files import write_sh3f
from toponav.core.errors import InputError
from toponav.worlds.furniture_library import join_libraries, load_sh3f
from toponav.worlds.furniture_names import CLASS_OF, furniture_class, semantic_of_name
from toponav.worlds.grid import SemanticClass
from toponav.worlds.load.properties import read_properties

_DEBIAN = Path("/usr/share/sweethome3d/furniture")


def test_a_library_gives_metres_classes_and_its_makers(tmp_path: Path) -> None:
    write_sh3f(tmp_path / "tiny.sh3f")
    library = load_sh3f(tmp_path / "tiny.sh3f")
    assert library.name == "Tiny"
    assert library.categories == ("bed", "chair"), "a car is no furniture"
    (chair,) = library.of("chair")
    assert chair.size_m == (0.5, 0.6, 0.9)
    assert (chair.creator, chair.licence) == ("A. Maker", "CC0")
    assert chair.attribution.source == "tiny.sh3f"


def test_a_model_stands_on_the_floor_with_its_back_at_plus_y(tmp_path: Path) -> None:
    write_sh3f(tmp_path / "tiny.sh3f")
    mesh = load_sh3f(tmp_path / "tiny.sh3f").of("chair")[0].mesh
    assert mesh.vertices_m.min(axis=0) == pytest.approx([-0.25, -0.3, 0.0], abs=1e-6)
    assert mesh.vertices_m.max(axis=0) == pytest.approx([0.25, 0.3, 0.9], abs=1e-6)
    # The back is the part with z = 0 in the file.
    assert mesh.vertices_m[mesh.vertices_m[:, 2] > 0.5][:, 1] == pytest.approx(0.3)
    (material,) = mesh.materials
    assert material.texture is not None
    assert material.texture[0, 0].tolist() == [10, 200, 10]
    assert mesh.corner_uv.max() == 1.0
    assert (mesh.face_semantic == SemanticClass.CHAIR).all()


def test_models_are_turned_as_the_catalogue_says(tmp_path: Path) -> None:
    write_sh3f(tmp_path / "a.sh3f", {"modelRotation": "0 0 1 0 1 0 -1 0 0"})
    mesh = load_sh3f(tmp_path / "a.sh3f").of("chair")[0].mesh
    tall = mesh.vertices_m[mesh.vertices_m[:, 2] > 0.5]
    assert tall[:, 0] == pytest.approx(-0.25), "what was at the back is at the left now"


def test_heavy_models_are_simplified_and_held_out_ones_are_one_in_five(tmp_path: Path) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(5).export(file_type="obj").encode()
    write_sh3f(
        tmp_path / "a.sh3f", **{"models/ball.obj": ball}, entries={"model": "/models/ball.obj"}
    )
    (chair,) = load_sh3f(tmp_path / "a.sh3f", max_faces=500).of("chair")
    assert len(chair.mesh.faces) <= 500
    assert np.ptp(chair.mesh.vertices_m, axis=0) == pytest.approx((0.5, 0.6, 0.9), rel=0.1)
    library = load_sh3f(tmp_path / "a.sh3f")
    for model in library.models:
        held = library.of(model.category, held_out=True)
        assert (model in held) == model.is_held_out
        assert model in (*held, *library.of(model.category, held_out=False))


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"width": "-4"}, "must lie in"),
        ({"width": "wide"}, "must be a number"),
        ({"height": "nan"}, "must be a number"),
        ({"depth": "1e9"}, "must be a number"),
        ({"modelRotation": "1 0 0"}, "nine numbers"),
        ({"modelRotation": "0 0 0 0 0 0 0 0 0"}, "not flatten"),
        ({"model": "/models/gone.obj"}, "holds no file"),
        ({"model": "../../etc/passwd.obj"}, "must lie inside"),
        ({"model": "/models/empty.obj"}, "no triangles"),
    ],
)
def test_a_broken_catalogue_is_one_clear_error(
    tmp_path: Path, entries: dict[str, str], says: str
) -> None:
    path = tmp_path / "a.sh3f"
    write_sh3f(path, entries, **{"models/empty.obj": b"# nothing"})
    with pytest.raises(InputError, match=says):
        [model.mesh for model in load_sh3f(path).models]


def test_a_missing_texture_is_left_out_and_the_model_stays(tmp_path: Path) -> None:
    mtl = b"newmtl seat\nKd 1 0 0\nmap_Kd C:\\Users\\me\\gone.png\n"
    write_sh3f(tmp_path / "a.sh3f", **{"models/chair.mtl": mtl})
    (material,) = load_sh3f(tmp_path / "a.sh3f").of("chair")[0].mesh.materials
    assert material.texture is None
    assert material.color == pytest.approx((1, 0, 0))


def test_zip_bombs_and_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.sh3f"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("PluginFurnitureCatalog.properties", b" " * 30_000_000)
    with pytest.raises(InputError, match="bytes are read"):
        load_sh3f(path)
    path.write_bytes(b"PK\x03\x04 no zip")
    with pytest.raises(InputError, match="not a whole zip"):
        load_sh3f(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("something", b"else")
    with pytest.raises(InputError, match="must hold PluginFurnitureCatalog"):
        load_sh3f(path)


def test_libraries_join_and_unknown_classes_are_named(tmp_path: Path) -> None:
    write_sh3f(tmp_path / "a.sh3f")
    library = load_sh3f(tmp_path / "a.sh3f")
    assert len(join_libraries([library, library]).models) == len(library.models)
    with pytest.raises(InputError, match="did you mean 'chair'"):
        library.of("chairs")


def test_names_tell_classes() -> None:
    expected = {
        "Glass coffee table": "coffee_table",
        "aws_robomaker_residential_NightStand_01": "nightstand",
        "TVCabinet_01": "tv_stand",
        "DeskPortraitA_01": "picture",
        "Corner sofa": "sofa",
        "Upper cabinet": "upper_cabinet",
        "washing machine": "washing_machine",
        "Sedan": None,
    }
    assert {name: furniture_class(name) for name in expected} == expected
    assert len(CLASS_OF) >= 45
    assert semantic_of_name("HouseWallB_01") == SemanticClass.WALL
    assert semantic_of_name("Wall lamp") == SemanticClass.CLUTTER
    assert semantic_of_name("FloorB_01") == SemanticClass.FLOOR


def test_properties_are_read_as_java_does() -> None:
    text = b"# no\na=1\n  b : two words \\\n   and more\nc\\:d=\\u00e9\\t!\n! no\nempty=\nalone\n"
    assert read_properties(text, "x") == {
        "a": "1",
        "b": "two words and more",
        "c:d": "é\t!",
        "empty": "",
        "alone": "",
    }


def test_the_libraries_of_debian_are_read() -> None:
    paths = sorted(_DEBIAN.glob("*.sh3f"))
    if not paths:
        pytest.skip(f"no libraries at {_DEBIAN}; apt-get install sweethome3d-furniture")
    library = join_libraries([load_sh3f(path) for path in paths])
    assert len(library.models) > 400
    assert {"bed", "sofa", "chair", "desk", "toilet", "refrigerator"} <= set(library.categories)
    for category in ("bed", "toilet"):
        model = library.of(category)[0]
        assert 0 < len(model.mesh.faces) <= 3000
        assert np.ptp(model.mesh.vertices_m, axis=0) == pytest.approx(model.size_m, rel=0.1)
