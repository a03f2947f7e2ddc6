"""Errors a person can act on."""

import difflib
import itertools
from collections.abc import Iterable

__all__ = ["InputError", "did_you_mean", "shown"]

_COMPARED = 100
_MOST_COMPARED = 2000


class InputError(ValueError):
    """Something a user gave is wrong; the message says what, where and the remedy.

    The command line prints the message without a traceback and exits with status 1.

    Args:
        rule: What has to hold, and the value received instead.
        where: The file, node, edge, episode or flag at fault.
        remedy: What to do about it.

    Example:
        >>> raise InputError("depth must be finite, got NaN", where="frame 3", remedy="drop it")
        Traceback (most recent call last):
        toponav.core.errors.InputError: frame 3: depth must be finite, got NaN. Remedy: drop it
    """

    def __init__(self, rule: str, *, where: str, remedy: str) -> None:
        self.rule = rule
        self.where = where
        self.remedy = remedy
        super().__init__(f"{where}: {rule.rstrip('.')}. Remedy: {remedy}")


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """The nearest valid name as a hint, or the valid names when none is near.

    Example:
        >>> did_you_mean("turn_lift", ["turn_left", "straight"])
        "did you mean 'turn_left'?"
    """
    name, names = name[:_COMPARED], sorted(itertools.islice(valid, _MOST_COMPARED))
    by_lower_case = {valid_name.lower(): valid_name for valid_name in names}
    near = difflib.get_close_matches(name, names, n=1) or [
        by_lower_case[found]
        for found in difflib.get_close_matches(name.lower(), by_lower_case, n=1)
    ]
    if near:
        return f"did you mean '{near[0]}'?"
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"valid names: {shown or 'none'}"


def shown(value: object, most: int = 80) -> str:
    """A value received, as a message shows it: never longer than a line.

    Example:
        >>> shown("office")
        "'office'"
    """
    text = repr(value)
    return text if len(text) <= most else f"{text[: most - 3]}..."
