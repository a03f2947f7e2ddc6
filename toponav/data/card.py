"""A data card: what a dataset holds, how it was made and what it is not good for, as Markdown."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from toponav.core.errors import InputError
from toponav.core.files import check_out_file, hash_of_file, write_atomically
from toponav.core.vocabulary import Behavior, Difficulty
from toponav.data.dataset import INDEX, INDEX_COLUMNS, MANIFEST, read_table
from toponav.data.statistics import dataset_statistics

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["behaviors_figure", "lengths_figure", "write_card"]

_COLORS = {"train": "#4f6d8f", "val": "#d9a441"}
_PAPER = "2,371 trajectories (GraphNav, section VI-A)"


def write_card(dataset_dir: Path, out: Path) -> list[Path]:
    """Write the card and the pictures that it shows; returns their paths, the card first.

    Beside `card.md` come `card_lengths.png` (how far, how many nodes, how many frames) and
    `card_behaviors.png` (frames of each behaviour, by plan and by the paper's heuristic).

    Args:
        dataset_dir: Folder of a finished dataset.
        out: The Markdown file to write.

    Raises:
        InputError: The folder is no finished dataset, or `out` cannot be written.

    Reference:
        Gebru et al. 2021, "Datasheets for Datasets".
    """
    check_out_file(out, "--card")
    statistics = dataset_statistics(dataset_dir)
    if not statistics["complete"] or not statistics.get("trajectories"):
        raise InputError(
            "a card is of a finished dataset, this one is not",
            where=str(dataset_dir),
            remedy="run the same `toponav collect` again",
        )
    rows = read_table(dataset_dir / INDEX, "run `toponav data repair`", INDEX_COLUMNS).to_pylist()
    split_of = {name: entry["split"] for name, entry in statistics["buildings"].items()}
    pictures = {"lengths": lengths_figure(rows, split_of)}
    if statistics.get("labels"):
        pictures["behaviors"] = behaviors_figure(statistics["labels"])
    written = []
    for name, figure in pictures.items():
        sink = io.BytesIO()
        figure.savefig(sink, format="png", dpi=110, metadata={"Software": None})
        path = out.with_name(f"{out.stem}_{name}.png")
        written.append(write_atomically(path, sink.getvalue()))
    text = _card(out.stem, dataset_dir, statistics, rows, [path.name for path in written])
    return [write_atomically(out, text), *written]


def lengths_figure(rows: Sequence[Mapping[str, Any]], split_of: Mapping[str, str]) -> "Figure":
    """Histograms of the drives: metres, nodes of the plan, frames (as the figures 11 and 12).

    Args:
        rows: Rows of the index.
        split_of: `train` or `val`, by building.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 3.0), layout="constrained")
    panels = figure.subplots(1, 3)
    shown = {
        "distance_m": ("driven [m]", 2.5),
        "nodes": ("plan [nodes]", 1.0),
        "frames": ("frames at 5 Hz", 25.0),
    }
    for ax, (name, (label, step)) in zip(panels, shown.items(), strict=True):
        values = {
            split: [_value(row, name) for row in rows if split_of[row["building"]] == split]
            for split in _COLORS
        }
        most = max((value for found in values.values() for value in found), default=step)
        bins = np.arange(0.0, most + 2 * step, step) - (0.5 if name == "nodes" else 0.0)
        kept = {split: found for split, found in values.items() if found}
        ax.hist(
            list(kept.values()),
            bins=bins.tolist(),
            stacked=True,
            color=[_COLORS[split] for split in kept],
            label=list(kept),
        )
        ax.set_xlabel(label)
        ax.spines[["top", "right"]].set_visible(False)
        if name == "nodes":
            _mark_difficulties(ax, most)
    panels[0].set_ylabel("trajectories")
    panels[-1].legend(frameon=False, fontsize=8)
    return figure


