"""Map files made to exhaust time or memory, in every format."""

from collections.abc import Iterator

from tests.maps.format_fuzz import ENDINGS, Case
from toponav.maps.formats.convert import MapFormat

__all__ = ["large_bombs", "small_bombs"]

_YAML_KEYS = {MapFormat.TMAP2: "nodes", MapFormat.RMF: "levels", MapFormat.AREA: "image"}


def small_bombs() -> Iterator[Case]:
    """Small files made to exhaust time or memory by what they unfold to."""
    for one in (MapFormat.TOPO, MapFormat.NAV2, MapFormat.CANVAS):
        yield _bomb(one, "deep nesting", "[" * 200_000)
        yield _bomb(one, "deep nesting", '{"nodes":' * 100_000 + "1" + "}" * 100_000)
        yield _bomb(one, "huge number", '{"version": ' + "9" * 100_000 + "}")
        yield _bomb(one, "huge number", '{"version": 1e' + "9" * 5000 + "}")
    for one, key in _YAML_KEYS.items():
        yield _bomb(one, "deep nesting", f"{key}: " + "[" * 100_000)
        yield _bomb(one, "deep nesting", "\n".join(" " * i + "a:" for i in range(200)))
        yield _bomb(one, "alias bomb", f"{_alias_bomb('[{}]', ', ')}{key}: *a9\n")
        yield _bomb(one, "alias bomb", f"{_alias_bomb('{{k: 1, <<: [{}]}}', ', ')}{key}: *a9\n")
        yield _bomb(one, "alias bomb", f"{key}: &a [*a, *a]\n")
        yield _bomb(one, "huge number", f"{key}: " + "9" * 100_000)
    head = '<?xml version="1.0"?><!DOCTYPE x ['
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    for text in (
        f'{head}<!ENTITY a0 "lol">{entities}]><graphml>&a9;</graphml>',
        f'{head}<!ENTITY a "{"x" * 100_000}">]><graphml>{"&a;" * 10_000}</graphml>',
        f'{head}<!ENTITY a SYSTEM "file:///etc/passwd">]><graphml>&a;</graphml>',
        f'{head}<!ENTITY % a SYSTEM "http://127.0.0.1/x"> %a;]><graphml/>',
        '<!DOCTYPE graphml SYSTEM "http://127.0.0.1/x.dtd"><graphml/>',
    ):
        yield _bomb(MapFormat.GRAPHML, "entity bomb", text)
    yield _bomb(MapFormat.GRAPHML, "deep nesting", "<graphml>" + "<graph>" * 200_000)


def large_bombs() -> Iterator[Case]:
    """Files of up to thirty megabytes, of a million elements, and of one hub."""
    many = 1_000_000
    for one in (MapFormat.TOPO, MapFormat.NAV2, MapFormat.CANVAS):
        yield _bomb(one, "huge number", '{"version": ' + "9" * many + "}")
        yield _bomb(one, "one huge text", '{"version": "' + "a" * 30_000_000 + '"}')
    for one, key in _YAML_KEYS.items():
        yield _bomb(one, "huge number", f"{key}: " + "9" * many)
        yield _bomb(one, "many elements", f"{key}: [" + "1, " * many + "]")
        yield _bomb(one, "many elements", f"{key}:\n" + "- {node: {}}\n" * 150_000)
        yield _bomb(one, "many keys", "".join(f"k{i}: 1\n" for i in range(200_000)))
    yield _bomb(MapFormat.GRAPHML, "many elements", f"<graphml>{'<a/>' * many}</graphml>")
    attributes = " ".join(f'a{i}="1"' for i in range(100_000))
    yield _bomb(MapFormat.GRAPHML, "many attributes", f"<graphml {attributes}/>")
    yield _bomb(MapFormat.GRAPHML, "one huge text", f"<graphml>{'a' * 30_000_000}</graphml>")
    yield from _well_formed()


def _bomb(map_format: MapFormat, kind: str, text: str) -> Case:
    return Case(map_format, kind, f"bomb{ENDINGS[map_format]}", text.encode(), False)


