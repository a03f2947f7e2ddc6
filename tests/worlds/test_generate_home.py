import numpy as np
import pytest

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.furniture_library import FurnitureLibrary, FurnitureModel
from toponav.worlds.generate.home import HELD_OUT_SEEDS, generate_home, home_models
from toponav.worlds.generate.pieces import CLASSES, parametric_model
from toponav.worlds.generate.surfaces import SURFACE_KINDS, is_held_out, surface, variants
from toponav.worlds.grid import SemanticClass
from toponav.worlds.invariants import check_invariants
from toponav.worlds.mesh import SceneMesh
from toponav.worlds.scene import Scene
from toponav.worlds.storage import load_scene, save_scene


@pytest.fixture(scope="module")
def homes() -> list[Scene]:
    return [generate_home(0, rooms=2), generate_home(3, rooms=4), generate_home(8, rooms=6)]


def test_the_same_seed_makes_the_same_bytes(homes: list[Scene]) -> None:
    assert generate_home(3, rooms=4).content_hash == homes[1].content_hash


def test_seeds_make_different_homes(homes: list[Scene]) -> None:
    assert generate_home(4, rooms=4).content_hash != homes[1].content_hash


def test_homes_are_sound(homes: list[Scene]) -> None:
    assert {home.name: check_invariants(home) for home in homes} == {
        home.name: [] for home in homes
    }


@pytest.mark.slow
@pytest.mark.parametrize("seed", [100, 1000, 2000])
def test_homes_of_any_size_are_sound(seed: int) -> None:
    assert check_invariants(generate_home(seed)) == []


def test_a_home_has_as_many_rooms_as_asked_for(homes: list[Scene]) -> None:
    assert [len(home.rooms) for home in homes] == [2, 4, 6]


def test_a_home_has_the_rooms_that_people_need(homes: list[Scene]) -> None:
    for home in homes[1:]:
        kinds = {room.kind for room in home.rooms}
        assert {RoomKind.KITCHEN, RoomKind.BEDROOM, RoomKind.BATHROOM} <= kinds
    assert RoomKind.HALLWAY in {room.kind for room in homes[2].rooms}


def test_doors_join_rooms_that_exist(homes: list[Scene]) -> None:
    for home in homes:
        names = {room.name for room in home.rooms}
        for door in home.doors:
            assert set(door.rooms) <= names
            assert home.room_at(*door.segment_m.mean(axis=0)) in door.rooms
            assert door.width_m >= 0.7


def test_large_homes_hold_goals_ten_metres_away(homes: list[Scene]) -> None:
    home = homes[2]
    space = FreeSpace.of(home, 0.18)
    cells = np.argwhere(space.component == 1)
    farthest = 0.0
    for row, col in cells[:: len(cells) // 6].tolist():
        away_m = space.geodesic_from_cells_m(np.array([[row, col]], np.int32))
        farthest = max(farthest, float(away_m[np.isfinite(away_m)].max()))
    assert farthest >= 10.0


def test_rooms_look_unlike_each_other(homes: list[Scene]) -> None:
    """Tiles lie in bathrooms and not in bedrooms: the floors' materials differ."""
    mesh = homes[2].mesh
    floor = mesh.face_semantic == SemanticClass.FLOOR
    names = {mesh.materials[number].name for number in np.unique(mesh.face_material[floor])}
    assert any(name.startswith("floor_tiles/") for name in names)
    assert any(name.startswith(("planks/", "parquet/", "carpet/")) for name in names)


def test_there_are_more_than_45_furniture_classes_and_homes_use_them() -> None:
    assert len(CLASSES) >= 45
    used = {name for name, _ in home_models(8, rooms=6).values()}
    assert {"bed", "nightstand", "toilet", "washbasin", "sink", "sofa"} <= used
    assert len(used) >= 25


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_models_stand_before_their_back(name: str) -> None:
    shape = parametric_model(name, 0)
    points = shape.corners_m.reshape(-1, 3)
    assert np.isfinite(points).all()
    assert points[:, 1].min() == pytest.approx(0.0, abs=1e-9)
    assert points[:, 0].min() == pytest.approx(-points[:, 0].max())
    assert max(shape.size_m) <= 2.7
    assert set(shape.slots) <= {*SURFACE_KINDS, "front"}


def test_surfaces_are_the_same_every_time() -> None:
    first = surface("wood", 3).material.texture
    surface.cache_clear()
    assert first is not None
    assert np.array_equal(first, surface("wood", 3).material.texture)


@pytest.mark.parametrize("kind", [*SURFACE_KINDS, *CLASSES])
def test_every_kind_has_variants_for_training_and_for_tests(kind: str) -> None:
    kept, used = variants(kind, True), variants(kind, False)
    assert len(kept) >= 2
    assert len(used) >= 10
    assert set(kept).isdisjoint(used)


def test_test_homes_share_no_model_and_no_surface_with_training_homes() -> None:
    train, test = home_models(1, rooms=2), home_models(HELD_OUT_SEEDS[0], rooms=2)
    assert not any(is_held_out(model) for _, model in train.values())
    assert all(is_held_out(model) for _, model in test.values())
    scene = generate_home(HELD_OUT_SEEDS[0], rooms=2)
    assert all(is_held_out(material.name) for material in scene.mesh.materials)


def _library(identity: str) -> FurnitureLibrary:
    """A library with one wardrobe: a box with its back at +y."""
    shape = parametric_model("wardrobe", 0)
    vertices = (shape.corners_m * [-1, -1, 1]).reshape(-1, 3).astype(np.float32)
    count = len(shape.corners_m)
    mesh = SceneMesh(
        vertices,
        np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        np.full(count, 12, np.uint8),
        np.zeros(count, np.int32),
    )
    model = FurnitureModel(
        identity, "Wardrobe", "wardrobe", shape.size_m, "A. Author", "CC0", load=lambda: mesh
    )
    return FurnitureLibrary("test", (model,))


def test_models_of_a_library_are_used_and_credited() -> None:
    identity = next(f"w{n}" for n in range(50) if not _library(f"w{n}").models[0].is_held_out)
    library = _library(identity)
    found = [generate_home(seed, rooms=4, furniture=library) for seed in (3, 5)]
    credited = [scene for scene in found if scene.attribution]
    assert credited
    assert credited[0].attribution[0].creator == "A. Author"
    assert all(check_invariants(scene) == [] for scene in credited)


def test_a_saved_home_is_the_same_home(homes: list[Scene], tmp_path) -> None:
    save_scene(homes[0], tmp_path / "home")
    assert load_scene(tmp_path / "home").content_hash == homes[0].content_hash


@pytest.mark.parametrize("rooms", [1, 10])
def test_homes_too_small_or_too_large_are_refused(rooms: int) -> None:
    with pytest.raises(InputError, match="a home has 2 to 9 rooms"):
        generate_home(1, rooms=rooms)


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(InputError, match="seed must be 0 or more"):
        generate_home(-1)


def test_a_window_as_wide_as_its_stretch_of_wall_is_no_fault() -> None:
    assert check_invariants(generate_home(3160), views=2, rays=500) == []
