import json
import math

import numpy as np
import pytest
import yaml
from PIL import Image
from scipy.io import savemat

from toponav.core.errors import InputError
from toponav.core.vocabulary import RoomKind
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.load.importer import import_building
from toponav.worlds.load.obstacle_heights import raise_obstacles
from toponav.worlds.load.ros_map import read_ros_map
from toponav.worlds.load.stanford import AreaFiles, load_area, load_pairs
from toponav.worlds.scene import SemanticClass

AREAS = ("1", "3", "5b", "6")
SHAPE = (40, 60)


def write_area(folder, **changes):
    """A building of two rooms, as the authors would have published it."""
    solid = np.zeros(SHAPE, bool)
    solid[5:35, 5:55] = True
    solid[6:34, 6:30] = solid[6:34, 31:54] = False
    solid[18:24, 30] = False
    solid[10:12, 10:13] = True
    labels = np.zeros(SHAPE, np.uint8)
    labels[6:34, 6:30], labels[6:34, 30:54] = 4, 9
    pixels = np.where(solid, 0, 254).astype(np.uint8)
    Image.fromarray(pixels).save(folder / "area_0.png")
    rooms = np.zeros(2, [("name", object), ("id", object)])
    rooms[:] = [("lobby_1", 4), ("conferenceRoom_1", 9)]
    data = {"semantic_map": labels, "rooms": rooms, **changes.pop("mat", {})}
    savemat(folder / "area_0.mat", {"area_data": data})
    settings = {
        "image": "area_0.png",
        "resolution": 0.1,
        "origin": [-1.0, -2.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
        "mat_filepath": "area_0.mat",
        "graph_filepath": "area_0_graph.json",
        "node_sizes": {"lobby_1": 0.7},
        "invalid_rooms": ["lobby_1"],
        **changes,
    }
    path = folder / "area_0.yaml"
    path.write_text(yaml.safe_dump({k: v for k, v in settings.items() if v is not None}))
    pair = {"start_room": "lobby_1", "end_room": "conferenceRoom_1"}
    pair |= {"start_px": [30, 8], "end_px": [8, 50], "start_yaw": 1.5 * math.pi}
    (folder / "area_0_plans.json").write_text(json.dumps([pair]))
    return path


def test_area_lies_in_the_map_frame_with_its_rooms_named(tmp_path):
    scene = load_area(write_area(tmp_path))
    assert scene.name == "area_0"
    assert scene.grid.origin_m == (-1.0, -2.0)
    assert [(room.name, room.kind) for room in scene.rooms] == [
        ("lobby_1", RoomKind.HALLWAY),
        ("conferenceRoom_1", RoomKind.CONFERENCE_ROOM),
    ]
    # Image row 8 is row 31 from below; the box at image rows 10-11 is at rows 28-29.
    assert scene.room_at(*scene.grid.center_of(31, 50)) == "conferenceRoom_1"
    assert scene.room_at(*scene.grid.center_of(2, 2)) is None
    assert 0 < scene.heights_m[28, 10] < scene.ceiling_m
    assert scene.heights_m[5, 5] == np.float32(scene.ceiling_m)
    assert scene.occupied.sum() == 30 * 50 - 28 * 24 - 28 * 23 - 6 + 6
    assert 2.6 <= scene.ceiling_m <= 3.0
    assert scene.provenance.source == "area_0.yaml"


def test_seed_decides_the_furniture_and_nothing_else(tmp_path):
    path = write_area(tmp_path)
    first, again, other = load_area(path, 0), load_area(path, 0), load_area(path, 1)
    assert first.content_hash == again.content_hash != other.content_hash
    np.testing.assert_array_equal(first.occupied, other.occupied)


def test_files_of_an_area_are_those_its_yaml_names(tmp_path):
    files = AreaFiles.read(write_area(tmp_path))
    assert files.name == "area_0"
    assert files.graph == tmp_path / "area_0_graph.json"
    assert files.plans == tmp_path / "area_0_plans.json"
    assert files.node_sizes == {"lobby_1": 0.7}
    assert files.invalid_rooms == ("lobby_1",)


def test_pairs_come_in_the_map_frame(tmp_path):
    write_area(tmp_path)
    (pair,) = load_pairs(tmp_path / "area_0_plans.json")
    assert pair.start_pose == pytest.approx((-1.0 + 0.85, -2.0 + 0.95, -math.pi / 2))
    assert pair.end_xy == pytest.approx((-1.0 + 5.05, -2.0 + 3.15))


def test_plain_ros_map_is_a_scene_without_rooms(tmp_path):
    scene = load_area(write_area(tmp_path, mat_filepath=None))
    assert scene.rooms == ()
    assert scene.room_index.max() == -1


def test_negated_map_reads_white_as_solid(tmp_path):
    path = write_area(tmp_path)
    plain = read_ros_map(path).occupied
    negated = read_ros_map(write_area(tmp_path, negate=1)).occupied
    np.testing.assert_array_equal(plain, ~negated)


def test_raw_maps_hold_percents(tmp_path):
    path = write_area(tmp_path, mode="raw")
    pixels = np.zeros(SHAPE, np.uint8)
    pixels[-1, :4] = 10, 25, 100, 255
    Image.fromarray(pixels).save(tmp_path / "area_0.png")
    assert read_ros_map(path).occupied[0, :5].tolist() == [False, True, True, True, False]


def test_an_imported_ros_map_has_rooms_and_doors(tmp_path):
    pixels = np.zeros((84, 164), np.uint8)
    pixels[2:82, 2:80] = pixels[2:82, 82:162] = 254
    pixels[30:48, 80:82] = 254
    Image.fromarray(pixels).save(tmp_path / "a.png")
    text = "image: a.png\nresolution: 0.05\norigin: [-1, -2, 0]\n"
    (tmp_path / "a.yaml").write_text(text)
    scene = import_building(tmp_path / "a.yaml").scene
    assert len(scene.rooms) == 2
    (door,) = scene.doors
    assert door.width_m == pytest.approx(0.9, abs=0.08)
    assert door.segment_m.mean(axis=0) == pytest.approx((-1 + 4.05, -2 + 4.2 - 1.95), abs=0.12)


def test_what_nobody_saw_free_is_solid(tmp_path):
    path = write_area(tmp_path)
    pixels = np.full(SHAPE, 254, np.uint8)
    pixels[0, 0], pixels[0, 1] = 205, 206
    Image.fromarray(pixels).save(tmp_path / "area_0.png")
    assert np.argwhere(read_ros_map(path).occupied).tolist() == [[SHAPE[0] - 1, 0]]


def test_pieces_get_heights_of_what_they_probably_are():
    rng = np.random.default_rng(0)
    solid = np.zeros((120, 120), bool)
    solid[20, 20:100] = solid[100, 20:100] = solid[20:101, 20] = solid[20:101, 100] = True
    solid[60, 21:100] = True
    solid[60, 50:68] = False  # a doorway between two rooms
    solid[61:77, 66] = True  # a door leaf, ajar at the wall
    solid[61, 66] = False
    solid[40, 40:44] = True  # a chair's worth
    solid[21:31, 80:96] = True  # a cupboard against the wall
    solid[60, 58] = True  # a crumb in the doorway
    room_index = np.full(solid.shape, -1, np.int16)
    room_index[21:60, 21:100], room_index[60:100, 21:100] = 0, 1
    found = raise_obstacles(solid, room_index, 0.05, 2.7, rng)
    np.testing.assert_array_equal(found.heights_m > 0, solid)
    np.testing.assert_array_equal(found.semantics > 0, solid)
    assert found.semantics[20, 50] == SemanticClass.WALL
    assert found.heights_m[20, 50] == np.float32(2.7)
    assert found.semantics[60, 58] == SemanticClass.WALL, "it stands between two rooms"
    assert found.semantics[70, 66] == SemanticClass.DOOR
    assert found.semantics[40, 41] in (SemanticClass.CHAIR, SemanticClass.CLUTTER)
    assert 0.4 <= found.heights_m[40, 41] <= 1.0
    assert found.semantics[25, 90] in (SemanticClass.BOOKCASE, SemanticClass.FURNITURE)
    assert 0.9 <= found.heights_m[25, 90] <= 2.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"resolution": "fine"}, "resolution must be a number"),
        ({"resolution": float("nan")}, "resolution must be a number"),
        ({"resolution": -0.05}, "resolution_m is out of range"),
        ({"origin": [1]}, "origin must be"),
        ({"origin": [0.0, 0.0, 0.5]}, "turned map is not supported"),
        ({"free_thresh": 0.9, "occupied_thresh": 0.2}, "free_thresh <= occupied_thresh"),
        ({"free_thresh": 70}, "free_thresh <= occupied_thresh"),
        ({"negate": "no"}, "negate must be 0 or 1"),
        ({"mode": "fancy"}, "mode must be trinary, scale or raw"),
        ({"width": 7}, "width says 7, but the image has 60 pixels"),
        ({"image": None}, "image must name a file"),
        ({"image": "none.png"}, r"none\.png: no such image"),
        ({"mat_filepath": "none.mat"}, r"none\.mat: cannot be read: no such file"),
        ({"mat_filepath": 7}, "mat_filepath must name a file"),
        ({"node_sizes": {"a": -1}}, "node_sizes must map"),
        ({"invalid_rooms": "lobby_1"}, "invalid_rooms must be a list"),
        ({"mat": {"semantic_map": np.zeros((3, 3))}}, "must label the 40 x 60 pixels"),
        ({"mat": {"semantic_map": np.full(SHAPE, 5)}}, "row 0 column 0: label 5 is the id of no"),
        ({"mat": {"rooms": np.zeros(0)}}, "is the id of no room"),
        ({"mat": {"rooms": np.ones(3)}}, "a room has a name and an id"),
    ],
)
def test_broken_area_is_one_clear_error(changes, message, tmp_path):
    path = write_area(tmp_path, **changes)
    with pytest.raises(InputError, match=message) as caught:
        load_area(path)
    assert str(tmp_path) in str(caught.value)


