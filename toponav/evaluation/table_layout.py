"""Tables of text cells, and their three shapes: for a terminal, as CSV, as LaTeX."""

import csv
import io
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.markup import escape
from rich.table import Table

__all__ = [
    "NONE",
    "PaperTable",
    "counted",
    "interval",
    "pair",
    "percent",
    "to_csv",
    "to_latex",
    "to_markdown",
    "to_rich",
]

NONE = "-"


@dataclass(frozen=True)
class PaperTable:
    """A table as text cells; the first columns are names, rows with the same names a group."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    name_columns: int = 3


def percent(value: float | None) -> str:
    """A share in per cent."""
    return NONE if value is None else f"{100 * value:.1f}"


def interval(ends: Sequence[float] | None) -> str:
    """A confidence interval in per cent."""
    return NONE if ends is None else f"{100 * ends[0]:.0f}..{100 * ends[1]:.0f}"


def pair(numbers: Mapping[str, Any] | None) -> str:
    """Success and plan completion."""
    if numbers is None:
        return NONE
    return f"{percent(numbers['success_rate'])} / {percent(numbers['plan_completion'])}"


def counted(numbers: Mapping[str, Any], rate: str, count: str) -> str:
    """A rate with the number of trials behind it."""
    return f"{percent(numbers[rate])} ({numbers[count]})"


def to_rich(table: PaperTable) -> Table:
    """The table for a terminal."""
    caption = "\n".join(map(escape, table.notes)) or None
    shown = Table(title=escape(table.title), caption=caption, caption_justify="left")
    for position, column in enumerate(table.columns):
        is_name = position < table.name_columns
        shown.add_column(column, justify="left" if is_name else "right", no_wrap=is_name)
    areas = [row[0] if table.name_columns > 1 else "" for row in table.rows]
    for row, area, following in itertools.zip_longest(table.rows, areas, areas[1:]):
        shown.add_row(*map(escape, row), end_section=area != following)
    return shown


def to_csv(table: PaperTable) -> str:
    """The table as CSV, with a header."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return sink.getvalue()


def to_latex(table: PaperTable) -> str:
    """The table as a LaTeX `table*` that needs the package booktabs."""
    names = table.name_columns
    columns = "l" * names + "r" * (len(table.columns) - names)
    lines = [
        r"\begin{table*}",
        r"\centering\footnotesize\setlength{\tabcolsep}{3pt}",
        rf"\caption{{{_latex(table.title)}. {_latex(' '.join(table.notes))}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        " & ".join(map(_latex, table.columns)) + r" \\",
        r"\midrule",
    ]
    for before, row in zip((None, *table.rows), table.rows, strict=False):
        if before is not None and before[: names - 1] != row[: names - 1]:
            lines.append(r"\addlinespace")
        lines.append(" & ".join(map(_latex, row)) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", r"\end{table*}"]) + "\n"


def to_markdown(table: PaperTable) -> str:
    """The table for a page of documentation, its title and notes around it."""
    names = table.name_columns
    aligned = ["---"] * names + ["--:"] * (len(table.columns) - names)
    rows = [" | ".join(cell.replace("|", "\\|") for cell in row) for row in table.rows]
    lines = [" | ".join(table.columns), " | ".join(aligned), *rows]
    body = "\n".join(f"| {line} |" for line in lines)
    return "\n\n".join([f"**{table.title}**", body, *table.notes])


_LATEX = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        ">": r"\textgreater{}",
        "<": r"\textless{}",
        **{letter: f"\\{letter}" for letter in "%_&#$}{"},
    }
)


def _latex(text: str) -> str:
    return text.translate(_LATEX)
