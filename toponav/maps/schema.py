"""JSON documents that can be trusted to have the shape of their schema, or one clear error."""

import functools
import json
from importlib import resources
from pathlib import Path
from typing import Any, cast

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import read_json

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
    """Every breach of the schema as (place, rule), in the order of the document."""
    if not isinstance(document, dict):
        kind = type(document).__name__
        return [("document", f"a topological map is a JSON object, got {kind}")]
    version = document.get("version")
    if version != FORMAT_VERSION or isinstance(version, bool):
        return [("version", _version_rule(document))]
    errors = Draft202012Validator(map_schema()).iter_errors(document)
    found = [(_place(error, document), _rule(error)) for error in errors]
    return sorted(dict.fromkeys(found), key=lambda fault: _natural(fault[0]))


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


def _place(error: ValidationError, document: dict[str, Any]) -> str:
    """`node 'office_1' (nodes[3]).x`: by name where the element has one, always by index."""
    path = list(error.absolute_path)
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


def _natural(place: str) -> tuple[int, int]:
    """Sorts document-level faults first, then nodes and edges by index."""
    for rank, key in enumerate(("nodes[", "edges["), start=1):
        if key in place:
            return rank, int(place.split(key)[1].split("]")[0])
    return 0, 0
