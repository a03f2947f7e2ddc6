"""Values out of strangers' documents, each checked and each fault named by its place."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeGuard

from toponav.core.errors import InputError, shown

__all__ = ["Place", "is_name"]

_CONTROL = re.compile("[\u0000-\u001f\u007f\ud800-\udfff]")
_LONGEST_NAME = 200
_LARGEST_M = 1e6


def is_name(value: Any) -> TypeGuard[str]:
    """Whether our maps can have this as a name."""
    return (
        isinstance(value, str)
        and 0 < len(value) <= _LONGEST_NAME
        and ((value.isascii() and value.isprintable()) or not _CONTROL.search(value))
    )


@dataclass(frozen=True)
class Place:
    """A place in a document, to say where a fault is."""

    file: str
    path: str = ""

    def __str__(self) -> str:
        return f"{self.file}: {self.path}" if self.path else self.file

    def key(self, name: object) -> "Place":
        """The place under a key."""
        text = str(name)[:80]
        return Place(self.file, f"{self.path}.{text}" if self.path else text)

    def index(self, number: int) -> "Place":
        """The place at an index."""
        return Place(self.file, f"{self.path}[{number}]")

    def fault(
        self, rule: str, remedy: str = "correct it in the tool that made the file"
    ) -> InputError:
        """The error that says that something has to hold here."""
        return InputError(rule, where=str(self), remedy=remedy)

    def mapping(self, value: Any) -> Mapping[str, Any]:
        """The value, if it is an object."""
        if not isinstance(value, dict):
            raise self.fault(f"must be an object, got {_kind(value)}")
        return value

    def sequence(self, value: Any, *, at_least: int = 0) -> list[Any]:
        """The value, if it is a list of at least so many elements."""
        if not isinstance(value, list):
            raise self.fault(f"must be a list, got {_kind(value)}")
        if len(value) < at_least:
            raise self.fault(f"must have at least {at_least} elements, got {len(value)}")
        return value

    def name(self, value: Any) -> str:
        """The value, if our maps can have it as a name."""
        if not is_name(value):
            raise self.fault(
                f"must be a name of 1 to {_LONGEST_NAME} characters without control characters, "
                f"got {_kind(value)}"
            )
        text: str = value
        return text

    def number(self, value: Any, low: float = -_LARGEST_M, high: float = _LARGEST_M) -> float:
        """The value, if it is a number in the range; numbers written as text count too."""
        if isinstance(value, str) and len(value) <= 40:
            try:
                value = float(value)
            except ValueError:
                raise self.fault(f"must be a number, got {shown(value, 50)}") from None
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fault(f"must be a number, got {_kind(value)}")
        if not low <= value <= high:
            raise self.fault(f"must be a number from {low:g} to {high:g}, got {shown(value, 50)}")
        return float(value)

    def whole(self, value: Any, low: int, high: int) -> int:
        """The value, if it is a whole number in the range."""
        if isinstance(value, float) and math.isfinite(value) and value == int(value):
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.fault(f"must be a whole number from {low} to {high}, got {_kind(value)}")
        return value


def _kind(value: Any) -> str:
    if isinstance(value, list | dict):
        return f"a {'list' if isinstance(value, list) else 'mapping'} of {len(value)}"
    if isinstance(value, str):
        return shown(value[:80], 60)
    return shown(value, 60)