def behaviors_figure(labels: Mapping[str, Any]) -> "Figure":
    """Frames of each behaviour, labelled by the plan and by the paper's heuristic.

    Args:
        labels: The labels of `dataset_statistics`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.5, 2.8), layout="constrained")
    ax = figure.subplots()
    names = [*map(str, Behavior), "none"]
    kinds = {"by plan": ("edge_behavior", "#4f6d8f"), "by heuristic": ("behavior", "#b9c3cc")}
    for offset, (label, (column, color)) in zip((-0.2, 0.2), kinds.items(), strict=True):
        counts = [labels[column][name] for name in names]
        ax.bar(np.arange(len(names)) + offset, counts, 0.38, color=color, label=label)
    ax.set_xticks(range(len(names)), [name.replace("_", "\n") for name in names], fontsize=8)
    ax.set_ylabel("frames")
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=8)
    return figure


def _value(row: Mapping[str, Any], name: str) -> float:
    return float(len(row["plan_nodes"]) if name == "nodes" else row[name])


def _mark_difficulties(ax: "Axes", most: float) -> None:
    """Lines between the classes I, II and III of plans."""
    for nodes in range(2, int(most)):
        if Difficulty.of_plan(nodes) is not Difficulty.of_plan(nodes + 1):
            ax.axvline(nodes + 0.5, color="#b5402a", lw=0.8, ls=":")


def _card(
    title: str,
    dataset_dir: Path,
    statistics: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    pictures: Sequence[str],
) -> str:
    parts = [
        f"# Data card: {title}",
        "Drives of a simulated TurtleBot 2 through buildings with topological maps: depth images "
        "at 5 Hz, true poses, the expert's commands and what was executed, and labels of place "
        "and behaviour. One ROS 2 bag (MCAP) a trajectory.",
        _amounts(statistics, rows),
        f"![Lengths of the trajectories]({pictures[0]})\n\nDriven metres, nodes of the plan "
        "(dotted: difficulty I, II, III) and frames; as the paper's figures 11 and 12.",
    ]
    if len(pictures) > 1:
        parts += [f"![Frames of each behaviour]({pictures[1]})", _labels(statistics)]
    parts += [_origin(dataset_dir, statistics), _limits(statistics)]
    return "\n\n".join(parts) + "\n"


def _amounts(statistics: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    frames = np.array([row["frames"] for row in rows])
    nodes = np.array([len(row["plan_nodes"]) for row in rows])
    splits = [entry["split"] for entry in statistics["buildings"].values()]
    val = sum(e["frames"] for e in statistics["buildings"].values() if e["split"] == "val")
    quarter, median, three = np.percentile(frames, (25, 50, 75))
    table = {
        "trajectories": f"{statistics['trajectories']:,}; the paper: {_PAPER}",
        "frames": f"{statistics['frames']:,} ({statistics['hours']:.1f} h at 5 Hz)",
        "frames a trajectory": f"mean {frames.mean():.0f}, quartiles {quarter:.0f} / "
        f"{median:.0f} / {three:.0f}, longest {frames.max():,}",
        "distance": f"{statistics['distance_m'] / 1000:.1f} km",
        "plans": f"{nodes.min()} to {nodes.max()} nodes, mean {nodes.mean():.1f}",
        "buildings": f"{len(splits)}: {splits.count('train')} to train, {splits.count('val')} "
        "held out whole for validation, by name",
        "validation": f"{val:,} frames, {100 * val / statistics['frames']:.1f} %",
        "outcomes": ", ".join(f"{n:,} {name}" for name, n in statistics["outcomes"].items()),
        "size": f"{statistics['bytes'] / 1e6:,.0f} MB",
    }
    lines = [f"| {name} | {value} |" for name, value in table.items()]
    return "\n".join(["## Amounts", "", "| | |", "|---|---|", *lines])


def _labels(statistics: Mapping[str, Any]) -> str:
    labels = statistics["labels"]
    lines = [
        f"| {name} | {labels['edge_behavior'][name]:,} | "
        f"{100 * labels['edge_behavior'][name] / statistics['frames']:.1f} | "
        f"{labels['behavior'][name]:,} |"
        for name in labels["edge_behavior"]
    ]
    shares = ", ".join(
        f"`{column}` {100 * labels[f'{column}_labelled']:.1f} %"
        for column in ("node", "edge", "plan_edge")
    )
    return "\n".join(
        [
            "## Labels",
            "",
            "| behaviour | frames, by plan | % | frames, by the paper's heuristic |",
            "|---|---|---|---|",
            *lines,
            "",
            f"Frames with a label: {shares}. Off the plan: {100 * labels['off_plan']:.2f} %.",
        ]
    )


def _origin(dataset_dir: Path, statistics: Mapping[str, Any]) -> str:
    config, environment = statistics["config"], statistics["environment"]
    camera, noise = config.get("camera", {}), config.get("noise", {})
    table = {
        "who drove": config.get("source", "expert"),
        "buildings": ", ".join(PurePath(str(name)).name for name in config.get("buildings", ())),
        "seed": config.get("seed"),
        "noise on executed commands": f"{noise.get('noise_scale')} x the paper's (equations 2, 3)",
        "camera": f"{camera.get('width')}x{camera.get('height')}, "
        f"{np.degrees(camera.get('hfov_rad', np.nan)):.0f} degrees, clipped at "
        f"{camera.get('max_depth_m')} m, {camera.get('mount_height_m')} m above the floor",
        "made by": f"toponav {environment.get('toponav')}, commit "
        f"{str(environment.get('commit'))[:12]}",
        "SHA-256 of `dataset.json`": f"`{hash_of_file(dataset_dir / MANIFEST)}`",
    }
    lines = [f"| {name} | {value} |" for name, value in table.items()]
    return "\n".join(
        [
            "## Origin",
            "",
            "| | |",
            "|---|---|",
            *lines,
            "",
            "Start and goal are drawn at random among the rooms of a building, the plan is the "
            "shortest. `dataset.json` has the whole configuration and a hash of every file; the "
            "same configuration and version give the same frames, whatever the number of workers.",
        ]
    )


def _limits(statistics: Mapping[str, Any]) -> str:
    missed = statistics["trajectories"] - statistics["outcomes"].get("success", 0)
    return "\n".join(
        [
            "## Limits",
            "",
            "- Simulated depth without the holes and noise of a real sensor, in buildings without "
            "people or anything that moves.",
            f"- The driver knows the floor plan and its pose; {missed} of "
            f"{statistics['trajectories']:,} drives missed their goal and are kept with their "
            "outcome.",
            "- Behaviours are as uneven as in buildings: corridors most, straight into a room "
            "least. Sample by behaviour when training.",
        ]
    )
