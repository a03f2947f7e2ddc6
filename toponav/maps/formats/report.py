"""What a conversion between map formats lost, guessed or changed, to be told to the user."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from toponav.core.errors import shown

__all__ = ["ConversionReport", "Loss", "Notes", "ReportLine"]

_EXAMPLES = 3


class Loss(StrEnum):
    """What happened to a piece of information."""

    DROPPED = "dropped"
    """The format or our maps have no place for it."""
    GUESSED = "guessed"
    """It was not there and had to be made up."""
    CHANGED = "changed"
    """It is there, but not as it was."""


@dataclass(frozen=True)
class ReportLine:
    """One kind of loss.

    Example:
        >>> str(ReportLine(Loss.DROPPED, "sizes", "LIF has no place for them", 2, ("a", "b")))
        "dropped: sizes: LIF has no place for them (2: 'a', 'b')"
    """

    loss: Loss
    what: str
    """Which information."""
    how: str
    """Why it was lost, or how it was guessed."""
    count: int
    """How many elements it concerns."""
    examples: tuple[str, ...]
    """The first of them."""

    def __str__(self) -> str:
        named = ", ".join(shown(example, 40) for example in self.examples)
        more = ", ..." if self.examples and self.count > len(self.examples) else ""
        where = (
            f" ({self.count}{': ' * bool(named)}{named}{more})" if self.count > 1 or named else ""
        )
        return f"{self.loss}: {self.what}: {self.how}{where}"


@dataclass(frozen=True)
class ConversionReport:
    """Everything that a conversion lost, guessed or changed; without lines it was exact.

    Example:
        >>> bool(ConversionReport())
        False
    """

    lines: tuple[ReportLine, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.lines)

    def __iter__(self) -> Iterator[ReportLine]:
        return iter(self.lines)

    def __add__(self, other: "ConversionReport") -> "ConversionReport":
        return ConversionReport(self.lines + other.lines)

    def to_document(self) -> list[dict[str, Any]]:
        """The lines as JSON."""
        return [
            {
                "loss": line.loss.value,
                "what": line.what,
                "how": line.how,
                "count": line.count,
                "examples": list(line.examples),
            }
            for line in self.lines
        ]


@dataclass
class Notes:
    """Collects losses element by element, and counts those of one kind on one line."""

    _found: dict[tuple[Loss, str, str], tuple[int, list[str]]] = field(default_factory=dict)

    def dropped(self, what: str, how: str, example: str = "", count: int = 1) -> None:
        """Notes what has no place."""
        self._add(Loss.DROPPED, what, how, example, count)

    def guessed(self, what: str, how: str, example: str = "", count: int = 1) -> None:
        """Notes what was made up."""
        self._add(Loss.GUESSED, what, how, example, count)

    def changed(self, what: str, how: str, example: str = "", count: int = 1) -> None:
        """Notes what is no longer as it was."""
        self._add(Loss.CHANGED, what, how, example, count)

    def report(self) -> ConversionReport:
        """The lines so far, in the order in which their kinds were first noted."""
        return ConversionReport(
            tuple(
                ReportLine(loss, what, how, count, tuple(examples))
                for (loss, what, how), (count, examples) in self._found.items()
            )
        )

    def _add(self, loss: Loss, what: str, how: str, example: str, count: int) -> None:
        if count == 0:
            return
        before, examples = self._found.get((loss, what, how), (0, []))
        if example and len(examples) < _EXAMPLES:
            examples.append(example[:200])
        self._found[loss, what, how] = before + count, examples
