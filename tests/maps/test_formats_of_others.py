"""Files as other tools write them, in miniature, and what the importers say of them."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import pytest
import yaml

from tests.maps.small_maps import office_floor
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.formats.convert import ImportedMap, MapFormat, export_map, import_map


def _told(imported: ImportedMap) -> str:
    return "\n".join(str(line) for line in imported.report)


def _nav2() -> dict[str, Any]:
    def point(number: int, x: float, y: float) -> dict[str, Any]:
        return {
            "type": "Feature",
            "properties": {"id": number, "frame": "map"},
            "geometry": {"type": "Point", "coordinates": [x, y]},
        }

    def line(number: int, start: int, end: int, **more: Any) -> dict[str, Any]:
        return {
            "type": "Feature",
            "properties": {"id": number, "startid": start, "endid": end, **more},
            "geometry": {"type": "MultiLineString"},
        }

    operations = {"open": {"type": "open_door", "trigger": "ON_ENTER"}}
    features = [
        *(point(10, 0, 0), point(11, 5, 0), point(12, 5, 5)),
        line(13, 10, 11, cost=2.0, overridable=False),
        line(14, 11, 12, metadata={"speed_limit": 0.5}, operations=operations),
    ]
    return {"type": "FeatureCollection", "name": "graph", "features": features}


def _import(folder: Path, name: str, document: Any) -> ImportedMap:
    text = json.dumps(document) if name.endswith("json") else yaml.safe_dump(document)
    (folder / name).write_text(text)
    return import_map(folder / name)


def test_nav2_graph_of_others_gets_names_and_behaviors(tmp_path: Path) -> None:
    imported = _import(tmp_path, "depot.geojson", _nav2())
    assert imported.format is MapFormat.NAV2
    assert imported.map.name == "depot"
    assert [node.id for node in imported.map.nodes] == ["node_10", "node_11", "node_12"]
    assert imported.map.edge("node_10->node_11").behavior is Behavior.CORRIDOR_FOLLOW
    assert imported.map.edge("node_11->node_12").behavior is Behavior.TURN_LEFT
    told = _told(imported)
    for line in (
        "guessed: names of nodes: from their ids (3: 'node_10'",
        "dropped: operations of edges",
        "dropped: other metadata of edges",
        "dropped: cost of edges",
        "guessed: behaviours of edges",
    ):
        assert line in told


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        (("features", 0, "properties", "id"), 11, r"features\[1\].properties.id: 11 is the id"),
        (("features", 0, "properties", "id"), -1, r"whole number from 0 to 4294967295, got -1"),
        (("features", 3, "properties", "endid"), 99, r"features\[3\].properties.endid: there is"),
        (("features", 1, "geometry", "coordinates"), [1], "at least 2 elements, got 1"),
        (("features", 1, "geometry", "coordinates"), ["x", 1], "must be a number, got 'x'"),
        (("features", 2, "properties", "frame"), "odom", "in one frame, got 'map' and 'odom'"),
        (("features", 2, "properties"), None, r"features\[2\].properties: must be an object"),
        (("features",), 3, "features: must be a list, got 3"),
    ],
)
def test_a_broken_nav2_graph_names_its_feature(
    tmp_path: Path, path: tuple[Any, ...], value: Any, says: str
) -> None:
    document: Any = _nav2()
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(InputError, match=says):
        _import(tmp_path, "a.geojson", document)


def test_nav2_graph_has_small_ids_and_no_nulls(tmp_path: Path) -> None:
    export_map(office_floor(), tmp_path / "a.geojson")
    text = (tmp_path / "a.geojson").read_text()
    assert "null" not in text
    features = json.loads(text)["features"]
    ids = [feature["properties"]["id"] for feature in features]
    assert ids == list(range(len(ids)))
    edges = [one["properties"] for one in features if one["geometry"]["type"] != "Point"]
    assert {"yaw", "behavior"} <= edges[0]["metadata"].keys()
    assert all(isinstance(edge["metadata"]["yaw"], float) for edge in edges)


def test_nav2_has_ids_for_65536_elements_only(tmp_path: Path) -> None:
    many = office_floor()
    edge = many.edges[0]
    many = replace(many, edges=tuple(replace(edge, id=f"e{i}") for i in range(65_530)))
    with pytest.raises(InputError, match="Nav2 has ids for 65,536 nodes and edges"):
        export_map(many, tmp_path / "a.geojson")


def _tmap2(**more: Any) -> dict[str, Any]:
    def node(name: str, x: float, y: float, targets: str) -> dict[str, Any]:
        edges = [
            {"action": "move_base", "edge_id": f"{name}_{target}", "node": target}
            for target in targets
        ]
        pose = {"position": {"x": x, "y": y, "z": 0}, "orientation": {"w": 1.0, "z": 0.0}}
        content = {"name": name, "parent_frame": "topo_map", "pose": pose, "edges": edges}
        return {"meta": {"map": "m", "node": name, "pointset": "m"}, "node": content}

    return {
        "name": "farm",
        "pointset": "m",
        "nodes": [node("A", 0, 0, "B"), node("B", 4, 0, "AC"), node("C", 4, 4, "")],
        **more,
    }


def test_tmap2_of_others_is_moved_into_the_parent_frame(tmp_path: Path) -> None:
    quarter = {"w": math.cos(math.pi / 4), "z": math.sin(math.pi / 4), "x": 0.0, "y": 0.0}
    motion = {"child": "topo_map", "parent": "map", "rotation": quarter}
    motion["translation"] = {"x": 10.0, "y": 0.0, "z": 0.0}
    imported = _import(tmp_path, "a.tmap2", _tmap2(transformation=motion))
    node = imported.map.node("B")
    assert (imported.map.name, imported.map.frame.name) == ("farm", "map")
    assert (node.x_m, node.y_m) == pytest.approx((10.0, 4.0))
    assert imported.map.edge("B_C").behavior is Behavior.TURN_LEFT
    assert "changed: positions: moved by the file's transformation to map (3)" in _told(imported)
    assert "dropped: actions of edges" in _told(imported)


def test_tmap2_aliases_are_followed_but_bombs_are_not(tmp_path: Path) -> None:
    path = tmp_path / "a.tmap2"
    text = yaml.safe_dump(_tmap2()).replace("edge_id: A_B", "edge_id: A_B\n      goal: &id1 [1]")
    path.write_text(text.replace("edge_id: B_A", "edge_id: B_A\n      goal: *id1"))
    assert len(import_map(path).map.edges) == 3
    bomb = "a0: &a0 [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
        f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 9)
    )
    path.write_text(bomb + "nodes: *a8\n")
    with pytest.raises(InputError, match="more than 500,000 values, with its aliases"):
        import_map(path)


def test_tmap2_edge_to_nowhere_is_named(tmp_path: Path) -> None:
    document = _tmap2()
    document["nodes"][0]["node"]["edges"][0]["node"] = "Q"
    with pytest.raises(InputError, match=r"nodes\[0\].node.edges\[0\]: there is no node 'Q'"):
        _import(tmp_path, "a.tmap2", document)


def _building(**more: Any) -> dict[str, Any]:
    vertices = [
        *([0, 0, 0, ""], [100, 0, 0, ""]),
        [0, 100, 0, "lobby", {"is_charger": [4, True]}],
        [0, 300, 0, "pantry"],
        [200, 100, 0, ""],
    ]
    level = {
        "vertices": vertices,
        "measurements": [[0, 1, {"distance": [3, 5.0]}]],
        "lanes": [
            [2, 3, {"bidirectional": [4, True], "graph_idx": [2, 0]}],
            [3, 4, {"bidirectional": [4, False], "graph_idx": [2, 0]}],
        ],
        "walls": [[0, 1, {}]],
        **more,
    }
    return {"name": "hq", "levels": {"L1": level}}


def test_rmf_level_is_scaled_by_its_measurements(tmp_path: Path) -> None:
    imported = _import(tmp_path, "hq.building.yaml", _building())
    assert imported.format is MapFormat.RMF
    assert imported.map.name == "hq"
    pantry = imported.map.node("pantry")
    assert (pantry.x_m, pantry.y_m, pantry.kind) == (0.0, -15.0, NodeKind.ROOM)
    assert imported.map.node("lobby").kind is NodeKind.HALLWAY
    ids = {edge.id for edge in imported.map.edges}
    assert ids == {"lobby->pantry", "pantry->lobby", "pantry->v4"}
    told = _told(imported)
    for line in ("dropped: walls", "dropped: vertices: no lane leads to them (2)"):
        assert line in told
    assert "dropped: parameters of vertices" in told


def test_rmf_level_without_measurements_says_that_its_scale_is_a_guess(tmp_path: Path) -> None:
    imported = _import(tmp_path, "hq.building.yaml", _building(measurements=[]))
    assert "guessed: scale: no measurements" in _told(imported)


def test_rmf_levels_are_aligned_by_their_fiducials(tmp_path: Path) -> None:
    def turned(x: float, y: float) -> list[float]:
        return [30 + 2 * y, 40 - 2 * x]

    building = _building(fiducials=[[0, 0, "a"], [100, 0, "b"], [100, 100, "c"]])
    first = building["levels"]["L1"]
    building["levels"]["L2"] = {
        "vertices": [[*turned(*vertex[:2]), *vertex[2:]] for vertex in first["vertices"]],
        "fiducials": [[*turned(*one[:2]), one[2]] for one in first["fiducials"]],
        "lanes": first["lanes"],
    }
    lower = _import(tmp_path, "hq.building.yaml", building)
    upper = import_map(tmp_path / "hq.building.yaml", level="L2")
    assert (lower.map.name, upper.map.name) == ("hq L1", "hq L2")
    assert upper.map.positions_m == pytest.approx(lower.map.positions_m)
    assert "dropped: other levels" in _told(lower)
    with pytest.raises(InputError, match="there is no level 'L9'"):
        import_map(tmp_path / "hq.building.yaml", level="L9")


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"lanes": [[2, 99, {}]]}, r"levels.L1.lanes\[0\]\[1\]: must be a whole number from 0"),
        ({"lanes": [[2]]}, r"lanes\[0\]: must have at least 2 elements"),
        ({"vertices": [["x", 0, 0, ""]] * 5}, r"must be a number, got 'x'"),
        ({"measurements": [[0, 0, {"distance": [3, 1.0]}]]}, "two different ends"),
        ({"measurements": [[0, 1, {}]]}, r"measurements\[0\].distance: must be a number"),
    ],
)
def test_a_broken_building_names_its_element(
    tmp_path: Path, more: dict[str, Any], says: str
) -> None:
    with pytest.raises(InputError, match=says):
        _import(tmp_path, "hq.building.yaml", _building(**more))


def test_buildings_in_degrees_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must be reference_image or cartesian_meters"):
        _import(tmp_path, "a.building.yaml", {**_building(), "coordinate_system": "wgs84"})
    metres = {**_building(), "coordinate_system": "cartesian_meters"}
    imported = _import(tmp_path, "a.building.yaml", metres)
    assert imported.map.node("pantry").y_m == 300.0


def test_networkx_reads_our_graphml_with_its_types(tmp_path: Path) -> None:
    floor = office_floor()
    export_map(floor, tmp_path / "a.graphml")
    graph = nx.read_graphml(tmp_path / "a.graphml")
    assert graph.is_directed()
    assert graph.nodes["office_4"] == {
        "kind": "room", "x": 5.0, "y": 2.0, "room": "office_4", "size": 1.0
    }  # fmt: skip
    edge = graph.edges["office_4", "office_4_door"]
    assert (edge["behavior"], edge["id"]) == ("find_door", "office_4->office_4_door")
    assert isinstance(edge["yaw"], float)
    assert len(graph.edges) == len(floor.edges)


def test_graphml_of_networkx_is_read(tmp_path: Path) -> None:
    graph: nx.Graph[str] = nx.Graph()
    for name, x, y in (("office_1", 0.0, 2), ("hall", 0.0, 0), ("far", 9.0, 0)):
        graph.add_node(name, x=x, y=float(y), colour="red")
    graph.add_edges_from((("office_1", "hall"), ("hall", "far")), weight=2.5)
    nx.write_graphml(graph, tmp_path / "plan.graphml")
    imported = import_map(tmp_path / "plan.graphml")
    assert imported.map.name == "plan"
    assert len(imported.map.edges) == 4
    assert imported.map.node("office_1").kind is NodeKind.ROOM
    told = _told(imported)
    assert "changed: edges without direction: became two (2" in told
    assert "dropped: other data of nodes" in told
    assert "dropped: other data of edges" in told


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("<graphml", '<!DOCTYPE x [<!ENTITY a "b">]><graphml'), "is not read"),
        (('"edge_yaw" for="edge"', '"other" for="edge"'), "unknown key 'edge_yaw'"),
        (('target="office_4"', 'target="office_5"'), "there is no node 'office_5'"),
        (('<data key="node_x">5.0</data>', ""), "node 'office_4' must have a position"),
        (('<data key="node_x">5.0</data>', '<data key="node_x">nan</data>'), "from -1e"),
        (("</graph>", ""), "is not XML"),
        (("<graphml", "<svg"), "is not XML|must be a graphml"),
    ],
)
def test_broken_graphml_names_its_element(
    tmp_path: Path, change: tuple[str, str], says: str
) -> None:
    export_map(office_floor(), tmp_path / "a.graphml")
    text = (tmp_path / "a.graphml").read_text()
    assert change[0] in text
    (tmp_path / "a.graphml").write_text(text.replace(*change))
    with pytest.raises(InputError, match=says):
        import_map(tmp_path / "a.graphml")


def test_lif_has_all_that_the_standard_requires(tmp_path: Path) -> None:
    report = export_map(office_floor(), tmp_path / "a.lif.json")
    document = json.loads((tmp_path / "a.lif.json").read_text())
    meta = document["metaInformation"]
    assert meta["lifVersion"] == "1.0.0"
    assert {"projectIdentification", "creator", "exportTimestamp"} <= meta.keys()
    (layout,) = document["layouts"]
    assert {"layoutId", "layoutVersion", "nodes", "edges", "stations"} <= layout.keys()
    ids = {node["nodeId"] for node in layout["nodes"]}
    assert len(ids) == len(office_floor().nodes)
    assert all(node["vehicleTypeNodeProperties"] for node in layout["nodes"])
    for edge in layout["edges"]:
        assert {edge["startNodeId"], edge["endNodeId"]} <= ids
        (properties,) = edge["vehicleTypeEdgeProperties"]
        (action,) = properties["actions"]
        assert action["actionType"] in set(Behavior)
        assert {"requirementType", "blockingType"} <= action.keys()
    stations = {one["stationId"]: one["interactionNodeIds"] for one in layout["stations"]}
    assert stations["office_4"] == ["office_4"]
    assert "dropped: rooms of nodes that are not room nodes" in "\n".join(map(str, report))
