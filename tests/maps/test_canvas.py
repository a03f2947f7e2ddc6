import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.formats.canvas import (
    BEHAVIOR_CODES,
    area_of_drawing,
    drawing_faults,
    load_area_map,
    map_from_canvas,
    node_kind_of_name,
    room_of_name,
)
from toponav.maps.validate import Rule, Severity, validate
from toponav.worlds.grid import GridFrame
from toponav.worlds.load.stanford import AreaFiles

_GRID = GridFrame(0.05, (-1.0, -2.0), rows=100, cols=80)


def _canvas() -> dict[str, list[Any]]:
    return {
        "oval": [
            [7.0, 87.0, 13.0, 93.0, {"tags": "node_0", "outline": "red", "fill": "red"}],
            [27.0, 67.0, 33.0, 73.0, {"tags": "node_1", "outline": "red", "fill": "red"}],
        ],
        "text": [
            [10.0, 80.0, {"text": "office_1_door", "tags": "node_0", "fill": "blue"}],
            [30.0, 60.0, {"text": "hallway_1-1u", "tags": "node_1", "fill": "blue"}],
            [20.0, 80.0, {"text": "tl", "tags": "edge_0 node_0 node_1", "fill": "blue"}],
        ],
        "line": [[10.0, 90.0, 30.0, 70.0, {"tags": "edge_0 node_0 node_1", "arrow": "last"}]],
    }


def test_pixels_become_metres_with_y_up() -> None:
    drawn = map_from_canvas(_canvas(), _GRID, name="tiny", node_sizes={"hallway_1-1u": 0.7})
    door, hallway = drawn.node("office_1_door"), drawn.node("hallway_1-1u")
    # Pixel (row 90, column 10) is the cell in row 9 from below, column 10.
    assert (door.x_m, door.y_m) == pytest.approx(_GRID.center_of(9, 10))
    assert (hallway.x_m, hallway.y_m) == pytest.approx(_GRID.center_of(29, 30))
    assert (door.kind, door.room, door.size) == (NodeKind.DOOR, "office_1", 1.0)
    assert (hallway.kind, hallway.room, hallway.size) == (NodeKind.HALLWAY, "hallway_1", 0.7)
    (edge,) = drawn.edges
    assert edge.behavior is Behavior.TURN_LEFT
    assert edge.yaw_rad == pytest.approx(math.pi / 4)
    assert edge.length_m == pytest.approx(math.sqrt(2))


def test_every_behavior_code_of_the_authors_is_known() -> None:
    for code in ("cf", "fd", "fd_l", "fd_r", "lio", "rio", "s", "s_l", "s_r", "tl", "tr"):
        canvas = _canvas()
        canvas["text"][2][2]["text"] = code
        (edge,) = map_from_canvas(canvas, _GRID, name="tiny").edges
        assert edge.behavior is BEHAVIOR_CODES[code]


@pytest.mark.parametrize(
    ("name", "kind", "room"),
    [
        ("office_12", NodeKind.ROOM, "office_12"),
        ("conferenceRoom_1_door", NodeKind.DOOR, "conferenceRoom_1"),
        ("office_29_door-l", NodeKind.DOOR, "office_29"),
        ("office_41d", NodeKind.ROOM, "office_41"),
        ("hallway_6_1u", NodeKind.HALLWAY, "hallway_6"),
        ("lobby_1-2u", NodeKind.HALLWAY, "lobby_1"),
        ("lounge_1_1d", NodeKind.OPEN_SPACE, "lounge_1"),
        ("openspace_1-1r", NodeKind.OPEN_SPACE, "openspace_1"),
        ("WC_2", NodeKind.ROOM, "WC_2"),
        ("storage-3", NodeKind.ROOM, None),
    ],
)
def test_names_say_kind_and_room(name, kind, room) -> None:
    assert node_kind_of_name(name) is kind
    assert room_of_name(name) == room


def _without_text(canvas):
    del canvas["text"][0]


def _one_tag(canvas):
    canvas["oval"][1][4]["tags"] = "node_0"


def _same_name(canvas):
    canvas["text"][1][2]["text"] = "office_1_door"


def _bad_code(canvas):
    canvas["text"][2][2]["text"] = "tll"


def _no_behavior(canvas):
    del canvas["text"][2]


def _dangling(canvas):
    canvas["line"][0][4]["tags"] = "edge_0 node_0 node_9"


def _short(canvas):
    canvas["oval"][0] = [1.0, {}]


def _text_coordinate(canvas):
    canvas["oval"][1][0] = "7"


def _no_tags(canvas):
    canvas["line"][0][4] = {}


