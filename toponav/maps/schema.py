"""JSON documents that can be trusted to have the shape of their schema, or one clear error."""

import functools
import itertools
import json
import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any, cast

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import read_json
from toponav.core.vocabulary import Behavior, NodeKind

__all__ = [
    "FORMAT_VERSION",
    "map_schema",
    "map_schema_faults",
    "read_json",
    "read_map_document",
]

FORMAT_VERSION = 1
"""Version of the `*.topo.json` format that this package writes and reads."""

_SHOWN_FAULTS = 5
_SHOWN_CHARACTERS = 60
_MOST_FAULTY = 1000
_CONTROL = re.compile("[\\u0000-\\u001f\\u007f]")
_KINDS = frozenset(kind.value for kind in NodeKind)
_BEHAVIORS = frozenset(behavior.value for behavior in Behavior)
_NODE_KEYS = frozenset({"id", "kind", "x", "y", "room", "size"})
_EDGE_KEYS = frozenset({"id", "source", "target", "behavior", "yaw", "length"})


@functools.cache
def map_schema() -> dict[str, Any]:
    """The JSON Schema of `*.topo.json`, as shipped in the package."""
    text = (
        resources.files("toponav.maps").joinpath("topological_map.schema.json").read_text("utf-8")
    )
    schema: dict[str, Any] = json.loads(text)
    return schema


def read_map_document(path: Path) -> dict[str, Any]:
    """The document of a topological map whose version and schema were checked.

    Raises:
        InputError: If the file is not one; names the first faults by element.
    """
    document = read_json(path)
    faults = map_schema_faults(document)
    if faults:
        shown = "; ".join(f"{place}: {rule}" for place, rule in faults[:_SHOWN_FAULTS])
        more = len(faults) - _SHOWN_FAULTS
        raise InputError(
            shown + (f"; and {more} more" if more > 0 else ""),
            where=str(path),
            remedy="correct the named elements; `toponav map check` lists every fault",
        )
    checked: dict[str, Any] = document
    return checked


def map_schema_faults(document: Any) -> list[tuple[str, str]]:
    """Every breach of the schema as (place, rule), in the order of the document.

    Of nodes and of edges at most the first thousand with a breach are told.
    """
    if not isinstance(document, dict):
        kind = type(document).__name__
        return [("document", f"a topological map is a JSON object, got {kind}")]
    version = document.get("version")
    if version != FORMAT_VERSION or isinstance(version, bool):
        return [("version", _version_rule(document))]
    lists = {key: document[key] for key in _ELEMENTS if isinstance(document.get(key), list)}
    frame = Draft202012Validator(map_schema())
    errors = frame.iter_errors({**document, **{key: [] for key in lists}})
    found = [(_place((), error, document), _rule(error)) for error in errors]
    for key, elements in lists.items():
        most = map_schema()["properties"][key]["maxItems"]
        if len(elements) > most:
            return [*found, (key, f"maxItems is {most}, got a list of {len(elements)}")]
        found += _element_faults(key, elements, document)
    return sorted(dict.fromkeys(found), key=lambda fault: _natural(fault[0]))


def _element_faults(
    key: str, elements: list[Any], document: dict[str, Any]
) -> list[tuple[str, str]]:
    """Breaches of the nodes or the edges, of the first thousand that have any.

    The general validator takes 0.1 ms an element, so it only sees those that a plain check
    would not let pass.
    """
    is_fine, name = _ELEMENTS[key]
    schema = {"$ref": f"#/$defs/{name}", "$defs": map_schema()["$defs"]}
    validator = Draft202012Validator(schema)
    suspects = (index for index, element in enumerate(elements) if not is_fine(element))
    return [
        (_place((key, index), error, document), _rule(error))
        for index in itertools.islice(suspects, _MOST_FAULTY)
        for error in validator.iter_errors(elements[index])
    ]