def _well_formed() -> Iterator[Case]:
    """Well-formed documents of a million elements, of doubles, and of one hub."""
    many = 1_000_000
    top = '{"version": 1, "name": "a", "frame": {"name": "map"}, "nodes": [%s], "edges": [%s]}'
    nodes = ", ".join(
        f'{{"id": "n{i}", "kind": "hallway", "x": {i}, "y": 0}}' for i in range(99_000)
    )
    yield _bomb(MapFormat.TOPO, "many elements", top % (", ".join(["0"] * many), ""))
    yield _bomb(MapFormat.TOPO, "many elements", top % ("", ", ".join(["{}"] * many)))
    yield _bomb(MapFormat.TOPO, "many elements", top % (nodes, ""))
    yield _bomb(MapFormat.TOPO, "duplicated ids", top % (nodes.replace("n1", "n0"), ""))
    for feature in ("0", "{}", '{"geometry": {"type": "Point"}}'):
        features = ", ".join([feature] * (many if len(feature) < 5 else 200_000))
        text = f'{{"type": "FeatureCollection", "features": [{features}]}}'
        yield _bomb(MapFormat.NAV2, "many elements", text)
    point = '{"properties": {"id": %d}, "geometry": {"type": "Point", "coordinates": [%d, 0]}}'
    points = [point.replace("%d", str(i)) for i in range(20_000)]
    line = (
        '{"properties": {"id": 0, "startid": %d, "endid": %d}, "geometry": {"type": "LineString"}}'
    )
    for kind, lines in (
        ("one hub", [line % pair for i in range(1, 20_000) for pair in ((0, i), (i, 0))]),
        ("parallel edges", [line % (1, 2)] * 60_000),
        ("edges to nowhere", [line % (1, 2)] * 1000 + [line % (1, 999_999)]),
    ):
        features = ", ".join(points + lines)
        text = f'{{"type": "FeatureCollection", "features": [{features}]}}'
        yield _bomb(MapFormat.NAV2, kind, text)
    ovals = ", ".join(["[1, 2, 3, 4, {}]"] * 200_000)
    yield _bomb(
        MapFormat.CANVAS, "many elements", f'{{"oval": [{ovals}], "line": [], "text": []}}'
    )
    texts = ", ".join(['[1, 2, {"tags": "a", "text": "b"}]'] * 200_000)
    yield _bomb(
        MapFormat.CANVAS, "many elements", f'{{"oval": [], "line": [], "text": [{texts}]}}'
    )
    code = "x" * 5_000_000
    text = '{"oval": [[1,2,3,4,{"tags": "n"}]], "line": [[1,2,3,4,{"tags": "e n n"}]], "text": ['
    text += f'[1,2,{{"tags": "n", "text": "a"}}], [1,2,{{"tags": "e n n", "text": "{code}"}}]]}}'
    yield _bomb(MapFormat.CANVAS, "one huge text", text)
    nodes_xml = "".join(f'<node id="n{i}"/>' for i in range(200_000))
    yield _bomb(
        MapFormat.GRAPHML, "many elements", f"<graphml><graph>{nodes_xml}</graph></graphml>"
    )
    vertices = "[0, 0, 0, a], " * 100_000
    building = f"levels: {{L1: {{vertices: [{vertices}], lanes: [{'[0, 1, {}], ' * 60_000}]}}}}"
    yield _bomb(MapFormat.RMF, "many elements", building)
    fiducials = "".join(f"[{i}, {i}, f{i}], " for i in range(50_000))
    level = f"{{fiducials: [{fiducials}], vertices: [[0,0,0,a],[1,1,0,b]], lanes: [[0,1,{{}}]], "
    level += "measurements: [[0,1,{distance: [3, 1.0]}]]}"
    yield _bomb(MapFormat.RMF, "many elements", f"levels: {{L1: {level}, L2: {level}}}")


def _alias_bomb(pattern: str, comma: str) -> str:
    lines = ["a0: &a0 {k: 1}\n"]
    for level in range(1, 10):
        aliases = comma.join([f"*a{level - 1}"] * 10)
        lines.append(f"a{level}: &a{level} {pattern.format(aliases)}\n")
    return "".join(lines)
