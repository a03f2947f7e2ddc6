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


Table_ = Literal["1", "5", "6", "rules", "failures", "transitions"]


def tables(
    folders: Annotated[tuple[Path, ...], tyro.conf.Positional],
    /,
    *,
    only: Annotated[tuple[Table_, ...], tyro.conf.UseAppendAction] = (),
    format: Literal["text", "csv", "latex"] = "text",
    out: Path | None = None,
    figures: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Lay out results as the paper's tables I, V and VI, with the paper's numbers beside ours.

    Then the same runs by both rules on contact, what failures are made of, and success by
    semantic transition. For two areas, to the terminal and then as files for a paper:

    toponav tables runs/area_1 runs/area_3

    toponav tables runs/area_1 runs/area_3 --format latex --out tables --figures

    Args:
        folders: Folders that `toponav eval graphnav` wrote.
        only: A table to show, instead of all of them. Repeat for more.
        format: How to lay the tables out.
        out: Folder to write `table_1`, `table_5`... to, instead of printing them.
        figures: Also draw what `toponav figures` draws, into --out or each folder's `figures`.
        json: Print the folders' results.json, by folder, instead of tables.
    """
    from toponav.core.errors import InputError
    from toponav.core.files import check_out_folder, write_atomically
    from toponav.evaluation.tables import load_results

    if out is not None:
        check_out_folder(out)
    if not folders:
        raise InputError(
            "at least one folder of results is needed",
            where="toponav tables",
            remedy="name a folder that `toponav eval graphnav` wrote",
        )
    stored = [load_results(folder) for folder in folders]
    if json:
        print(json_module.dumps({str(found.folder): found.results for found in stored}))
        return 0
    endings = {"text": "txt", "csv": "csv", "latex": "tex"}
    for name, table in _laid_out(stored, only).items():
        text = _as_text(table, format)
        if out is None:
            print(text)
        else:
            write_atomically(out / f"{name}.{endings[format]}", text)
            print(out / f"{name}.{endings[format]}")
    if figures:
        from toponav.cli.figures import figures as draw

        return draw(folders, out=out)
    return 0


def _laid_out(stored: Any, only: tuple[str, ...]) -> dict[str, Any]:
    from toponav.evaluation import tables as layouts
    from toponav.evaluation.analysis_tables import ANALYSES

    every = {
        "1": layouts.success_table,
        "5": layouts.localization_table,
        "6": layouts.prediction_table,
        **ANALYSES,
    }
    return {f"table_{name}": every[name](stored) for name in every if not only or name in only}


def _as_text(table: Any, format: str) -> str:
    from toponav.evaluation import tables as layouts

    if format == "text":
        return whole(layouts.to_rich(table))
    return layouts.to_csv(table) if format == "csv" else layouts.to_latex(table)


def whole(table: "Table") -> str:
    """A table as text: numbers cut off to fit a narrow terminal would be worth nothing."""
    from rich.console import Console

    width = Console(width=1000).measure(table).maximum
    console = Console(width=max(width, Console().width))
    with console.capture() as captured:
        console.print(table)
    return captured.get()
