"""`toponav demo`: the main job, ending with a page to look at."""

import json as json_module
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import tyro

__all__ = ["demo", "register"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    from toponav.cli._demo_imagenav import demo_imagenav

    return {("demo",): demo, ("demo", "imagenav"): demo_imagenav}


def demo(
    *,
    out: Path = Path("toponav-demo"),
    building: int | None = None,
    plans: int = 4,
    seed: int = 0,
    agent: str = "graphnav_pf",
    weights: str | None = None,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Drive an office that no training run saw, and write a page to look at.

    The usual one, and another building:

    toponav demo

    toponav demo --building 7 --out demo-7

    Args:
        out: Folder for the page, the film and the numbers.
        building: Which of the 50 test offices, from 0; the demo's own if left out.
        plans: How many plans to drive.
        seed: Seed of the plans.
        agent: Who the page is about: graphnav_pf, graphnav, or your own as module:factory.
            GTL and the expert drive beside it.
        weights: Folder of other weights. What ships, if left out.
        json: Print results.json instead of a summary.
    """
    from rich.console import Console

    from toponav.core.files import check_out_folder
    from toponav.evaluation.agents import check_weights
    from toponav.evaluation.demo import DemoConfig, run_demo
    from toponav.evaluation.metrics import suite_results

    began_s = time.perf_counter()
    agents = tuple(dict.fromkeys((agent, "gtl", "expert")))
    config = DemoConfig(out, building, plans, agents, weights, seed)
    check_out_folder(out)
    check_weights(weights, agents)
    errors = Console(stderr=True)
    with _progress_bar(errors) as bar:
        line = bar.add_task("starting", total=1)

        def show(what: str, done: int, total: int) -> None:
            bar.update(line, description=what, completed=done, total=total)

        result = run_demo(config, show)
    results = suite_results(result.report.records.values())
    if json:
        print(json_module.dumps(results))
        return 0
    from toponav.cli.tables import whole
    from toponav.evaluation.tables import summary_table

    console = Console()
    print(whole(summary_table(results, title=f"{result.report.suite.name}, {plans} plans")))
    page = result.page.resolve()
    console.print(f"{time.perf_counter() - began_s:.0f} s in all. Open this page in a browser:")
    console.print(f"  {page.as_uri()}", style="bold", highlight=False, soft_wrap=True)
    return 0


def _progress_bar(console: Any) -> Any:
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    columns = (
        TextColumn("{task.description:<28}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    return Progress(*columns, console=console, transient=True)
