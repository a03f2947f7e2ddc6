"""`toponav eval graphnav`: drive plans, judge them, write a folder of results."""

import json as json_module
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

__all__ = ["eval_graphnav", "eval_localization", "register"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    from toponav.cli._eval_imagenav import eval_imagenav

    return {
        ("eval", "graphnav"): eval_graphnav,
        ("eval", "localization"): eval_localization,
        ("eval", "imagenav"): eval_imagenav,
    }


def eval_graphnav(
    *,
    agent: Annotated[tuple[str, ...], tyro.conf.UseAppendAction],
    out: Path,
    area: Path | None = None,
    plans: Path | None = None,
    scene: Path | None = None,
    map: Path | None = None,
    episodes: int | None = None,
    seed: int = 0,
    workers: int = 1,
    engine: Literal["local", "ray"] = "local",
    weights: str | None = None,
    collisions: Literal["fail", "stuck"] = "fail",
    no_expert: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Evaluate agents on the GraphNav protocol, strict and tolerant from the same runs.

    On published pairs of a Stanford area, with two processes:

    toponav eval graphnav --area area_3.yaml --plans area_3_plans.json
    --agent graphnav_pf --agent gtl --workers 2 --out runs/area_3

    On twenty plans sampled in a scene:

    toponav eval graphnav --scene office --map office.topo.json --episodes 20
    --agent graphnav_pf --out runs/office

    Two weights beside each other, on the same episodes with the same random numbers:

    toponav eval graphnav --scene office --map office.topo.json
    --agent graphnav_pf=compact --agent graphnav_pf=runs/weights --out runs/both

    Writes run.json, results.json, episodes.parquet and steps.parquet. Interrupt it whenever
    you like: the same command resumes, and the results are the same.

    Args:
        agent: Agent to evaluate: a name in the registry, such as graphnav, graphnav_pf, gtl or
            expert, or your own as module:factory. NAME=WEIGHTS gives it other weights than
            --weights does, NAME,setting=value a setting, ,label=LABEL another name in the
            results. teacher_forced measures localization as Table V does. Repeat for more.
            The expert is always run beside the others.
        out: Folder of results.
        area: A Stanford area in the GraphNav authors' format (yaml).
        plans: Published start/goal pairs of that area (json).
        scene: Folder of a scene, instead of an area.
        map: Topological map of that scene.
        episodes: How many: the first pairs, or sampled plans. All pairs, or 20, if left out.
        seed: Seed of sampled plans and of the agents.
        workers: Processes. Results do not depend on it.
        engine: Where they run: on this machine, or on a Ray cluster.
        weights: Folder of other weights, or a preset. What ships, if left out.
        collisions: The rule on contact behind the headline numbers; every run is judged by both.
            `fail`: any contact fails. `stuck`: the reference code's softer rule.
        no_expert: Leave out the expert, and with it the success on what it passes.
        json: Print results.json instead of a table.
    """
    from toponav.core.errors import InputError
    from toponav.evaluation.protocol import JudgeRules
    from toponav.evaluation.runner import EvaluationConfig
    from toponav.evaluation.suite import SuiteSource
    from toponav.evaluation.worker import RunSettings

    if not agent:
        raise InputError(
            "at least one agent is needed",
            where="--agent",
            remedy="name one, such as --agent graphnav_pf",
        )
    agents = tuple(dict.fromkeys((*agent, *(() if no_expert else ("expert",)))))
    config = EvaluationConfig(
        source=SuiteSource(area, plans, scene, map, episodes, seed),
        agents=agents,
        out=out,
        settings=RunSettings(weights=weights, rules=JudgeRules(collisions=collisions), seed=seed),
        workers=workers,
        engine=engine,
    )
    return _evaluate_and_print(config, json)


def eval_localization(
    *,
    weights: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = (),
    out: Path,
    area: Path | None = None,
    plans: Path | None = None,
    scene: Path | None = None,
    map: Path | None = None,
    episodes: int | None = None,
    seed: int = 0,
    workers: int = 1,
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Measure localization as the paper's Table V does: told where the robot just was.

    The expert drives the plans, and the network is asked at each step with the crop around the
    true edge of the step before. `toponav tables` shows it beside the paper's numbers.

    toponav eval localization --area area_3.yaml --plans area_3_plans.json --out runs/table_5

    The same as the agent `teacher_forced` of `toponav eval graphnav`. Weights that hold a belief
    over poses, such as `best`, are told nothing instead (`own_belief`).

    Args:
        weights: Folder of weights, or a preset. Repeat to compare. What ships, if left out.
        out: Folder of results.
        area: A Stanford area in the GraphNav authors' format (yaml).
        plans: Published start/goal pairs of that area (json).
        scene: Folder of a scene, instead of an area.
        map: Topological map of that scene.
        episodes: How many: the first pairs, or sampled plans. All pairs, or 20, if left out.
        seed: Seed of sampled plans.
        workers: Processes. Results do not depend on it.
        json: Print results.json instead of a table.
    """
    from toponav.evaluation.agents import AgentChoice, probes_of
    from toponav.evaluation.runner import EvaluationConfig
    from toponav.evaluation.suite import SuiteSource
    from toponav.evaluation.worker import RunSettings

    choices = [
        AgentChoice(probe, name) for name in dict.fromkeys(weights) for probe in probes_of(name)
    ]
    config = EvaluationConfig(
        source=SuiteSource(area, plans, scene, map, episodes, seed),
        agents=tuple(choices) or probes_of(None),
        out=out,
        settings=RunSettings(seed=seed),
        workers=workers,
    )
    return _evaluate_and_print(config, json)


def _evaluate_and_print(config: Any, json: bool) -> int:
    evaluation = _evaluate_with_progress(config)
    if json:
        print(json_module.dumps(evaluation.results))
    else:
        _print_summary(evaluation)
    return 0


def _evaluate_with_progress(config: Any) -> Any:
    from toponav.cli.progress_bar import progress
    from toponav.evaluation.runner import evaluate

    with progress("episodes") as update:
        return evaluate(config, update)


def _print_summary(evaluation: Any) -> None:
    from rich.console import Console

    from toponav.cli.tables import whole
    from toponav.evaluation.tables import summary_table

    console = Console()
    if evaluation.resumed:
        console.print(f"{evaluation.resumed} episodes were finished before")
    if len(evaluation.commits) > 1:
        commits = ", ".join(str(commit)[:12] for commit in evaluation.commits)
        console.print(f"[yellow]the episodes come from several source versions: {commits}[/]")
    _print_left_out(console, evaluation.suite.left_out)
    print(whole(summary_table(evaluation.results, title=evaluation.suite.name)))
    console.print(f"results in {evaluation.out}", highlight=False, soft_wrap=True, markup=False)


def _print_left_out(console: Any, left_out: Sequence[Any]) -> None:
    if not left_out:
        return
    console.print(f"{len(left_out)} pairs have no plan in the map and are left out:")
    for pair in left_out:
        console.print(
            f"  {pair.index:3d}  {pair.start_room} -> {pair.end_room}: {pair.reason}",
            highlight=False,
            markup=False,
        )
