"""`toponav eval imagenav`: look for pictures in homes, write a folder of results."""

import json as json_module
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

__all__ = ["eval_imagenav"]

_Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]


def eval_imagenav(
    *,
    agent: Annotated[tuple[str, ...], tyro.conf.UseAppendAction],
    out: Path,
    suite: str = "homes-test",
    episodes: int = 100,
    level: Annotated[
        tuple[Literal["easy", "medium", "hard"], ...], tyro.conf.UseAppendAction
    ] = (),
    no_noise: _Flag = False,
    no_stop: _Flag = False,
    sliding: _Flag = False,
    goals: int = 1,
    seed: int = 0,
    workers: int = 1,
    engine: Literal["local", "ray"] = "local",
    weights: str | None = None,
    json: _Flag = False,
) -> int:
    """Evaluate agents that look for the place in a picture, as the NTS paper does.

    A hundred episodes of each difficulty, in homes that no training run saw:

    toponav eval imagenav --agent nts_rgbd --agent ans_rgbd --workers 2 --out runs/table_1

    The paper's Table 2, and its figure 8:

    toponav eval imagenav --agent nts_rgbd --no-noise --out runs/no_noise

    toponav eval imagenav --agent nts_rgbd --agent nts_no_graph_rgbd --goals 5 --out runs/goals

    Writes run.json, results.json and episodes.parquet; `toponav tables` lays them out. All agents
    get the same episodes with the same noise. Interrupt it whenever you like: the same command
    resumes, and the results are the same.

    Args:
        agent: Agent to evaluate: a name in the registry, such as nts_rgbd, ans_rgbd,
            frontier_rgbd, oracle or random, or your own as module:factory. NAME=WEIGHTS gives it
            other weights, ,label=LABEL another name in the results. Repeat for more; the first is
            compared with each of the others. `all` stands for every row of tables 1 and 2 whose
            weights ship.
        out: Folder of results.
        suite: Homes to run in: homes-test or homes-val.
        episodes: How many of each difficulty.
        level: A difficulty, instead of all three. Repeat for more.
        no_noise: Perfect motions and odometry.
        no_stop: An episode ends by itself where stopping would have been right.
        sliding: The robot slides along what it touches.
        goals: Goals one after the other in each episode.
        seed: Seed of the noise and of the agents.
        workers: Processes. Results do not depend on it.
        engine: Where they run: on this machine, or on a Ray cluster.
        weights: Folder of other weights, or a preset. What ships, if left out.
        json: Print results.json instead of a table.
    """
    from toponav.cli.progress_bar import progress
    from toponav.core.imagenav import DIFFICULTIES
    from toponav.evaluation.imagenav.runner import ImageNavConfig, evaluate_image_nav
    from toponav.evaluation.imagenav.worker import ImageNavSettings

    config = ImageNavConfig(
        agents=tuple(dict.fromkeys(_named(agent))),
        out=out,
        suite=suite,
        levels=tuple(name for name in DIFFICULTIES if not level or name in level),
        episodes=episodes,
        settings=ImageNavSettings(
            noise=not no_noise,
            stop=not no_stop,
            sliding=sliding,
            goals=goals,
            weights=weights,
            seed=seed,
        ),
        workers=workers,
        engine=engine,
    )
    with progress("episodes") as update:
        evaluation = evaluate_image_nav(config, update)
    if json:
        print(json_module.dumps(evaluation.results))
    else:
        _print_summary(evaluation)
    return 0


def _named(agents: tuple[str, ...]) -> Iterator[str]:
    from toponav.evaluation.imagenav.agents import table_agents

    for agent in agents:
        yield from table_agents() if agent == "all" else (agent,)


def _print_summary(evaluation: Any) -> None:
    from rich.console import Console

    from toponav.cli.tables import whole
    from toponav.evaluation.imagenav.tables import summary_table
    from toponav.evaluation.table_layout import to_rich

    console = Console()
    if evaluation.resumed:
        console.print(f"{evaluation.resumed} episodes were finished before")
    if len(evaluation.commits) > 1:
        commits = ", ".join(str(commit)[:12] for commit in evaluation.commits)
        console.print(f"[yellow]the episodes come from several source versions: {commits}[/]")
    print(whole(to_rich(summary_table(evaluation.results))))
    console.print(f"results in {evaluation.out}", highlight=False, soft_wrap=True, markup=False)
