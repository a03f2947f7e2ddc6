"""Broken and hostile map files, each from a number: the same number gives the same file."""

import json
import random
import string
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import yaml

from tests.maps.small_maps import office_floor
from toponav.core.errors import InputError
from toponav.maps.formats.convert import export_map, import_map
from toponav.maps.formats.map_format import READABLE, MapFormat
from toponav.maps.schema import map_schema_faults
from toponav.maps.spec import map_to_document

__all__ = ["ENDINGS", "Case", "Outcome", "Seeds", "case_of", "outcome_of"]

ENDINGS = {
    MapFormat.TOPO: ".topo.json",
    MapFormat.NAV2: ".geojson",
    MapFormat.TMAP2: ".tmap2",
    MapFormat.GRAPHML: ".graphml",
    MapFormat.CANVAS: ".json",
    MapFormat.AREA: ".yaml",
    MapFormat.RMF: ".building.yaml",
}
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_YAML = (MapFormat.TMAP2, MapFormat.RMF, MapFormat.AREA)


@dataclass(frozen=True)
class Case:
    """One file: what it pretends to be, how it was made, and what it holds."""

    format: MapFormat
    kind: str
    name: str
    content: bytes
    told: bool
    """Whether the importer is told the format, or has to find out."""


@dataclass(frozen=True)
class Outcome:
    """What an importer did with a file: a map, an error of the right kind, or a fault of ours."""

    result: str
    """`map`, `error`, or what went wrong."""
    seconds: float
    """Processor time that the import took."""


class Seeds:
    """Valid files of each format, in a folder of their own, to be broken."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.content: dict[MapFormat, bytes] = {}
        written = datetime(2026, 1, 1, tzinfo=UTC)
        for one in (MapFormat.TOPO, MapFormat.NAV2, MapFormat.TMAP2, MapFormat.GRAPHML):
            path = folder / f"seed{ENDINGS[one]}"
            export_map(office_floor(), path, one, written=written)
            self.content[one] = path.read_bytes()
        self.content[MapFormat.RMF] = yaml.safe_dump(_building()).encode()
        self.content[MapFormat.CANVAS] = json.dumps(_canvas()).encode()
        self.content[MapFormat.AREA] = (
            b"image: area.png\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\noccupied_thresh: 0.65\n"
            b"free_thresh: 0.196\nnegate: 0\ngraph_filepath: seed.json\n"
            b"locations_filepath: no.mat\n"
            b"node_sizes: {office_1: 2.0}\n"
        )
        # A canvas is read with the yaml and the image beside it.
        from PIL import Image

        Image.new("L", (100, 80), 255).save(folder / "area.png")

    def write(self, case: Case) -> Path:
        """The case's file, with what has to lie beside it."""
        path = self.folder / case.name
        path.write_bytes(case.content)
        if case.format is MapFormat.CANVAS:
            area = self.content[MapFormat.AREA].replace(b"seed.json", case.name.encode())
            (self.folder / "seed.yaml").write_bytes(area)
        elif case.format is MapFormat.AREA:
            (self.folder / "seed.json").write_bytes(self.content[MapFormat.CANVAS])
        return path


def outcome_of(case: Case, seeds: Seeds) -> Outcome:
    """What happens when the case's file is imported."""
    path = seeds.write(case)
    start = time.process_time()
    try:
        imported = import_map(path, case.format if case.told else None)
        seconds = time.process_time() - start
        faults = map_schema_faults(map_to_document(imported.map))
        return Outcome(f"a map that cannot be saved: {faults[0]}" if faults else "map", seconds)
    except InputError as error:
        seconds = time.process_time() - start
        message = str(error)
        good = str(seeds.folder) in message or "--" in error.where
        if not good or len(message) > 1500 or "Remedy: " not in message:
            return Outcome(f"an error that does not name the place: {message[:300]}", seconds)
        return Outcome("error", seconds)
    except Exception as error:
        return Outcome(f"{type(error).__name__}: {str(error)[:300]}", time.process_time() - start)


def case_of(number: int, seeds: Seeds) -> Case:
    """The case of a number."""
    draw = random.Random(number)
    map_format = draw.choice(READABLE)
    kind = draw.choice(list(_KINDS))
    content = _KINDS[kind](draw, map_format, seeds.content)
    ending = ENDINGS[map_format] if draw.random() < 0.85 else draw.choice(list(ENDINGS.values()))
    return Case(map_format, kind, f"case{ending}", content, draw.random() < 0.3)


