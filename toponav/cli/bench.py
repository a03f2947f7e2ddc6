"""`toponav bench`: how fast this machine runs the parts."""

import json as json_module
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

__all__ = ["bench", "register"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {("bench",): bench}


def bench(
    only: Literal["all", "render", "closed_loop", "imagenav"] = "all",
    out: Path = Path("benchmarks/results"),
    agent: str = "graphnav_pf",
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Measure frame rates, the closed loop and its memory, image-goal agents, on one core.

    Runs on Stanford area 3 where the data is there (TOPONAV_DATA), else in a generated office.

    toponav bench --only render

    Args:
        only: Which benchmark to run.
        out: Folder to write `<name>.json` to.
        agent: The agent in the closed loop: a name of the registry, or module:factory.
        json: Print the figures as JSON.
    """
    from rich.console import Console

    from toponav.core.files import check_out_folder
    from toponav.evaluation.agents import check_agent_name
    from toponav.evaluation.benchmarks.closed_loop import measure_closed_loop
    from toponav.evaluation.benchmarks.imagenav import measure_image_nav
    from toponav.evaluation.benchmarks.record import Benchmark, run_alone, write_benchmark
    from toponav.evaluation.benchmarks.render import measure_render

    check_agent_name(agent)
    check_out_folder(out)
    measures: dict[str, Callable[[], Benchmark]] = {
        "render": lambda: run_alone(measure_render),
        "closed_loop": lambda: run_alone(measure_closed_loop, agent),
        "imagenav": lambda: run_alone(measure_image_nav),
    }
    console = Console(stderr=json)
    found = []
    for name, measure in measures.items():
        if only in ("all", name):
            with console.status(f"measuring {name} ..."):
                found.append(measure())
            path = write_benchmark(found[-1], out)
            if not json:
                _print(console, found[-1], path)
    if json:
        print(json_module.dumps({one.name: dict(one.metrics) for one in found}))
    return 0


def _print(console: Any, benchmark: Any, path: Path) -> None:
    from rich.table import Table

    table = Table(
        title=f"{benchmark.name} in {benchmark.settings['building']}", title_justify="left"
    )
    table.add_column("metric")
    table.add_column("median", justify="right")
    for name, value in benchmark.metrics.items():
        table.add_row(name, f"{value:,.0f}" if value >= 100 else f"{value:.2f}")
    console.print(table)
    if "left_out" in benchmark.settings:
        console.print(f"left out: {benchmark.settings['left_out']}", markup=False)
    console.print(f"written: {path}", markup=False)