def test_room_of_unknown_kind_offers_the_nearest(tmp_path):
    rooms = np.zeros(1, [("name", object), ("id", object)])
    rooms[0] = ("hallwy_1", 1)
    path = write_area(tmp_path, mat={"rooms": rooms, "semantic_map": np.ones(SHAPE)})
    with pytest.raises(InputError, match="did you mean 'hallway'"):
        load_area(path)


@pytest.mark.parametrize("name", ["area_0.yaml", "area_0.png", "area_0.mat"])
@pytest.mark.parametrize("content", [b"", b"\x00\xff not this", b"[" * 5000, "cut"])
def test_bytes_that_are_no_map_are_named(name, content, tmp_path):
    path = write_area(tmp_path)
    broken = tmp_path / name
    whole = broken.read_bytes()
    broken.write_bytes(whole[: len(whole) // 2] if content == "cut" else content)
    with pytest.raises(InputError, match=r"area_0\.(yaml|png|mat)"):
        load_area(path)


def test_yaml_error_names_the_line(tmp_path):
    path = write_area(tmp_path)
    path.write_text("image: a.png\nresolution: [0.05\norigin: 3\n")
    with pytest.raises(InputError, match="line 3"):
        load_area(path)
    with pytest.raises(InputError, match="no such file"):
        load_area(tmp_path / "area_9.yaml")


def test_huge_image_is_refused_before_it_is_unpacked(tmp_path):
    path = write_area(tmp_path)
    Image.new("1", (12_000, 12_000)).save(tmp_path / "area_0.png")
    with pytest.raises(InputError, match="at most 64,000,000 pixels"):
        load_area(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start_px": [40, 8]}, r"pair 0: start_px must be a \[row, column\] in 40 x 60"),
        ({"end_px": [1.5, 8]}, "end_px must be"),
        ({"start_yaw": None}, "start_yaw must be an angle"),
        ({"end_room": 3}, "end_room must be a room's name"),
    ],
)
def test_broken_pair_is_named(change, message, tmp_path):
    write_area(tmp_path)
    path = tmp_path / "area_0_plans.json"
    pairs = json.loads(path.read_text())
    pairs[0] |= change
    path.write_text(json.dumps(pairs))
    with pytest.raises(InputError, match=message):
        load_pairs(path)
    path.write_text('[{"start_room": ')
    with pytest.raises(InputError, match=r"not JSON: .* line 1"):
        load_pairs(path)


@pytest.mark.parametrize("area", AREAS)
def test_published_pairs_start_and_end_in_their_rooms_and_can_be_driven(areas_dir, area):
    scene = load_area(areas_dir / f"area_{area}.yaml")
    pairs = load_pairs(areas_dir / f"area_{area}_plans.json")
    assert len(pairs) == 100
    space = FreeSpace.of(scene, 0.18)
    apart = 0
    for pair in pairs:
        start_xy = pair.start_pose.x_m, pair.start_pose.y_m
        assert scene.room_at(*start_xy) == pair.start_room
        assert scene.room_at(*pair.end_xy) == pair.end_room
        start, end = space.nearest_free(*start_xy), space.nearest_free(*pair.end_xy)
        apart += space.component[start] != space.component[end]
    assert apart <= 1


def test_area_3_extrudes_to_few_triangles(areas_dir):
    scene = load_area(areas_dir / "area_3.yaml")
    assert len(scene.mesh.faces) < 15_000
    assert scene.room_at(*scene.grid.center_of(300, 520)) is not None
    assert {room.name for room in scene.rooms} >= {"office_4", "hallway_4", "WC_2", "lounge_1"}
    assert scene.provenance.seed == 0


def test_free_space_of_area_3_stays_indoors(areas_dir):
    scene = load_area(areas_dir / "area_3.yaml")
    space = FreeSpace.of(scene, 0.18)
    near_a_room = np.zeros(scene.grid.shape, bool)
    rows, cols = np.nonzero(scene.room_index >= 0)
    for down in range(-12, 13, 4):
        for right in range(-12, 13, 4):
            r = np.clip(rows + down, 0, scene.grid.rows - 1)
            near_a_room[r, np.clip(cols + right, 0, scene.grid.cols - 1)] = True
    assert not (space.free & ~near_a_room).any()
    assert (space.component == 1).sum() > 0.95 * space.free.sum()
