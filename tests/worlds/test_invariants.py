import dataclasses

import numpy as np
import pytest

from toponav.core.vocabulary import RoomKind
from toponav.worlds.generate.home import generate_home
from toponav.worlds.generate.office import generate_office
from toponav.worlds.grid import GridFrame
from toponav.worlds.invariants import check_invariants
from toponav.worlds.scene import Door, Room, Scene, scene_from_heights


def two_rooms(gap: int = 16) -> Scene:
    """Two rooms of 2 m by 2 m with an opening of `gap` cells between them."""
    heights = np.pad(np.zeros((40, 82), np.float32), 2, constant_values=2.5)
    heights[:, 42:44] = 2.5
    index = np.full(heights.shape, -1)
    index[2:42, 2:42], index[2:42, 44:84] = 0, 1
    heights[20 : 20 + gap, 42:44] = 0
    index[20 : 20 + gap, 42:44] = 1
    segment = np.array([[2.15, 1.0], [2.15, 1.0 + 0.05 * gap]])
    return scene_from_heights(
        "pair",
        GridFrame(0.05, (0.0, 0.0), *heights.shape),
        heights,
        ceiling_m=2.5,
        room_index=index,
        rooms=[Room("left", RoomKind.STUDY), Room("right", RoomKind.KITCHEN)],
        doors=[Door("door", segment, 0.05 * gap, ("left", "right"))],
    )


def rules(scene: Scene) -> set[str]:
    return {fault.rule for fault in check_invariants(scene, views=2, rays=500)}


@pytest.fixture(scope="module")
def home() -> Scene:
    return generate_home(3, rooms=4)


def test_two_rooms_and_a_door_are_sound() -> None:
    assert rules(two_rooms()) == set()


def test_offices_are_sound() -> None:
    assert check_invariants(generate_office(3, size="small")) == []


def test_a_narrow_door_is_a_fault() -> None:
    assert "doors_clear" in rules(two_rooms(gap=12))


def test_furniture_in_a_door_is_a_fault() -> None:
    scene = two_rooms()
    heights = scene.heights_m.copy()
    heights[20:26, 42:44] = 0.5
    assert "doors_clear" in rules(dataclasses.replace(scene, heights_m=heights))


def test_a_room_behind_a_wall_is_a_fault() -> None:
    scene = two_rooms()
    heights = scene.heights_m.copy()
    heights[:, 43] = 2.5
    assert "rooms_reachable" in rules(dataclasses.replace(scene, heights_m=heights))


def test_outlines_that_overlap_are_a_fault() -> None:
    scene = two_rooms()
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
    rooms = tuple(dataclasses.replace(room, polygon_m=square) for room in scene.rooms)
    assert rules(dataclasses.replace(scene, rooms=rooms)) == {"rooms_disjoint"}


def moved(home: Scene, by_m: tuple[float, float]) -> Scene:
    """The home with all of its furniture shifted."""
    mesh = home.mesh
    loose = mesh.face_semantic > 5
    corners = mesh.vertices_m[mesh.faces].copy()
    corners[loose, :, :2] += np.array(by_m, np.float32)
    faces = np.arange(corners.shape[0] * 3, dtype=np.int32).reshape(-1, 3)
    shifted = dataclasses.replace(mesh, vertices_m=corners.reshape(-1, 3), faces=faces)
    return dataclasses.replace(home, imported_mesh=shifted)


def test_furniture_pushed_into_walls_is_a_fault(home: Scene) -> None:
    assert {"furniture_inside", "grid_matches_mesh"} <= rules(moved(home, (0.3, 0.0)))


def test_a_missing_wall_lets_rays_out(home: Scene) -> None:
    mesh = home.mesh
    keep = mesh.face_semantic != 1
    open_mesh = dataclasses.replace(
        mesh,
        faces=mesh.faces[keep],
        face_semantic=mesh.face_semantic[keep],
        face_instance=mesh.face_instance[keep],
        face_material=mesh.face_material[keep],
        corner_uv=mesh.corner_uv[keep],
    )
    assert "watertight" in rules(dataclasses.replace(home, imported_mesh=open_mesh))
