"""`toponav tables`: the papers' tables, theirs beside ours."""

import json as json_module
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["register", "tables", "whole"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {("tables",): tables}


def tables(
    folders: Annotated[tuple[Path, ...], tyro.conf.Positional],
    /,
    *,
    format: Literal["text", "csv", "latex"] = "text",
    out: Path | None = None,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Lay out results as the paper's tables I and VI, with the paper's numbers beside ours.

    For two areas, to the terminal and then as files for a paper:

    toponav tables runs/area_1 runs/area_3

    toponav tables runs/area_1 runs/area_3 --format latex --out tables

    Args:
        folders: Folders that `toponav eval graphnav` wrote.
        format: How to lay the tables out.
        out: Folder to write `table_1` and `table_6` to, instead of printing them.
        json: Print the folders' results.json, by folder, instead of tables.
    """
    from toponav.core.errors import InputError
    from toponav.core.files import check_out_folder, write_atomically
    from toponav.evaluation import tables as layouts

    if out is not None:
        check_out_folder(out)
    if not folders:
        raise InputError(
            "at least one folder of results is needed",
            where="toponav tables",
            remedy="name a folder that `toponav eval graphnav` wrote",
        )
    stored = [layouts.load_results(folder) for folder in folders]
    if json:
        print(json_module.dumps({str(found.folder): found.results for found in stored}))
        return 0
    made = {"table_1": layouts.success_table(stored), "table_6": layouts.prediction_table(stored)}
    endings = {"text": "txt", "csv": "csv", "latex": "tex"}
    for name, table in made.items():
        if format == "text":
            text = whole(layouts.to_rich(table))
        else:
            text = layouts.to_csv(table) if format == "csv" else layouts.to_latex(table)
        if out is None:
            print(text)
        else:
            write_atomically(out / f"{name}.{endings[format]}", text)
            print(out / f"{name}.{endings[format]}")
    return 0


def whole(table: "Table") -> str:
    """A table as text: numbers cut off to fit a narrow terminal would be worth nothing."""
    from rich.console import Console

    width = Console(width=1000).measure(table).maximum
    console = Console(width=max(width, Console().width))
    with console.capture() as captured:
        console.print(table)
    return captured.get()