def _is_fine_node(raw: Any) -> bool:
    return (
        isinstance(raw, dict)
        and raw.keys() <= _NODE_KEYS
        and _is_name(raw.get("id"))
        and isinstance(raw.get("kind"), str)
        and raw["kind"] in _KINDS
        and _is_number(raw.get("x"), -1e6, 1e6)
        and _is_number(raw.get("y"), -1e6, 1e6)
        and (raw.get("room") is None or _is_name(raw["room"]))
        and _is_number(raw.get("size", 1.0), 0.001, 1000.0)
    )


def _is_fine_edge(raw: Any) -> bool:
    return (
        isinstance(raw, dict)
        and raw.keys() <= _EDGE_KEYS
        and all(_is_name(raw.get(key)) for key in ("id", "source", "target"))
        and isinstance(raw.get("behavior"), str)
        and raw["behavior"] in _BEHAVIORS
        and _is_number(raw.get("yaw", 0.0), -6.3, 6.3)
        and _is_number(raw.get("length", 0.0), 0.0, 1e6)
    )


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= 200 and not _CONTROL.search(value)


def _is_number(value: Any, low: float, high: float) -> bool:
    return type(value) in (int, float) and low <= value <= high


def _version_rule(document: dict[str, Any]) -> str:
    if "version" not in document:
        if {"oval", "line", "text"} <= document.keys():
            return (
                "this is a drawing of the GraphNav authors' canvas: "
                "`toponav map build AREA.yaml --out MAP` converts it"
            )
        return f"missing; this package reads version {FORMAT_VERSION}"
    version = document["version"]
    newer = isinstance(version, int) and not isinstance(version, bool) and version > FORMAT_VERSION
    advice = ": upgrade toponav" if newer else ""
    return f"this package reads version {FORMAT_VERSION}, got {_short(version)}{advice}"


def _place(outer: tuple[str | int, ...], error: ValidationError, document: dict[str, Any]) -> str:
    """`node 'office_1' (nodes[3]).x`: by name where the element has one, always by index."""
    path = [*outer, *error.absolute_path]
    if len(path) < 2 or path[0] not in ("nodes", "edges"):
        return ".".join(str(part) for part in path) or "document"
    element = document[path[0]][path[1]]
    name = element.get("id") if isinstance(element, dict) else None
    label = f"{str(path[0])[:-1]} {_short(name)} " if isinstance(name, str) else ""
    rest = "".join(f".{part}" for part in path[2:])
    return f"{label}({path[0]}[{path[1]}]){rest}"


def _rule(error: ValidationError) -> str:
    value = _short(error.instance)
    limit: Any = error.validator_value
    instance, schema = cast(Any, error.instance), cast(Any, error.schema)
    match error.validator:
        case "required":
            missing = [key for key in limit if key not in instance]
            return f"must have {', '.join(missing)}"
        case "additionalProperties":
            known = schema["properties"]
            extra = [key for key in instance if key not in known]
            return f"unknown key {_short(extra[0])}, {did_you_mean(extra[0], known)}"
        case "enum":
            hint = did_you_mean(error.instance, limit) if isinstance(error.instance, str) else ""
            return f"must be one of {', '.join(limit)}, got {value} {hint}".rstrip()
        case "type":
            return f"must be of type {limit}, got {value}"
        case "oneOf":
            return f"must be a name or null, got {value}"
        case "not":
            return f"must not hold control characters, got {value}"
        case "minLength":
            return "must not be empty"
        case "minimum" | "maximum" | "maxLength" | "maxItems":
            return f"{error.validator} is {limit}, got {value}"
    return error.message[:200]


def _short(value: Any) -> str:
    if isinstance(value, list | dict):
        return f"a {type(value).__name__} of {len(value)}"
    text = repr(value)
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 3] + "..."


_ELEMENTS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "nodes": (_is_fine_node, "node"),
    "edges": (_is_fine_edge, "edge"),
}


def _natural(place: str) -> tuple[int, int]:
    """Sorts document-level faults first, then nodes and edges by index."""
    for rank, key in enumerate(("nodes[", "edges["), start=1):
        if key in place:
            return rank, int(place.split(key)[1].split("]")[0])
    return 0, 0