def _bytes_mutated(
    draw: random.Random, map_format: MapFormat, valid: dict[MapFormat, bytes]
) -> bytes:
    data = bytearray(valid[map_format])
    for _ in range(draw.randint(1, 6)):
        at = draw.randrange(len(data) + 1)
        match draw.randrange(7):
            case 0 if data:
                data[min(at, len(data) - 1)] = draw.randrange(256)
            case 1:
                del data[at:]
            case 2:
                del data[at : at + draw.randint(1, 40)]
            case 3:
                data[at:at] = data[at : at + draw.randint(1, 400)]
            case 4:
                data[at:at] = draw.choice(_TOKENS).encode("utf-8", "surrogatepass")
            case 5:
                other = draw.choice(list(valid.values()))
                start = draw.randrange(len(other))
                data[at:at] = other[start : start + draw.randint(1, 200)]
            case _:
                data[at:at] = draw.randbytes(draw.randint(1, 8))
    return bytes(data)


def _values_mutated(
    draw: random.Random, map_format: MapFormat, valid: dict[MapFormat, bytes]
) -> bytes:
    if map_format is MapFormat.GRAPHML:
        return _xml_mutated(draw, valid[map_format].decode()).encode("utf-8", "surrogatepass")
    text = valid[map_format].decode()
    document = yaml.load(text, _Loader) if map_format in _YAML else json.loads(text)
    for _ in range(draw.randint(1, 4)):
        _mutate(draw, document)
    if map_format in _YAML and draw.random() < 0.7:
        try:
            return yaml.dump(document, Dumper=_Dumper, allow_unicode=True).encode(
                "utf-8", "surrogatepass"
            )
        except (yaml.YAMLError, UnicodeError, RecursionError):
            pass
    return json.dumps(document).encode()


def _mutate(draw: random.Random, document: Any) -> None:
    """Breaks one value somewhere in the document."""
    place = document
    while True:
        keys: list[Any] = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return
        key = draw.choice(keys)
        inner = place[key]
        if not isinstance(inner, dict | list) or not inner or draw.random() < 0.12:
            break
        place = inner
    match draw.randrange(6):
        case 0:
            del place[key]
        case 1 if isinstance(place, list):
            place.insert(draw.randrange(len(place) + 1), place[draw.randrange(len(place))])
        case 2 if isinstance(place, dict):
            place[draw.choice(_TOKENS)] = place[key]
        case 3 if len(keys) > 1:
            place[key] = place[draw.choice(keys)]
        case _:
            place[key] = _hostile(draw)


def _xml_mutated(draw: random.Random, text: str) -> str:
    parts = text.split("<")
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(1, len(parts))
        match draw.randrange(5):
            case 0:
                del parts[at]
            case 1:
                parts.insert(at, parts[draw.randrange(1, len(parts))])
            case 2:
                head, _, _ = parts[at].partition(">")
                parts[at] = f"{head}>{_hostile(draw)}"
            case 3:
                parts[at] = parts[at].replace('"', f'"{draw.choice(_TOKENS)}', 1)
            case _:
                parts.insert(at, draw.choice(_XML_PIECES))
        if len(parts) < 2:
            break
    return "<".join(parts)


def _random_text(draw: random.Random, map_format: MapFormat, _: dict[MapFormat, bytes]) -> bytes:
    match draw.randrange(5):
        case 0:
            return draw.randbytes(draw.randint(0, 300))
        case 1:
            return json.dumps(_random_value(draw, 4)).encode()
        case 2:
            tokens = draw.choices([*_TOKENS, *_YAML_PIECES], k=draw.randint(1, 60))
            return "".join(tokens).encode("utf-8", "surrogatepass")
        case 3:
            pieces = draw.choices(_XML_PIECES, k=draw.randint(1, 40))
            return ("<graphml><" + "<".join(pieces)).encode()
        case _:
            return "".join(draw.choices(string.printable, k=draw.randint(0, 300))).encode()


def _encoded(draw: random.Random, map_format: MapFormat, valid: dict[MapFormat, bytes]) -> bytes:
    text = valid[map_format].decode().replace("office", draw.choice(["büro", "事務所", "кабинет"]))
    encoding = draw.choice(
        ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "latin-1", "cp1251", "shift-jis"]
    )
    data = text.encode(encoding, "replace")
    if draw.random() < 0.3:
        data = data.replace(b'encoding="UTF-8"', b'encoding="%s"' % encoding.encode())
    return data


_KINDS: dict[str, Callable[[random.Random, MapFormat, dict[MapFormat, bytes]], bytes]] = {
    "bytes of a valid file broken": _bytes_mutated,
    "values of a valid file broken": _values_mutated,
    "random text": _random_text,
    "other encodings": _encoded,
}