def _number_tag(canvas):
    canvas["oval"][0][4]["tags"] = 5


def _not_lists(canvas):
    canvas["oval"] = {}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_without_text, r"oval\[0\]: node 'node_0' has no name"),
        (_one_tag, r"oval\[1\]: two nodes are tagged 'node_0'"),
        (_same_name, "node 'office_1_door' comes twice"),
        (_bad_code, "unknown behaviour 'tll'.*did you mean 'tl'"),
        (_no_behavior, "edge office_1_door -> hallway_1-1u has no behaviour"),
        (_dangling, r"line\[0\]: an edge is tagged .*node_9"),
        (_short, r"oval\[0\]: must be a list of 4 coordinates and an object"),
        (_text_coordinate, r"oval\[1\]: coordinates must be pixels"),
        (_no_tags, r"line\[0\]: must have a text 'tags'"),
        (_number_tag, r"oval\[0\]: must have a text 'tags'"),
        (_not_lists, "lists oval, line and text"),
    ],
)
def test_a_broken_drawing_is_named_by_its_element(spoil, message) -> None:
    canvas = _canvas()
    spoil(canvas)
    with pytest.raises(InputError, match=message) as caught:
        map_from_canvas(canvas, _GRID, name="tiny", where="tiny.json")
    assert str(caught.value).startswith("tiny.json")


def test_the_areas_have_what_their_drawings_show(areas_dir: Path) -> None:
    sizes = {}
    for area in ("1", "3", "5b", "6"):
        drawn = load_area_map(areas_dir / f"area_{area}.yaml")
        sizes[area] = (len(drawn.nodes), len(drawn.edges))
        assert drawn.frame.plan == f"area_{area}.yaml"
    assert sizes == {"1": (179, 304), "3": (81, 127), "5b": (190, 312), "6": (202, 355)}


def test_room_nodes_lie_in_the_rooms_of_their_name(areas_dir: Path) -> None:
    from toponav.worlds.load.stanford import load_area

    scene = load_area(areas_dir / "area_3.yaml")
    for node in load_area_map(areas_dir / "area_3.yaml").nodes:
        if node.kind is NodeKind.ROOM:
            assert scene.room_at(node.x_m, node.y_m) == node.room


def test_the_authors_slips_are_reported(areas_dir: Path) -> None:
    errors = {}
    warnings = set()
    for area in ("1", "3", "5b", "6"):
        files = AreaFiles.read(areas_dir / f"area_{area}.yaml")
        drawn = load_area_map(files.yaml)
        faults = (*validate(drawn), *drawing_faults(files, drawn))
        errors[area] = {(f.rule, f.element) for f in faults if f.severity is Severity.ERROR}
        warnings |= {(f.rule, f.element) for f in faults if f.severity is Severity.WARNING}
    assert errors == {
        "1": {(Rule.DOOR_HAS_NODE, "node office_26"), (Rule.REACHABLE, "node office_26")},
        "3": set(),
        "5b": {
            (Rule.ONE_NODE_PER_ROOM, "node office_29d"),
            (Rule.ONE_NODE_PER_ROOM, "node office_41d"),
        },
        "6": {(Rule.FIND_DOOR, "edge hallway_4-2r->hallway_4-3r")},
    }
    assert {element for rule, element in warnings if rule is Rule.BEHAVIOR_FITS} == {
        "edge hallway_1-1d->hallway_13-1r",
        "edge hallway_2-8d->office_37",
    }
    assert (Rule.SIZE_HAS_NODE, "node_sizes storage-3") in warnings


def test_a_drawing_finds_its_area(areas_dir: Path, tmp_path: Path) -> None:
    assert area_of_drawing(areas_dir / "area_3_graph_v6.json").name == "area_3.yaml"
    alone = tmp_path / "area_3_graph_v6.json"
    shutil.copy(areas_dir / alone.name, alone)
    with pytest.raises(InputError, match="pixels alone have no scale"):
        area_of_drawing(alone)


def test_an_area_without_a_drawing_is_said_so(tmp_path: Path) -> None:
    plain = tmp_path / "map.yaml"
    plain.write_text("image: map.png\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\n")
    with pytest.raises(InputError, match="the area has no drawn map"):
        load_area_map(plain)
    plain.write_text(plain.read_text() + "graph_filepath: gone.json\n")
    with pytest.raises(InputError, match=r"gone\.json: cannot be read"):
        load_area_map(plain)
    (tmp_path / "gone.json").write_text(json.dumps(_canvas()))
    with pytest.raises(InputError, match=r"map\.png"):
        load_area_map(plain)
