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


Table_ = Literal[
    "1",
    "5",
    "6",
    "rules",
    "failures",
    "transitions",
    "nts_1",
    "nts_2",
    "nts_figure_8",
    "nts_paired",
    "nts_episodes",
]


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
    """Lay out results as the papers' tables, with the papers' numbers beside ours.

    GraphNav's tables I, V and VI, the same runs by both rules on contact, what failures are made
    of, and success by semantic transition. For two areas, to the terminal and as files:

    toponav tables runs/area_1 runs/area_3

    toponav tables runs/area_1 runs/area_3 --format latex --out tables --figures

    Of runs of `toponav eval imagenav`, tables 1 and 2 and figure 8 of Neural Topological SLAM,
    paired differences, and how hard the episodes are:

    toponav tables runs/nts runs/nts_no_stop runs/nts_goals --out tables --figures

    Args:
        folders: Folders that `toponav eval graphnav` or `toponav eval imagenav` wrote.
        only: A table to show, instead of all of them. Repeat for more.
        format: How to lay the tables out.
        out: Folder to write `table_1`, `table_5`... to, instead of printing them.
        figures: Also draw what `toponav figures` draws, into --out or each folder's `figures`.
        json: Print the folders' results.json, by folder, instead of tables.
    """
    from toponav.core.errors import InputError
    from toponav.core.files import check_out_folder, write_atomically
    from toponav.evaluation.imagenav.tables import is_image_nav, load_image_nav_results
    from toponav.evaluation.tables import load_results

    if out is not None:
        check_out_folder(out)
    if not folders:
        raise InputError(
            "at least one folder of results is needed",
            where="toponav tables",
            remedy="name a folder that `toponav eval graphnav` or `eval imagenav` wrote",
        )
    image_nav = [folder for folder in folders if is_image_nav(folder)]
    stored = [load_results(folder) for folder in folders if folder not in image_nav]
    pictures = [load_image_nav_results(folder) for folder in image_nav]
    if json:
        every = {str(found.folder): found.results for found in stored}
        every |= {str(found.folder): found.results for found in pictures}
        print(json_module.dumps(every))
        return 0
    endings = {"text": "txt", "csv": "csv", "latex": "tex"}
    for name, table in {**_laid_out(stored, only), **_of_nts(pictures, only)}.items():
        text = _as_text(table, format)
        if out is None:
            print(text)
        else:
            write_atomically(out / f"{name}.{endings[format]}", text)
            print(out / f"{name}.{endings[format]}")
    if figures and pictures:
        _draw_figure_8(pictures, out or pictures[0].folder / "figures")
    if figures and stored:
        from toponav.cli.figures import figures as draw

        return draw(tuple(found.folder for found in stored), out=out)
    return 0


def _of_nts(pictures: Any, only: tuple[str, ...]) -> dict[str, Any]:
    """The tables of image-goal runs; one without a row is left out."""
    from toponav.evaluation.imagenav.tables import IMAGE_NAV_TABLES

    if not pictures:
        return {}
    laid_out = {
        f"table_{name}": lay_out(pictures)
        for name, lay_out in IMAGE_NAV_TABLES.items()
        if not only or name in only
    }
    return {name: table for name, table in laid_out.items() if table.rows}


def _draw_figure_8(pictures: Any, out: Path) -> None:
    import io

    from toponav.core.files import write_atomically
    from toponav.evaluation.imagenav.tables import sequential_figure

    content = io.BytesIO()
    sequential_figure(pictures).savefig(content, format="png", dpi=150)
    print(write_atomically(out / "nts_figure_8.png", content.getvalue()))


def _laid_out(stored: Any, only: tuple[str, ...]) -> dict[str, Any]:
    if not stored:
        return {}
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
