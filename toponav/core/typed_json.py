"""Frozen dataclasses from JSON, strictly: no unknown keys, no other types, none left out."""

import dataclasses
import enum
import types
import typing
from typing import Any, Literal, TypeVar

from toponav.core.errors import InputError, did_you_mean, shown

__all__ = ["from_json"]

Value = TypeVar("Value")
_MOST_ITEMS = 10_000
_REMEDY = "copy the file again, or use the version of toponav that wrote it"


def from_json(
    wanted: type[Value], document: Any, *, where: str, key: str = "", remedy: str = _REMEDY
) -> Value:
    """The dataclass that `dataclasses.asdict` turned into this JSON.

    Fields may be numbers, text, enumerations, literals, mappings from text, tuples, dataclasses,
    and any of these or None.

    Args:
        wanted: The dataclass.
        document: What JSON parsing gave.
        where: The file, for messages.
        key: Where in the file, for messages.
        remedy: What to do about a fault.

    Raises:
        InputError: A key is missing or unknown, or a value has the wrong type or range.
    """
    value = _Parser(where, remedy).parse(wanted, document, key)
    assert isinstance(value, wanted)
    return value


@dataclasses.dataclass(frozen=True)
class _Parser:
    where: str
    remedy: str

    def parse(self, wanted: Any, value: Any, key: str) -> Any:
        origin, arguments = typing.get_origin(wanted), typing.get_args(wanted)
        if wanted is Any:
            return value
        if dataclasses.is_dataclass(wanted):
            return self._dataclass(wanted, value, key)
        if origin in (typing.Union, types.UnionType):
            choices = [one for one in arguments if one is not type(None)]
            if value is None and len(choices) < len(arguments):
                return None
            exact = [kind for kind in choices if type(value) is kind]
            return self.parse((exact or choices)[-1], value, key)
        if origin is Literal:
            if any(value == one and type(value) is type(one) for one in arguments):
                return value
        elif origin is tuple and isinstance(value, list) and len(value) <= _MOST_ITEMS:
            repeated = arguments[-1] is Ellipsis
            if repeated or len(value) == len(arguments):
                kinds = [arguments[0]] * len(value) if repeated else arguments
                return tuple(
                    self.parse(kind, item, f"{key}[{number}]")
                    for number, (kind, item) in enumerate(zip(kinds, value, strict=True))
                )
        elif origin is list and isinstance(value, list) and len(value) <= _MOST_ITEMS:
            return [
                self.parse(arguments[0], item, f"{key}[{number}]")
                for number, item in enumerate(value)
            ]
        elif origin is dict and isinstance(value, dict):
            return {
                name: self.parse(arguments[1], one, f"{key}.{name}") for name, one in value.items()
            }
        elif isinstance(wanted, type) and issubclass(wanted, enum.Enum):
            if value in [member.value for member in wanted]:
                return wanted(value)
        elif wanted is float:
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            if is_number and abs(value) <= 1e300:
                return float(value)
        elif _is_plain(wanted, value):
            return value
        name = wanted.__name__ if isinstance(wanted, type) and not arguments else str(wanted)
        raise self._fault(f"{key or 'it'} has to be {name}, got {shown(value)}")

    def _dataclass(self, wanted: Any, value: Any, key: str) -> Any:
        kinds = typing.get_type_hints(wanted)
        if not isinstance(value, dict):
            raise self._fault(f"{key or 'it'} has to be an object")
        for name in value:
            if name not in kinds:
                hint = did_you_mean(str(name), kinds)
                raise self._fault(f"{key or 'it'} has no {str(name)[:80]!r}; {hint}")
        needed = [field.name for field in dataclasses.fields(wanted) if _has_no_default(field)]
        missing = [name for name in needed if name not in value]
        if missing:
            raise self._fault(f"{key or 'it'} lacks {missing[0]!r}")
        prefix = f"{key}." if key else ""
        parsed = {name: self.parse(kinds[name], value[name], prefix + name) for name in value}
        try:
            return wanted(**parsed)
        except InputError as error:
            raise self._fault(error.rule, key) from None

    def _fault(self, rule: str, key: str = "") -> InputError:
        where = f"{self.where}, {key}" if key else self.where
        return InputError(rule, where=where, remedy=self.remedy)


def _has_no_default(field: "dataclasses.Field[Any]") -> bool:
    """Whether old files have it too: a field added later has the default that they meant."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _is_plain(wanted: Any, value: Any) -> bool:
    """Whether the value is of a class that JSON has, a whole number never being a truth value."""
    if wanted is int:
        return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63
    return isinstance(wanted, type) and isinstance(value, wanted)
