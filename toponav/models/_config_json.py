"""Frozen dataclasses from JSON, strictly: no unknown keys, no missing ones, no other types."""

import dataclasses
import enum
import math
import types
import typing
from collections.abc import Mapping
from typing import Any, Literal, TypeVar

from toponav.core.errors import InputError, did_you_mean

__all__ = ["config_from_json"]

Config = TypeVar("Config")
_MOST_ITEMS = 1000
_REMEDY = "copy the checkpoint again, or use the version of toponav that wrote it"


def config_from_json(config_type: type[Config], document: Mapping[str, Any], where: str) -> Config:
    """The configuration that `dataclasses.asdict` turned into this JSON.

    Raises:
        InputError: A key is missing or unknown, or a value has the wrong type or range.
    """
    value = _parse(config_type, document, "config", where)
    assert isinstance(value, config_type)
    return value


def _parse(wanted: Any, value: Any, key: str, where: str) -> Any:
    origin, arguments = typing.get_origin(wanted), typing.get_args(wanted)
    if dataclasses.is_dataclass(wanted):
        return _parse_dataclass(wanted, value, key, where)
    if origin is Literal:
        if value in arguments:
            return value
    elif origin is tuple:
        if isinstance(value, list) and len(value) <= _MOST_ITEMS:
            repeated = arguments[-1] is Ellipsis
            if repeated or len(value) == len(arguments):
                kinds = [arguments[0]] * len(value) if repeated else arguments
                return tuple(
                    _parse(kind, item, f"{key}[{number}]", where)
                    for number, (kind, item) in enumerate(zip(kinds, value, strict=True))
                )
    elif isinstance(wanted, type) and issubclass(wanted, enum.Enum):
        if value in [member.value for member in wanted]:
            return wanted(value)
    elif wanted is float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if is_number and math.isfinite(value):
            return float(value)
    elif isinstance(value, wanted) and (wanted is bool) == isinstance(value, bool):
        return value
    name = (
        str(wanted)
        if isinstance(wanted, types.GenericAlias)
        else getattr(wanted, "__name__", wanted)
    )
    raise InputError(
        f"{key} has to be {name}, got {str(value)[:80]!r}", where=where, remedy=_REMEDY
    )


def _parse_dataclass(wanted: Any, value: Any, key: str, where: str) -> Any:
    kinds = typing.get_type_hints(wanted)
    if not isinstance(value, dict):
        raise InputError(f"{key} has to be an object", where=where, remedy=_REMEDY)
    for name in value:
        if name not in kinds:
            raise InputError(
                f"{key} has no {str(name)[:80]!r}; {did_you_mean(str(name), kinds)}",
                where=where,
                remedy=_REMEDY,
            )
    missing = [name for name in kinds if name not in value]
    if missing:
        raise InputError(f"{key} lacks {missing[0]!r}", where=where, remedy=_REMEDY)
    parsed = {name: _parse(kinds[name], value[name], f"{key}.{name}", where) for name in kinds}
    try:
        return wanted(**parsed)
    except InputError as error:
        raise InputError(error.rule, where=f"{where}, {key}", remedy=_REMEDY) from None
