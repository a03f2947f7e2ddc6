"""`toponav figures`: the papers' figures, drawn from stored results."""

import io
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

__all__ = ["figures", "register"]

Figure_ = Literal["failures", "trajectories", "localization", "lengths"]
_KINDS: tuple[str, ...] = ("failures", "trajectories", "localization", "lengths")


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {("figures",): figures}


def figures(
    folders: Annotated[tuple[Path, ...], tyro.conf.Positional],
    /,
    *,
    only: Annotated[tuple[Figure_, ...], tyro.conf.UseAppendAction] = (),
    agent: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = (),
    episode: Annotated[tuple[int, ...], tyro.conf.UseAppendAction] = (),
    area: Path | None = None,
    scene: Path | None = None,
    map: Path | None = None,
    rule: Literal["strict", "tolerant"] = "tolerant",
    format: Literal["png", "pdf", "svg"] = "png",
    out: Path | None = None,
) -> int:
    """Draw stored runs: where they ended, their paths, what was believed, how long plans were.

    Failure maps (with a CSV of every edge), trajectories (the paper's figures 5 and 13),
    localization over time (6), and histograms of plan lengths (11 and 12).

    toponav figures runs/area_3

    toponav figures runs/area_3 --only localization --agent graphnav_pf --episode 7 --format pdf

    Args:
        folders: Folders that `toponav eval graphnav` wrote.
        only: A kind of figure, instead of all of them. Repeat for more.
        agent: Whose runs. Failure maps of all, other figures of GraphNavPF, if left out.
        episode: An episode to draw; if left out, long successes and a failure. Repeat for more.
        area: The area's yaml, if it lies neither under $TOPONAV_DATA nor in ../shared/data.
        scene: Folder of the scene that was driven in, if it does not lie in the results.
        map: Topological map of that scene.
        rule: Which verdict failure maps show.
        format: What kind of picture.
        out: Folder to write to; `figures` in each folder of results, if left out.
    """
    from toponav.cli.progress_bar import progress
    from toponav.core.errors import InputError
    from toponav.core.files import check_out_folder
    from toponav.evaluation.stored_run import find_building, load_run

    if out is not None:
        check_out_folder(out)
    if not folders:
        raise InputError(
            "at least one folder of results is needed",
            where="toponav figures",
            remedy="name a folder that `toponav eval graphnav` wrote",
        )
    runs = [load_run(folder) for folder in folders]
    buildings = [find_building(run, area, scene, map) for run in runs]
    chosen = _Chosen(only or _KINDS, agent, episode, rule)
    written: list[Path] = []
    with progress("figures") as update:
        for place, figure in _every_figure(runs, buildings, chosen, out):
            written.append(_write(place, figure, format))
            update(len(written), None)
    for path in written:
        print(path)
    for run in runs:
        if not run.has_steps and {"trajectories", "localization"} & set(chosen.kinds):
            print(
                f"{run.folder} has no steps.parquet: no paths, no belief over time",
                file=sys.stderr,
            )
    return 0


@dataclass(frozen=True)
class _Chosen:
    """What to draw."""

    kinds: tuple[str, ...]
    agents: tuple[str, ...]
    episodes: tuple[int, ...]
    rule: Literal["strict", "tolerant"]


def _every_figure(
    runs: list[Any], buildings: list[Any], chosen: _Chosen, out: Path | None
) -> Iterator[tuple[Path, Any]]:
    """Each figure, or text, with its place without the ending."""
    from toponav.evaluation.run_figures import lengths_figure

    together = out is not None and len(runs) > 1
    for run, building in zip(runs, buildings, strict=True):
        folder = (out or run.folder / "figures") / (_file_name(run.name) if together else "")
        for name, figure in _of_run(run, building, chosen):
            yield folder / _file_name(name), figure
        if "lengths" in chosen.kinds and not together:
            yield folder / "lengths", lengths_figure([(run, building)])
    if "lengths" in chosen.kinds and together:
        assert out is not None
        yield out / "lengths", lengths_figure(list(zip(runs, buildings, strict=True)))


def _of_run(run: Any, building: Any, chosen: _Chosen) -> Iterator[tuple[str, Any]]:
    from toponav.evaluation import failures as maps
    from toponav.evaluation import run_figures as drawn

    for agent in chosen.agents:
        run.check_agent(agent)
    if "failures" in chosen.kinds:
        for agent in chosen.agents or run.agents:
            figure = maps.failure_figure(run, agent, building, chosen.rule)
            counts = maps.edge_counts(run.rows_of(agent), chosen.rule)
            yield f"failures_{agent}", figure
            yield f"failures_{agent}", maps.failures_csv(counts)
    if not run.has_steps:
        return
    for agent in chosen.agents or _main_agent(run.agents):
        episodes = list(chosen.episodes) or drawn.choose_episodes(run, agent)
        if "trajectories" in chosen.kinds:
            yield (
                f"trajectories_{agent}",
                drawn.trajectories_figure(run, agent, building, episodes),
            )
        if "localization" in chosen.kinds:
            for episode in list(chosen.episodes) or episodes[:1] + episodes[1:][-1:]:
                yield (
                    f"localization_{agent}_{episode:03d}",
                    drawn.localization_figure(run, agent, building, episode),
                )


def _main_agent(agents: tuple[str, ...]) -> list[str]:
    """The one that the figures are about if none is named."""
    for wanted in ("graphnav_pf", "graphnav"):
        found = [agent for agent in agents if agent.partition("=")[0] == wanted]
        if found:
            return found[:1]
    return [agent for agent in agents if agent != "expert"][:1] or list(agents[:1])


def _file_name(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "_-" else "_" for letter in name)


def _write(place: Path, figure: Any, format: str) -> Path:
    from toponav.core.files import write_atomically

    if isinstance(figure, str):
        return write_atomically(place.with_name(place.name + ".csv"), figure)
    sink = io.BytesIO()
    # No date inside: the same run gives the same file.
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    figure.savefig(sink, format=format, dpi=130, metadata=metadata[format])
    return write_atomically(place.with_name(f"{place.name}.{format}"), sink.getvalue())