_TOKENS = [
    *("null", "true", "NaN", "Infinity", "-1e999", "1e308", "9" * 30, "9" * 5000, "0x1F", "1_0"),
    *("", " ", "\n", "\t", "\x00", "\x85", "\u2028", "\ufeff", "\uffff", "\ud800", "\U0001f600"),
    *(
        "office_4",
        "a" * 201,
        "a" * 5000,
        "<<",
        "*a",
        "&a",
        "!!python/object/apply:os.system",
        "---",
    ),
    *(
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        '"',
        "'",
        "<",
        ">",
        "&lt;",
        "&#0;",
        "&#xD800;",
        "&x;",
        "%",
        "?",
    ),
    *("2001-99-99", "1:30:00", ".inf", ".nan", "0b2", "-", "- ", "...", "|", "\\u0000", "\\ud800"),
]
_YAML_PIECES = [
    *(
        "a: ",
        "b: &b ",
        "*b",
        "\n",
        "\n  ",
        "\n- ",
        "{a: ",
        "[1, ",
        "}",
        "]",
        "nodes: ",
        "levels: ",
    ),
    *(
        "!!binary ",
        "!!set ",
        "!!timestamp ",
        "!!float ",
        "!<",
        "%YAML 1.1\n---\n",
        "? ",
        "# ",
        "'x'",
    ),
    *("<<: ", "{<<: *b}", "1", "2.5", "x", "pointset: p\n", "node:\n", "vertices: [[0,0,0,a]]\n"),
]
_XML_PIECES = [
    *("!DOCTYPE a>", '!DOCTYPE a [<!ENTITY x "y">]>', "a>&x;</a>", "!-- c -->", "![CDATA[x]]>"),
    *(
        "?xml version='1.0' encoding='x'?>",
        "graph>",
        "/graph>",
        "node id='1'>",
        "/node>",
        "node/>",
    ),
    *("edge source='1' target='1'/>", "data key='node_x'>nan</data>", "data>x</data>", "key/>"),
    *(
        "graph edgedefault='undirected'>",
        "key id='node_x' for='all' attr.name='x'/>",
        "hyperedge/>",
    ),
]


def _hostile(draw: random.Random) -> Any:
    return draw.choice(
        [
            *(None, True, False, 0, -1, 65_536, 2**31, 2**63, 2**64, -(2**63) - 1, 10**18),
            *(0.5, -0.0, 1e-320, 1e6, 1e6 + 1, 1e308, float("nan"), float("inf"), float("-inf")),
            *(_TOKENS[draw.randrange(len(_TOKENS))], [], {}, [[]], {"": {}}, [0] * 500),
            *({"id": 1}, [None], [1, 2, 3, 4, 5, 6], ["a", "b"], [1e400, 2], _nested(draw)),
        ]
    )


def _nested(draw: random.Random) -> Any:
    value: Any = 1
    for _ in range(draw.choice([3, 30, 70, 300])):
        value = [value] if draw.random() < 0.5 else {"a": value}
    return value


def _random_value(draw: random.Random, depth: int) -> Any:
    if depth == 0 or draw.random() < 0.3:
        return _hostile(draw)
    keys = ["nodes", "edges", "features", "type", "id", "levels", "oval", "version", "name", "x"]
    if draw.random() < 0.5:
        return [_random_value(draw, depth - 1) for _ in range(draw.randrange(4))]
    chosen = draw.sample(keys, draw.randrange(6))
    return {key: _random_value(draw, depth - 1) for key in chosen}


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    def ignore_aliases(self, data: Any) -> bool:
        return True


def _building() -> dict[str, Any]:
    vertices = [
        *([0, 0, 0, ""], [100, 0, 0, ""], [0, 300, 0, "pantry"], [200, 100, 0, ""]),
        [0, 100, 0, "lobby", {"is_charger": [4, True]}],
    ]
    level = {
        "vertices": vertices,
        "measurements": [[0, 1, {"distance": [3, 5.0]}]],
        "fiducials": [[0, 0, "a"], [10, 0, "b"], [0, 10, "c"]],
        "lanes": [[2, 3, {"bidirectional": [4, True], "graph_idx": [2, 0]}], [3, 4, {}]],
        "doors": [[0, 1, {"name": [1, "d"]}]],
        "drawing": {"filename": "a.png"},
        "elevation": 0.0,
    }
    return {
        "name": "hq",
        "coordinate_system": "reference_image",
        "reference_level_name": "L1",
        "levels": {"L1": level, "L2": {**level, "lanes": []}},
        "lifts": {},
    }


def _canvas() -> dict[str, Any]:
    return {
        "oval": [
            [7.0, 27.0, 13.0, 33.0, {"tags": "node_0", "outline": "red"}],
            [27.0, 17.0, 33.0, 23.0, {"tags": "node_1", "outline": "red"}],
        ],
        "text": [
            [10.0, 20.0, {"text": "office_1_door", "tags": "node_0"}],
            [30.0, 10.0, {"text": "hallway_1-1u", "tags": "node_1"}],
            [20.0, 20.0, {"text": "tl", "tags": "edge_0 node_0 node_1"}],
        ],
        "line": [[10.0, 30.0, 30.0, 20.0, {"tags": "edge_0 node_0 node_1", "arrow": "last"}]],
    }
