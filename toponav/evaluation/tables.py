"""Tables."""

from typing import Any

from rich.table import Table

__all__ = ["summary_table"]


def summary_table(results: dict[str, Any], title: str) -> Table:
    """x."""
    table = Table(title=title)
    return table
